// Elevation models of many files and systems as one grid.
#include "io/ground/crs.hpp"
#include "io/ground/formats.hpp"
#include "io/ground/ground.hpp"
#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

/// The area that a window covers in another system.
Window moved(const Window& w, const Transform& way)
{
    const double far = std::numeric_limits<double>::infinity();
    Window to{far, far, -far, -far};
    const int n = 32;
    for (int k = 0; k <= n; ++k) {
        const double t = double(k) / n, x = w.low_x + t * (w.high_x - w.low_x), y = w.low_y + t * (w.high_y - w.low_y);
        for (const auto p : {way(x, w.low_y), way(x, w.high_y), way(w.low_x, y), way(w.high_x, y)}) {
            if (!std::isfinite(p[0]) || !std::isfinite(p[1])) continue;
            to = {std::min(to.low_x, p[0]), std::min(to.low_y, p[1]), std::max(to.high_x, p[0]), std::max(to.high_y, p[1])};
        }
    }
    return to;
}

Window wider(Window w, double by) { return {w.low_x - by, w.low_y - by, w.high_x + by, w.high_y + by}; }

bool coincide(const scene::Grid& a, const scene::Grid& b)
{
    if (std::abs(a.cell - b.cell) * std::max({a.columns, a.rows, b.columns, b.rows}) > 1e-3 * a.cell) return false;
    const double i = (b.x - a.x) / a.cell, j = (b.y - a.y) / a.cell;
    return std::abs(i - std::round(i)) < 2e-3 && std::abs(j - std::round(j)) < 2e-3;
}

/// Fills the holes of a grid from one that coincides with it.
void fill_from(scene::Grid& to, const scene::Grid& from)
{
    const auto di = std::llround((from.x - to.x) / to.cell), dj = std::llround((from.y - to.y) / to.cell);
    for (int j = 0; j < from.rows; ++j)
        for (int i = 0; i < from.columns; ++i) {
            const auto a = i + di, b = j + dj;
            if (a < 0 || b < 0 || a >= to.columns || b >= to.rows) continue;
            double& there = to.at(int(a), int(b));
            if (std::isnan(there)) there = from.at(i, j);
        }
}

/// A grid around two that coincide, without values.
scene::Grid around(const scene::Grid& a, const scene::Grid& b)
{
    scene::Grid g = a;
    const auto di = std::llround((b.x - a.x) / a.cell), dj = std::llround((b.y - a.y) / a.cell);
    const auto low_i = std::min(0ll, di), low_j = std::min(0ll, dj);
    const auto high_i = std::max<long long>(a.columns, di + b.columns), high_j = std::max<long long>(a.rows, dj + b.rows);
    g.x = a.x + double(low_i) * a.cell, g.y = a.y + double(low_j) * a.cell;
    g.columns = int(high_i - low_i), g.rows = int(high_j - low_j);
    g.values.assign(std::size_t(g.columns) * std::size_t(g.rows), std::numeric_limits<double>::quiet_NaN());
    return g;
}

/// Bilinear to single precision; on a point of the grid, but for round-off, its own number.
double resampled(const scene::Grid& g, double x, double y)
{
    double u = (x - g.x) / g.cell, v = (y - g.y) / g.cell;
    // On a point but for round-off: that point.
    if (std::abs(u - std::round(u)) < 1e-6) u = std::round(u);
    if (std::abs(v - std::round(v)) < 1e-6) v = std::round(v);
    if (!(u >= 0 && v >= 0 && u <= g.columns - 1 && v <= g.rows - 1)) return std::numeric_limits<double>::quiet_NaN();
    const int i = std::min(int(u), std::max(g.columns - 2, 0)), j = std::min(int(v), std::max(g.rows - 2, 0));
    const double a = u - i, b = v - j;
    double sum = 0;
    for (int q = 0; q < 2; ++q)
        for (int p = 0; p < 2; ++p) {
            const double w = (p ? a : 1 - a) * (q ? b : 1 - b);
            if (w != 0) sum += w * g.at(i + p, j + q);
        }
    return ground::single(sum);
}

