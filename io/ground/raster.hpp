#pragma once
// Rasters on the map: GeoTIFF and ESRI ASCII. Only what a window needs is read of a GeoTIFF.
#include "io/file.hpp"
#include "solver/scene/height_field.hpp"
#include <array>
#include <limits>
#include <optional>
#include <string>

namespace kuzure::io {

/// A part of the map, in the units of its coordinate system.
struct Window {
    double low_x = 0, low_y = 0, high_x = 0, high_y = 0;
    bool operator==(const Window&) const = default;
    bool meets(const Window& o) const { return low_x < o.high_x && o.low_x < high_x && low_y < o.high_y && o.low_y < high_y; }
};

struct Raster {
    scene::Grid grid; // x, y: map coordinates of the centre of the south-west cell; values to the precision of float
    std::string crs;  // WKT; empty: none
};

/// What a raster's file says of itself.
struct RasterInfo {
    std::string format; // "GeoTIFF", "ESRI ASCII", "GSI JPGIS"
    scene::Grid grid;   // without values
    std::string crs;    // WKT; empty: none
    std::optional<double> nodata;
    std::string numbers; // "float32"
    Window extent() const;
};
/// The area of a grid's cells, to their outer edges.
Window extent_of(const scene::Grid&);

/// Float32, DEFLATE, north up, cells are areas, -9999 for NaN, GeoKeys; the same bytes for the same raster. Throws IoFailed.
void write_geotiff(const Place&, const Raster&);
/// The bytes of such a file.
std::string geotiff_bytes(const Raster&);

/// By its content: GeoTIFF (float32, float64, integers; strips and tiles; any compression that libtiff has), ESRI ASCII (with a .prj beside
/// it), GSI JPGIS (.xml, or .zip of them). Throws BadInput with file, what was expected, remedy.
RasterInfo raster_info(const Path&);

/// The cells whose area meets the window, all where there is none; values of the nodata number, and "nan", are NaN. No cells (0 x 0) where
/// none does. Throws BadInput with file and cell.
Raster read_raster(const Path&, const std::optional<Window>& = {});

} // namespace kuzure::io
