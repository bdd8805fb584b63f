#pragma once
// history.csv: one row per interval, appended whole, cut back to the restart time without touching what came
// before.
#include "io/file.hpp"
#include <optional>

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
};

class History {
public:
    /// Collective. Starts a new file; with a restart time, goes on after the last row not later than it,
    /// dropping later and torn rows. Throws IoFailed, also where the file is not a history of kuzure.
    History(const Team&, const Path& file, int dimensions, std::optional<double> restart_time = {});
    ~History();
    History(const History&) = delete;
    History& operator=(const History&) = delete;

    /// Collective; rank 0's row counts. The row is with the system when this returns. Throws IoFailed on all
    /// ranks.
    void append(const HistoryRow&);
    /// Collective. The rows are on the disk when this returns: to be called before a checkpoint is written.
    void sync();
    /// Time of the last row in the file, if there is one: a restart must not write it again.
    std::optional<double> last_time() const { return last_time_; }

private:
    const Team& team_;
    Path file_;
    std::optional<double> last_time_;
    int fd_ = -1; // rank 0 only
};

} // namespace kuzure::io
