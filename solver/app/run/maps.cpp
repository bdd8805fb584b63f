#include "solver/app/run/maps.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/raster.hpp"
#include "io/json.hpp"
#include "solver/app/run/fronts.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/ring.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure {

namespace {

constexpr const char* table_name = "maps";
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

bool reached(const MapCell& c) { return c.memory.arrival >= 0; }

/// A cell's value in each map, in the order of io::map_kinds; NaN where it has none.
std::array<double, io::map_kinds.size()> values_of(const MapCell& c, double gravity, double spacing)
{
    const auto& m = c.memory;
    const auto if_reached = [&](double x) { return reached(c) ? x : nan; };
    return {m.thickness,
            c.now.thickness,
            if_reached(m.speed),
            if_reached(m.flux),
            if_reached(m.pressure / 1000),
            c.now.active * c.now.density * gravity * c.now.thickness / 1000,
            if_reached(m.arrival),
            m.stop >= 0 ? m.stop : nan,
            c.now.thickness - m.start,
            c.now.thickness / spacing};
}

/// A number as a cell of a table; empty where there is none.
std::string cell_text(double x) { return std::isnan(x) ? std::string() : fmt::format("{:.7g}", x); }

/// Centre (m) of the soil at t = 0, the same on any ranks.
Vector centre_of(const Comm& comm, const Particles& p, const scene::Filling& filling)
{
    // Origins may lie elsewhere than the filling, where the run starts from the state of another: whole units of 2^-20 m about its box, in
    // two parts, so that any number of them is exact.
    const auto o = p[field::origin];
    const Vector low = filling.bounds().low;
    std::int64_t sums[7] = {p.size(), 0, 0, 0, 0, 0, 0};
    for (Index i = 0; i < p.size(); ++i) {
        const Vector a = o[i] - low;
        std::size_t k = 1;
        for (const double x : {a.x, a.y, a.z}) {
            const double whole = std::floor(x);
            sums[k++] += std::int64_t(whole), sums[k++] += std::lrint((x - whole) * 0x1p30);
        }
    }
    comm.sum(std::span<std::int64_t>(sums));
    const double n = double(std::max<std::int64_t>(1, sums[0]));
    const auto mean = [&](std::size_t k) { return (double(sums[k]) + double(sums[k + 1]) * 0x1p-30) / n; };
    return low + Vector{mean(1), mean(3), mean(5)};
}

/// Files that get their names together.
class Together {
public:
    explicit Together(io::Place folder) : folder_(std::move(folder)) {}
    void add(const std::string& name, const std::string& bytes)
    {
        io::write_lightly(folder_ / (name + ".new"), bytes);
        names_.push_back(name);
    }
    void publish()
    {
        for (const auto& name : names_) io::move_file(folder_ / (name + ".new"), folder_ / name);
        io::sync(folder_);
    }

private:
    io::Place folder_;
    std::vector<std::string> names_;
};

/// The cells in a box around all of them, in the coordinates of the scene.
scene::Grid smallest_grid(const std::vector<MapCell>& cells, const scene::MapGrid& grid, double elsewhere, double (*value)(const MapCell&))
{
    std::int64_t low[2] = {grid.columns, grid.rows}, high[2] = {-1, -1};
    for (const auto& c : cells) {
        const std::int64_t at[2] = {c.cell % grid.columns, c.cell / grid.columns};
        for (int k : {0, 1}) low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
    }
    scene::Grid g;
    if (cells.empty()) return g;
    g.x = grid.x + (double(low[0]) + 0.5) * grid.cell, g.y = grid.y + (double(low[1]) + 0.5) * grid.cell, g.cell = grid.cell;
    g.columns = int(high[0] - low[0] + 1), g.rows = int(high[1] - low[1] + 1);
    g.values.assign(std::size_t(g.columns) * std::size_t(g.rows), elsewhere);
    for (const auto& c : cells) g.at(int(c.cell % grid.columns - low[0]), int(c.cell / grid.columns - low[1])) = value(c);
    return g;
}

} // namespace

