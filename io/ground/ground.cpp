// The real ground of a scene, from its files.
#include "io/ground/ground.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/formats.hpp"
#include "io/ground/loading.hpp"
#include "solver/scene/draped.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::io {

namespace ground {

std::string cell_text(const scene::Grid& g, int i, int j) { return fmt::format("({:.10g}, {:.10g})", g.x + i * g.cell, g.y + j * g.cell); }
std::string shown(const Window& w)
{
    return fmt::format("x {:.10g} to {:.10g}, y {:.10g} to {:.10g}", w.low_x, w.high_x, w.low_y, w.high_y);
}
std::string dem_files(const Scene& scene) { return fmt::format("{}", fmt::join(scene.terrain->dem, ", ")); }

} // namespace ground

using namespace ground;

namespace {

class Loader {
public:
    explicit Loader(Scene& scene) : scene_(scene), terrain_(*scene.terrain) {}

    scene::Issues load()
    {
        check_keys();
        const auto map = terrain_.crs.empty() ? "" : at_key("terrain.crs", [&] { return crs_from(terrain_.crs, "terrain.crs"); });
        std::vector<Path> files(terrain_.dem.begin(), terrain_.dem.end());
        const Mosaic mosaic = at_key("terrain.dem", [&] { return Mosaic(files, map); });
        crs_ = mosaic.crs();
        all_ = mosaic.extent();
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (auto* r = std::get_if<scene::Release>(&scene_.bodies[b].shape)) read_outline(*r, fmt::format("body.{}.release", b));
        read_heights(mosaic);
        for (auto& m : masses_) thickness_and_bed(m, dem_, crs_, scene_, issues_);
        finish();
        return std::move(issues_);
    }

private:
    void warn(const std::string& key, const std::string& text) { issues_.push_back({scene::Severity::Warning, key, text, ""}); }
    void check_keys()
    {
        if (!has_terrain()) throw Refused{"terrain", built_without_maps};
        if (scene_.dimensions != 3) throw Refused{"terrain", "expected dimensions = 3 on real ground, found 2. Remedy: dimensions = 3"};
        if (terrain_.surface == scene::Surface::Coulomb && terrain_.friction_angle == 0 && terrain_.friction_map.empty())
            throw Refused{"terrain.friction",
                          "expected the friction angle between soil and ground in degrees, found none. Remedy: friction = 24.0, or "
                          "surface = \"rough\" or \"smooth\""};
        if (terrain_.surface != scene::Surface::Coulomb)
            for (const auto& [key, there] : {std::pair("friction", terrain_.friction_angle != 0),
                                             {"friction_map", !terrain_.friction_map.empty()},
                                             {"xi", terrain_.xi.has_value()}})
                if (there)
                    throw Refused{fmt::format("terrain.{}", key),
                                  fmt::format("expected none beside a rough or smooth surface. Remedy: leave {} out, or surface", key)};
        if (terrain_.dem.empty()) throw Refused{"terrain.dem", "expected the file of an elevation model, or several, found none"};
        if (const auto& w = terrain_.window; w && !((*w)[0] < (*w)[2] && (*w)[1] < (*w)[3]))
            throw Refused{"terrain.window",
                          fmt::format("expected [x from, y from, x to, y to] with growing x and y, found [{}, {}, {}, {}]", (*w)[0],
                                      (*w)[1], (*w)[2], (*w)[3])};
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
            const auto* r = std::get_if<scene::Release>(&scene_.bodies[b].shape);
            if (!r) continue;
            const auto key = fmt::format("body.{}.release", b);
            const int ways = int(r->thickness.has_value()) + int(!r->thickness_map.empty()) + int(!r->surface.empty()) +
                             int(!r->before.empty() || !r->after.empty());
            if (ways > 1)
                throw Refused{key, "expected one of thickness, thickness_map, surface, before with after; found more. Remedy: keep one"};
            if (ways == 0 && r->outline.empty())
                throw Refused{key, "expected how thick the mass is: thickness, thickness_map, surface, or before and after; found none"};
            if (r->before.empty() != r->after.empty())
                throw Refused{key + (r->before.empty() ? ".after" : ".before"),
                              "expected before and after together, found one. Remedy: name the other elevation model, or surface = "
                              "\"slip.tif\" for the slip surface"};
            if (r->thickness && r->outline.empty())
                throw Refused{key + ".thickness",
                              "expected an outline with a thickness, found none. Remedy: outline = \"scar.shp\", or thickness_map"};
            if (r->on_top && (!r->surface.empty() || !r->before.empty()))
                throw Refused{key + ".on_top", "expected on_top with thickness or thickness_map alone: surface, before and after say "
                                               "themselves where the bed is. Remedy: leave it out"};
        }
    }

