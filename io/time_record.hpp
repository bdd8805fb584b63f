#pragma once
// Vectors over time from a .csv: accelerations of the ground, ways of walls.
#include "io/file.hpp"
#include <array>
#include <vector>

namespace kuzure::io {

/// What a record is of, and its unit.
struct RecordOf {
    const char *what, *unit;
};
/// Rows of time (s, from 0 on, rising) and x, y, z; the file's first line names the columns time, x, y, z, of which those that are left out
/// are zero. Throws BadInput with file and line.
std::vector<std::array<double, 4>> read_time_record(const Path&, const RecordOf&);

} // namespace kuzure::io
