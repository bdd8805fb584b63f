#include "solver/app/scaling/forecast.hpp"
#include "solver/core/mix.hpp"
#include "solver/run/simulation.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/step_limits.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <omp.h>
#include <optional>

namespace kuzure {

namespace {

// What cannot be measured in a moment, from runs of hirata_52 on the machine of docs/performance.md. Elsewhere it is taken to be
// slower or faster as `chain_seconds` is.
constexpr double reference_chain = 4.07e-3; // s
constexpr double history_particle = 30e-9;  // s a soil particle of a rank and row
constexpr double pictures_base = 0.06;      // s: fonts, axes, colours, once
constexpr double wall_particle = 0.3e-6;    // s a wall particle, once
constexpr double picture_base = 0.012;      // s of one core, each
constexpr double picture_particle = 0.4e-6; // s of one core a soil particle
constexpr double snapshot_base = 4.2e-3;    // s: two files made, synced, renamed
constexpr double file_byte = 2.5e-9;        // s
// Soil that has run out over real ground lies in thin, ragged layers: a pair costs 1.6 to 2.3 times that of the mass as it lay, and how
// long it runs is not known to better than a factor (four slides of docs/terrain.md).
constexpr double ragged = 2, ground_low = 0.7, ground_high = 2;

/// A chain of a million multiplications and shifts on one core, s: how fast this core is now, whatever else runs here.
double chain_seconds()
{
    const double begin = omp_get_wtime();
    std::uint64_t z = 1;
    for (int k = 0; k < 1000000; ++k) z = mix(z + 0x9e3779b97f4a7c15ull);
    volatile std::uint64_t sink = z;
    (void)sink;
    return omp_get_wtime() - begin;
}

struct Measured {
    std::vector<double> pair;    // s a directed pair, update included; one a round
    double rebuild_particle = 0; // s a soil particle
    double walls_particle = 0;   // s a soil particle, each time the walls near the soil are made anew
};

/// A few steps of a block of the scene's own soil and kernel, its lattice shaken as soil in motion is; on real ground, of the mass as it
/// lies there, if that is no more.
Measured measure(const Comm& comm, Scene s, const scene::Filling& filling, std::int64_t soil)
{
    // So many particles that every rank has what a small run has, and no more than the scene itself.
    const double wanted = double(std::clamp<std::int64_t>(soil, 216, 8000 * std::int64_t(comm.size())));
    const double points = std::round(s.dimensions == 3 ? std::cbrt(wanted) : std::sqrt(wanted)), edge = points * s.space.spacing;
    const double shake = 0.2 * s.space.spacing;
    RunOptions options;
    s.loads.clear(), s.events.clear(), s.probes.clear();
    if (scene::ground_of(s) && double(soil) <= wanted) options.filling = filling;
    else {
        s.space.low.reset(), s.space.high.reset(), s.space.periodic = {};
        s.walls.clear();
        s.bodies.resize(1);
        s.bodies[0] = {.soil = s.bodies[0].soil, .shape = scene::Box{{0, 0, 0}, {edge, edge, edge}}};
    }
    for (auto& b : s.bodies) b.stress = scene::InitialStress::None;
    const double step = 1e-3 * scene::crossing_time(s);
    s.time = {.end = 1e3 * step, .step = step}; // more steps than are taken below, however soft the soil
    options.initial = [&](Particles& p) {
        for (Index i = 0; i < p.size(); ++i) {
            // three numbers in -1 .. 1 from the id, the same for any ranks
            auto bits = std::uint64_t(p[field::id][i] + 1) * 0x9e3779b97f4a7c15ull;
            Vector x = p[field::position][i];
            for (double* c : {&x.x, &x.y, &x.z}) {
                bits ^= bits >> 29, bits *= 0xbf58476d1ce4e5b9ull;
                if (s.dimensions == 3 || c != &x.y) *c += shake * (double(bits >> 11) * 0x1p-52 - 1);
            }
            p[field::position].set(i, x);
        }
    };
    Measured m;
    m.rebuild_particle = m.walls_particle = std::numeric_limits<double>::max();
    // The first lists of three runs, the fastest counts: what else runs here may hold one up for longer than all of them take.
    std::optional<Simulation> made;
    for (int k = 0; k < 3; ++k) {
        made.emplace(comm, s, options);
        made->step();
        const auto& t = made->timers();
        const double each =
            1 / std::max<double>(1, double(made->filling().soil_count()) * double(std::max<std::int64_t>(1, made->rebuilds())));
        const double lists = comm.max(t.seconds(Phase::Migrate) + t.seconds(Phase::Sort) + t.seconds(Phase::Lists)) * each;
        const double around = comm.max(t.seconds(Phase::Ghosts)) * each;
        m.rebuild_particle = std::min(m.rebuild_particle, s.walls.empty() ? lists + around : lists);
        m.walls_particle = std::min(m.walls_particle, s.walls.empty() ? 0 : around);
    }
    Simulation& sim = *made;
    sim.step();
    const auto& t = sim.timers();
    // Rounds of about 30 ms each: as many steps as that takes.
    const double first = comm.max(t.seconds(Phase::Interior) + t.seconds(Phase::Rim)) / 2;
    const int steps = std::clamp(int(0.03 / std::max(first, 1e-6)), 2, 50);
    for (int round = 0; round < 7; ++round) {
        const auto pairs = sim.pairs();
        const double begin = omp_get_wtime();
        for (int k = 0; k < steps; ++k) sim.step();
        const double seconds = comm.max(omp_get_wtime() - begin);
        m.pair.push_back(seconds / double(std::max<std::int64_t>(1, sim.pairs() - pairs)));
    }
    std::sort(m.pair.begin(), m.pair.end());
    return m;
}

/// Way (m) of a point that slides down real ground against its friction from the middle of the soil, until the scene's end.
double way_down(const Scene& s, const scene::Filling& f)
{
    const scene::Wall* ground = scene::ground_wall(s);
    if (!ground || !s.effects.gravity) return 0;
    const auto& field = *std::get<scene::Ground>(ground->shape).field;
    const Vector g = *s.effects.gravity;
    const auto& box = f.soil_bounds();
    // Soil on rough ground shears in itself.
    const bool rough = ground->surface == scene::Surface::Rough;
    const double own = s.soils[std::size_t(s.bodies.front().soil)].friction_angle;
    Vector x = 0.5 * (box.low + box.high), v{};
    double way = 0;
    constexpr int steps = 4000;
    const double dt = s.time.end / steps;
    for (int k = 0; k < steps; ++k) {
        const auto p = field.at(x.x, x.y);
        if (!std::isfinite(p.z)) break;
        x.z = p.z;
        const Vector n = p.normal();
        const double press = std::max(0.0, -dot(g, n)), speed = length(v);
        // The ground turns it without slowing it; then gravity along the ground, and friction.
        Vector along = v - dot(v, n) * n;
        if (const double kept = length(along); kept > 0) along = (speed / kept) * along;
        v = along + dt * (g - dot(g, n) * n);
        const double now = length(v), lost = dt * press * std::tan(rough ? own : scene::friction_angle_at(*ground, x));
        v = now > lost ? (1 - lost / now) * v : Vector{};
        x = x + dt * v, way += dt * length(v);
    }
    return way;
}

/// The longest way (m) of any particle. It speeds up as if it fell at three quarters of g, moves with 0.8 sqrt(g H) until about
/// 3 sqrt(H/g), and slowly creeps then; or goes down a slope half as fast again as the middle of the soil.
double longest_way(const Scene& s, const scene::Filling& f)
{
    double fastest = 0;
    for (const auto& b : s.bodies) fastest = std::max(fastest, length(b.velocity));
    double way = fastest * s.time.end;
    if (s.effects.gravity) {
        const double g = length(*s.effects.gravity), height = f.soil_height();
        const double top = 0.8 * std::sqrt(g * height), until = top / (0.75 * g), slow = 3 * std::sqrt(height / g), t = s.time.end;
        if (g > 0) {
            way += 0.5 * 0.75 * g * std::pow(std::min(t, until), 2);
            if (t > until) way += top * (std::min(t, slow) - until);
            if (t > slow) way += 0.1 * top * (t - slow);
        }
    }
    return way + 1.5 * way_down(s, f);
}

/// How often the lists are made anew: whenever the fastest particle has gone half a skin.
double rebuilds(const Scene& s, double way, double steps)
{
    const double half_skin = 0.5 * s.accuracy.skin * s.support();
    return std::clamp(half_skin > 0 ? way / half_skin : steps, 1.0, std::max(1.0, steps));
}

} // namespace

Forecast forecast(const Comm& comm, const Scene& s, const scene::Filling& f, const Estimate& e, double done)
{
    const double begin = omp_get_wtime();
    const Measured m = measure(comm, s, f, e.soil);
    const bool ground = scene::ground_of(s) != nullptr;
    const double pair = (ground ? ragged : 1) * m.pair[m.pair.size() / 2], slower = chain_seconds() / reference_chain;
    const double soil = double(e.soil), in_steps = e.pairs * (1 - done) * pair;
    const double way = longest_way(s, f), walls = rebuilds(s, way, double(e.steps)) * std::min(1.0, 0.5 * s.accuracy.skin / 3);
    const double lists = (1 - done) * soil * (rebuilds(s, way, double(e.steps)) * m.rebuild_particle + walls * m.walls_particle);
    const double rows = e.history_rows * soil / comm.size() * history_particle;
    // All of them at the end, also those of before a restart; the ranks and their threads share them.
    const double hands = std::min(e.snapshots, double(comm.size()) * omp_get_max_threads());
    const double pictures = s.output.picture ? pictures_base + wall_particle * double(e.shown) +
                                                   e.snapshots / hands * (picture_base + picture_particle * double(e.soil))
                                             : 0;
    const double files = e.snapshots * snapshot_base + (e.snapshots * e.snapshot + e.wall_files + (1 - done) * e.checkpoint) * file_byte;
    const double outside_steps = lists + slower * ((1 - done) * rows + pictures + files) + 2 * (omp_get_wtime() - begin);
    Forecast out;
    out.pair_nanoseconds = 1e9 * pair;
    out.seconds = in_steps + outside_steps;
    // What the rounds differed by, and a tenth for what the model leaves out.
    const double middle = m.pair[m.pair.size() / 2];
    out.low = (ground ? ground_low : 0.9) * (in_steps * m.pair.front() / middle + outside_steps);
    out.high = (ground ? ground_high : 1.1) * (in_steps * m.pair.back() / middle + outside_steps);
    // Clocks differ between ranks: the root's word counts.
    double all[] = {out.seconds, out.low, out.high, out.pair_nanoseconds};
    comm.broadcast(std::as_writable_bytes(std::span<double>(all)));
    return {all[0], all[1], all[2], all[3]};
}

TimeUnit unit_for(double seconds)
{
    if (seconds < 100) return {1, "seconds"};
    if (seconds < 6000) return {60, "minutes"};
    return {3600, "hours"};
}

std::string forecast_text(const Forecast& f)
{
    const auto [of, unit] = unit_for(f.high);
    return fmt::format("{:.1f} {} ({:.1f} to {:.1f})", f.seconds / of, unit, f.low / of, f.high / of);
}

} // namespace kuzure
