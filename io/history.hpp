#pragma once
// history.csv: what the soil did, a row an interval; progress.csv: how fast the run went.
#include "io/rows.hpp"

namespace kuzure::io {

/// One row, in the order of the file. Energies in J (2-D: J per m of thickness).
struct HistoryRow {
    double time;                                                         // s
    std::int64_t step;                                                   // 1
    double dt;                                                           // s
    double kinetic, potential, elastic, plastic, viscous, wall, damping; // J
    double residual;                                                     // 1
    double max_speed;                                                    // m/s
    double height, front_min_x, front_max_x, front_min_y, front_max_y;   // m
    double stabilising, moved_wall; // J; work of artificial stress and stress diffusion, of walls that move
};

class History : public Rows {
public:
    /// Collective. As Rows.
    History(const Team&, const Place& file, int dimensions, std::optional<double> restart_time = {});
    /// Collective; rank 0's row counts. Throws IoFailed on all ranks.
    void append(const HistoryRow&);
};

/// How fast a run goes. It differs from run to run: nothing of it is in history.csv, whose bits do not.
struct ProgressRow {
    double time;             // s
    std::int64_t step;       // 1
    double dt;               // s
    double wall;             // s since this start of the program
    double steps_per_second; // 1/s since the row before
    double balance;          // 1, busiest rank over the mean
};

/// progress.csv
class ProgressLog : public Rows {
public:
    /// Collective. As Rows.
    ProgressLog(const Team&, const Place& file, std::optional<double> restart_time = {});
    /// Collective; rank 0's row counts. Throws IoFailed on all ranks.
    void append(const ProgressRow&);
};

} // namespace kuzure::io
