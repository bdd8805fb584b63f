#pragma once
// Points with names, from a table a user wrote: houses, gauges, a road's kilometres.
#include "io/ground/vectors.hpp"

namespace kuzure::io {

/// Of a .shp or GeoJSON, or of a .csv (UTF-8; commas or semicolons; a first line with the columns name, x, y among others; lines that begin
/// with # are passed over), which says nothing of its coordinate system; at most a million points. Throws BadInput with file, line or
/// feature, what was expected and the remedy.
NamedPoints read_named_points(const Path&);

/// A name as a cell of a .csv: quoted where it has to be.
std::string csv_cell(const std::string&);

} // namespace kuzure::io
