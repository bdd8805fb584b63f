// The maps of runs, read, and those that are made of them.
#include "io/ground/crs.hpp"
#include "io/ground/raster.hpp"
#include "io/ground/vectors.hpp"
#include "solver/app/hazard/answer.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/ring.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

scene::MapGrid grid_of(const scene::Grid& g) { return {g.x - 0.5 * g.cell, g.y - 0.5 * g.cell, g.cell, g.columns, g.rows}; }

/// The cells of several runs, whose grids differ by whole cells.
scene::MapGrid around(const std::vector<const Run*>& runs)
{
    scene::MapGrid all = runs.front()->maps->grid;
    double high_x = all.x, high_y = all.y;
    for (const auto* r : runs) {
        const auto& g = r->maps->grid;
        if (std::fabs(g.cell / all.cell - 1) > 1e-9)
            throw IoFailed(fmt::format("{}: its maps have cells of {} m, others of {} m: not of one ensemble", r->directory.string(),
                                       g.cell, all.cell));
        all.x = std::min(all.x, g.x), all.y = std::min(all.y, g.y);
        high_x = std::max(high_x, g.x + double(g.columns) * g.cell), high_y = std::max(high_y, g.y + double(g.rows) * g.cell);
    }
    all.columns = std::llround((high_x - all.x) / all.cell), all.rows = std::llround((high_y - all.y) / all.cell);
    return all;
}

/// What the runs say of one cell: of each a number, 0 where soil did not come.
struct Cell {
    std::vector<float> thickness, pressure, arrival; // arrival: of those that come
    std::size_t reached() const { return arrival.size(); }
};

/// Goes over the cells of runs that any of them reached, row by row from the south.
template <class Visit> void for_each_cell(const std::vector<const Run*>& runs, const scene::MapGrid& all, Visit visit)
{
    struct Part {
        const RunMaps* m;
        std::int64_t column, row; // of its first cell among all
    };
    std::vector<Part> parts;
    std::int64_t low_row = all.rows, high_row = 0, low_column = all.columns, high_column = 0;
    for (const auto* r : runs) {
        const auto& m = *r->maps;
        const Part p{&m, m.column + std::llround((m.grid.x - all.x) / all.cell), m.row + std::llround((m.grid.y - all.y) / all.cell)};
        if (m.columns == 0) continue;
        parts.push_back(p);
        low_row = std::min(low_row, p.row), high_row = std::max(high_row, p.row + m.rows);
        low_column = std::min(low_column, p.column), high_column = std::max(high_column, p.column + m.columns);
    }
    Cell cell;
    for (std::int64_t row = low_row; row < high_row; ++row)
        for (std::int64_t column = low_column; column < high_column; ++column) {
            cell.thickness.clear(), cell.pressure.clear(), cell.arrival.clear();
            bool soil = false;
            for (const auto& p : parts) {
                const std::int64_t i = column - p.column, j = row - p.row;
                const bool in = i >= 0 && j >= 0 && i < p.m->columns && j < p.m->rows;
                const auto k = std::size_t(j * p.m->columns + i);
                const float h = in ? p.m->thickness[k] : std::nanf(""), a = in ? p.m->arrival[k] : std::nanf("");
                cell.thickness.push_back(std::isnan(h) ? 0 : h);
                cell.pressure.push_back(in && !std::isnan(p.m->pressure[k]) ? p.m->pressure[k] : 0);
                if (!std::isnan(a)) cell.arrival.push_back(a);
                soil = soil || !std::isnan(h);
            }
            if (!soil) continue;
            cell.thickness.resize(runs.size()), cell.pressure.resize(runs.size()); // 0 of those that came nowhere
            std::sort(cell.thickness.begin(), cell.thickness.end()), std::sort(cell.pressure.begin(), cell.pressure.end()),
                std::sort(cell.arrival.begin(), cell.arrival.end());
            visit(row * all.columns + column, cell);
        }
}

double exceeding(const std::vector<float>& sorted, double limit)
{
    // A whole layer counts, whatever its last digits; as in the maps of a run.
    const auto first = std::lower_bound(sorted.begin(), sorted.end(), limit * (1 - 1e-6));
    return double(sorted.end() - first) / double(sorted.size());
}
std::array<double, 3> spread_of(const std::vector<float>& sorted)
{
    if (sorted.empty()) return {nan, nan, nan};
    const std::span<const float> s(sorted);
    return {quantile(s, 0.1), quantile(s, 0.5), quantile(s, 0.9)};
}

struct Layer {
    std::string name;
    io::MapKind kind;
    std::vector<double> values;
};

