#include "solver/app/run/outputs.hpp"
#include "io/soil_color.hpp"
#include "solver/core/wall_clock.hpp"
#include "solver/run/probes.hpp"
#include "solver/scene/motion.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure {

namespace {

/// This rank's even share of the wall particles that show, for snapshots and pictures.
io::WallPoints wall_share(const Comm& comm, const scene::Filling& f, const Material& first_soil)
{
    io::WallPoints w;
    const std::int64_t n = f.shown_wall_count();
    const std::int64_t begin = n * comm.rank() / comm.size(), end = n * (comm.rank() + 1) / comm.size();
    const auto mine = std::size_t(end - begin);
    w.position.reserve(mine), w.id.reserve(mine), w.density.reserve(mine);
    f.for_each_shown_wall(begin, end, [&](std::int64_t id, Vector x) {
        w.position.push_back(x), w.id.push_back(id), w.density.push_back(first_soil.density);
    });
    return w;
}

/// Of those what is there now, where events have moved it.
io::WallPoints walls_of_now(const io::WallPoints& drawn, const scene::Filling& f, const Scene& now)
{
    io::WallPoints w;
    for (std::size_t k = 0; k < drawn.size(); ++k) {
        const scene::Wall& wall = now.walls[std::size_t(f.wall_of(drawn.id[k]))];
        if (!wall.present) continue;
        w.position.push_back(scene::placed(wall.pose, drawn.position[k]));
        w.id.push_back(drawn.id[k]), w.density.push_back(drawn.density[k]);
    }
    return w;
}

/// True if something that comes every `interval` s is due at this step and was not there at the one before.
bool due(std::optional<double> interval, double time, double before)
{
    if (!interval) return false;
    const auto count = [&](double t) { return std::floor(t / *interval * (1 + 1e-12) + 1e-9); };
    return before < 0 || count(time) > count(before);
}

} // namespace

Outputs::Outputs(const Comm& comm, const Scene& scene, const io::ResultDirectory& directory, const Simulation& sim,
                 std::optional<double> restart, double start)
    : comm_(comm), scene_(scene), directory_(directory), walls_(wall_share(comm, sim.filling(), sim.soils().front())), start_(start)
{
    open(restart);
}

void Outputs::open(std::optional<double> restart)
{
    snapshots_.emplace(comm_, directory_.snapshots(), restart);
    history_.emplace(comm_, directory_.history(), scene_.dimensions, restart);
    progress_.emplace(comm_, directory_.progress(), scene_.dimensions, restart);
    if (!scene_.events.empty()) events_.emplace(comm_, directory_ / "events.csv", scene_.dimensions, restart);
    if (!WallForces::named(scene_).empty()) forces_.emplace(comm_, directory_ / "forces.csv", scene_.dimensions, restart);
    if (!scene_.probes.empty()) probes_.emplace(comm_, directory_ / "probes.csv", scene_.dimensions, restart);
}

void Outputs::sync()
{
    history_->sync();
    if (events_) events_->sync();
    if (forces_) forces_->sync();
    if (probes_) probes_->sync();
}

void Outputs::begin_maps(Simulation& sim, std::vector<io::NamedPoint> points, const std::optional<KeptMaps>& kept,
                         std::optional<double> restart)
{
    maps_.emplace(comm_, scene_, directory_, sim, std::move(points), kept, restart);
}

void Outputs::write_maps(Simulation& sim)
{
    if (maps_) maps_->write(sim, Maps::Pictures::Draw);
}

void Outputs::take_back(const Simulation& sim)
{
    open(sim.time());
    reported_ = std::min(reported_, sim.happened().size());
    if (maps_) maps_->take_back(sim.time());
}

std::vector<std::string> Outputs::write_events(const Simulation& sim)
{
    std::vector<std::string> words;
    const auto fresh_events = sim.happened().subspan(reported_);
    reported_ = sim.happened().size();
    if (fresh_events.empty()) return words;
    std::vector<io::EventRow> rows;
    for (const auto& h : fresh_events) {
        const auto& event = scene_.events[std::size_t(h.event)];
        std::string what = scene::in_words(scene_, event);
        words.push_back(fmt::format("t = {:.6g} s, event {}{}: {}", h.time, h.event,
                                    scene::lasting(event) ? fmt::format(" (to {:.6g} s)", scene::end_of(event)) : "", what));
        std::ranges::replace(what, ',', ' '); // a cell
        rows.push_back({h.time, h.step, h.event, what, h.taken});
    }
    if (!events_->last_time() || rows.front().time > *events_->last_time()) events_->append(rows);
    return words;
}

