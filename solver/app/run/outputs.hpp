#pragma once
// What a run writes while it goes: history.csv, the snapshots, maps, progress.csv, each at the first step at or after its time.
#include "io/history.hpp"
#include "io/result_directory.hpp"
#include "io/snapshot.hpp"
#include "solver/app/run/fronts.hpp"
#include "solver/app/run/maps.hpp"
#include "solver/run/simulation.hpp"
#include <optional>

namespace kuzure {

class Outputs {
public:
    /// Collective. `restart`: the simulated time (s) from which a run goes on: what lies behind it is taken back. `start`: wall_clock()
    /// when the run began.
    Outputs(const Comm&, const Scene&, const io::ResultDirectory&, const Simulation&, std::optional<double> restart, double start);
    /// Collective, in a scene with maps: begins them, or goes on with those of the checkpoint. As the constructor of Maps.
    void begin_maps(Simulation&, std::vector<io::NamedPoint>, const std::optional<KeptMaps>&, std::optional<double> restart);
    /// The steps to come count for the rate in progress.csv.
    void begin_loop(const Simulation&);
    /// Collective: what is due after a step that began at time `before` (s; negative: there was none).
    void write_due(Simulation&, double before, bool last);
    /// Collective: the maps as they are now, where there are some.
    void write_maps(Simulation&);
    /// Collective: the state whose numbers failed, unless it is kept already.
    void write_failure(Simulation&);
    /// Collective: forgets what was written after the time to which the simulation went back.
    void take_back(const Simulation&);
    /// Collective: the events that a step began with are in events.csv; gives them in words.
    std::vector<std::string> write_events(const Simulation&);
    /// The history and what else grows with it is on the disk as far as it goes.
    void sync();
    /// Of the last row of the history; nothing before there is one.
    const std::optional<double>& residual() const { return residual_; }
    const std::optional<Fronts>& fronts() const { return fronts_; }
    const std::optional<Maps>& maps() const { return maps_; }

private:
    void open(std::optional<double> restart);
    void write_history(Simulation&);
    void write_forces(Simulation&);
    void write_probes(const Simulation&);
    void write_snapshot(const Simulation&, std::optional<std::int64_t> failed);
    void log_progress(const Simulation&);

    const Comm& comm_;
    const Scene& scene_;
    const io::ResultDirectory& directory_;
    io::WallPoints walls_;
    std::optional<io::Snapshots> snapshots_;
    std::optional<io::History> history_;
    std::optional<io::ProgressLog> progress_;
    std::optional<io::EventLog> events_; // of a scene that has some
    std::optional<io::ForceLog> forces_;
    std::optional<io::ProbeLog> probes_;
    std::size_t reported_ = 0; // events of Simulation::happened() that are written
    std::optional<double> residual_;
    std::optional<Fronts> fronts_;
    std::optional<Maps> maps_;
    double start_, logged_wall_ = 0; // s: of wall_clock(), since start_
    std::int64_t logged_step_ = 0;
};

} // namespace kuzure
