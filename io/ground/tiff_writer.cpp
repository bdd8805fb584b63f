// Maps as GeoTIFF: single precision, the system as GeoKeys.
#include "io/ground/formats.hpp"
#if KUZURE_TERRAIN
#include "io/ground/crs.hpp"
#include "io/ground/tiff_library.hpp"
#include <algorithm>
#include <cmath>
#include <cstring>
#endif

namespace kuzure::io {

#if KUZURE_TERRAIN
namespace ground {
namespace {

/// A TIFF in memory.
struct Memory {
    std::string bytes;
    std::size_t at = 0;
};
Memory& memory(thandle_t h) { return *static_cast<Memory*>(h); }

Tiff open_memory(Memory& m)
{
    set_up_libtiff();
    return Tiff(XTIFFClientOpen(
        "map", "wl", &m, // little endian everywhere
        [](thandle_t h, void* to, tmsize_t n) {
            auto& f = memory(h);
            const std::size_t got = f.at < f.bytes.size() ? std::min(std::size_t(n), f.bytes.size() - f.at) : 0;
            std::memcpy(to, f.bytes.data() + f.at, got);
            f.at += got;
            return tmsize_t(got);
        },
        [](thandle_t h, void* from, tmsize_t n) {
            auto& f = memory(h);
            if (f.bytes.size() < f.at + std::size_t(n)) f.bytes.resize(f.at + std::size_t(n), '\0');
            std::memcpy(f.bytes.data() + f.at, from, std::size_t(n));
            f.at += std::size_t(n);
            return n;
        },
        [](thandle_t h, toff_t to, int whence) {
            auto& f = memory(h);
            f.at = std::size_t(to) + (whence == SEEK_CUR ? f.at : whence == SEEK_END ? f.bytes.size() : 0);
            return toff_t(f.at);
        },
        [](thandle_t) { return 0; }, [](thandle_t h) { return toff_t(memory(h).bytes.size()); },
        [](thandle_t, void**, toff_t*) { return 0; }, [](thandle_t, void*, toff_t) {}));
}

/// GeoKeys by EPSG's number where the system has one, else as ESRI's WKT, which GDAL and QGIS understand.
void write_keys(TIFF* tiff, const std::string& crs)
{
    const auto keys = geo_keys(tiff);
    ensure(keys != nullptr, "GeoKeys cannot be written");
    const bool geographic = is_geographic(crs);
    const int model = geographic ? ModelTypeGeographic : ModelTypeProjected, epsg = epsg_of(crs);
    GTIFKeySet(keys.get(), GTModelTypeGeoKey, TYPE_SHORT, 1, model);
    GTIFKeySet(keys.get(), GTRasterTypeGeoKey, TYPE_SHORT, 1, RasterPixelIsArea);
    const auto which = geographic ? GeographicTypeGeoKey : ProjectedCSTypeGeoKey;
    if (epsg >= first_epsg && epsg <= last_epsg) {
        GTIFKeySet(keys.get(), which, TYPE_SHORT, 1, epsg);
    } else {
        GTIFKeySet(keys.get(), which, TYPE_SHORT, 1, KvUserDefined);
        const auto text = "ESRI PE String = " + esri_wkt(crs);
        GTIFKeySet(keys.get(), geographic ? GeogCitationGeoKey : PCSCitationGeoKey, TYPE_ASCII, int(text.size()) + 1, text.c_str());
    }
    if (!geographic) GTIFKeySet(keys.get(), ProjLinearUnitsGeoKey, TYPE_SHORT, 1, Linear_Meter);
    GTIFWriteKeys(keys.get());
}

} // namespace
} // namespace ground

std::string geotiff_bytes(const Raster& r)
{
    using namespace ground;
    const scene::Grid& g = r.grid;
    ensure(g.columns > 0 && g.rows > 0 && g.values.size() == std::size_t(g.columns) * std::size_t(g.rows),
           "a raster to write has no cells");
    Memory file;
    {
        const Tiff t = open_memory(file);
        ensure(t != nullptr, "a TIFF cannot be made in memory");
        TIFF* tiff = t.get();
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, std::uint32_t(g.columns));
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, std::uint32_t(g.rows));
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 32);
        TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, std::uint32_t(std::clamp(65536 / (4 * g.columns), 1, g.rows)));
        const double scale[3] = {g.cell, g.cell, 0};
        const double tie[6] = {0, 0, 0, g.x - 0.5 * g.cell, g.y + (g.rows - 0.5) * g.cell, 0};
        TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale);
        TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, tie);
        TIFFSetField(tiff, gdal_nodata, "-9999");
        if (!r.crs.empty()) write_keys(tiff, r.crs);
        std::vector<float> line(std::size_t(g.columns));
        for (int row = g.rows - 1; row >= 0; --row) {
            for (int column = 0; column < g.columns; ++column) {
                const double x = g.at(column, row);
                line[std::size_t(column)] = std::isnan(x) ? -9999.f : float(x);
            }
            ensure(TIFFWriteScanline(tiff, line.data(), std::uint32_t(g.rows - 1 - row), 0) >= 0, "a TIFF's row cannot be written");
        }
    }
    return std::move(file.bytes);
}

void write_geotiff(const Place& place, const Raster& raster) { write_atomically(place, geotiff_bytes(raster)); }

#else

std::string geotiff_bytes(const Raster&) { throw Broken("maps are written by a program that was built without them"); }
void write_geotiff(const Place&, const Raster&) { throw Broken("maps are written by a program that was built without them"); }

#endif

} // namespace kuzure::io
