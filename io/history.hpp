#pragma once
// The tables that a run writes as it goes, a kind of row each: history.csv, events.csv, forces.csv, probes.csv, progress.csv.
#include "io/rows.hpp"
#include "solver/core/tensor.hpp"
#include <span>
#include <string>

namespace kuzure::io {

/// history.csv, in its order. Energies in J (2-D: J per m of thickness).
struct HistoryRow {
    double time;                                                         // s
    std::int64_t step;                                                   // 1
    double dt;                                                           // s
    double kinetic, potential, elastic, plastic, viscous, wall, damping; // J
    double residual;                                                     // 1
    double max_speed;                                                    // m/s
    double height, front_min_x, front_max_x, front_min_y, front_max_y;   // m
    double stabilising, moved_wall; // J; work of artificial stress and stress diffusion, of walls that move
    double events, loads;           // J, that events and loads have taken
};

/// events.csv: what happened, a row an event.
struct EventRow {
    double time;       // s
    std::int64_t step; // 1
    int event;         // number in the scene file
    std::string what;
    double taken; // J, by all events of this time
};

/// forces.csv: what soil does to a named wall, a row a wall at each time; in 2-D per metre of thickness.
struct ForceRow {
    double time; // s
    std::string wall;
    Vector force, moment, impulse; // N, N m about the scene's origin, N s since the start
};

/// probes.csv: a row a probe at each time.
struct ProbeRow {
    double time; // s
    std::string probe;
    std::int64_t particles;
    Vector position, velocity; // m, m/s
    double density;            // kg/m^3
    Stress stress;             // Pa
    double plastic_strain;     // 1
};

/// progress.csv: how fast a run goes. It differs from run to run: nothing of it is in history.csv, whose bits do not.
struct ProgressRow {
    double time;             // s
    std::int64_t step;       // 1
    double dt;               // s
    double wall;             // s since this start of the program
    double steps_per_second; // 1/s since the row before
    double balance;          // 1, busiest rank over the mean
};

/// The table of one kind of row.
template <class Row> class Log : public Rows {
public:
    /// Collective. As Rows.
    Log(const Team&, const Place& file, int dimensions, std::optional<double> restart_time = {});
    /// Collective; rank 0's row counts, or its rows of one time. Throws IoFailed on all ranks.
    void append(const Row&);
    void append(std::span<const Row>);
};
using History = Log<HistoryRow>;
using EventLog = Log<EventRow>;
using ForceLog = Log<ForceRow>;
using ProbeLog = Log<ProbeRow>;
using ProgressLog = Log<ProgressRow>;

} // namespace kuzure::io
