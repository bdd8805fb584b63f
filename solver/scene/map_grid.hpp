#pragma once
// The cells of the maps: squares over the plan of a scene.
#include "solver/scene/fill.hpp"

namespace kuzure::scene {

/// Square cells in plan, in the scene's own coordinates: columns to the east, rows to the north, cell 0 in the south-west.
struct MapGrid {
    double x = 0, y = 0; // m, the south-west corner
    double cell = 1;     // m
    std::int64_t columns = 0, rows = 0;

    std::int64_t count() const { return columns * rows; }
    double area() const { return cell * cell; } // m^2
    /// The cell that holds a point (its western and southern edges belong to it), or -1 beyond all.
    std::int64_t at(double px, double py) const
    {
        const double column = std::floor((px - x) / cell), row = std::floor((py - y) / cell);
        if (!(column >= 0 && column < double(columns) && row >= 0 && row < double(rows))) return -1;
        return std::int64_t(row) * columns + std::int64_t(column);
    }
    /// Coordinates (m) of a cell's middle.
    double middle_x(std::int64_t k) const { return x + (double(k % columns) + 0.5) * cell; }
    double middle_y(std::int64_t k) const { return y + (double(k / columns) + 0.5) * cell; }
    bool operator==(const MapGrid&) const = default;
};

/// More cells make no map.
inline constexpr double most_map_cells = 5e7;

/// The cells that cover everything in a scene that has maps, walls and soil; their corners are multiples of their side.
MapGrid map_grid(const Scene&, const Filling&);

} // namespace kuzure::scene
