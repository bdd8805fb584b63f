#include "solver/run/loads.hpp"
#include "solver/core/ensure.hpp"
#include "solver/physics/smoothing.hpp"
#include "solver/run/exact_sums.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/loads.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace kuzure {

double unit_pressure(const Scene& scene)
{
    if (scene.accuracy.kernel_norm == scene::KernelNorm::Lattice) return 1; // its gradients are exact there
    const int d = scene.dimensions;
    const double h = scene.space.h; // lengths in spacings
    switch (scene.accuracy.kernel) {
    case scene::Kernel::CubicSpline:
        return 1 / lattice_moment(CubicSpline(h, d), d);
    case scene::Kernel::WendlandC2:
        return 1 / lattice_moment(WendlandC2(h, d), d);
    case scene::Kernel::WendlandC4:
        break;
    }
    return 1 / lattice_moment(WendlandC4(h, d), d);
}

std::vector<LoadNow> loads_now(const Scene& scene)
{
    std::vector<LoadNow> now;
    const double unit = scene.loads.empty() ? 1 : unit_pressure(scene);
    for (const auto& l : scene.loads) {
        const double factor = l.present ? l.factor : 0;
        now.push_back(l.follow ? LoadNow{unit * factor * l.pressure.value_or(0), 0} : LoadNow{0, factor});
    }
    return now;
}

std::vector<int> loads_come(const Scene& before, const Scene& after)
{
    std::vector<int> loads;
    for (std::size_t l = 0; l < after.loads.size(); ++l)
        if (after.loads[l].present && !before.loads[l].present) loads.push_back(int(l));
    return loads;
}

void give_to_loads(const Team& team, const Scene& scene, const scene::Filling& filling, std::span<const int> loads, double time,
                   bool settles, Particles& p)
{
    const auto number = p[field::load];
    const auto push = p[field::load_push];
    for (const int l : loads) {
        std::int64_t found = 0, taken = std::numeric_limits<std::int64_t>::max(), other = -1;
        for (Index i = 0; i < p.size(); ++i) {
            const std::int64_t id = std::as_const(p)[field::id][i];
            const Vector x = std::as_const(p)[field::position][i];
            if (!scene::pushes(scene, scene.loads[std::size_t(l)], filling.body_of(id), x)) continue;
            ++found;
            if (number[i] != 0 && id < taken) taken = id, other = number[i] - 1;
            number.set(i, std::int32_t(l + 1)), push.set(i, Vector{});
        }
        std::int64_t first = taken;
        team.min(std::span(&first, 1));
        const std::int64_t pushes = team.max(taken == first ? other : -1);
        if (pushes >= 0)
            throw NumbersFailed(fmt::format("{} begins at t = {:.6g} s on soil that {} pushes already: particle {}. Remedy: boxes that do "
                                            "not overlap, or remove the other load first",
                                            scene::name_of_load(scene, l), time, scene::name_of_load(scene, int(pushes)), first));
        if (!settles && team.sum(found) == 0)
            throw NumbersFailed(
                fmt::format("{} begins at t = {:.6g} s where no soil is. Remedy: a box that holds the face and the two layers "
                            "of soil below it as they are then",
                            scene::name_of_load(scene, l), time));
    }
}

void take_from_loads(std::span<const int> loads, Particles& p)
{
    if (loads.empty()) return;
    const auto number = p[field::load];
    for (Index i = 0; i < p.size(); ++i)
        if (std::ranges::count(loads, number[i] - 1) > 0) number.set(i, 0), p[field::load_push].set(i, Vector{});
}

