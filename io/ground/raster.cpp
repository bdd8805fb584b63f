#include "io/ground/raster.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/formats.hpp"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace kuzure::io {

Window extent_of(const scene::Grid& g)
{
    const double x = g.x - 0.5 * g.cell, y = g.y - 0.5 * g.cell;
    return {x, y, x + g.columns * g.cell, y + g.rows * g.cell};
}
Window RasterInfo::extent() const { return extent_of(grid); }

namespace ground {

Part part_of(const scene::Grid& g, const std::optional<Window>& window, const std::string& file)
{
    Part p{0, 0, g.columns, g.rows};
    if (window) {
        const Window all = extent_of(g);
        const auto cells = [&](double way, int most) { return std::clamp(way / g.cell, 0.0, double(most)); };
        const double slack = 1e-6;
        p.column = int(std::floor(cells(window->low_x - all.low_x, g.columns) + slack));
        p.end_column = int(std::ceil(cells(window->high_x - all.low_x, g.columns) - slack));
        p.row = g.rows - int(std::ceil(cells(window->high_y - all.low_y, g.rows) - slack));
        p.end_row = g.rows - int(std::floor(cells(window->low_y - all.low_y, g.rows) + slack));
    }
    const double most = 4e8;
    if (!p.empty() && double(p.columns()) * p.rows() > most)
        throw BadInput(fmt::format("{}: {} x {} cells are more than kuzure takes at once ({:.0e}). Remedy: a window around what can be "
                                   "reached (terrain.window), or larger cells: gdalwarp -tr 2 2 -r average in.tif out.tif",
                                   file, p.columns(), p.rows(), most));
    return p;
}

scene::Grid crop(const scene::Grid& whole, const Part& p)
{
    if (p.empty()) return {whole.x, whole.y, whole.cell, 0, 0, {}};
    scene::Grid g{whole.x + p.column * whole.cell, whole.y + (whole.rows - p.end_row) * whole.cell, whole.cell, p.columns(), p.rows(), {}};
    g.values.assign(std::size_t(g.columns) * std::size_t(g.rows), std::numeric_limits<double>::quiet_NaN());
    return g;
}

double rounded_cell(double cell, bool geographic)
{
    // Thousandths of a second of arc, millimetres: where the digits of the file allow it.
    const double unit = geographic ? 1.0 / 3.6e6 : 1e-3;
    const double n = std::round(cell / unit);
    if (n >= 1 && std::abs(cell / unit - n) < 1e-4 * std::max(1.0, 1e-2 * n)) return geographic ? n / 3.6e6 : n / 1e3;
    return cell;
}

scene::Grid grid_at(double low_x, double low_y, double cell, std::int64_t columns, std::int64_t rows, const std::string& file)
{
    if (!std::isfinite(low_x) || !std::isfinite(low_y) || std::abs(low_x) > 1e9 || std::abs(low_y) > 1e9 || !(cell > 0) || cell > 1e6)
        throw BadInput(fmt::format("{}: expected the place and the size of its cells, found a corner at ({}, {}) and cells of {}. Remedy: "
                                   "make the file again from its source",
                                   file, low_x, low_y, cell));
    if (columns < 1 || rows < 1 || columns > 2000000000 || rows > 2000000000)
        throw BadInput(fmt::format("{}: expected columns and rows of cells, found {} x {}", file, columns, rows));
    const auto centre = [&](double low) {
        const double halves = 2 * low / cell, n = std::round(halves);
        if (std::abs(halves - n) < 2e-3) return (n + 1) * 0.5 * cell;
        return low + 0.5 * cell;
    };
    return {centre(low_x), centre(low_y), cell, int(columns), int(rows), {}};
}

std::string crs_beside(const Path& file)
{
    for (const char* ending : {".prj", ".PRJ"}) {
        Path prj = file;
        prj.replace_extension(ending);
        if (!exists(prj)) continue;
        auto text = read_text(prj, 1 << 20);
        if (text.find_first_not_of(" \t\r\n") == text.npos) return "";
        return crs_from(text, prj.string());
    }
    return "";
}

namespace {

enum class Format { Tiff, Ascii, Jpgis };

Format format_of(const Path& path)
{
    std::error_code none;
    if (std::filesystem::is_directory(path, none))
        throw BadInput(fmt::format("{}: expected a raster file, found a directory", path.string()));
    const Descriptor in = open_file(path, O_RDONLY | O_NONBLOCK);
    if (in < 0)
        throw BadInput(fmt::format("{}: cannot be opened: {}. Remedy: correct the path; it counts from the scene file's directory",
                                   path.string(), cause(path, errno)));
    std::string start(512, '\0');
    const auto n = ::read(in, start.data(), start.size());
    start.resize(std::size_t(std::max<ssize_t>(n, 0)));
    if (start.starts_with("II") || start.starts_with("MM")) return Format::Tiff;
    if (start.starts_with("PK\x03\x04") || start.find("<?xml") < 8) return Format::Jpgis;
    std::string lower;
    for (const char c : start) lower += char(std::tolower((unsigned char)(c)));
    const auto at = lower.find_first_not_of(" \t\r\n");
    for (const char* word : {"ncols", "nrows", "xll", "yll", "cellsize"})
        if (at != lower.npos && lower.compare(at, std::string(word).size(), word) == 0) return Format::Ascii;
    throw BadInput(fmt::format("{}: expected a GeoTIFF, an ESRI ASCII grid or GSI's JPGIS (.xml, .zip); it begins like none of them. "
                               "Remedy: gdal_translate -of GTiff in out.tif",
                               path.string()));
}

} // namespace
} // namespace ground

RasterInfo raster_info(const Path& path)
{
    need_terrain(path.string());
    switch (ground::format_of(path)) {
    case ground::Format::Tiff:
        return ground::tiff_info(path);
    case ground::Format::Ascii:
        return ground::ascii_info(path);
    case ground::Format::Jpgis:
        return ground::jpgis_info(path);
    }
    return {};
}

Raster read_raster(const Path& path, const std::optional<Window>& window)
{
    need_terrain(path.string());
    switch (ground::format_of(path)) {
    case ground::Format::Tiff:
        return ground::read_tiff(path, window);
    case ground::Format::Ascii:
        return ground::read_ascii(path, window);
    case ground::Format::Jpgis:
        return ground::read_jpgis(path, window);
    }
    return {};
}

} // namespace kuzure::io