/// Values at the points of a grid of the map.
void sample(const Raster& from, scene::Grid& to, const std::string& crs)
{
    if (from.grid.columns == 0) return;
    const bool same = from.crs == crs || same_crs(from.crs, crs);
    if (same && coincide(from.grid, to)) return fill_from(to, from.grid);
    std::optional<Transform> way;
    if (!same) way.emplace(from.crs, crs, "elevation model");
    const double cell = same ? from.grid.cell : [&] { // metres
        const double x = from.grid.x + 0.5 * from.grid.columns * from.grid.cell, y = from.grid.y + 0.5 * from.grid.rows * from.grid.cell;
        const auto a = (*way)(x, y), b = (*way)(x + from.grid.cell, y);
        return std::hypot(b[0] - a[0], b[1] - a[1]);
    }();
    const int n = std::max(1, int(std::floor(to.cell / cell + 1e-6)));
    const scene::Grid source = n > 1 ? scene::averaged(from.grid, n) : from.grid;
    for (int j = 0; j < to.rows; ++j)
        for (int i = 0; i < to.columns; ++i) {
            double& there = to.at(i, j);
            if (!std::isnan(there)) continue;
            const double x = to.x + i * to.cell, y = to.y + j * to.cell;
            const auto p = way ? way->back(x, y) : std::array<double, 2>{x, y};
            there = resampled(source, p[0], p[1]);
        }
}

void check_numbers(const RasterInfo& info, const std::string& crs, const Path& path)
{
    const Window w = info.extent();
    const auto shown = fmt::format("x {:.8g} to {:.8g}, y {:.8g} to {:.8g}", w.low_x, w.high_x, w.low_y, w.high_y);
    if (is_geographic(crs)) {
        if (w.low_x < -360.01 || w.high_x > 360.01 || w.low_y < -90.01 || w.high_y > 90.01)
            throw BadInput(
                fmt::format("{}: its system is {}, in degrees, but it lies at {}, which are metres. Remedy: give it its true system: "
                            "gdal_translate -a_srs EPSG:N in.tif out.tif",
                            path.string(), crs_name(crs), shown));
        return;
    }
    if (w.low_x >= -180.01 && w.high_x <= 180.01 && w.low_y >= -90.01 && w.high_y <= 90.01 && info.grid.cell < 0.02)
        throw BadInput(
            fmt::format("{}: its system is {}, in metres, but it lies at {} with cells of {:.4g}, which are degrees. Remedy: give it its "
                        "true system: gdal_translate -a_srs EPSG:4326 in.tif out.tif, and name the map's as terrain.crs",
                        path.string(), crs_name(crs), shown, info.grid.cell));
    const double unit = metres_per_unit(crs);
    if (unit != 1)
        throw BadInput(fmt::format(
            "{}: its system {} is not in metres ({:.6g} m a unit). Remedy: gdalwarp -t_srs EPSG:N -r bilinear in.tif out.tif with "
            "a system in metres, heights too",
            path.string(), crs_name(crs), unit));
}

} // namespace

std::string crs_for(const std::string& own, const std::string& map, const std::string& file)
{
    if (own.empty() && map.empty())
        throw BadInput(
            fmt::format("{}: it has no system of coordinates. Remedy: name the one it is in, as terrain.crs = \"EPSG:6670\", or write it "
                        "into the file: gdal_translate -a_srs EPSG:N in out.tif (a .prj beside .asc and .shp)",
                        file));
    if (own.empty() || map.empty()) return own.empty() ? map : own;
    if (same_crs(own, map)) return map;
    if (is_geographic(own)) return own;
    throw BadInput(fmt::format(
        "{}: it is in {}, the map in {}. Remedy: gdalwarp -t_srs EPSG:{} -r bilinear in.tif out.tif (ogr2ogr -t_srs for outlines), "
        "or another terrain.crs",
        file, crs_name(own), crs_name(map), epsg_of(map) ? std::to_string(epsg_of(map)) : "N"));
}