namespace {

Vector outward(const scene::Load& l) { return (1 / length(*l.normal)) * *l.normal; }

/// Where one load's soil is seen along a normal: a particle covers a square of a spacing, and each of the samples, two a spacing, belongs
/// to the soil that is seen there and what lies just behind it.
class SeenAlong {
public:
    /// `deep`: m, how far behind what is seen soil belongs to it.
    SeenAlong(const Team& team, const Scene& scene, std::int32_t number, Vector normal, double deep, const Particles& p)
        : team_(team), number_(number), dimensions_(scene.dimensions), spacing_(scene.space.spacing), deep_(deep),
          n_((1 / length(normal)) * normal), p_(p)
    {
        // In 2-D the first tangent lies in the plane, and all of y is one sample.
        const Vector other = dimensions_ == 2 || std::fabs(n_.y) < 0.9 ? Vector{0, 1, 0} : Vector{1, 0, 0};
        const Vector t = cross(other, n_);
        a_ = (1 / length(t)) * t, b_ = cross(n_, a_);
        std::array<double, 2> low{infinite, infinite}, high{-infinite, -infinite};
        for_each([&](Index i, Vector) {
            const double at[2] = {along_a(i), along_b(i)};
            for (std::size_t k = 0; k < 2; ++k) low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
        });
        team_.min(std::span<double>(low)), team_.max(std::span<double>(high));
        // Between samples, so that rounding decides nothing on a lattice.
        low_ = {low[0] - 0.25 * spacing_, low[1] - 0.25 * spacing_};
        const double wide[2] = {high[0] - low[0], dimensions_ == 3 ? high[1] - low[1] : 0.0};
        if ((wide[0] / sample() + 2) * (wide[1] / sample() + 2) > most_samples)
            throw NumbersFailed(fmt::format("{} pushes soil that lies over {:.3g} by {:.3g} m, more than can be seen along its normal at "
                                            "once. Remedy: a box around each part of it, with a load of its own",
                                            scene::name_of_load(scene, number - 1), wide[0], wide[1]));
        for (std::size_t k = 0; k < 2; ++k) count_[k] = low[k] > high[k] ? 0 : std::size_t((high[k] - low_[k]) / sample() + 1) + 1;
        if (dimensions_ == 2) count_[1] = std::min<std::size_t>(count_[1], 1);
    }
    /// Calls give(particle, area in m^2) for this rank's soil. Collective.
    template <class Give> void share(Give give)
    {
        std::vector<double> top(count_[0] * count_[1], -infinite);
        for_each([&](Index i, Vector x) { for_each_sample(i, [&](std::size_t k) { top[k] = std::max(top[k], dot(x, n_)); }); });
        team_.max(std::span<double>(top));
        // Weights in whole units, so that their sums are the same in any order.
        std::vector<std::int64_t> weights(top.size(), 0);
        const auto weight = [&](Index i) {
            const double area = std::max(0.0, -dot(p_[field::load_push][i], n_));
            return std::int64_t(std::nearbyint(std::ldexp(area / area_of_particle(), 30))) + 1; // one at least: some soil is seen there
        };
        const auto near = [&](Vector x, std::size_t k) { return dot(x, n_) >= top[k] - deep_; };
        for_each([&](Index i, Vector x) { for_each_sample(i, [&](std::size_t k) { weights[k] += near(x, k) ? weight(i) : 0; }); });
        team_.sum(std::span<std::int64_t>(weights));
        const double area = area_of_particle() / (dimensions_ == 3 ? 4 : 2);
        for_each([&](Index i, Vector x) {
            double mine = 0;
            for_each_sample(i, [&](std::size_t k) { mine += near(x, k) ? double(weight(i)) / double(weights[k]) : 0; });
            give(i, area * mine);
        });
    }

private:
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    static constexpr double most_samples = 1 << 26; // half a gigabyte of numbers
    double sample() const { return 0.5 * spacing_; }
    double area_of_particle() const { return dimensions_ == 3 ? spacing_ * spacing_ : spacing_; }
    double along_a(Index i) const { return dot(p_[field::position][i], a_); }
    double along_b(Index i) const { return dimensions_ == 3 ? dot(p_[field::position][i], b_) : 0; }
    template <class Visit> void for_each(Visit visit) const
    {
        for (Index i = 0; i < p_.size(); ++i)
            if (p_[field::load][i] == number_) visit(i, p_[field::position][i]);
    }
    /// The samples that a particle covers: centres from half a spacing before it to half a spacing after it.
    template <class Visit> void for_each_sample(Index i, Visit visit) const
    {
        const double at[2] = {along_a(i), along_b(i)};
        std::array<std::size_t, 2> first{}, last{};
        for (std::size_t k = 0; k < 2; ++k) {
            const double from = (at[k] - 0.5 * spacing_ - low_[k]) / sample(), to = (at[k] + 0.5 * spacing_ - low_[k]) / sample();
            first[k] = std::size_t(std::max(0.0, std::ceil(from)));
            last[k] = std::size_t(std::clamp(std::ceil(to), 0.0, double(count_[k])));
        }
        if (dimensions_ == 2) first[1] = 0, last[1] = 1;
        for (std::size_t b = first[1]; b < last[1]; ++b)
            for (std::size_t a = first[0]; a < last[0]; ++a) visit(b * count_[0] + a);
    }

