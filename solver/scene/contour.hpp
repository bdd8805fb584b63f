#pragma once
// Outlines of what stands higher than a level on a grid.
#include "solver/scene/height_field.hpp"
#include "solver/scene/parts.hpp"

namespace kuzure::scene {

/// An area: its outer ring counterclockwise, then its holes clockwise.
using Area = std::vector<Ring>;

/// Where the grid's numbers, linear between its points, reach a level; no number, and all beyond the grid, counts as below. Rings do not
/// touch one another.
std::vector<Area> areas_above(const Grid&, double level);

} // namespace kuzure::scene