io::Raster raster_of(const scene::MapGrid& g, const std::string& crs, std::vector<double> values)
{
    return {{.x = g.x + 0.5 * g.cell,
             .y = g.y + 0.5 * g.cell,
             .cell = g.cell,
             .columns = int(g.columns),
             .rows = int(g.rows),
             .values = std::move(values)},
            crs};
}

/// The cells around what has a number: first column and row, and how many.
struct Extent {
    int column = 0, row = 0, columns = 0, rows = 0;
};
Extent extent_of(const scene::Grid& g)
{
    int low_i = g.columns, low_j = g.rows, high_i = -1, high_j = -1;
    g.for_each([&](int i, int j, std::size_t k) {
        if (std::isnan(g.values[k])) return;
        low_i = std::min(low_i, i), high_i = std::max(high_i, i), low_j = std::min(low_j, j), high_j = std::max(high_j, j);
    });
    if (high_i < 0) return {};
    return {low_i, low_j, high_i - low_i + 1, high_j - low_j + 1};
}
scene::Grid cropped(const scene::Grid& g, Extent e)
{
    scene::Grid out;
    if (e.columns == 0) return out;
    out.x = g.x_of(e.column), out.y = g.y_of(e.row), out.cell = g.cell, out.columns = e.columns, out.rows = e.rows;
    for (int j = e.row; j < e.row + e.rows; ++j)
        for (int i = e.column; i < e.column + e.columns; ++i) out.values.push_back(g.at(i, j));
    return out;
}
scene::Grid cropped(const scene::Grid& g) { return cropped(g, extent_of(g)); }

double area_of(const std::vector<scene::Area>& areas)
{
    double sum = 0;
    for (const auto& a : areas)
        for (const auto& ring : a) sum += scene::signed_area(ring);
    return sum;
}

/// Polygons as GeoJSON of RFC 7946: longitude and latitude, outer rings counterclockwise.
std::string geojson(const std::vector<scene::Area>& areas, const std::string& crs, double probability)
{
    const io::Transform to_globe(crs, "EPSG:4326", "outlines");
    using Json = nlohmann::ordered_json;
    Json polygons = Json::array();
    for (const auto& area : areas) {
        Json rings = Json::array();
        for (const auto& ring : area) {
            Json corners = Json::array();
            const auto add = [&](const auto& p) {
                const auto at = to_globe(p[0], p[1]);
                corners.push_back({std::round(at[0] * 1e7) / 1e7, std::round(at[1] * 1e7) / 1e7});
            };
            for (const auto& p : ring) add(p);
            add(ring.front());
            rings.push_back(std::move(corners));
        }
        polygons.push_back(std::move(rings));
    }
    const Json feature{{"type", "Feature"},
                       {"properties", {{"probability", probability}}},
                       {"geometry", {{"type", "MultiPolygon"}, {"coordinates", std::move(polygons)}}}};
    return Json{{"type", "FeatureCollection"}, {"features", Json::array({feature})}}.dump() + "\n";
}

std::string number_text(double x) { return std::isnan(x) ? std::string() : fmt::format("{:.7g}", x); }

} // namespace

RunMaps read_maps(const io::Path& run, const Base& base, double wet, double spacing)
{
    const auto read = [&](const char* name) { return io::read_raster(run / "maps" / name).grid; };
    const auto h = read("h_max.tif"), p = read("p_max.tif"), a = read("t_arrival.tif"), end = read("h_end.tif");
    if (grid_of(h) != grid_of(a) || grid_of(h) != grid_of(p) || grid_of(h) != grid_of(end))
        throw IoFailed(
            fmt::format("{}: its maps do not lie on one grid. Remedy: remove this directory and run the hazard again", run.string()));
    RunMaps m;
    m.grid = grid_of(h);
    for (const double v : end.values)
        if (!std::isnan(v)) m.volume += v * h.cell * h.cell;
    const Extent e = extent_of(h);
    m.column = e.column, m.row = e.row, m.columns = e.columns, m.rows = e.rows;
    const auto kept = [&](const scene::Grid& g) {
        const auto values = cropped(g, e).values;
        return std::vector<float>(values.begin(), values.end());
    };
    m.thickness = kept(h), m.pressure = kept(p), m.arrival = kept(a);
    const scene::Grid thickness = cropped(h, e); // where it counts as reached, for the outline
    if (e.columns == 0) return m;
    const double x = base.scene.map_frame.x + base.centre.x, y = base.scene.map_frame.y + base.centre.y;
    const auto reach_of = [&](double limit) {
        double reach = 0;
        for (const auto& area : scene::areas_above(thickness, limit * (1 - 1e-6)))
            for (const auto& ring : area)
                for (const auto& c : ring) reach = std::max(reach, std::hypot(c[0] - x, c[1] - y));
        return reach;
    };
    m.reach = reach_of(wet);
    // A thickness is a count of particles, and flow that is a layer or two of them deep is hardly resolved. By the slope of the front: half
    // a layer either way, twice.
    m.front = 2 * std::max(m.reach - reach_of(wet + 0.5 * spacing), reach_of(std::max(wet - 0.5 * spacing, 0.1 * wet)) - m.reach);
    return m;
}

