#pragma once
// What a raster of heights is like: numbers and a picture.
#include "io/canvas.hpp"
#include "io/ground/raster.hpp"
#include <vector>

namespace kuzure::io {

struct Relief {
    std::size_t cells = 0, missing = 0;                  // missing: without a height
    double lowest = 0, highest = 0, mean = 0;            // m
    bool whole_numbers = false;                          // all heights are whole metres
    static constexpr double slope_class = 5;             // deg
    std::array<std::size_t, 18> slopes{};                // cells by slope, 0-5, 5-10 ... 85-90 degrees
    double steepest = 0, steepest_x = 0, steepest_y = 0; // deg, and where on the map
    std::size_t with_slope() const;
};
/// Slopes by central differences where all four neighbours have heights. Cells are `dx` by `dy` metres: of a grid in degrees two lengths.
Relief relief(const scene::Grid&, double dx, double dy);
/// Metres of a cell along x and y, in the middle of a raster.
std::array<double, 2> metres_of_cell(const scene::Grid&, const std::string& crs);

/// PNG: light from the north-west, 45 degrees high; cells without a height are white. At most `most` pixels wide and high, one a cell or
/// one for several.
std::string hillshade(const scene::Grid&, double dx, double dy, int most = 1200);

} // namespace kuzure::io
