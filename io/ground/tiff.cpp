// GeoTIFF by libtiff and libgeotiff.
#include "io/ground/formats.hpp"
#if KUZURE_TERRAIN
#include "io/ground/crs.hpp"
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <fmt/format.h>
#include <geo_normalize.h>
#include <geotiffio.h>
#include <memory>
#include <mutex>
#include <tiffio.h>
#include <xtiffio.h>
#endif

namespace kuzure::io {

#if KUZURE_TERRAIN
namespace ground {
namespace {

constexpr std::uint32_t gdal_metadata = 42112, gdal_nodata = 42113;
constexpr int first_epsg = 1024, last_epsg = 32766;

thread_local std::string last_words; // of libtiff

void keep_words(const char*, const char* format, std::va_list arguments)
{
    char text[400];
    std::vsnprintf(text, sizeof text, format, arguments);
    last_words = text;
}

/// libtiff as kuzure uses it: its errors are kept for our messages, and it knows GDAL's tags.
void set_up_libtiff()
{
    static std::once_flag once;
    std::call_once(once, [] {
        TIFFSetErrorHandler(keep_words);
        TIFFSetWarningHandler(nullptr);
        XTIFFInitialize();
        static TIFFExtendProc parent;
        parent = TIFFSetTagExtender([](TIFF* tiff) {
            static const TIFFFieldInfo fields[] = {
                {gdal_metadata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALMetadata")},
                {gdal_nodata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALNoDataValue")}};
            TIFFMergeFieldInfo(tiff, fields, 2);
            if (parent) parent(tiff);
        });
    });
}

struct Close {
    void operator()(TIFF* t) const { XTIFFClose(t); }
};
struct Free {
    void operator()(GTIF* g) const { GTIFFree(g); }
};
using Tiff = std::unique_ptr<TIFF, Close>;
using GeoKeys = std::unique_ptr<GTIF, Free>;

std::string remedy() { return "Remedy: gdalwarp -t_srs EPSG:6670 -tr 2 2 -r bilinear in.tif out.tif, with your system and cell"; }

Tiff open(const Path& path)
{
    set_up_libtiff();
    last_words.clear();
    Tiff t(XTIFFOpen(path.c_str(), "rm")); // not mapped: a window of a huge file takes its own memory only
    if (!t)
        throw BadInput(fmt::format("{}: cannot be read as a TIFF: {}. Remedy: copy it again, or make it anew with gdal_translate",
                                   path.string(), last_words));
    return t;
}

std::string ascii_key(GTIF* keys, geokey_t key)
{
    int size = 0;
    tagtype_t type;
    const int n = GTIFKeyInfo(keys, key, &size, &type);
    if (n <= 0 || type != TYPE_ASCII || n > 100000) return "";
    std::string text(std::size_t(n) + 1, '\0');
    GTIFKeyGet(keys, key, text.data(), 0, n);
    text.resize(std::strlen(text.c_str()));
    return text;
}

/// The system that the GeoKeys name; empty where they name none.
std::string crs_of(TIFF* tiff, const std::string& file)
{
    const GeoKeys keys(GTIFNew(tiff));
    if (!keys) return "";
    const auto number = [&](geokey_t key) {
        unsigned short value = 0;
        return GTIFKeyGetSHORT(keys.get(), key, &value, 0, 1) == 1 ? int(value) : 0;
    };
    const int model = number(GTModelTypeGeoKey);
    const int projected = number(ProjectedCSTypeGeoKey), geographic = number(GeographicTypeGeoKey);
    if (model == 0 && projected == 0 && geographic == 0) return "";
    const auto by_number = [&](int n) { return crs_from(fmt::format("EPSG:{}", n), file); };
    if (projected >= first_epsg && projected <= last_epsg) return by_number(projected);
    for (const auto key : {PCSCitationGeoKey, GeogCitationGeoKey, GTCitationGeoKey}) {
        const auto text = ascii_key(keys.get(), geokey_t(key));
        const std::string start = "ESRI PE String = ";
        if (text.starts_with(start)) return crs_from(text.substr(start.size()), file);
    }
    if (projected == 0 && model != ModelTypeProjected && geographic >= first_epsg && geographic <= last_epsg) return by_number(geographic);
    // Described by its numbers.
    GTIFDefn definition;
    if (!GTIFGetDefn(keys.get(), &definition)) return "";
    const std::unique_ptr<char, void (*)(char*)> text(GTIFGetProj4Defn(&definition), [](char* p) { GTIFFreeMemory(p); });
    if (!text || !*text) return "";
    const std::string said = text.get();
    if (said.find("+proj=") == said.npos) return "";
    return crs_from(said, file);
}

struct Layout {
    RasterInfo info;
    std::uint16_t bits = 0, format = 0;
};

Layout layout(TIFF* tiff, const Path& path)
{
    const std::string file = path.string();
    Layout l;
    std::uint32_t columns = 0, rows = 0;
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &columns);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &rows);
    std::uint16_t bands = 1, orientation = ORIENTATION_TOPLEFT, compression = COMPRESSION_NONE;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &bands);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &l.bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &l.format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &orientation);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
    if (bands != 1)
        throw BadInput(
            fmt::format("{}: expected one number a cell, found {} bands, as a photograph has. Remedy: gdal_translate -b 1 in.tif "
                        "out.tif, if the first are the heights",
                        file, bands));
    if (!TIFFIsCODECConfigured(compression))
        throw BadInput(
            fmt::format("{}: its compression (number {}) is unknown here. Remedy: gdal_translate -co COMPRESS=DEFLATE in.tif out.tif", file,
                        compression));
    const bool whole = l.format == SAMPLEFORMAT_INT || l.format == SAMPLEFORMAT_UINT;
    if (!(l.format == SAMPLEFORMAT_IEEEFP && (l.bits == 32 || l.bits == 64)) && !(whole && (l.bits == 8 || l.bits == 16 || l.bits == 32)))
        throw BadInput(fmt::format("{}: expected float32, float64 or integers of 8, 16 or 32 bits, found format {} of {} bits. Remedy: "
                                   "gdal_translate -ot Float32 in.tif out.tif",
                                   file, l.format, l.bits));
    if (orientation != ORIENTATION_TOPLEFT)
        throw BadInput(fmt::format("{}: its rows do not run from north to south (orientation {}). {}", file, orientation, remedy()));