std::vector<io::NamedPoint> points_of_maps(const Comm& comm, const Scene& scene, const scene::Filling& filling,
                                           const std::function<void(const std::string&)>& warn)
{
    std::vector<io::NamedPoint> points;
    io::on_root(comm, [&] {
        io::need_terrain("maps");
        if (scene.maps->points.empty()) return;
        auto read = io::read_named_points(scene.maps->points);
        points = std::move(read.points);
        const std::string& here = scene.map_frame.crs;
        if (!read.crs.empty() && here.empty())
            throw BadInput(
                fmt::format("{}: expected points in the scene's own coordinates, as it has no [terrain], found a coordinate system "
                            "({}). Remedy: a .csv with name, x, y, or [terrain]",
                            scene.maps->points, io::crs_name(read.crs)));
        if (!read.crs.empty() && !io::same_crs(read.crs, here)) {
            const io::Transform to_map(read.crs, here, scene.maps->points);
            for (auto& p : points) {
                const auto xy = to_map(p.x, p.y);
                p.x = xy[0], p.y = xy[1];
            }
        }
        const auto grid = scene::map_grid(scene, filling);
        std::vector<const io::NamedPoint*> beyond;
        for (const auto& p : points)
            if (grid.at(p.x - scene.map_frame.x, p.y - scene.map_frame.y) < 0) beyond.push_back(&p);
        if (beyond.empty()) return;
        const double x = grid.x + scene.map_frame.x, y = grid.y + scene.map_frame.y;
        const std::string what =
            fmt::format("{}: \"{}\" at ({:.10g}, {:.10g}) is not on the maps, which reach from ({:.10g}, {:.10g}) to "
                        "({:.10g}, {:.10g}){}",
                        scene.maps->points, beyond[0]->name, beyond[0]->x, beyond[0]->y, x, y, x + double(grid.columns) * grid.cell,
                        y + double(grid.rows) * grid.cell, beyond.size() > 1 ? fmt::format(", and {} more", beyond.size() - 1) : "");
        if (beyond.size() == points.size())
            throw BadInput(what +
                           ": none of the points is. Expected coordinates of the scene's map in m, x to the east; are they of another "
                           "coordinate system, or exchanged?");
        warn(what + ": nothing can come there");
    });
    return points;
}

KeptMaps maps_of(const Comm& comm, const io::Checkpoint& from, const Scene& scene, const scene::Filling& filling)
{
    const auto refuse = [&](const std::string& found, const std::string& remedy) {
        throw BadInput(
            fmt::format("{}: expected a checkpoint with the [maps] of this scene, found {}: what happened before it cannot be told. "
                        "Remedy: {}",
                        from.file.string(), found, remedy));
    };
    const std::string again = "go on without [maps], or run from the start with --force";
    const auto rows = io::read_checkpoint_table(comm, from, table_name, int(MapRow{}.size()));
    const auto header = io::parse_json(from.header, false);
    if (!rows || !header.is_object() || !header.contains("maps")) refuse("one written without them", again);
    KeptMaps kept;
    scene::MapGrid was;
    double wet = 0;
    try {
        const auto& j = header.at("maps");
        j.at("way").get_to(kept.way), j.at("last").get_to(kept.last), j.at("wet").get_to(wet);
        j.at("x").get_to(was.x), j.at("y").get_to(was.y), j.at("cell").get_to(was.cell);
        j.at("columns").get_to(was.columns), j.at("rows").get_to(was.rows);
    } catch (const nlohmann::json::exception& e) {
        throw IoFailed(fmt::format("{}: what this checkpoint says of maps cannot be read ({})", from.file.string(), e.what()));
    }
    const auto is = scene::map_grid(scene, filling);
    if (!(was == is) || wet != scene.maps->wet)
        refuse(fmt::format("cells of {} m and wet = {} m, here {} m and {} m", was.cell, wet, is.cell, scene.maps->wet),
               fmt::format("maps.cell = {} and maps.wet = {}, {}", was.cell, wet, again));
    kept.rows.resize(rows->size() / MapRow{}.size());
    std::memcpy(kept.rows.data(), rows->data(), kept.rows.size() * sizeof(MapRow));
    return kept;
}

