// Elevation models as GeoTIFF.
#include "io/ground/formats.hpp"
#if KUZURE_TERRAIN
#include "io/ground/crs.hpp"
#include "io/ground/tiff_library.hpp"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#endif

namespace kuzure::io {

#if KUZURE_TERRAIN
namespace ground {
namespace {

std::string remedy() { return "Remedy: gdalwarp -t_srs EPSG:6670 -tr 2 2 -r bilinear in.tif out.tif, with your system and cell"; }

Tiff open(const Path& path)
{
    set_up_libtiff();
    last_words().clear();
    Tiff t(XTIFFOpen(path.c_str(), "rm")); // not mapped: a window of a huge file takes its own memory only
    if (!t)
        throw BadInput(fmt::format("{}: cannot be read as a TIFF: {}. Remedy: copy it again, or make it anew with gdal_translate",
                                   path.string(), last_words()));
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
    const auto keys = geo_keys(tiff);
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

/// The kind of its numbers; refuses what is no single number a cell, or cannot be decoded.
void read_format(TIFF* tiff, const std::string& file, Layout& l)
{
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
}

/// Where its cells lie: the corner of pixel (column, row) at (x, y), sizes along x and y.
struct Placing {
    double x = 0, y = 0, dx = 0, dy = 0, column = 0, row = 0;
};
Placing placing_of(TIFF* tiff, double cells, const std::string& file)
{
    Placing at;
    auto& [x, y, dx, dy, column, row] = at;
    std::uint16_t n = 0;
    double* v = nullptr;
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
    if (std::abs(dx - dy) * cells > 0.1 * dx)
        throw BadInput(fmt::format("{}: cells of {} x {} are not square. {}", file, dx, dy, remedy()));
    return at;
}

/// What GDAL wrote beside the numbers.
std::optional<double> nodata_of(TIFF* tiff, const std::string& file)
{
    std::optional<double> nodata;
    char* text = nullptr;
    if (TIFFGetField(tiff, gdal_nodata, &text) && text) {
        const std::string said(text);
        char* end = nullptr;
        const double value = std::strtod(said.c_str(), &end);
        if (end == said.c_str())
            throw BadInput(fmt::format("{}: its nodata value \"{}\" is no number. Remedy: gdal_translate -a_nodata -9999 in.tif out.tif",
                                       file, said.substr(0, 40)));
        nodata = value;
    }
    if (TIFFGetField(tiff, gdal_metadata, &text) && text) {
        const std::string said(text);
        if (said.find("role=\"scale\"") != said.npos || said.find("role=\"offset\"") != said.npos)
            throw BadInput(fmt::format("{}: its numbers are to be scaled or shifted to become heights. Remedy: gdal_translate -unscale -ot "
                                       "Float32 in.tif out.tif",
                                       file));
    }
    return nodata;
}

Layout layout(TIFF* tiff, const Path& path)
{
    const std::string file = path.string();
    Layout l;
    std::uint32_t columns = 0, rows = 0;
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &columns);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &rows);
    read_format(tiff, file, l);
    const auto [x, y, dx, dy, column, row] = placing_of(tiff, double(std::max(columns, rows)), file);
    l.info.crs = crs_of(tiff, file);
    unsigned short kind = RasterPixelIsArea;
    {
        const auto keys = geo_keys(tiff);
        if (keys) GTIFKeyGetSHORT(keys.get(), GTRasterTypeGeoKey, &kind, 0, 1);
    }
    const bool geographic = !l.info.crs.empty() && is_geographic(l.info.crs);
    const double cell = rounded_cell(dx, geographic);
    const double shift = kind == RasterPixelIsPoint ? 0.5 : 0;
    l.info.grid = grid_at(x - (column + shift) * cell, y + (row + shift) * cell - double(rows) * cell, cell, columns, rows, file);
    l.info.format = "GeoTIFF";
    l.info.numbers = fmt::format("{}{}", l.format == SAMPLEFORMAT_IEEEFP ? "float" : l.format == SAMPLEFORMAT_INT ? "int" : "uint", l.bits);
    l.info.nodata = nodata_of(tiff, file);
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

namespace {

/// Reads the cells of a part into a grid, by tiles or by rows.
class Cells {
public:
    Cells(TIFF* tiff, const Layout& l, const Part& part, const std::string& file, scene::Grid& to)
        : tiff_(tiff), layout_(l), part_(part), whole_(l.info.grid), file_(file), to_(to), bytes_(l.bits / 8u)
    {
    }
    void read() const { TIFFIsTiled(tiff_) ? read_tiles() : read_rows(); }

private:
    void put(int column, int row, const unsigned char* at) const
    {
        const double x = sample(layout_, at);
        const auto& nodata = layout_.info.nodata;
        if (std::isnan(x) || (nodata && (x == *nodata || (layout_.bits == 32 && x == single(*nodata))))) return;
        if (!std::isfinite(single(x)))
            throw BadInput(
                fmt::format("{}: row {} from the north, column {}: {} is no height. Remedy: gdal_translate -a_nodata {} in.tif out.tif",
                            file_, row + 1, column + 1, x, x));
        to_.at(column - part_.column, part_.end_row - 1 - row) = single(x);
    }
    BadInput broken(int row, int column) const
    {
        return BadInput(fmt::format("{}: row {} from the north, column {}: its data cannot be decoded: {}. Remedy: copy it again, or make "
                                    "it anew with gdal_translate",
                                    file_, row + 1, column + 1, last_words()));
    }

