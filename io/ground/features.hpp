#pragma once
// What the readers of vector files share.
#include "io/ground/vectors.hpp"
#include <fmt/format.h>

namespace kuzure::io::ground {

inline constexpr const char* mend = "Remedy: in QGIS, Vector geometry > Fix geometries, or draw it again";

std::string lower(std::string);
/// True for what can be coordinates in metres or degrees: the Earth is 4e7 m around, and areas stay numbers.
bool on_map(double x, double y);
/// Throws BadInput: the file, its feature (counted from 0 here), what is wrong with it.
[[noreturn]] void refuse(const Path&, std::size_t feature, const std::string& text);
/// A closed ring without its last corner.
scene::Ring checked_ring(scene::Ring, const Path&, std::size_t feature);
/// Metres from the text of an attribute; nothing where it is empty.
std::optional<double> thickness_of(const std::string& text, const Path&, std::size_t feature);

Outlines outlines_of_shapefile(const Path&);
NamedPoints points_of_shapefile(const Path&);
Outlines outlines_of_geojson(const Path&);
NamedPoints points_of_geojson(const Path&);

} // namespace kuzure::io::ground