Maps::Maps(const Comm& comm, const Scene& scene, const io::ResultDirectory& directory, Simulation& sim, std::vector<io::NamedPoint> points,
           const std::optional<KeptMaps>& kept, std::optional<double> restart_time)
    : comm_(comm), scene_(scene), directory_(directory), points_(std::move(points)), record_(comm, scene, sim.filling()),
      centre_(centre_of(comm, sim.particles(), sim.filling())), gravity_(length(scene.effects.gravity.value_or(Vector{})))
{
    if (!kept) record_.begin(sim.particles());
    else if (!record_.set(kept->way, kept->last, kept->rows))
        throw IoFailed("the checkpoint's cells of maps are not of this scene's grid: use the version that wrote it");
    if (scene.time.retry) good_ = record_.state();
    io::on_root(comm_, [&] { io::make_directory(directory_ / "maps"); });
    open_front(restart_time);
}

void Maps::open_front(std::optional<double> restart_time)
{
    front_.emplace(comm_, directory_ / "front.csv", "time,x,y,distance,h_over_l", "# s,m,m,m,1", restart_time);
}

void Maps::after_step(Simulation& sim)
{
    sim.timers().timed(Phase::Maps, [&] { record_.after_step(sim.particles(), sim.time(), sim.dt(), sim.max_speed()); });
    if (good_ && sim.good_step() == sim.steps()) good_ = record_.state();
}

void Maps::take_back(double time)
{
    ensure(good_.has_value(), "a run without time.retry went back");
    record_.set(*good_);
    open_front(time);
}

void Maps::write(Simulation& sim, Pictures pictures)
{
    sim.timers().timed(Phase::Maps, [&] {
        double beyond = 0;
        const auto cells = record_.cells(sim.particles(), sim.time(), beyond);
        // What was taken out counts as it was at first: how dense it was when it left is not kept.
        beyond += double(taken_out(comm_, sim.particles(), sim.scene(), sim.filling())) * scene_.particle_volume();
        io::on_root(comm_, [&] { write_files(cells, sim.time(), beyond, pictures); });
    });
}

void Maps::write_front(Simulation& sim)
{
    if (front_->last_time() && sim.time() <= *front_->last_time()) return;
    sim.timers().timed(Phase::Maps, [&] {
        double beyond = 0;
        const auto cells = record_.cells(sim.particles(), sim.time(), beyond);
        const auto& grid = record_.grid();
        const MapCell* farthest = nullptr;
        double distance = -1;
        for (const auto& c : cells) {
            if (c.now.thickness < record_.wet() * (1 - 1e-6)) continue;
            const double d = std::hypot(grid.middle_x(c.cell) - centre_.x, grid.middle_y(c.cell) - centre_.y);
            if (d > distance) distance = d, farthest = &c;
        }
        std::string row = fmt::format("{},,,,", sim.time());
        if (farthest)
            row = fmt::format("{},{:.10g},{:.10g},{:.7g},{}", sim.time(), scene_.map_frame.x + grid.middle_x(farthest->cell),
                              scene_.map_frame.y + grid.middle_y(farthest->cell), distance,
                              distance > 0 ? fmt::format("{:.5g}", (centre_.z - 0.5 * (farthest->now.low + farthest->now.high)) / distance)
                                           : "");
        front_->append(sim.time(), row);
    });
}

