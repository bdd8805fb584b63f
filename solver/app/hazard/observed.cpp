#include "solver/app/hazard/observed.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/ground.hpp"
#include "io/ground/vectors.hpp"
#include "solver/scene/map_grid.hpp"
#include "solver/scene/ring.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::hazard {
namespace {

constexpr int samples = 4; // of a cell's side

struct Box {
    double low_x = HUGE_VAL, low_y = HUGE_VAL, high_x = -HUGE_VAL, high_y = -HUGE_VAL;
    void hold(const std::vector<scene::Ring>& rings)
    {
        for (const auto& ring : rings)
            for (const auto& p : ring)
                low_x = std::min(low_x, p[0]), high_x = std::max(high_x, p[0]), low_y = std::min(low_y, p[1]),
                high_y = std::max(high_y, p[1]);
    }
};

/// Points of a lattice: whether an odd number of rings encloses them.
struct Lattice {
    double x, y, step; // of the first point
    std::size_t columns, rows;
    std::vector<char> inside(const std::vector<scene::Ring>& rings) const
    {
        std::vector<char> in(columns * rows, 0);
        // Each edge turns what lies to the east of it; then each row is summed up.
        const auto first_from = [](double u) { return u <= 0 ? std::size_t(0) : std::size_t(std::ceil(u)); };
        for (const auto& ring : rings)
            for (std::size_t k = 0; k < ring.size(); ++k) {
                const auto &a = ring[k], &b = ring[k + 1 < ring.size() ? k + 1 : 0];
                const double low = std::min(a[1], b[1]), high = std::max(a[1], b[1]);
                for (std::size_t j = first_from((low - y) / step); j < rows; ++j) {
                    const double at = y + double(j) * step;
                    if (at >= high) break;
                    if (at < low) continue;
                    const double crossing = a[0] + (at - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                    const std::size_t i = first_from((crossing - x) / step);
                    if (i < columns) in[j * columns + i] ^= 1;
                }
            }
        for (std::size_t j = 0; j < rows; ++j)
            for (std::size_t i = 1; i < columns; ++i) in[j * columns + i] ^= in[j * columns + i - 1];
        return in;
    }
};

/// Points of the cells that hold all of these; cells are counted from the map's own corner.
Lattice lattice_around(const Box& b, const Base& base, double cell)
{
    const auto& f = base.scene.map_frame;
    const double x = f.x + std::floor((b.low_x - f.x) / cell) * cell, y = f.y + std::floor((b.low_y - f.y) / cell) * cell,
                 step = cell / samples;
    return {x + 0.5 * step, y + 0.5 * step, step, std::size_t(std::ceil((b.high_x - x) / step)) + 1,
            std::size_t(std::ceil((b.high_y - y) / step)) + 1};
}

double reach_of(const std::vector<scene::Ring>& rings, const Base& base)
{
    const double x = base.scene.map_frame.x + base.centre.x, y = base.scene.map_frame.y + base.centre.y;
    double reach = 0;
    for (const auto& ring : rings)
        for (const auto& p : ring) reach = std::max(reach, std::hypot(p[0] - x, p[1] - y));
    return reach;
}

std::vector<scene::Ring> rings_of(const std::vector<scene::Area>& areas)
{
    std::vector<scene::Ring> all;
    for (const auto& a : areas) all.insert(all.end(), a.begin(), a.end());
    return all;
}

bool is_outline(const io::Path& file)
{
    std::string ending = file.extension().string();
    for (char& c : ending) c = char(std::tolower((unsigned char)(c)));
    return ending == ".shp" || ending == ".geojson" || ending == ".json";
}

/// Throws BadInput for an event beside the map; notes what is doubtful.
void locate(Observed& o, const Base& base, const scene::Filling& filling)
{
    const auto grid = scene::map_grid(base.scene, filling);
    const auto& f = base.scene.map_frame;
    const double x0 = grid.x + f.x, y0 = grid.y + f.y, x1 = x0 + double(grid.columns) * grid.cell, y1 = y0 + double(grid.rows) * grid.cell;
    Box box;
    box.hold(o.rings);
    const std::string where = fmt::format("it reaches from ({:.10g}, {:.10g}) to ({:.10g}, {:.10g}), the map from ({:.10g}, {:.10g}) to "
                                          "({:.10g}, {:.10g})",
                                          box.low_x, box.low_y, box.high_x, box.high_y, x0, y0, x1, y1);
    if (box.low_x >= x1 || box.high_x <= x0 || box.low_y >= y1 || box.high_y <= y0)
        throw BadInput(
            fmt::format("--observed: {}: expected an event on the scene's map, found one beside it: {}. Remedy: is it of another "
                        "place, or of another coordinate system than it says?",
                        o.file, where));
    const double hair = 1e-6 * grid.cell;
    if (box.low_x < x0 - hair || box.high_x > x1 + hair || box.low_y < y0 - hair || box.high_y > y1 + hair)
        o.doubts.push_back(
            fmt::format("{}: part of it lies beyond the scene's map and counts as missed by every run ({}). Remedy: a larger "
                        "terrain.window, or larger walls",
                        o.file, where));
    if (!o.deposit && !scene::encloses(o.rings, f.x + base.centre.x, f.y + base.centre.y))
        o.doubts.push_back(fmt::format("{}: the middle of the mass lies outside of it. It should hold all that was reached, with where the "
                                       "mass came from: else every run is charged for that",
                                       o.file));
}

} // namespace

Observed read_observed(const std::string& file, const Base& base, const scene::Filling& filling, double wet)
{
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
        throw BadInput(fmt::format("--observed: {}: expected a file, an outline (.shp, .geojson) or a raster of the deposit, found none. "
                                   "Remedy: correct the path",
                                   file));
    Observed o;
    o.file = file;
    std::string crs;
    if (is_outline(file)) {
        const auto read = io::read_outlines(file);
        crs = read.crs;
        for (const auto& f : read.features) o.rings.insert(o.rings.end(), f.rings.begin(), f.rings.end());
    } else {
        o.deposit = true;
        const auto read = io::read_raster(file);
        crs = read.crs;
        o.rings = rings_of(scene::areas_above(read.grid, wet * (1 - 1e-6)));
        if (o.rings.empty())
            throw BadInput(fmt::format("--observed: {}: expected a deposit, thickness in m, found nothing that is {:g} m thick. Remedy: "
                                       "another file, or --set maps.wet=0.1",
                                       file, wet));
    }
    const std::string& here = base.scene.map_frame.crs;
    if (!crs.empty() && here.empty())
        throw BadInput(
            fmt::format("--observed: {}: expected the scene's own coordinates, as it has no [terrain], found a coordinate system "
                        "({}). Remedy: a .shp without .prj, GeoJSON with \"crs\": null, or [terrain]",
                        file, io::crs_name(crs)));
    if (!crs.empty() && !io::same_crs(crs, here)) {
        const io::Transform to_map(crs, here, file);
        for (auto& ring : o.rings)
            for (auto& p : ring) {
                p = to_map(p[0], p[1]);
                if (!std::isfinite(p[0]) || !std::isfinite(p[1]))
                    throw BadInput(fmt::format("--observed: {}: it cannot be brought into {}. Remedy: save it in that system", file,
                                               io::crs_name(here)));
            }
    }
    o.area = io::area(o.rings), o.reach = reach_of(o.rings, base);
    for (const auto& ring : o.rings)
        for (std::size_t k = 0; k < ring.size(); ++k) {
            const auto& next = ring[k + 1 < ring.size() ? k + 1 : 0];
            o.perimeter += std::hypot(next[0] - ring[k][0], next[1] - ring[k][1]);
        }

    locate(o, base, filling);
    return o;
}

Comparison compare(const Observed& o, const io::Path& run, const Base& base, double cell, double wet)
{
    Comparison c;
    const auto soil = io::read_raster(run / "maps" / (o.deposit ? "h_end.tif" : "h_max.tif")).grid;
    c.drawn = scene::areas_above(soil, wet * (1 - 1e-6));
    const auto rings = rings_of(c.drawn);
    c.area = io::area(rings), c.reach = reach_of(rings, base), c.reach_error = c.reach - o.reach;
    Box box;
    box.hold(o.rings), box.hold(rings);
    const auto lattice = lattice_around(box, base, cell);
    const auto a = lattice.inside(o.rings), b = lattice.inside(rings);
    std::int64_t both = 0, either = 0;
    for (std::size_t k = 0; k < a.size(); ++k) both += a[k] && b[k], either += a[k] || b[k];
    c.overlap = either > 0 ? double(both) / double(either) : 0, c.misfit = 1 - c.overlap;
    if (o.deposit) {
        const auto seen = io::onto(o.file, soil, base.scene.map_frame.crs);
        double sum = 0;
        std::int64_t cells = 0;
        for (std::size_t k = 0; k < seen.size(); ++k) {
            const double mine = std::isnan(soil.values[k]) ? 0 : soil.values[k], theirs = std::isnan(seen[k]) ? 0 : std::max(0.0, seen[k]);
            if (std::max(mine, theirs) < wet * (1 - 1e-6)) continue;
            sum += (mine - theirs) * (mine - theirs), ++cells;
        }
        c.rms = cells > 0 ? std::sqrt(sum / double(cells)) : 0;
    }
    return c;
}

double misfit_of_cells(const Observed& o, double cell) { return 2 * 0.29 * std::sqrt(o.perimeter / cell) * cell * cell / o.area; }

} // namespace kuzure::hazard