    void read_outline(scene::Release& r, const std::string& key)
    {
        Mass m{&r, key, {}, {}, {}, {}, {}};
        if (!r.outline.empty()) {
            at_key(key + ".outline", [&] { return take_outline(m), 0; });
        } else {
            const auto& [file, which] = !r.thickness_map.empty() ? std::pair(r.thickness_map, ".thickness_map")
                                        : !r.surface.empty()     ? std::pair(r.surface, ".surface")
                                                                 : std::pair(r.after, ".after");
            at_key(key + which, [&, &file = file] { return take_extent(m, file), 0; });
        }
        masses_.push_back(std::move(m));
    }

    static Window nothing()
    {
        const double far = std::numeric_limits<double>::infinity();
        return {far, far, -far, -far};
    }
    static void widen(Window& w, double x, double y)
    {
        w = {std::min(w.low_x, x), std::min(w.low_y, y), std::max(w.high_x, x), std::max(w.high_y, y)};
    }

    void take_outline(Mass& m) const
    {
        const scene::Release& r = *m.release;
        m.box = nothing();
        auto read = read_outlines(r.outline);
        const auto own = crs_for(read.crs, crs_, r.outline);
        std::optional<Transform> way;
        if (!same_crs(own, crs_)) way.emplace(own, crs_, r.outline);
        for (auto& outline : read.features)
            for (auto& ring : outline.rings)
                for (auto& p : ring) {
                    if (way) p = (*way)(p[0], p[1]);
                    if (!std::isfinite(p[0]))
                        throw BadInput(fmt::format("{}: a corner cannot be brought into {}. Remedy: check the outline's system", r.outline,
                                                   crs_name(crs_)));
                    widen(m.box, p[0], p[1]);
                }
        const bool by_feature = !r.thickness && r.thickness_map.empty() && r.surface.empty() && r.before.empty();
        for (std::size_t k = 0; k < read.features.size(); ++k) {
            if (by_feature && !read.features[k].thickness)
                throw BadInput(fmt::format("{}: feature {}: it has no attribute \"thickness\", and the scene no thickness. Remedy: "
                                           "thickness = 4.5 beside outline, or "
                                           "the attribute for every feature",
                                           r.outline, k + 1));
            if (by_feature && !(*read.features[k].thickness > 0))
                throw BadInput(
                    fmt::format("{}: feature {}: expected a thickness above 0, found {}", r.outline, k + 1, *read.features[k].thickness));
            m.rings.insert(m.rings.end(), read.features[k].rings.begin(), read.features[k].rings.end());
        }
        m.outlines = std::move(read.features);
        if (!m.box.meets(all_)) {
            const Window turned{m.box.low_y, m.box.low_x, m.box.high_y, m.box.high_x};
            throw BadInput(fmt::format(
                "{}: it lies at {}, the elevation model at {}: they do not overlap.{} Remedy: check the systems of both", r.outline,
                shown(m.box), shown(all_), turned.meets(all_) ? " With x and y exchanged they would: are its axes in another order?" : ""));
        }
    }

    /// The extent of a raster; of thicknesses only where there is soil.
    void take_extent(Mass& m, const std::string& file) const
    {
        const Mosaic one({file}, crs_);
        m.box = one.extent();
        if (!m.box.meets(all_))
            throw BadInput(
                fmt::format("{}: it lies at {}, the elevation model at {}: they do not overlap. Remedy: check the systems of both", file,
                            shown(m.box), shown(all_)));
        if (!m.release->thickness_map.empty()) {
            const auto g = one.read({});
            m.box = nothing();
            for (int j = 0; j < g.rows; ++j)
                for (int i = 0; i < g.columns; ++i)
                    if (g.at(i, j) > 0)
                        widen(m.box, g.x + (i - 0.5) * g.cell, g.y + (j - 0.5) * g.cell),
                            widen(m.box, g.x + (i + 0.5) * g.cell, g.y + (j + 0.5) * g.cell);
            if (!(m.box.low_x < m.box.high_x)) throw BadInput(fmt::format("{}: no cell of it is thicker than 0", file));
        }
    }