    // Where the cells are.
    std::uint16_t n = 0;
    double* v = nullptr;
    double x = 0, y = 0, dx = 0, dy = 0, column = 0, row = 0;
    if (TIFFGetField(tiff, TIFFTAG_GEOTRANSMATRIX, &n, &v) && n >= 8) {
        if (v[1] != 0 || v[4] != 0) throw BadInput(fmt::format("{}: its grid is turned against the map. {}", file, remedy()));
        dx = v[0], dy = -v[5], x = v[3], y = v[7];
    } else if (TIFFGetField(tiff, TIFFTAG_GEOPIXELSCALE, &n, &v) && n >= 2) {
        dx = v[0], dy = v[1];
        if (!TIFFGetField(tiff, TIFFTAG_GEOTIEPOINTS, &n, &v) || n < 6)
            throw BadInput(fmt::format("{}: it says how large its cells are, but not where they lie (no tie point). {}", file, remedy()));
        column = v[0], row = v[1], x = v[3], y = v[4];
    } else {
        throw BadInput(
            fmt::format("{}: it does not say where on the map it lies (no tie point and scale). Remedy: gdal_translate -a_srs EPSG:N "
                        "-a_ullr WEST NORTH EAST SOUTH in.tif out.tif",
                        file));
    }
    if (!(dx > 0) || !(dy > 0))
        throw BadInput(fmt::format("{}: its cells run west or south to north ({} x {}). {}", file, dx, dy, remedy()));
    if (std::abs(dx - dy) * double(std::max(columns, rows)) > 0.1 * dx)
        throw BadInput(fmt::format("{}: cells of {} x {} are not square. {}", file, dx, dy, remedy()));
    l.info.crs = crs_of(tiff, file);
    unsigned short kind = RasterPixelIsArea;
    {
        const GeoKeys keys(GTIFNew(tiff));
        if (keys) GTIFKeyGetSHORT(keys.get(), GTRasterTypeGeoKey, &kind, 0, 1);
    }
    const bool geographic = !l.info.crs.empty() && is_geographic(l.info.crs);
    const double cell = rounded_cell(dx, geographic);
    const double shift = kind == RasterPixelIsPoint ? 0.5 : 0;
    l.info.grid = placed(x - (column + shift) * cell, y + (row + shift) * cell - double(rows) * cell, cell, columns, rows, file);
    l.info.format = "GeoTIFF";
    l.info.numbers = fmt::format("{}{}", l.format == SAMPLEFORMAT_IEEEFP ? "float" : l.format == SAMPLEFORMAT_INT ? "int" : "uint", l.bits);

