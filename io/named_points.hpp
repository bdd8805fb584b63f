#pragma once
// Places with names, from a table a user wrote: houses, gauges, a road's kilometres.
#include "io/file.hpp"
#include <string>
#include <vector>

namespace kuzure::io {

struct NamedPoint {
    std::string name;
    double x, y; // m, in the coordinates of the map
    int line;    // of the file
    bool operator==(const NamedPoint&) const = default;
};

/// A .csv (UTF-8; commas or semicolons; a first line with the columns name, x, y among others; lines that begin with # are passed over), at
/// most a million points. Throws BadInput with file, line, what was expected and the remedy.
std::vector<NamedPoint> read_named_points(const Path&);

/// A name as a cell of a .csv: quoted where it has to be.
std::string csv_cell(const std::string&);

} // namespace kuzure::io