    const Team& team_;
    std::int32_t number_;
    int dimensions_;
    double spacing_, deep_;
    Vector n_, a_, b_;
    std::array<double, 2> low_{};
    std::array<std::size_t, 2> count_{};
    const Particles& p_;
};

} // namespace

void set_pushes(const Team& team, const Scene& scene, std::span<const int> loads, Particles& p)
{
    const auto push = p[field::load_push];
    for (const int number : loads) {
        const scene::Load& l = scene.loads[std::size_t(number)];
        if (!l.normal) {
            for (Index i = 0; i < p.size(); ++i)
                if (std::as_const(p)[field::load][i] == number + 1) push.set(i, l.pressure.value_or(0) * push[i]);
            continue;
        }
        const Vector n = outward(l);
        std::vector<std::pair<Index, double>> areas;
        // Under a plate the face alone carries it.
        const double deep = l.plate ? 0.5 * scene.space.spacing : scene.support();
        SeenAlong(team, scene, number + 1, n, deep, std::as_const(p)).share([&](Index i, double area) { areas.emplace_back(i, area); });
        for (Index i = 0; i < p.size(); ++i)
            if (std::as_const(p)[field::load][i] == number + 1) push.set(i, Vector{});
        for (const auto& [i, area] : areas) push.set(i, area * (l.traction ? *l.traction : -l.pressure.value_or(0) * n));
    }
}

bool any_plate(const Scene& scene)
{
    return std::ranges::any_of(scene.loads, [](const scene::Load& l) { return l.plate; });
}

namespace {
/// Calls visit(particle, mass) for this rank's soil under a plate.
template <class Visit>
void for_each_under(const Scene& scene, std::size_t load, std::span<const Material> soils, const Particles& p, Visit visit)
{
    for (Index i = 0; i < p.size(); ++i)
        if (p[field::load][i] == std::int32_t(load + 1) && p[field::load_push][i] != Vector{})
            visit(i, soils[std::size_t(p[field::soil][i])].density * scene.particle_volume());
}
/// Of each load's soil the mean by mass of a vector along its normal; 0 where it has no plate. Collective.
template <class Of>
std::vector<double> means_along(const Team& team, const Scene& scene, std::span<const Material> soils, const Particles& p, Of of)
{
    const std::size_t n = scene.loads.size();
    const auto sums = exact_sums(team, 2 * n, [&](auto add) {
        for (std::size_t l = 0; l < n; ++l)
            if (scene.loads[l].plate && scene.loads[l].present)
                for_each_under(scene, l, soils, p,
                               [&](Index i, double mass) { add(2 * l, mass), add(2 * l + 1, mass * dot(of(i), outward(scene.loads[l]))); });
    });
    std::vector<double> means(n, 0.0);
    for (std::size_t l = 0; l < n; ++l)
        if (sums[2 * l] > 0) means[l] = sums[2 * l + 1] / sums[2 * l];
    return means;
}
/// Calls visit(particle, unit normal, mean) for this rank's soil under plates.
template <class Visit>
void for_each_held(const Scene& scene, std::span<const Material> soils, const std::vector<double>& means, const Particles& p, Visit visit)
{
    for (std::size_t l = 0; l < scene.loads.size(); ++l)
        if (scene.loads[l].plate && scene.loads[l].present)
            for_each_under(scene, l, soils, p, [&](Index i, double) { visit(i, outward(scene.loads[l]), means[l]); });
}
} // namespace

