#include "solver/app/run/ending.hpp"
#include "io/picture_series.hpp"
#include "io/summary.hpp"
#include "perf/report.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/report/movie.hpp"
#include "solver/app/report/pictures.hpp"
#include "solver/app/report/report.hpp"
#include "solver/app/run/fronts.hpp"
#include "solver/core/ensure.hpp"
#include "solver/core/simd.hpp"
#include "solver/core/wall_clock.hpp"
#include "solver/run/loads.hpp"
#include "solver/scene/motion.hpp"
#include <algorithm>
#include <fmt/format.h>

namespace kuzure {

void Ending::write(Simulation& sim, const Outputs& outputs, const std::string& status, Exit code, const std::string& message)
{
    draw_pictures(sim);
    write_summary(sim, outputs, status, code, message);
    write_report();
}

/// The pictures, from the snapshots and when the last of them is there: one camera and one range for all. Without them the results are
/// complete, so what the program cannot draw is said and nothing more.
void Ending::draw_pictures(Simulation& sim)
{
    if (!scene_.output.picture) return;
    sim.timers().timed(Phase::Picture, [&] {
        try {
            io::remove_pictures(comm_, directory_.place()); // also those of snapshots that a restart took back
            auto task = picture_task(scene_, directory_.place());
            task.tolerant = true;
            for (const auto& w : io::draw_pictures(comm_, task).warnings) messages_.warn(w);
        } catch (const BadInput& e) {
            messages_.warn(e.what());
        }
    });
}

namespace {
std::vector<std::pair<std::string, double>> energies(const Ledger& l, double residual)
{
    return {{"kinetic", l.state.kinetic},
            {"potential", l.state.potential},
            {"elastic", l.state.elastic},
            {"plastic", l.dissipated.plastic},
            {"viscous", l.dissipated.viscous},
            {"wall", l.dissipated.wall},
            {"damping", l.dissipated.damping},
            {"stabilising", l.dissipated.stabilising},
            {"moved_wall", l.dissipated.moved_wall},
            {"events", l.events},
            {"loads", l.dissipated.loads},
            {"residual", residual}};
}
nlohmann::json told(const LoadedSoil& load)
{
    const Vector f = load.force;
    return {{"name", load.name}, {"particles", load.particles}, {"force", {f.x, f.y, f.z}}, {"factor", load.factor}};
}
} // namespace

void Ending::write_summary(Simulation& sim, const Outputs& outputs, const std::string& status, Exit code, const std::string& message)
{
    const Ledger l = sim.ledger();
    const std::int64_t steps_here = sim.steps() - facts_.first_step;
    const double stepping = facts_.loop_seconds;
    const double volume = resting_volume_ratio(comm_, sim.particles(), scene_, sim.filling());
    warn_of_volume(volume);
    io::Summary s;
    s.wall_seconds = wall_clock() - facts_.start;
    s.status = status, s.exit_code = int(code), s.scene_hash = facts_.scene_hash, s.version = version_text();
    s.ranks = comm_.size(), s.threads = facts_.threads;
    s.precision = sim.model().precision() == scene::Precision::Mixed ? "mixed" : "double";
    s.soil_particles = sim.filling().soil_count(), s.wall_particles = sim.filling().wall_count();
    s.steps = sim.steps(), s.time = sim.time(), s.pairs = sim.pairs();
    s.seconds_per_step = steps_here > 0 ? stepping / double(steps_here) : 0;
    const std::int64_t particle_steps = comm_.sum(sim.work_done().particle_steps);
    s.particle_steps_per_second = stepping > 0 ? double(particle_steps) / stepping : 0;
    s.energy = energies(l, sim.residual(l));
    s.effects = scene_.notes;
    s.state_hash = state_hash(comm_, sim.particles());
    s.message = message;
    s.host = host_name(), s.hosts = comm_.node_position().nodes, s.warnings = messages_.warnings();
    s.predicted_seconds = facts_.forecast.seconds, s.predicted_low = facts_.forecast.low, s.predicted_high = facts_.forecast.high;
    auto j = io::to_json(s);
    const MemoryUse memory = sim.memory();
    j["memory_bytes_per_rank"] = comm_.max(std::int64_t(memory.all()));
    memory.for_each([&](std::string_view kind, std::size_t bytes) { j["memory_bytes_by_kind"][kind] = comm_.max(std::int64_t(bytes)); });
    if (sim.filling().wall_count() > 0 && scene::walls_change(scene_)) j["walls_in"] = {"snapshots/state_*.hdf"};
    else if (sim.filling().wall_count() > 0) j["walls_in"] = {"snapshots/state_000000.hdf", "snapshots/walls.hdf"};
    j["rebuilds"] = sim.rebuilds();
    j["repartitions"] = sim.balance().cuts(), j["repartitions_by_metis"] = sim.balance().full_partitions();
    j["pair_model"] = sim.model().name();
    const auto& seen = sim.seen();
    j["guard"] = {{"clumped", seen.clumped}, {"most_clumped", seen.most_clumped}, {"deepest_in_wall", seen.deepest}};
    j["retries"] = facts_.retries;
    j["peak_speed"] = facts_.peak_speed;
    if (!facts_.started_from.is_null()) j["started_from"] = facts_.started_from;
    if (const auto& settled = sim.settled())
        j["settling"] = {{"why", settled->why},        {"steps", settled->steps},        {"seconds", settled->time},
                         {"speed", settled->speed},    {"moved", settled->displacement}, {"held", settled->held},
                         {"at_rest", settled->at_rest}};
    for (const auto& load : loaded_soil(comm_, sim.scene(), sim.particles())) j["loads"].emplace_back(told(load));
    if (volume > 0) j["resting_volume_ratio"] = volume;
    if (outputs.fronts()) j["soil_off_ground"] = outputs.fronts()->off_ground;
    if (outputs.maps() && !outputs.maps()->summary().is_null()) j["maps"] = outputs.maps()->summary();
    if (facts_.with_twins && code == Exit::Ok) {
        io::on_root(comm_, [&] { j["error_bars"] = study::error_bars(scene_, directory_.path(), facts_.peak_speed, facts_.twins); });
        if (messages_.prints())
            for (const auto& line : study::error_bar_lines(j["error_bars"])) messages_.say(line);
    }
    io::write_json(comm_, directory_.summary(), j);
    write_timers(sim);
}

/// Without dilation soil keeps its volume: more, where it rests, is not the soil's doing.
void Ending::warn_of_volume(double ratio)
{
    constexpr double most = 1.02;
    for (const auto& soil : scene_.soils)
        if (soil.dilation_angle > 0) return;
    if (ratio > most)
        messages_.warn(fmt::format(
            "the soil at rest takes {:.1f} % more space than at the start, though it does not dilate: heights and reach "
            "are too great by about that{}",
            100 * (ratio - 1),
            std::ranges::any_of(scene_.soils, [](const scene::Soil& s) { return s.opened_volume == scene::OpenedVolume::Forgotten; })
                ? "; soil.*.opened_volume = \"kept\" would close what tension has opened"
                : ""));
}

void Ending::write_timers(Simulation& sim)
{
    auto report = phase_report(sim.timers(), sim.work_done(), facts_.threads, comm_);
    // The roofs of this machine: those kept, or measured now if the run was long enough to hide the two seconds.
    const int on_node = facts_.threads * comm_.node_position().size;
    if (comm_.rank() == 0) report.machine = kept_machine(instruction_set(), on_node);
    if (!report.machine && comm_.size() == 1 && facts_.loop_seconds > 20) report.machine = this_machine(instruction_set(), on_node);
    io::on_root(comm_, [&] {
        io::write_atomically(directory_ / "timers.json", report.json());
        io::write_atomically(directory_ / "timers.txt", report.text());
    });
}

/// What people look at. The results are complete without it: trouble here is said and nothing more.
void Ending::write_report()
{
    if (comm_.rank() != 0) return;
    if (!directory_.in_place()) return complain(fmt::format("warning: no report.html: {} was moved meanwhile", directory_.path().string()));
    try {
        if (scene_.output.movie) messages_.say(fmt::format("film: {}", report::write_movie(directory_.path()).string()));
    } catch (const std::exception& e) {
        complain(fmt::format("warning: {}", e.what()));
    }
    try {
        report::write_report(directory_.path());
    } catch (const std::exception& e) {
        complain(fmt::format("warning: no report.html: {}", e.what()));
    }
}

void Ending::say_finished(const Simulation& sim, const Outputs& outputs)
{
    const double took = wall_clock() - facts_.start;
    const std::int64_t steps = sim.steps() - facts_.first_step;
    messages_.say(fmt::format("{} steps in {:.1f} s ({:.2f} ms a step); energy residual {}", steps, facts_.loop_seconds,
                              1e3 * facts_.loop_seconds / std::max<double>(1, double(steps)),
                              outputs.residual() ? fmt::format("{:+.2e}", *outputs.residual()) : "unknown"));
    if (facts_.forecast.seconds > 0)
        messages_.say(fmt::format("took {:.1f} s, predicted {:.1f} s ({:+.0f} %)", took, facts_.forecast.seconds,
                                  100 * (facts_.forecast.seconds / took - 1)));
    messages_.say(fmt::format("results in {}, to begin with report.html", directory_.path().string()));
}

} // namespace kuzure