Mosaic::Mosaic(std::vector<Path> files, std::string crs) : files_(std::move(files)), crs_(std::move(crs))
{
    for (const auto& f : files_) infos_.push_back(raster_info(f));
    for (std::size_t k = 0; k < files_.size(); ++k) {
        auto& info = infos_[k];
        const auto file = files_[k].string();
        // A map is in metres: what the files say counts where it is so.
        if (crs_.empty() && !info.crs.empty() && !is_geographic(info.crs)) crs_ = info.crs;
        if (crs_.empty() && !info.crs.empty()) {
            check_numbers(info, info.crs, files_[k]);
            const Window w = info.extent();
            throw BadInput(fmt::format(
                "{}: it is in degrees ({}), and the map's system is not named. Remedy: terrain.crs = \"{}\" (the UTM zone here), or "
                "the national one in metres, as \"EPSG:6670\"",
                file, crs_name(info.crs), utm_zone(0.5 * (w.low_x + w.high_x), 0.5 * (w.low_y + w.high_y))));
        }
        if (info.crs.empty() && !crs_.empty()) check_numbers(info, crs_, files_[k]);
        info.crs = crs_for(info.crs, crs_, file);
        check_numbers(info, info.crs, files_[k]);
    }
    if (is_geographic(crs_))
        throw BadInput(fmt::format("expected a system in metres, found {}, in degrees. Remedy: the UTM zone or the national system there",
                                   crs_name(crs_)));
    if (metres_per_unit(crs_) != 1) throw BadInput(fmt::format("expected a system in metres, found {}", crs_name(crs_)));
    const double far = std::numeric_limits<double>::infinity();
    extent_ = {far, far, -far, -far};
    for (std::size_t k = 0; k < files_.size(); ++k) {
        const auto& info = infos_[k];
        Window w = info.extent();
        if (is_geographic(info.crs)) {
            const Transform way(info.crs, crs_, files_[k].string());
            const double x = 0.5 * (w.low_x + w.high_x), y = 0.5 * (w.low_y + w.high_y), d = info.grid.cell;
            const auto o = way(x, y), a = way(x + d, y), b = way(x, y + d);
            const double size = std::min(std::hypot(a[0] - o[0], a[1] - o[1]), std::hypot(b[0] - o[0], b[1] - o[1]));
            w = moved(w, way);
            if (!(size > 0) || !(w.high_x > w.low_x))
                throw BadInput(fmt::format("{}: it cannot be brought into {}. Remedy: a system that is meant for that place",
                                           files_[k].string(), crs_name(crs_)));
            const double ten = std::pow(10, std::floor(std::log10(size)));
            if (k == 0) cell_ = std::round(size / ten) * ten;
        } else if (k == 0) {
            cell_ = info.grid.cell;
        }
        extent_ = {std::min(extent_.low_x, w.low_x), std::min(extent_.low_y, w.low_y), std::max(extent_.high_x, w.high_x),
                   std::max(extent_.high_y, w.high_y)};
    }
}