void Maps::write_files(const std::vector<MapCell>& cells, double time, double beyond, Pictures pictures)
{
    const io::Place folder = io::hold(directory_ / "maps");
    write_rasters(folder, cells);
    const auto lines = outlines(cells);
    write_outlines(folder, lines);
    if (pictures == Pictures::Draw) write_pictures(folder, cells, lines);
    if (!points_.empty()) write_points(cells);

    double volume = 0, area = 0, thickest = 0, fastest = 0;
    for (const auto& c : cells) {
        volume += c.now.thickness * record_.grid().area(), area += reached(c) ? record_.grid().area() : 0;
        thickest = std::max(thickest, c.memory.thickness), fastest = std::max(fastest, c.memory.speed);
    }
    const auto& grid = record_.grid();
    summary_ = {
        {"time", time},
        {"cell", grid.cell},
        {"columns", grid.columns},
        {"rows", grid.rows},
        {"x", scene_.map_frame.x + grid.x},
        {"y", scene_.map_frame.y + grid.y},
        {"crs", scene_.map_frame.crs.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(io::crs_name(scene_.map_frame.crs))},
        {"wet", record_.wet()},
        {"limits", scene_.maps->limits},
        {"volume", volume},
        {"volume_beyond", beyond},
        {"area_reached", area},
        {"h_max", thickest},
        {"v_max", fastest},
        {"points", points_.size()}};
    auto& files = summary_["files"] = nlohmann::ordered_json::array();
    for (const auto& kind : io::map_kinds) files.push_back(fmt::format("maps/{}.tif", kind.name));
}

void Maps::write_rasters(const io::Place& folder, const std::vector<MapCell>& cells)
{
    const auto& grid = record_.grid();
    io::Raster raster;
    raster.crs = scene_.map_frame.crs;
    raster.grid = {.x = scene_.map_frame.x + grid.x + 0.5 * grid.cell,
                   .y = scene_.map_frame.y + grid.y + 0.5 * grid.cell,
                   .cell = grid.cell,
                   .columns = int(grid.columns),
                   .rows = int(grid.rows),
                   .values = {}};
    raster.grid.values.assign(std::size_t(grid.count()), nan);
    Together files(folder);
    for (std::size_t k = 0; k < io::map_kinds.size(); ++k) {
        double low = 0, high = 0;
        for (const auto& c : cells) {
            const double v = values_of(c, gravity_, scene_.space.spacing)[k];
            raster.grid.values[std::size_t(c.cell)] = v;
            if (!std::isnan(v)) low = std::min(low, v), high = std::max(high, v);
        }
        const auto& kind = io::map_kinds[k];
        if (io::has_signs(kind)) high = std::max(high, -low), low = -high;
        files.add(fmt::format("{}.tif", kind.name), io::geotiff_bytes(raster));
        files.add(fmt::format("{}.qml", kind.name), io::qml_style(kind, low, high > low ? high : low + 1));
    }
    files.publish();
}

/// The outlines of the limits, in the coordinates of the map.
std::vector<io::MapPicture::Outline> Maps::outlines(const std::vector<MapCell>& cells) const
{
    std::vector<io::MapPicture::Outline> all;
    if (scene_.maps->limits.empty()) return all;
    auto thickness = smallest_grid(cells, record_.grid(), 0, [](const MapCell& c) { return c.memory.thickness; });
    thickness.x += scene_.map_frame.x, thickness.y += scene_.map_frame.y;
    for (const double limit : scene_.maps->limits) all.push_back({limit, scene::areas_above(thickness, limit), {}});
    return all;
}

