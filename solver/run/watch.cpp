#include "solver/run/watch.hpp"
#include "solver/run/start.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/shape.hpp"
#include "solver/scene/step_limits.hpp"
#include <fmt/format.h>
#include <limits>
#include <numbers>

namespace kuzure {

namespace {
/// Largest value over the ranks, and the lowest id among the particles that reach it.
struct Worst {
    double value = 0;
    std::int64_t id = std::numeric_limits<std::int64_t>::max();
    void meet(double v, std::int64_t i)
    {
        if (v > value || (v == value && i < id)) value = v, id = i;
    }
    std::int64_t combine(const Team& team)
    {
        const double largest = team.max(value);
        if (value < largest) id = std::numeric_limits<std::int64_t>::max();
        value = largest;
        team.min(std::span<std::int64_t>(&id, 1));
        return value > 0 ? id : -1;
    }
};
} // namespace

Neighbourhoods inspect_neighbours(const Team& team, const Scene& scene, std::int64_t soil_count, const Particles& p, const Layout& layout)
{
    const ClusterLists& lists = layout.lists();
    const double dx = scene.space.spacing, support2 = scene.support() * scene.support(), near2 = limit::near * dx * limit::near * dx;
    const double reach = 2 * scene.space.h, pi = std::numbers::pi;
    const double lattice = scene.dimensions == 3 ? 4 * pi / 3 * reach * reach * reach : pi * reach * reach;
    const auto x = p[field::sorted_position];
    const double *px = x.column[0], *py = x.column[1], *pz = x.column[2];
    const auto* id = p[field::id].column[0];
    const Index n = p.size(), clusters = lists.size();
    Worst crowded, sunk;
    std::int64_t clumped = 0;
#pragma omp parallel
    {
        Worst my_crowded, my_sunk;
        std::int64_t my_clumped = 0;
#pragma omp for schedule(static) nowait
        for (Index c = 0; c < clusters; ++c)
            for (Index i = lists.first(c); i < lists.first(c) + lists.count(c); ++i) {
                const Vector at{px[i], py[i], pz[i]};
                int neighbours = 0, near = 0;
                lists.soil(c).for_each([&](Index j) {
                    const Vector r = at - (j < n ? Vector{px[j], py[j], pz[j]} : layout.sorted(p, j));
                    const double r2 = dot(r, r);
                    neighbours += r2 < support2, near += r2 < near2;
                });
                my_clumped += near > 1; // every particle meets itself
                my_crowded.meet((neighbours - 1) / lattice, id[i]);
                lists.walls(c).for_each([&](int wall, const PointSet&) {
                    my_sunk.meet(-scene::contact(scene.walls[std::size_t(wall)], at, scene.dimensions).distance / dx, id[i]);
                });
            }
#pragma omp critical
        {
            crowded.meet(my_crowded.value, my_crowded.id), sunk.meet(my_sunk.value, my_sunk.id);
            clumped += my_clumped;
        }
    }
    Neighbourhoods all;
    all.clumped = double(team.sum(clumped)) / double(std::max<std::int64_t>(1, soil_count));
    all.crowded_id = crowded.combine(team), all.most_neighbours = crowded.value;
    all.sunk_id = sunk.combine(team), all.deepest = sunk.value;
    return all;
}

Watch::Watch(const Comm& comm, const Scene& scene, const scene::Filling& filling, std::span<const Material> soils)
    : comm_(comm), scene_(scene), filling_(filling), soils_(soils)
{
}

std::int64_t Watch::fastest(const Particles& p) const
{
    double v2 = -1;
    std::int64_t id = std::numeric_limits<std::int64_t>::max();
    for (Index i = 0; i < p.size(); ++i) {
        const Vector v = p[field::velocity][i];
        const double here = dot(v, v);
        if (here > v2 || (here == v2 && p[field::id][i] < id)) v2 = here, id = p[field::id][i];
    }
    if (v2 < comm_.max(v2)) id = std::numeric_limits<std::int64_t>::max();
    comm_.min(std::span(&id, 1));
    return id;
}

std::pair<std::string, std::string> Watch::diagnosis(const Clock& clock) const
{
    const double h = scene_.smoothing_length(), courant = clock.dt / scene::crossing_time(scene_);
    const double a = std::sqrt(clock.extremes.acceleration2), free = a > 0 ? std::sqrt(h / a) : std::numeric_limits<double>::infinity();
    const bool tension = std::any_of(soils_.begin(), soils_.end(), [](const Material& m) { return m.k > 0; });
    if (courant > scene::recommended_courant(scene_))
        return {fmt::format("the time step is too long for the P-wave: dt c_p/h = {:.3g}, recommended up to {:.3g}", courant,
                            scene::recommended_courant(scene_)),
                fmt::format("a time.step of {:.3g} s or less, or none (accuracy.cfl then sets it)", scene::recommended_step(scene_))};
    if (clock.dt > scene::recommended_courant(scene_) * free)
        return {fmt::format("the time step is too long for the acceleration: dt = {:.3g} s, sqrt(h/|a|) = {:.3g} s", clock.dt, free),
                "a smaller time.step, or none (accuracy.cfl then sets it)"};
    if (!scene_.effects.viscosity)
        return {"there is no artificial viscosity to damp shocks and zero-energy modes", "effects.viscosity = { alpha = 0.1 }"};
    if (tension && !scene_.effects.artificial_stress)
        return {"cohesive soil under tension clumps without artificial stress", "effects.artificial_stress = \"auto\""};
    return {fmt::format("an outlier velocity, although dt c_p/h = {:.3g}", courant),
            "a smaller time.step or accuracy.cfl, more viscosity, or time.retry = true"};
}

void Watch::fail_at(const Particles& p, const Clock& clock, std::int64_t id, const std::string& what, const std::string& remedy)
{
    failed_id_ = id;
    // Of no particle where it was not one alone: an energy that outgrew the ledger.
    std::string text = fmt::format("the soil {} in step {}, t = {:.6g} s. Remedy: {}", what, clock.step, clock.time, remedy);
    int root = 0;
    for (Index i = 0; i < p.size(); ++i) {
        if (p[field::id][i] != id) continue;
        const Vector x = p[field::position][i], v = p[field::velocity][i];
        text =
            fmt::format("particle {} ({}) {} at ({:.4g}, {:.4g}, {:.4g}) m with {:.3g} m/s in step {}, t = {:.6g} s. Remedy: {}", id,
                        scene::name_of_body(scene_, filling_.body_of(id)), what, x.x, x.y, x.z, length(v), clock.step, clock.time, remedy);
        root = comm_.rank();
    }
    root = int(comm_.max(std::int64_t(root)));
    throw NumbersFailed(comm_.broadcast(text, root));
}

void Watch::judge_step(const Particles& p, const Clock& clock)
{
    const Extremes& e = clock.extremes;
    const double h = scene_.smoothing_length();
    const bool outran = std::sqrt(e.half_step_speed2) * clock.dt > h;
    if (e.not_finite == 0 && e.outside == 0 && !outran && e.density_ratio < limit::density) return;
    // The lowest id among the offenders, so that the message does not depend on the ranks.
    std::int64_t lowest = std::numeric_limits<std::int64_t>::max();
    const auto finite = [](Vector a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); };
    for (Index i = 0; i < p.size(); ++i) {
        const Vector x = p[field::position][i];
        const double ratio = p[field::density][i] / soils_[p[field::soil][i]].density;
        bool failed = !finite(x) || !finite(p[field::velocity][i]) || !std::isfinite(trace(p[field::stress][i])) || !std::isfinite(ratio) ||
                      length(p[field::velocity][i] - clock.frame) * clock.dt > h || ratio >= limit::density || ratio * limit::density <= 1;
        if (scene_.space.low) {
            const Vector lo = *scene_.space.low, hi = *scene_.space.high;
            const auto out = [&](int axis, double v, double a, double b) { return !scene_.space.periodic[axis] && (v < a || v > b); };
            failed = failed || out(0, x.x, lo.x, hi.x) || (scene_.dimensions == 3 && out(1, x.y, lo.y, hi.y)) || out(2, x.z, lo.z, hi.z);
        }
        if (failed) lowest = std::min(lowest, std::int64_t(p[field::id][i]));
    }
    comm_.min(std::span(&lowest, 1));
    const auto [why, remedy] = diagnosis(clock);
    if (e.not_finite != 0) fail_at(p, clock, lowest, "has numbers that are no longer finite (" + why + ")", remedy);
    if (outran) fail_at(p, clock, lowest, "went further than its smoothing length in one step (" + why + ")", remedy);
    if (e.outside != 0) fail_at(p, clock, lowest, "left the box", "a larger space.low/space.high, a longer wall, or a smaller step");
    fail_at(p, clock, lowest, fmt::format("changed its density {} fold (", limit::density) + why + ")", remedy);
}