    /// The window of the scene, or what lies within the reach of its releases.
    void read_heights(const Mosaic& mosaic)
    {
        at_key(terrain_.window ? "terrain.window" : "terrain.dem", [&] {
            if (terrain_.window) {
                const auto& w = *terrain_.window;
                dem_ = mosaic.read(Window{w[0], w[1], w[2], w[3]});
            } else if (masses_.empty()) {
                dem_ = mosaic.read({});
            } else {
                Window box = masses_[0].box;
                for (const auto& m : masses_)
                    box = {std::min(box.low_x, m.box.low_x), std::min(box.low_y, m.box.low_y), std::max(box.high_x, m.box.high_x),
                           std::max(box.high_y, m.box.high_y)};
                // The lowest ground within some way tells how far soil can come; farther ground may be lower.
                for (double way = 200;;) {
                    const auto margin = [&](double by) { return Window{box.low_x - by, box.low_y - by, box.high_x + by, box.high_y + by}; };
                    const Window w = margin(way);
                    dem_ = mosaic.read(w);
                    const double needed = reach(box);
                    const bool whole = w.low_x <= all_.low_x && w.low_y <= all_.low_y && w.high_x >= all_.high_x && w.high_y >= all_.high_y;
                    if (needed <= way || whole) {
                        // To whole multiples of ten metres, so that a little change of the outline seldom changes the window.
                        if (const double to = 10 * std::ceil(needed / 10) + 2 * mosaic.cell(); to < way || !whole)
                            dem_ = mosaic.read(margin(to));
                        break;
                    }
                    way = std::max(1.5 * way, needed);
                }
            }
            return 0;
        });
        if (dem_.columns < 5 || dem_.rows < 5)
            throw Refused{terrain_.window ? "terrain.window" : "terrain.dem",
                          fmt::format("expected at least 5 x 5 cells of ground, found {} x {}. Remedy: a larger window, or an elevation "
                                      "model with smaller cells",
                                      dem_.columns, dem_.rows)};
        check_heights();
    }

    /// How far (m) soil can come from a box by the line of reach, as far as the heights read so far tell.
    double reach(const Window& box) const
    {
        double top = -std::numeric_limits<double>::infinity(), low = -top;
        dem_.for_each([&](int i, int j, std::size_t k) {
            const double z = dem_.values[k];
            if (std::isnan(z)) return;
            low = std::min(low, z);
            if (dem_.x_of(i) >= box.low_x - dem_.cell && dem_.x_of(i) <= box.high_x + dem_.cell && dem_.y_of(j) >= box.low_y - dem_.cell &&
                dem_.y_of(j) <= box.high_y + dem_.cell)
                top = std::max(top, z);
        });
        return top > low ? (top - low) / reach_slope : 0;
    }

    void check_heights()
    {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        bool whole = true;
        dem_.for_each([&](int i, int j, std::size_t k) {
            const double z = dem_.values[k];
            if (std::isnan(z)) return;
            if (z < -11000 || z > 9000)
                throw Refused{"terrain.dem", fmt::format("{}: the cell at {} has a height of {} m, which no place on Earth has. Remedy: if "
                                                         "it means no data: gdal_translate -a_nodata {} in.tif out.tif",
                                                         dem_files(scene_), cell_text(dem_, i, j), z, z)};
            low = std::min(low, z), high = std::max(high, z);
            whole = whole && z == std::floor(z);
        });
        if (!(low <= high))
            throw Refused{terrain_.window ? "terrain.window" : "terrain.dem",
                          fmt::format("{}: no cell at {} has a height. Remedy: another window, or files that cover it", dem_files(scene_),
                                      shown(extent_of(dem_)))};
        if (low == high) warn("terrain.dem", fmt::format("all heights are {} m: is this the elevation model?", low));
        else if (whole)
            warn("terrain.dem", "all heights are whole metres: slopes become stairs. Remedy: an elevation model with decimals, or gdalwarp "
                                "-r cubicspline onto coarser cells");
        const double x = 0.5 * (all_.low_x + all_.high_x), y = 0.5 * (all_.low_y + all_.high_y);
        if (!lies_in(crs_, x, y))
            warn("terrain.crs",
                 fmt::format("the elevation model lies at ({:.8g}, {:.8g}), outside the area for which {} is made{}", x, y, crs_name(crs_),
                             lies_in(crs_, y, x) ? "; with x and y exchanged it would lie inside: are its axes in the order of surveyors?"
                                                 : ". Remedy: check its EPSG number"));
        if (scene_.space.spacing > 4 * dem_.cell)
            warn("space.spacing",
                 fmt::format(
                     "one spacing ({} m) is {:.1f} cells of the elevation model ({} m): what the ground has between them is averaged away",
                     scene_.space.spacing, scene_.space.spacing / dem_.cell, dem_.cell));
    }