namespace {

/// The layers of the maps, and where each kind of them begins.
struct Layers {
    std::vector<Layer> all;
    std::size_t reach, arrival, thickness, deep, pressed;
};
Layers layers_for(const Base& base, std::size_t count, const std::vector<double>& limits)
{
    Layers out{};
    const auto add = [&](std::string name, const char* unit, const char* title) {
        out.all.push_back({std::move(name), {"", unit, title}, std::vector<double>(count, nan)});
        return out.all.size() - 1;
    };
    out.reach = add("p_reach", "1", "probability of reach");
    out.arrival = add("arrival_10", "s", "arrival, 10 % of the runs that come are earlier");
    add("arrival_median", "s", "arrival, median of the runs that come");
    add("arrival_90", "s", "arrival, 90 % of the runs that come are earlier");
    out.thickness = add("h_10", "m", "greatest thickness, 10 %");
    add("h_median", "m", "greatest thickness, median"), add("h_90", "m", "greatest thickness, 90 %");
    out.deep = out.all.size();
    for (const double limit : limits) add(fmt::format("p_h_{:g}", limit), "1", "probability of a thickness");
    out.pressed = out.all.size();
    for (const double limit : base.uncertain.pressures) add(fmt::format("p_p_{:g}", limit), "1", "probability of a pressure");
    return out;
}

/// Layers and points, cell by cell.
void sum_up(const Base& base, const scene::MapGrid& grid, const std::vector<double>& limits, Layers& to, Answer& answer)
{
    const auto& runs = answer.counted;
    auto& layers = to.all;
    std::vector<std::pair<std::int64_t, std::size_t>> wanted; // cell and point
    for (std::size_t k = 0; k < answer.points.size(); ++k) wanted.emplace_back(grid.at(answer.points[k].at.x, answer.points[k].at.y), k);
    std::sort(wanted.begin(), wanted.end());
    for_each_cell(runs, grid, [&](std::int64_t cell, const Cell& c) {
        const auto k = std::size_t(cell);
        const double p = double(c.reached()) / double(runs.size());
        const auto when = spread_of(c.arrival), how = spread_of(c.thickness);
        if (c.reached() > 0) {
            layers[to.reach].values[k] = p;
            for (std::size_t q = 0; q < 3; ++q) layers[to.arrival + q].values[k] = when[q], layers[to.thickness + q].values[k] = how[q];
            for (std::size_t l = 0; l < limits.size(); ++l) layers[to.deep + l].values[k] = exceeding(c.thickness, limits[l]);
            for (std::size_t l = 0; l < base.uncertain.pressures.size(); ++l)
                layers[to.pressed + l].values[k] = exceeding(c.pressure, base.uncertain.pressures[l]);
        }
        for (auto at = std::lower_bound(wanted.begin(), wanted.end(), std::pair{cell, std::size_t(0)});
             at != wanted.end() && at->first == cell; ++at) {
            auto& r = answer.points[at->second];
            r.probability = p, r.arrival = when, r.thickness = how, r.pressure = c.pressure.back();
        }
    });
}

/// How far the greatest thickness differs between the two finest runs of the likely values.
void compare_resolutions(const scene::MapGrid& grid, Layers& to, Discretisation& d)
{
    Layer l{"h_resolution", {"", "m", "greatest thickness, between two resolutions"}, std::vector<double>(std::size_t(grid.count()), nan)};
    double squares = 0;
    std::size_t cells = 0;
    for_each_cell(d.finest_two, grid, [&](std::int64_t cell, const Cell& c) {
        const double difference = double(c.thickness[1]) - double(c.thickness[0]);
        l.values[std::size_t(cell)] = difference, squares += difference * difference, ++cells;
    });
    d.thickness = cells > 0 ? std::sqrt(squares / double(cells)) : 0;
    to.all.push_back(std::move(l));
}

void write_layers(const Layers& from, const scene::MapGrid& grid, const std::string& crs, const io::Place& folder)
{
    const auto& layers = from.all;
    // Limits may have changed since an answer before.
    for (const auto& name : io::names_in(folder))
        if ((name.starts_with("p_h_") || name.starts_with("p_p_") || name.starts_with("h_resolution")) &&
            std::ranges::none_of(layers,
                                 [&](const Layer& l) { return name.starts_with(l.name + ".tif") || name.starts_with(l.name + ".qml"); }))
            io::remove_file(folder / name);
    for (const auto& l : layers) {
        double high = 0;
        for (const double v : l.values) high = std::isnan(v) ? high : std::max(high, v);
        if (std::string_view(l.kind.unit) == "1") high = 1;
        io::write_lightly(folder / (l.name + ".tif"), io::geotiff_bytes(raster_of(grid, crs, l.values)));
        io::write_lightly(folder / (l.name + ".qml"), io::qml_style(l.kind, 0, high > 0 ? high : 1));
    }
}

using Outlines = std::vector<io::MapPicture::Outline>;

/// Where 5, 50 and 95 % of the runs come: written, and their areas told.
Outlines write_outlines(const io::Raster& probability, const std::string& crs, const io::Place& folder, Answer& answer)
{
    const auto near = cropped(probability.grid);
    Outlines outlines;
    for (const auto& [percent, area] : {std::pair{5, &answer.area_05}, std::pair{50, &answer.area_50}, std::pair{95, &answer.area_95}}) {
        outlines.push_back({percent / 100.0, scene::areas_above(near, percent / 100.0), fmt::format("{} %", percent)});
        *area = area_of(outlines.back().areas);
        io::MapLayer layer{.kind = io::MapLayer::Polygons, .columns = {"percent", "area_m2"}, .features = {}, .crs = crs};
        for (const auto& a : outlines.back().areas) layer.features.push_back({a, {double(percent), area_of({a})}});
        const auto name = fmt::format("outline_p{:02}", percent);
        io::write_shapefile(folder / (name + ".shp"), layer);
        if (!crs.empty()) io::write_lightly(folder / (name + ".geojson"), geojson(outlines.back().areas, crs, percent / 100.0));
    }
    return outlines;
}

void draw_maps(const Base& base, const Layers& from, const scene::MapGrid& grid, const Outlines& outlines,
               const std::vector<io::NamedPoint>& points, const io::Place& folder)
{
    const auto& crs = base.scene.map_frame.crs;
    const scene::HeightField* ground = scene::ground_of(base.scene);
    for (const auto which : {from.reach, from.arrival + 1, from.thickness + 2}) {
        const auto& l = from.all[which];
        io::MapPicture picture{.kind = l.kind,
                               .title = base.scene.title,
                               .values = cropped(raster_of(grid, crs, l.values).grid),
                               .outlines = outlines,
                               .points = points};
        if (ground)
            picture.ground = [&, ground](double x, double y) {
                return ground->at(x - base.scene.map_frame.x, y - base.scene.map_frame.y).z;
            };
        io::write_lightly(folder / (l.name + ".png"), io::map_png(picture));
    }
}

void write_points(const Answer& answer, const io::Path& directory)
{
    std::string text = "name,x,y,p_reach,arrival_10,arrival_median,arrival_90,h_10,h_median,h_90,p_max\n# ,m,m,1,s,s,s,m,m,m,kPa\n";
    for (const auto& r : answer.points)
        text += fmt::format("{},{:.10g},{:.10g},{},{},{},{},{},{},{},{}\n", io::csv_cell(r.at.name), r.at.x, r.at.y,
                            number_text(r.probability), number_text(r.arrival[0]), number_text(r.arrival[1]), number_text(r.arrival[2]),
                            number_text(r.thickness[0]), number_text(r.thickness[1]), number_text(r.thickness[2]), number_text(r.pressure));
    io::write_lightly(directory / "points.csv", text);
}

} // namespace