void Watch::judge_ledger(const Particles& p, Clock& clock, const Ledger& l)
{
    clock.largest_energy = std::max(clock.largest_energy, l.state.kinetic + l.state.elastic + std::max(-l.state.potential, 0.0));
    // Against a thousandth of weight times height at least, so that the first movement is not judged by itself.
    const double allowed = limit::given * std::max(clock.largest_energy, 1e-3 * energy_units_per_scale * clock.energy_unit);
    const auto cause = diagnosis(clock);
    const std::string &why = cause.first, &remedy = cause.second;
    if (-l.dissipated.wall > allowed) {
        const auto id = fastest(p);
        fail_at(p, clock, id,
                fmt::format("is the fastest while fixed walls have given {:.3g} J, {:.2g} of the largest energy (at {}; {})",
                            -l.dissipated.wall, -l.dissipated.wall / clock.largest_energy, nearest_wall(p, id), why),
                remedy);
    }
    const auto falls = [&](const char* name, double now, double& most) {
        most = std::max(most, now);
        if (most - now > allowed)
            fail_at(p, clock, fastest(p),
                    fmt::format("is the fastest while {} work of {:.3g} J was given back ({})", name, most - now, why), remedy);
    };
    falls("plastic", l.dissipated.plastic, clock.largest_taken.plastic);
    falls("viscous", l.dissipated.viscous, clock.largest_taken.viscous);
    falls("damping", l.dissipated.damping, clock.largest_taken.damping);
}

