#pragma once
// What the readers of raster files share.
#include "io/ground/raster.hpp"

namespace kuzure::io::ground {

/// Cells of a grid that stands in a file with its first row in the north: columns and rows from, up to and without.
struct Part {
    int column = 0, row = 0, end_column = 0, end_row = 0;
    int columns() const { return end_column - column; }
    int rows() const { return end_row - row; }
    bool empty() const { return columns() <= 0 || rows() <= 0; }
};
/// The cells whose area meets the window. Throws BadInput where they are more than memory should hold.
Part part_of(const scene::Grid& whole, const std::optional<Window>&, const std::string& file);
/// A grid of these cells, all NaN.
scene::Grid crop(const scene::Grid& whole, const Part&);

/// A grid of one cell size whose south-west corner is at these coordinates: what is a multiple of half a cell, but for the digits of a
/// file, becomes one, so that the same grid in another format has the same bits. Throws BadInput where cells or their number make no sense.
scene::Grid grid_at(double low_x, double low_y, double cell, std::int64_t columns, std::int64_t rows, const std::string& file);
/// The size of cells: 0.2 seconds of arc in degrees, whatever digits a file gave.
double rounded_cell(double cell, bool geographic);

/// To the precision of float, as elevation models have it.
inline double single(double x) { return double(float(x)); }

RasterInfo tiff_info(const Path&);
Raster read_tiff(const Path&, const std::optional<Window>&);
RasterInfo ascii_info(const Path&);
Raster read_ascii(const Path&, const std::optional<Window>&);
RasterInfo jpgis_info(const Path&);
Raster read_jpgis(const Path&, const std::optional<Window>&);

/// The text of the .prj beside a file as WKT; empty where there is none. Throws BadInput.
std::string crs_beside(const Path& file);

} // namespace kuzure::io::ground
