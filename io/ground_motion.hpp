#pragma once
// Records of ground motion: a .csv of accelerations over time.
#include "io/file.hpp"
#include <array>
#include <vector>

namespace kuzure::io {

/// Rows of time (s, from 0 on, rising) and acceleration x, y, z (m/s^2); the file's first line names the columns time, x, y, z, of which
/// those that are left out are zero. Throws BadInput with file and line.
std::vector<std::array<double, 4>> read_ground_motion(const Path&);

} // namespace kuzure::io
