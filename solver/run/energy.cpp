#include "solver/run/energy.hpp"
#include "solver/core/ensure.hpp"
#include "solver/core/mix.hpp"
#include <bit>
#include <cmath>
#include <fmt/format.h>

namespace kuzure {

StateEnergy state_energy(const Team& team, const Particles& p, std::span<const Material> soils, double volume, Vector gravity,
                         const PoreWater& water, double unit, double dt)
{
    const auto x = p[field::position], o = p[field::origin], v = p[field::velocity];
    const auto s = p[field::stress];
    const auto rho = p[field::density];
    const auto soil = p[field::soil];
    const double magic = magic_of(unit);
    const bool staggered = p.has(field::acceleration);
    double kinetic = 0, potential = 0, elastic = 0;
    const Index n = p.size();
#pragma omp parallel for schedule(static) reduction(+ : kinetic, potential, elastic)
    for (Index i = 0; i < n; ++i) {
        const Material& m = soils[soil[i]];
        const double mass = m.density * volume;
        const Vector half_kick = staggered ? (0.5 * dt) * p[field::acceleration][i] : Vector{};
        kinetic += quantized(0.5 * mass * (dot(v[i], v[i]) - dot(half_kick, half_kick)), magic);
        potential += quantized(
            -mass * dot(gravity, x[i] - o[i]) + (water.present() ? volume * (water.at(x[i]).value - water.at(o[i]).value) : 0.0), magic);
        // sigma : C^-1 : sigma/2 = J2/(2 G) + I1^2/(18 K)
        const Stress sigma = s[i];
        const double I1 = trace(sigma);
        elastic += quantized(mass / rho[i] * (J2(deviator(sigma)) / (2 * m.shear) + I1 * I1 / (18 * m.bulk)), magic);
    }
    double sums[3] = {kinetic, potential, elastic};
    team.sum(std::span<double>(sums));
    return {sums[0], sums[1], sums[2]};
}

namespace {
[[noreturn]] void outgrown()
{
    throw NumbersFailed("an energy has outgrown its ledger: it is many times what the scene's heights and speeds allow. Remedy: a smaller "
                        "time.step or accuracy.cfl");
}
} // namespace

std::int64_t sum_of_units(std::int64_t units, double more)
{
    if (!(std::fabs(more) < 0x1p62)) outgrown();
    return sum_of_units(units, std::int64_t(more));
}
std::int64_t sum_of_units(std::int64_t units, std::int64_t more)
{
    std::int64_t sum = 0;
    if (__builtin_add_overflow(units, more, &sum)) outgrown();
    return sum;
}

DissipatedUnits over_ranks(const Team& team, DissipatedUnits mine)
{
    std::array<std::int64_t, std::tuple_size_v<decltype(DissipatedUnits::members)>> units;
    std::size_t k = 0;
    for_each_member(mine, mine, [&](std::int64_t& u, std::int64_t&) { units[k++] = u; });
    team.sum(std::span<std::int64_t>(units));
    k = 0;
    for_each_member(mine, mine, [&](std::int64_t& u, std::int64_t&) { u = units[k++]; });
    return mine;
}

double Ledger::sum() const
{
    double all = state.kinetic + state.potential + state.elastic + events;
    for_each_member(dissipated, dissipated, [&](double e, double) { all += e; });
    return all;
}

std::string state_hash(const Team& team, const Particles& p)
{
    const Index n = p.size();
    const auto id = p[field::id];
    std::vector<std::uint64_t> h(n);
    for (Index i = 0; i < n; ++i) h[i] = mix(std::uint64_t(id[i]) + 0x9e3779b97f4a7c15ull);
    p.for_each_present([&](auto f) {
        using F = decltype(f);
        const auto is = [](auto... g) { return (std::is_same_v<F, std::remove_const_t<decltype(g)>> || ...); };
        // not what never changes: where it began, id and soil; nor what walls did, which no step needs
        if constexpr (!is(field::origin, field::id, field::soil, field::wall_force, field::unstored)) {
            const auto columns = p[f];
            for (const auto* c : columns.column)
                for (Index i = 0; i < n; ++i) {
                    if constexpr (std::is_same_v<typename F::Number, double>) h[i] = mix(h[i] ^ std::bit_cast<std::uint64_t>(c[i] + 0.0));
                    else h[i] = mix(h[i] ^ std::uint64_t(c[i]));
                }
        }
    });
    std::uint64_t sum = 0;
    for (const auto v : h) sum += v;
    return fmt::format("{:016x}", std::uint64_t(team.sum(std::int64_t(sum))));
}

} // namespace kuzure