void Outputs::begin_loop(const Simulation& sim)
{
    logged_step_ = sim.steps();
    logged_wall_ = wall_clock() - start_;
}

void Outputs::write_due(Simulation& sim, double before, bool last)
{
    const double t = sim.time();
    if (before < 0 || last || due(scene_.time.end / 400, t, before)) log_progress(sim);
    if (due(scene_.output.history, t, before) || last || before < 0) {
        const auto fresh = [&](const auto& rows) { return rows && (!rows->last_time() || t > *rows->last_time()); };
        sim.timers().timed(Phase::History, [&] {
            if (fresh(history_)) write_history(sim);
            if (fresh(forces_)) write_forces(sim);
            if (fresh(probes_)) write_probes(sim);
        });
    }
    if (maps_) {
        if (before >= 0 && t > before) maps_->after_step(sim);
        // A hundred rows show how the front went where the scene does not say how many.
        if (due(scene_.output.history.value_or(scene_.time.end / 100), t, before) || last || before < 0) maps_->write_front(sim);
    }
    if (due(scene_.output.every, t, before) || last || before < 0) {
        if (maps_) maps_->write(sim, last ? Maps::Pictures::Draw : Maps::Pictures::Leave);
        if (!snapshots_->last_time() || t > *snapshots_->last_time()) sim.timers().timed(Phase::Snapshot, [&] { write_snapshot(sim, {}); });
    }
}

void Outputs::log_progress(const Simulation& sim)
{
    const double wall = wall_clock() - start_;
    const double rate = wall > logged_wall_ ? double(sim.steps() - logged_step_) / (wall - logged_wall_) : 0;
    if (!progress_->last_time() || sim.time() > *progress_->last_time())
        progress_->append(
            {sim.time(), sim.steps(), sim.dt(), wall, sim.steps() > logged_step_ ? rate : std::nan(""), sim.balance().imbalance()});
    logged_wall_ = wall, logged_step_ = sim.steps();
}

void Outputs::write_history(Simulation& sim)
{
    const Ledger l = sim.ledger();
    fronts_ = measure_fronts(comm_, sim.particles(), scene_, sim.filling());
    const Fronts& fronts = *fronts_;
    residual_ = sim.residual(l);
    // energy.cpp's sums, and the columns they and the heap read
    const auto n = double(sim.particles().size());
    sim.timers().did(Phase::History, 45 * n, 20 * 8 * n);
    history_->append({sim.time(),
                      sim.steps(),
                      sim.dt(),
                      l.state.kinetic,
                      l.state.potential,
                      l.state.elastic,
                      l.dissipated.plastic,
                      l.dissipated.viscous,
                      l.dissipated.wall,
                      l.dissipated.damping,
                      *residual_,
                      sim.max_speed(),
                      fronts.height,
                      fronts.min_x,
                      fronts.max_x,
                      fronts.min_y,
                      fronts.max_y,
                      l.dissipated.stabilising,
                      l.dissipated.moved_wall,
                      l.events,
                      l.dissipated.loads});
}

void Outputs::write_forces(Simulation& sim)
{
    std::vector<io::ForceRow> rows;
    for (const auto& load : sim.wall_loads()) rows.push_back({sim.time(), load.name, load.force, load.moment, load.impulse});
    forces_->append(rows);
}

void Outputs::write_probes(const Simulation& sim)
{
    std::vector<io::ProbeRow> rows;
    for (const auto& r : read_probes(comm_, sim.scene(), sim.filling(), sim.soils(), sim.particles()))
        rows.push_back({sim.time(), r.name, r.particles, r.position, r.velocity, r.density, r.stress, r.plastic_strain});
    probes_->append(rows);
}

void Outputs::write_snapshot(const Simulation& sim, std::optional<std::int64_t> failed)
{
    io::SnapshotLabel label{sim.time(), sim.steps(), scene_.dimensions, scene_.title, scene_.output.fields, failed};
    // What colours the pictures is kept, asked for or not.
    if (scene_.output.picture && !label.fields.empty())
        if (const std::string behind = io::field_behind(scene_.output.picture->color); std::ranges::count(label.fields, behind) == 0)
            label.fields.push_back(behind);
    label.walls_change = scene::walls_change(scene_);
    snapshots_->write(sim.particles(), label.walls_change ? walls_of_now(walls_, sim.filling(), sim.scene()) : walls_, label);
}

void Outputs::write_failure(Simulation& sim)
{
    write_maps(sim);
    // Its picture has a ring around the particle to blame.
    if (!snapshots_->last_time() || sim.time() > *snapshots_->last_time()) write_snapshot(sim, sim.failed_id());
}

} // namespace kuzure