    static constexpr std::uint64_t most_bytes = std::uint64_t(1) << 30; // of a tile or a row, which is read as a whole

    void read_tiles() const
    {
        std::uint32_t wide = 0, high = 0;
        TIFFGetField(tiff_, TIFFTAG_TILEWIDTH, &wide);
        TIFFGetField(tiff_, TIFFTAG_TILELENGTH, &high);
        const auto size = TIFFTileSize64(tiff_);
        if (wide == 0 || high == 0 || size > most_bytes || size < std::uint64_t(wide) * high * bytes_)
            throw BadInput(fmt::format("{}: its tiles of {} x {} cells are no good. {}", file_, wide, high, remedy()));
        std::vector<unsigned char> tile(size);
        const int w = int(wide), h = int(high);
        for (int top = part_.row / h * h; top < part_.end_row; top += h)
            for (int left = part_.column / w * w; left < part_.end_column; left += w) {
                // A tile that was never written (sparse files) has no bytes: no data.
                const auto which = TIFFComputeTile(tiff_, std::uint32_t(left), std::uint32_t(top), 0, 0);
                if (TIFFGetStrileByteCount(tiff_, which) == 0) continue;
                if (TIFFReadTile(tiff_, tile.data(), std::uint32_t(left), std::uint32_t(top), 0, 0) < 0) throw broken(top, left);
                for (int row = std::max(top, part_.row); row < std::min(top + h, part_.end_row); ++row)
                    for (int column = std::max(left, part_.column); column < std::min(left + w, part_.end_column); ++column)
                        put(column, row, &tile[(std::size_t(row - top) * wide + std::size_t(column - left)) * bytes_]);
            }
    }

    void read_rows() const
    {
        const auto size = TIFFScanlineSize64(tiff_);
        if (size > most_bytes || size < std::uint64_t(whole_.columns) * bytes_ || size > std::uint64_t(whole_.columns) * bytes_ + 64)
            throw BadInput(fmt::format("{}: its rows of {} bytes for {} cells are no good. {}", file_, size, whole_.columns, remedy()));
        std::vector<unsigned char> line(size);
        // A compressed strip can only be read from its beginning.
        std::uint32_t strip_rows = 0;
        TIFFGetFieldDefaulted(tiff_, TIFFTAG_ROWSPERSTRIP, &strip_rows);
        const int high = int(std::clamp<std::uint32_t>(strip_rows, 1, std::uint32_t(whole_.rows)));
        for (int row = part_.row / high * high; row < part_.end_row; ++row) {
            const auto strip = TIFFComputeStrip(tiff_, std::uint32_t(row), 0);
            if (TIFFGetStrileByteCount(tiff_, strip) == 0) continue;
            if (TIFFReadScanline(tiff_, line.data(), std::uint32_t(row), 0) < 0) throw broken(row, part_.column);
            if (row < part_.row) continue;
            for (int column = part_.column; column < part_.end_column; ++column) put(column, row, &line[std::size_t(column) * bytes_]);
        }
    }

    TIFF* tiff_;
    const Layout& layout_;
    const Part& part_;
    const scene::Grid& whole_;
    const std::string& file_;
    scene::Grid& to_;
    std::size_t bytes_; // of a number
};

} // namespace

Raster read_tiff(const Path& path, const std::optional<Window>& window)
{
    const std::string file = path.string();
    const Tiff tiff = open(path);
    const Layout l = layout(tiff.get(), path);
    const Part part = part_of(l.info.grid, window, file);
    Raster r{crop(l.info.grid, part), l.info.crs};
    if (!part.empty()) Cells(tiff.get(), l, part, file, r.grid).read();
    return r;
}

} // namespace ground

#else

namespace ground {
RasterInfo tiff_info(const Path&) { return {}; }
Raster read_tiff(const Path&, const std::optional<Window>&) { return {}; }
} // namespace ground
#endif

} // namespace kuzure::io