    /// Grids in local metres, the wall, the frame.
    void finish()
    {
        const Window w = extent_of(dem_);
        const double x0 = std::floor(w.low_x + 1e-6), y0 = std::floor(w.low_y + 1e-6);
        scene_.map_frame = {crs_, x0, y0};
        scene::Grid bed = dem_;
        for (const auto& m : masses_)
            for (std::size_t k = 0; k < bed.values.size(); ++k)
                if (!std::isnan(m.bed[k])) bed.values[k] = ground::single(m.bed[k]);
        // Where cells are finer than the spacing their means are what particles can feel.
        const int n = std::max(1, int(std::floor(scene_.space.spacing / dem_.cell + 1e-6)));
        const auto local = [&](scene::Grid g) {
            g.x -= x0, g.y -= y0;
            return scene::averaged(g, n);
        };
        auto heights = local(std::move(bed));
        if (heights.columns < 5 || heights.rows < 5)
            throw Refused{"space.spacing",
                          fmt::format("expected ground of at least 5 x 5 spacings, found {} x {}", heights.columns, heights.rows)};
        const auto field = std::make_shared<const scene::HeightField>(std::move(heights));
        for (auto& m : masses_) {
            m.release->bed = field;
            m.release->rings = m.rings;
            for (auto& ring : m.release->rings)
                for (auto& p : ring) p[0] -= x0, p[1] -= y0;
            if (m.release->thickness) continue;
            scene::Grid t = dem_;
            t.values = m.thickness;
            m.release->thicknesses = std::make_shared<const scene::Grid>(local(std::move(t)));
        }
        std::erase_if(scene_.walls, [](const scene::Wall& wall) { return std::holds_alternative<scene::Ground>(wall.shape); });
        const auto friction = read_friction();
        const double drag = terrain_.xi ? 9.81 / *terrain_.xi : 0;
        scene::Ground ground{field, scene::ground_depth(*field, scene_.support()), terrain_.lattice,
                             friction ? std::make_shared<const scene::Grid>(local(*friction)) : nullptr};
        const double angle = friction && terrain_.friction_angle == 0 ? mean_of(*friction) : terrain_.friction_angle;
        scene_.walls.push_back({.shape = std::move(ground), .surface = terrain_.surface, .friction_angle = angle, .drag = drag});
    }

    static double mean_of(const scene::Grid& g)
    {
        double sum = 0;
        std::size_t n = 0;
        for (const double v : g.values)
            if (!std::isnan(v)) sum += v, ++n;
        return sum / double(std::max<std::size_t>(1, n));
    }
    /// The raster of friction on the cells of the ground, rad; `friction` where it has none.
    std::optional<scene::Grid> read_friction() const
    {
        if (terrain_.friction_map.empty()) return {};
        const auto degrees = at_key("terrain.friction_map", [&] { return onto(terrain_.friction_map, dem_, crs_); });
        scene::Grid angles = dem_;
        dem_.for_each([&](int i, int j, std::size_t k) {
            const double d = degrees[k];
            if (std::isnan(d) && !std::isnan(dem_.values[k]) && terrain_.friction_angle == 0)
                throw Refused{
                    "terrain.friction_map",
                    fmt::format("{}: no data at {}, and no friction to count there. Remedy: friction = 24.0 beside it, or a raster "
                                "that covers the ground",
                                terrain_.friction_map, cell_text(dem_, i, j))};
            if (d <= 0 || d >= 90)
                throw Refused{
                    "terrain.friction_map",
                    fmt::format("{}: expected friction angles above 0 and below 90 degrees, found {} at {}. Remedy: gdal_calc.py, "
                                "or declare it no data: gdal_translate -a_nodata {}",
                                terrain_.friction_map, d, cell_text(dem_, i, j), d)};
            angles.values[k] = std::isnan(d) ? terrain_.friction_angle : d * (std::numbers::pi / 180);
        });
        return angles;
    }

    Scene& scene_;
    const scene::Terrain& terrain_;
    scene::Issues issues_;
    std::string crs_;
    Window all_;
    scene::Grid dem_; // map coordinates
    std::vector<Mass> masses_;
};

} // namespace

scene::Issues load_ground(Scene& scene)
{
    if (!scene.terrain) {
        for (std::size_t b = 0; b < scene.bodies.size(); ++b)
            if (std::holds_alternative<scene::Release>(scene.bodies[b].shape))
                return {{scene::Severity::Error, fmt::format("body.{}.release", b),
                         "expected [terrain] with an elevation model beside a release, found none. Remedy: [terrain] dem = \"dem.tif\"",
                         ""}};
        return {};
    }
    try {
        return Loader(scene).load();
    } catch (const Refused& r) {
        return {{scene::Severity::Error, r.key, r.text, ""}};
    } catch (const BadInput& e) {
        return {{scene::Severity::Error, "terrain", e.what(), ""}};
    }
}

} // namespace kuzure::io