void join_plates(const Team& team, const Scene& scene, std::span<const Material> soils, Particles& p)
{
    const auto v = p[field::velocity];
    const auto means = means_along(team, scene, soils, p, [&](Index i) { return v[i]; });
    for_each_held(scene, soils, means, p, [&](Index i, Vector n, double mean) { v.set(i, v[i] + (mean - dot(v[i], n)) * n); });
}

void hold_plates(const Team& team, const Scene& scene, std::span<const Material> soils, const StepInput& in, PassResult& result)
{
    Particles& p = *in.particles;
    const auto a = p[field::acceleration], v = p[field::velocity], unstored = p[field::unstored];
    const auto means = means_along(team, scene, soils, p, [&](Index i) { return a[i]; });
    const auto meet = [](double& most, Vector x) { most = std::max(most, dot(x, x)); };
    const double magic = magic_of(in.energy_unit), half_next = 0.5 * in.next;
    auto& maxima = result.maxima;
    for_each_held(scene, soils, means, p, [&](Index i, Vector n, double mean) {
        const Vector change = (mean - dot(a[i], n)) * n, before = v[i] - (0.5 * in.dt) * a[i];
        const double mass = soils[std::size_t(p[field::soil][i])].density * scene.particle_volume();
        // as the pass books it: work of forces, and of damping -mu (u + u')/2, u and u' the velocities half a step before and after
        const auto booked = [&](Vector coming) {
            const Vector damped = (-0.5 * in.forces.damping) * (before + coming);
            return quantized(-mass * half_next * dot(unstored[i] + damped, coming), magic);
        };
        const double without = booked(v[i] + half_next * a[i]);
        if (p.has(field::shift)) p[field::shift].set(i, Vector{}); // a plate's soil goes where the plate goes
        a.set(i, a[i] + change), v.set(i, v[i] + (0.5 * in.dt) * change);
        const Vector coming = v[i] + half_next * a[i];
        result.later.loads += booked(coming) - without;
        meet(maxima.acceleration2, a[i]), meet(maxima.speed2, v[i]), meet(maxima.half_step_speed2, coming - in.frame);
        meet(maxima.displacement2, p[field::position][i] + in.next * coming - p[field::sorted_position][i] - in.frame_way);
    });
}

std::vector<LoadedSoil> loaded_soil(const Team& team, const Scene& scene, const Particles& p)
{
    const std::size_t n = scene.loads.size();
    std::vector<LoadedSoil> all;
    if (n == 0) return all;
    const auto sums = exact_sums(team, 4 * n, [&](auto add) {
        for (Index i = 0; i < p.size(); ++i) {
            const std::int32_t number = p[field::load][i];
            if (number == 0) continue;
            const std::size_t at = 4 * (std::size_t(number) - 1);
            const Vector force = p[field::load_push][i];
            add(at, 1), add(at + 1, force.x), add(at + 2, force.y), add(at + 3, force.z);
        }
    });
    for (std::size_t l = 0; l < n; ++l) {
        const scene::Load& load = scene.loads[l];
        all.push_back({load.name.empty() ? std::to_string(l) : load.name,
                       std::int64_t(sums[4 * l]),
                       {sums[4 * l + 1], sums[4 * l + 2], sums[4 * l + 3]},
                       load.present ? load.factor : 0});
    }
    return all;
}

} // namespace kuzure