scene::Grid Mosaic::read(const std::optional<Window>& window) const
{
    // The lattice of the first file; of a geographic one its cell's multiples.
    scene::Grid lattice{0.5 * cell_, 0.5 * cell_, cell_, 1, 1, {}};
    if (!is_geographic(infos_[0].crs)) lattice.x = infos_[0].grid.x, lattice.y = infos_[0].grid.y;
    Window w = window.value_or(extent_);
    w = {std::max(w.low_x, extent_.low_x), std::max(w.low_y, extent_.low_y), std::min(w.high_x, extent_.high_x),
         std::min(w.high_y, extent_.high_y)};
    if (!(w.low_x < w.high_x && w.low_y < w.high_y))
        throw BadInput(fmt::format(
            "the window x {:.8g} to {:.8g}, y {:.8g} to {:.8g} does not meet the elevation model (x {:.8g} to {:.8g}, y {:.8g} to {:.8g})",
            window->low_x, window->high_x, window->low_y, window->high_y, extent_.low_x, extent_.high_x, extent_.low_y, extent_.high_y));
    const auto first = [&](double low, double at) { return std::floor((low - at) / cell_ + 0.5 + 1e-6); };
    const auto last = [&](double high, double at) { return std::ceil((high - at) / cell_ + 0.5 - 1e-6) - 1; };
    const double i = first(w.low_x, lattice.x), j = first(w.low_y, lattice.y);
    scene::Grid g{lattice.x + i * cell_,
                  lattice.y + j * cell_,
                  cell_,
                  int(last(w.high_x, lattice.x) - i) + 1,
                  int(last(w.high_y, lattice.y) - j) + 1,
                  {}};
    ground::part_of(g, {}, files_[0].string()); // not more than memory holds
    g.values.assign(std::size_t(g.columns) * std::size_t(g.rows), std::numeric_limits<double>::quiet_NaN());

    // Neighbouring tiles of one grid are joined first, so that there is no seam between them where they are projected.
    std::optional<Raster> joined;
    for (std::size_t k = 0; k < files_.size(); ++k) {
        Window part = wider(extent_of(g), 2 * cell_);
        if (!same_crs(infos_[k].crs, crs_))
            part = wider(moved(part, Transform(crs_, infos_[k].crs, files_[k].string())), 2 * infos_[k].grid.cell);
        Raster r = read_raster(files_[k], part);
        r.crs = infos_[k].crs;
        if (r.grid.columns == 0) continue;
        if (joined && same_crs(joined->crs, r.crs) && coincide(joined->grid, r.grid)) {
            scene::Grid both = around(joined->grid, r.grid);
            fill_from(both, joined->grid), fill_from(both, r.grid);
            joined->grid = std::move(both);
        } else {
            if (joined) sample(*joined, g, crs_);
            joined = std::move(r);
        }
    }
    if (joined) sample(*joined, g, crs_);
    return g;
}

std::vector<double> onto(const Path& path, const scene::Grid& target, const std::string& crs)
{
    auto info = raster_info(path);
    const bool local = info.crs.empty() && crs.empty(); // neither lies on a map
    if (info.crs.empty() && !local) check_numbers(info, crs, path);
    if (!local) info.crs = crs_for(info.crs, crs, path.string()), check_numbers(info, info.crs, path);
    const bool same = local || same_crs(info.crs, crs);
    Window part = wider(extent_of(target), 2 * std::max(target.cell, same ? info.grid.cell : 0));
    if (!same) part = wider(moved(part, Transform(crs, info.crs, path.string())), 2 * info.grid.cell);
    Raster r = read_raster(path, part);
    r.crs = info.crs;
    scene::Grid g = target;
    g.values.assign(std::size_t(g.columns) * std::size_t(g.rows), std::numeric_limits<double>::quiet_NaN());
    sample(r, g, crs);
    return std::move(g.values);
}

std::string digest(const scene::Grid& g)
{
    std::uint64_t hash = 14695981039346656037ull; // FNV-1a
    const auto add = [&](double x) {
        const auto bits = std::bit_cast<std::uint64_t>(std::isnan(x) ? std::numeric_limits<double>::quiet_NaN() : x + 0.0);
        for (int k = 0; k < 8; ++k) hash = (hash ^ ((bits >> (8 * k)) & 0xFF)) * 1099511628211ull;
    };
    add(g.x), add(g.y), add(g.cell), add(g.columns), add(g.rows);
    for (const double x : g.values) add(x);
    return fmt::format("{:016x}", hash);
}

} // namespace kuzure::io
