#pragma once
// A table that grows while a run goes on: two header lines, then rows that begin with a time, appended whole, shortened to the
// restart time without touching what came before.
#include "io/file.hpp"
#include <optional>

namespace kuzure::io {

class Rows {
public:
    /// Collective. Starts a new file with two lines, names and units; with a restart time, goes on after the last row not later
    /// than it, dropping later and torn rows. Throws IoFailed, also where the file does not begin with these names.
    Rows(const Team&, const Place& file, std::string names, const std::string& units, std::optional<double> restart_time = {});
    Rows(const Rows&) = delete;
    Rows& operator=(const Rows&) = delete;

    /// Collective; rank 0's line (without its end) counts and begins with `time`. The row is with the system when this returns.
    /// Throws IoFailed on all ranks.
    void append(double time, const std::string& line);
    /// Collective. The rows are on the disk when this returns: to be called before a checkpoint is written.
    void sync();
    /// Time of the last row in the file, if there is one: a restart must not write it again.
    std::optional<double> last_time() const { return last_time_; }

private:
    const Team& team_;
    Place file_;
    std::optional<double> last_time_;
    Descriptor fd_; // rank 0 only
};

} // namespace kuzure::io