    char* text = nullptr;
    if (TIFFGetField(tiff, gdal_nodata, &text) && text) {
        const std::string said(text);
        char* end = nullptr;
        const double nodata = std::strtod(said.c_str(), &end);
        if (end == said.c_str())
            throw BadInput(fmt::format("{}: its nodata value \"{}\" is no number. Remedy: gdal_translate -a_nodata -9999 in.tif out.tif",
                                       file, said.substr(0, 40)));
        l.info.nodata = nodata;
    }
    if (TIFFGetField(tiff, gdal_metadata, &text) && text) {
        const std::string said(text);
        if (said.find("role=\"scale\"") != said.npos || said.find("role=\"offset\"") != said.npos)
            throw BadInput(fmt::format("{}: its numbers are to be scaled or shifted to become heights. Remedy: gdal_translate -unscale -ot "
                                       "Float32 in.tif out.tif",
                                       file));
    }
    return l;
}

/// One number of a decoded row.
double sample(const Layout& l, const unsigned char* at)
{
    const auto as = [&]<class T>(T x) {
        std::memcpy(&x, at, sizeof x);
        return double(x);
    };
    if (l.format == SAMPLEFORMAT_IEEEFP) return l.bits == 32 ? as(0.f) : as(0.0);
    if (l.format == SAMPLEFORMAT_INT) return l.bits == 8 ? as(std::int8_t(0)) : l.bits == 16 ? as(std::int16_t(0)) : as(std::int32_t(0));
    return l.bits == 8 ? as(std::uint8_t(0)) : l.bits == 16 ? as(std::uint16_t(0)) : as(std::uint32_t(0));
}

} // namespace

RasterInfo tiff_info(const Path& path)
{
    const Tiff tiff = open(path);
    return layout(tiff.get(), path).info;
}

Raster read_tiff(const Path& path, const std::optional<Window>& window)
{
    const std::string file = path.string();
    const Tiff tiff = open(path);
    const Layout l = layout(tiff.get(), path);
    const scene::Grid& whole = l.info.grid;
    const Part part = part_of(whole, window, file);
    Raster r{cut(whole, part), l.info.crs};
    if (part.empty()) return r;
    const std::size_t bytes = l.bits / 8u;
    const bool has_nodata = l.info.nodata.has_value();
    const double nodata = l.info.nodata.value_or(0), rounded_nodata = single(nodata);
    const auto put = [&](int column, int row, const unsigned char* at) {
        const double x = sample(l, at);
        if (std::isnan(x) || (has_nodata && (x == nodata || (l.bits == 32 && x == rounded_nodata)))) return;
        if (!std::isfinite(single(x)))
            throw BadInput(
                fmt::format("{}: row {} from the north, column {}: {} is no height. Remedy: gdal_translate -a_nodata {} in.tif out.tif",
                            file, row + 1, column + 1, x, x));
        r.grid.at(column - part.column, part.end_row - 1 - row) = single(x);
    };
    const auto broken = [&](int row, int column) {
        return BadInput(fmt::format("{}: row {} from the north, column {}: its data cannot be decoded: {}. Remedy: copy it again, or make "
                                    "it anew with gdal_translate",
                                    file, row + 1, column + 1, last_words));
    };
    if (TIFFIsTiled(tiff.get())) {
        std::uint32_t wide = 0, high = 0;
        TIFFGetField(tiff.get(), TIFFTAG_TILEWIDTH, &wide);
        TIFFGetField(tiff.get(), TIFFTAG_TILELENGTH, &high);
        const auto size = TIFFTileSize64(tiff.get());
        const std::uint64_t most = std::uint64_t(1) << 30;
        if (wide == 0 || high == 0 || size > most || size < std::uint64_t(wide) * high * bytes)
            throw BadInput(fmt::format("{}: its tiles of {} x {} cells are no good. {}", file, wide, high, remedy()));
        std::vector<unsigned char> tile(size);
        const int w = int(wide), h = int(high);
        for (int top = part.row / h * h; top < part.end_row; top += h)
            for (int left = part.column / w * w; left < part.end_column; left += w) {
                // A tile that was never written (sparse files) has no bytes: no data.
                const auto which = TIFFComputeTile(tiff.get(), std::uint32_t(left), std::uint32_t(top), 0, 0);
                if (TIFFGetStrileByteCount(tiff.get(), which) == 0) continue;
                if (TIFFReadTile(tiff.get(), tile.data(), std::uint32_t(left), std::uint32_t(top), 0, 0) < 0) throw broken(top, left);
                for (int row = std::max(top, part.row); row < std::min(top + h, part.end_row); ++row)
                    for (int column = std::max(left, part.column); column < std::min(left + w, part.end_column); ++column)
                        put(column, row, &tile[(std::size_t(row - top) * wide + std::size_t(column - left)) * bytes]);
            }
    } else {
        const auto size = TIFFScanlineSize64(tiff.get());
        if (size < std::uint64_t(whole.columns) * bytes || size > std::uint64_t(whole.columns) * bytes + 64)
            throw BadInput(fmt::format("{}: its rows of {} bytes do not hold {} cells. {}", file, size, whole.columns, remedy()));
        std::vector<unsigned char> line(size);
        // A compressed strip can only be read from its beginning.
        std::uint32_t strip_rows = 0;
        TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_ROWSPERSTRIP, &strip_rows);
        const int high = int(std::clamp<std::uint32_t>(strip_rows, 1, std::uint32_t(whole.rows)));
        for (int row = part.row / high * high; row < part.end_row; ++row) {
            const auto strip = TIFFComputeStrip(tiff.get(), std::uint32_t(row), 0);
            if (TIFFGetStrileByteCount(tiff.get(), strip) == 0) continue;
            if (TIFFReadScanline(tiff.get(), line.data(), std::uint32_t(row), 0) < 0) throw broken(row, part.column);
            if (row < part.row) continue;
            for (int column = part.column; column < part.end_column; ++column) put(column, row, &line[std::size_t(column) * bytes]);
        }
    }
    return r;
}

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
    const GeoKeys keys(GTIFNew(tiff));
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

namespace ground {
RasterInfo tiff_info(const Path&) { return {}; }
Raster read_tiff(const Path&, const std::optional<Window>&) { return {}; }
} // namespace ground
std::string geotiff_bytes(const Raster&) { throw Broken("maps are written by a program that was built without them"); }
void write_geotiff(const Place&, const Raster&) { throw Broken("maps are written by a program that was built without them"); }

#endif

} // namespace kuzure::io