void Maps::write_outlines(const io::Place& folder, const std::vector<io::MapPicture::Outline>& outlines)
{
    // A restart may draw other limits than those that are there.
    for (const auto& name : io::names_in(folder))
        if (name.starts_with("outline_") &&
            std::ranges::none_of(outlines, [&](const auto& o) { return name.starts_with(fmt::format("outline_{}.", o.limit)); }))
            io::remove_file(folder / name);
    for (const auto& [limit, areas, label] : outlines) {
        io::MapLayer layer{.kind = io::MapLayer::Polygons, .columns = {"limit_m", "area_m2"}, .features = {}, .crs = scene_.map_frame.crs};
        for (const auto& area : areas) {
            double sum = 0;
            for (const auto& ring : area) sum += scene::signed_area(ring);
            layer.features.push_back({area, {limit, sum}});
        }
        const std::string name = fmt::format("outline_{}", limit);
        io::write_shapefile(folder / (name + ".shp"), layer);
    }
}

/// What the report shows: how thick it stood at most and when it came, on the ground, with the outlines.
void Maps::write_pictures(const io::Place& folder, const std::vector<MapCell>& cells, const std::vector<io::MapPicture::Outline>& outlines)
{
    if (!io::can_draw()) return;
    const scene::HeightField* ground = scene::ground_of(scene_);
    Together files(folder);
    for (const std::string_view name : {"h_max", "t_arrival"}) {
        io::MapPicture picture{.kind =
                                   *std::ranges::find(io::map_kinds, name, [](const io::MapKind& k) { return std::string_view(k.name); }),
                               .title = scene_.title,
                               .values = smallest_grid(
                                   cells, record_.grid(), nan,
                                   name == "h_max" ? [](const MapCell& c) { return reached(c) ? c.memory.thickness : nan; }
                                                   : [](const MapCell& c) { return reached(c) ? c.memory.arrival : nan; }),
                               .outlines = outlines,
                               .points = points_};
        picture.values.x += scene_.map_frame.x, picture.values.y += scene_.map_frame.y;
        if (ground)
            picture.ground = [&, ground](double x, double y) { return ground->at(x - scene_.map_frame.x, y - scene_.map_frame.y).z; };
        files.add(fmt::format("{}.png", name), io::map_png(picture));
    }
    files.publish();
}

void Maps::write_points(const std::vector<MapCell>& cells)
{
    std::string text = "name,x,y,t_arrival,h_max,v_max,hv_max,p_max,h_end,force_deposit\n# ,m,m,s,m,m/s,m2/s,kPa,m,kPa\n";
    for (const auto& p : points_) {
        const auto at = record_.grid().at(p.x - scene_.map_frame.x, p.y - scene_.map_frame.y);
        const auto found = std::ranges::lower_bound(cells, at, {}, &MapCell::cell);
        text += fmt::format("{},{:.10g},{:.10g}", io::csv_cell(p.name), p.x, p.y);
        const bool soil = found != cells.end() && found->cell == at;
        const auto value = soil ? values_of(*found, gravity_, scene_.space.spacing) : std::array<double, io::map_kinds.size()>{};
        for (const char* name : {"t_arrival", "h_max", "v_max", "hv_max", "p_max", "h_end", "force_deposit"}) {
            const auto kind =
                std::ranges::find(io::map_kinds, std::string_view(name), [](const io::MapKind& k) { return std::string_view(k.name); });
            text += ',' + cell_text(soil ? value[std::size_t(kind - io::map_kinds.begin())] : nan);
        }
        text += '\n';
    }
    io::write_lightly(directory_ / "points.csv", text);
}

io::CheckpointTable Maps::table() const
{
    io::CheckpointTable t{table_name, "cell,m,m,m/s,m2/s,Pa,s,s", int(MapRow{}.size()), {}};
    for (const auto& row : record_.rows()) t.rows.insert(t.rows.end(), row.begin(), row.end());
    return t;
}

nlohmann::ordered_json Maps::header() const
{
    const auto& grid = record_.grid();
    const auto& state = record_.state();
    return {{"x", grid.x},       {"y", grid.y},          {"cell", grid.cell}, {"columns", grid.columns},
            {"rows", grid.rows}, {"wet", record_.wet()}, {"way", state.way},  {"last", state.last}};
}

} // namespace kuzure
