#include "solver/run/energy.hpp"
#include <bit>
#include <fmt/format.h>

namespace kuzure {

StateEnergy state_energy(const Team& team, const Particles& p, std::span<const Material> soils, double volume, Vector gravity,
                         const PoreWater& water, double unit)
{
    const auto x = p[field::position], o = p[field::origin], v = p[field::velocity];
    const auto s = p[field::stress];
    const auto rho = p[field::density];
    const auto soil = p[field::soil];
    const double magic = magic_of(unit);
    double kinetic = 0, potential = 0, elastic = 0;
    const Index n = p.size();
#pragma omp parallel for schedule(static) reduction(+ : kinetic, potential, elastic)
    for (Index i = 0; i < n; ++i) {
        const Material& m = soils[soil[i]];
        const double mass = m.density * volume;
        kinetic += quantized(0.5 * mass * dot(v[i], v[i]), magic);
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
    double all = state.kinetic + state.potential + state.elastic;
    for_each_member(dissipated, dissipated, [&](double e, double) { all += e; });
    return all;
}

namespace {
/// Finalizer of splitmix64.
constexpr std::uint64_t mix(std::uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}
} // namespace

std::string state_hash(const Team& team, const Particles& p)
{
    const Index n = p.size();
    const auto id = p[field::id];
    std::vector<std::uint64_t> h(n);
    for (Index i = 0; i < n; ++i) h[i] = mix(std::uint64_t(id[i]) + 0x9e3779b97f4a7c15ull);
    p.for_each_present([&](auto f) {
        using F = decltype(f);
        if constexpr (std::is_same_v<typename F::Number, double> && !std::is_same_v<F, std::remove_const_t<decltype(field::origin)>>) {
            const auto columns = p[f];
            for (const double* c : columns.column)
                for (Index i = 0; i < n; ++i) h[i] = mix(h[i] ^ std::bit_cast<std::uint64_t>(c[i] + 0.0));
        }
    });
    std::uint64_t sum = 0;
    for (const auto v : h) sum += v;
    return fmt::format("{:016x}", std::uint64_t(team.sum(std::int64_t(sum))));
}

} // namespace kuzure