std::string Watch::nearest_wall(const Particles& p, std::int64_t id) const
{
    double nearest = std::numeric_limits<double>::infinity();
    std::int64_t wall = -1;
    for (Index i = 0; i < p.size(); ++i) {
        if (p[field::id][i] != id) continue;
        for (std::size_t w = 0; w < scene_.walls.size(); ++w)
            if (!scene_.walls[w].present) continue;
            else if (const double d = scene::signed_distance(scene_.walls[w], p[field::position][i], scene_.dimensions); d < nearest)
                nearest = d, wall = std::int64_t(w);
    }
    const std::int64_t found = comm_.max(wall);
    return found < 0 ? "no wall" : scene::name_of_wall(scene_, int(found));
}

void Watch::inspect(const Particles& p, const Layout& layout, Clock& clock, const Ledger& l)
{
    judge_ledger(p, clock, l);
    // Against a thousandth of weight times height at least, so that the first movement is not judged by itself.
    const double energy_scale = energy_units_per_scale * clock.energy_unit;
    const double scale =
        std::max({std::fabs(l.state.potential), l.state.kinetic, l.state.elastic, std::fabs(clock.energy_at_start), 1e-3 * energy_scale});
    const double grown = (l.sum() - clock.energy_at_start) / scale;
    const auto [why, remedy] = diagnosis(clock);
    if (!(grown < limit::energy_growth))
        fail_at(p, clock, fastest(p), fmt::format("is the fastest while energy grows out of nothing, by {:.0f} % ({})", 100 * grown, why),
                remedy);
    const auto seen = inspect_neighbours(comm_, scene_, filling_.soil_count(), p, layout);
    seen_.clumped = seen.clumped, seen_.most_clumped = std::max(seen_.most_clumped, seen.clumped);
    seen_.deepest = std::max(seen_.deepest, seen.deepest);
    if (seen.most_neighbours > limit::neighbours)
        fail_at(p, clock, seen.crowded_id,
                fmt::format("has {:.1f} times the neighbours of the lattice: soil has clumped ({})", seen.most_neighbours, why), remedy);
    if (seen.deepest > limit::penetration)
        fail_at(p, clock, seen.sunk_id, fmt::format("has sunk {:.1f} spacings into a wall", seen.deepest),
                "a thicker wall (2 h), a smaller step, or viscosity with beta = 1 for fast impacts");
    if (scene_.terrain && scene_.terrain->edge == scene::Edge::Closed) judge_edge(p, clock);
}

void Watch::judge_edge(const Particles& p, const Clock& clock)
{
    Worst outside;
    for (const auto& wall : scene_.walls) {
        const auto* ground = std::get_if<scene::Ground>(&wall.shape);
        if (!ground) continue;
        for (Index i = 0; i < p.size(); ++i) {
            const Vector x = p[field::position][i];
            if (!std::isfinite(ground->field->at(x.x, x.y).z)) outside.meet(1, p[field::id][i]);
        }
    }
    if (const std::int64_t id = outside.combine(comm_); id >= 0)
        fail_at(p, clock, id, "has left the ground (terrain.edge = \"closed\")",
                "a larger elevation model or terrain.window, or terrain.edge = \"open\", which counts what leaves");
}

} // namespace kuzure