void write_maps(const Base& base, Answer& answer, const std::vector<io::NamedPoint>& points, const io::Path& directory)
{
    auto all = answer.counted;
    auto& resolution = answer.discretisation;
    all.insert(all.end(), resolution.finest_two.begin(), resolution.finest_two.end());
    const auto grid = around(all);
    const auto& crs = base.scene.map_frame.crs;
    const auto limits = maps_of_runs(base).limits;
    Layers layers = layers_for(base, std::size_t(grid.count()), limits);
    answer.points.clear();
    for (const auto& p : points) answer.points.push_back({p, 0, {nan, nan, nan}, {0, 0, 0}, 0});
    sum_up(base, grid, limits, layers, answer);
    if (resolution.finest_two.size() == 2) compare_resolutions(grid, layers, resolution);

    std::error_code failed;
    std::filesystem::create_directories(directory / "maps", failed);
    const io::Place folder = io::hold(directory / "maps");
    write_layers(layers, grid, crs, folder);
    const auto outlines = write_outlines(raster_of(grid, crs, layers.all[layers.reach].values), crs, folder, answer);
    if (io::can_draw()) draw_maps(base, layers, grid, outlines, points, folder);
    io::sync(folder);
    if (!answer.points.empty()) write_points(answer, directory);
}

} // namespace kuzure::hazard
