#pragma once
// libtiff and libgeotiff as kuzure uses them: errors are kept for our messages, GDAL's tags are known.
#include <cstdint>
#include <geo_normalize.h>
#include <geotiffio.h>
#include <memory>
#include <string>
#include <tiffio.h>
#include <xtiffio.h>

namespace kuzure::io::ground {

inline constexpr std::uint32_t gdal_metadata = 42112, gdal_nodata = 42113; // tags
inline constexpr int first_epsg = 1024, last_epsg = 32766;

/// What the library said last on this thread.
std::string& last_words();
/// Before any file is opened; again and again does no harm.
void set_up_libtiff();

struct Close {
    void operator()(TIFF* t) const { XTIFFClose(t); }
};
struct Free {
    void operator()(GTIF* g) const { GTIFFree(g); }
};
using Tiff = std::unique_ptr<TIFF, Close>;
using GeoKeys = std::unique_ptr<GTIF, Free>;
/// Those of a file that is open; null where it has none that can be read.
GeoKeys geo_keys(TIFF*);

} // namespace kuzure::io::ground
