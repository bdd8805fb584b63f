#include "solver/app/hazard/run_scene.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/ground.hpp"
#include "io/ground/vectors.hpp"
#include "solver/app/study/twins.hpp"
#include "solver/core/mix.hpp"
#include "solver/scene/ground.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace kuzure::hazard {
namespace {

constexpr double radians = std::numbers::pi / 180;

io::Mosaic elevation(const Scene& s) { return {std::vector<io::Path>(s.terrain->dem.begin(), s.terrain->dem.end()), s.map_frame.crs}; }

/// The window in which the ground lies, so that every run sees the same.
std::array<double, 4> window_of(const Scene& s)
{
    if (s.terrain->window) return *s.terrain->window;
    const auto& g = scene::ground_of(s)->grid();
    const double half = 0.5 * g.cell, hair = 1e-3 * elevation(s).cell(); // cells that only touch it are not meant
    const double x = s.map_frame.x + g.x - half, y = s.map_frame.y + g.y - half;
    return {x + hair, y + hair, x + g.columns * g.cell - hair, y + g.rows * g.cell - hair};
}

io::Window as_window(const std::array<double, 4>& w) { return {w[0], w[1], w[2], w[3]}; }

/// Writes a raster into the directory of a run's own files; gives its name.
std::string keep(const io::Path& folder, const char* name, scene::Grid grid, const std::string& crs)
{
    const io::Path file = std::filesystem::absolute(folder / name);
    io::write_geotiff(file, {std::move(grid), crs});
    return file.string();
}

/// Changes of the ground and of what lies on it.
class GroundChange {
public:
    GroundChange(const Base& base, const Member& m, double factor, io::Path inputs)
        : base_(base), crs_(base.scene.map_frame.crs), factor_(factor), inputs_(std::move(inputs))
    {
        if (base.uncertain.dem_error && m.number > 0) error_ = m.error;
    }
    void apply(Scene& s)
    {
        bool rasters = error_.has_value();
        for (const auto& body : s.bodies)
            if (const auto* r = std::get_if<scene::Release>(&body.shape)) rasters = rasters || (factor_ != 1 && !r->thickness);
        if (!rasters) return scale_numbers(s);
        std::error_code failed;
        std::filesystem::create_directories(inputs_, failed); // writing says why, where it fails
        heights_ = elevation(base_.scene).read(as_window(*s.terrain->window));
        for (std::size_t b = 0; b < s.bodies.size(); ++b)
            if (auto* r = std::get_if<scene::Release>(&s.bodies[b].shape)) change(*r, b);
        if (error_) s.terrain->dem = {keep(inputs_, "dem.tif", with_error(heights_), crs_)};
    }

private:
    void scale_numbers(Scene& s) const
    {
        for (auto& body : s.bodies)
            if (auto* r = std::get_if<scene::Release>(&body.shape); r && r->thickness) *r->thickness *= factor_;
    }
    scene::Grid with_error(scene::Grid g) const
    {
        if (error_)
            g.for_each([&](int i, int j, std::size_t k) {
                g.values[k] += height_error(*base_.uncertain.dem_error, *error_, g.x_of(i), g.y_of(j));
            });
        return g;
    }
    std::string keep_own(const char* what, std::size_t body, scene::Grid g) const
    {
        return keep(inputs_, fmt::format("{}-{}.tif", what, body).c_str(), std::move(g), crs_);
    }
    /// Values of a file on the cells of the heights.
    scene::Grid on_cells(const std::string& file) const
    {
        scene::Grid g = heights_;
        g.values = io::onto(file, g, crs_);
        return g;
    }
    void change(scene::Release& r, std::size_t body) const
    {
        if (r.thickness) {
            *r.thickness *= factor_;
        } else if (!r.thickness_map.empty()) {
            if (factor_ == 1) return;
            auto t = io::Mosaic({r.thickness_map}, crs_).read({});
            for (double& x : t.values) x *= factor_;
            r.thickness_map = keep_own("thickness", body, std::move(t));
        } else if (!r.surface.empty()) {
            // The ground's error moves the slip surface along: the mass keeps its thickness.
            auto slip = on_cells(r.surface);
            for (std::size_t k = 0; k < slip.values.size(); ++k)
                if (const double t = heights_.values[k] - slip.values[k]; t > 0) slip.values[k] = heights_.values[k] - factor_ * t;
            r.surface = keep_own("surface", body, with_error(std::move(slip)));
        } else if (!r.before.empty()) {
            auto before = on_cells(r.before), after = on_cells(r.after);
            for (std::size_t k = 0; k < before.values.size(); ++k)
                if (const double t = before.values[k] - after.values[k]; t > 0) before.values[k] = after.values[k] + factor_ * t;
            r.before = keep_own("before", body, with_error(std::move(before)));
            if (error_) r.after = keep_own("after", body, with_error(std::move(after)));
        } else if (factor_ != 1) {
            const auto read = io::read_outlines(r.outline);
            io::MapLayer layer{
                .kind = io::MapLayer::Polygons, .columns = {"thickness"}, .features = {}, .crs = read.crs.empty() ? crs_ : read.crs};
            for (const auto& f : read.features) layer.features.push_back({f.rings, {factor_ * f.thickness.value_or(0)}});
            const io::Path file = std::filesystem::absolute(inputs_ / fmt::format("outline-{}.shp", body));
            io::write_shapefile(file, layer);
            r.outline = file.string();
        }
    }

    const Base& base_;
    const std::string& crs_;
    double factor_;
    io::Path inputs_;
    std::optional<std::uint64_t> error_;
    scene::Grid heights_; // as read, map coordinates
};

/// Makes bodies that are no releases `factor` times as high, about their foot; boxes to whole spacings.
void scale_bodies(Scene& s, const Scene& was, double factor)
{
    for (std::size_t b = 0; b < s.bodies.size(); ++b) {
        auto& shape = s.bodies[b].shape;
        if (auto* box = std::get_if<scene::Box>(&shape)) {
            const auto& old = std::get<scene::Box>(was.bodies[b].shape);
            const double layers = std::max(1.0, std::round(factor * (old.high.z - old.low.z) / s.space.spacing));
            box->high.z = box->low.z + layers * s.space.spacing;
        } else if (auto* c = std::get_if<scene::Cylinder>(&shape)) {
            c->height *= factor;
        } else if (auto* p = std::get_if<scene::Polygon>(&shape)) {
            double foot = HUGE_VAL;
            for (const auto& corner : p->points) foot = std::min(foot, corner[1]);
            for (auto& corner : p->points) corner[1] = foot + factor * (corner[1] - foot);
        }
    }
}

bool has_box(const Scene& s)
{
    return std::ranges::any_of(s.bodies, [](const auto& b) { return std::holds_alternative<scene::Box>(b.shape); });
}

} // namespace

double height_error(const scene::HeightError& e, std::uint64_t seed, double x, double y)
{
    // Normal numbers at the points of a square grid, smoothed by quadratic B-splines and scaled so that each point has the same spread. No
    // function of a mathematics library comes in, whose last digits differ between machines.
    const auto normal = [&](std::int64_t i, std::int64_t j) {
        // Of neighbours and of other seeds nothing in common.
        std::uint64_t z = mix(mix(seed + std::uint64_t(i)) + std::uint64_t(j));
        double sum = -6; // of twelve numbers in [0, 1): variance 1
        for (int k = 0; k < 12; ++k) {
            z += 0x9e3779b97f4a7c15ull;
            sum += double(mix(z) >> 11) * 0x1p-53;
        }
        return sum;
    };
    const double a = x / e.length, b = y / e.length, i0 = std::floor(a + 0.5), j0 = std::floor(b + 0.5);
    const auto weights = [](double t) { // at the points -1, 0, 1 about the nearest; t from it, in -1/2 ... 1/2
        return std::array{0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
    };
    const auto wx = weights(a - i0), wy = weights(b - j0);
    double sum = 0, square = 0;
    for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3; ++i) {
            const double w = wx[i] * wy[j];
            sum += w * normal(std::int64_t(i0) + std::int64_t(i) - 1, std::int64_t(j0) + std::int64_t(j) - 1), square += w * w;
        }
    return e.height * sum / std::sqrt(square);
}

Base base_of(const scene::CheckedScene& checked, const std::optional<scene::Uncertain>& uncertain, const std::string& file)
{
    const Scene& s = checked.scene;
    if (s.dimensions != 3)
        throw BadInput(fmt::format("{}: dimensions: expected 3 for maps of a hazard, found 2. Remedy: dimensions = 3", file));
    if (!s.maps)
        throw BadInput(
            fmt::format("{}: maps: expected [maps], of which probabilities are made, found none. Remedy: [maps] limits = [0.5, 1.0] "
                        "(docs/maps.md)",
                        file));
    io::need_terrain("maps");
    Base base;
    base.scene = s;
    if (uncertain) base.uncertain = *uncertain;
    else base.uncertain.pressures = {3, 30};
    auto& u = base.uncertain;
    int columns = 0;
    std::int64_t particles = 0;
    const auto& f = checked.filling;
    const Vector low = f.soil_bounds().low;
    Vector sum{};
    f.for_each_soil_stack_in(f.soil_bounds(), [&](const scene::Stack&, int) { ++columns; });
    f.for_each_soil_in(f.soil_bounds(), [&](std::int64_t, Vector x, int) { sum = sum + (x - low), ++particles; });
    base.thickness = double(particles) / std::max(1, columns) * s.space.spacing;
    base.volume = double(particles) * s.particle_volume();
    base.centre = low + (1 / double(std::max<std::int64_t>(1, particles))) * sum;

    const auto coulomb = [&](const scene::Wall& w) { return w.surface == scene::Surface::Coulomb; };
    if (u.bed_friction && std::ranges::none_of(s.walls, coulomb))
        throw BadInput(fmt::format("{}: uncertain.bed_friction: expected ground or a wall with Coulomb friction, found none. Remedy: "
                                   "terrain.friction, or surface = {{ friction_angle = 20.0 }} of a wall",
                                   file));
    if (u.bed_friction && s.terrain && !s.terrain->friction_map.empty())
        throw BadInput(fmt::format("{}: uncertain.bed_friction: expected one friction for the whole ground, found terrain.friction_map. "
                                   "Remedy: leave one of them out",
                                   file));
    if (u.thickness) {
        int others = 0;
        for (const auto& body : s.bodies) {
            others += !std::holds_alternative<scene::Release>(body.shape);
            if (std::holds_alternative<scene::Sphere>(body.shape))
                throw BadInput(fmt::format("{}: uncertain.thickness: a sphere has no thickness that could be varied. Remedy: "
                                           "[[uncertain.key]] key = \"body.0.sphere.radius\"",
                                           file));
        }
        if (others > 1)
            throw BadInput(
                fmt::format("{}: uncertain.thickness: expected releases, or one other body, found {} bodies that may stand on one "
                            "another. Remedy: leave it out, or [[uncertain.key]] with numbers of single bodies",
                            file, others));
    }
    if (!s.start.from.empty() && (u.thickness || u.dem_error))
        throw BadInput(
            fmt::format("{}: uncertain.{}: the scene starts from the state of another run (start.from), whose ground and mass are "
                        "given. Remedy: leave one of the two out",
                        file, u.thickness ? "thickness" : "dem_error"));
    return base;
}

double possible_spacing(const Base& base, double wanted)
{
    if (!has_box(base.scene)) return std::stod(fmt::format("{:.3g}", wanted));
    // Whole numbers of layers of the boxes, and near them what keeps their volume best.
    double best = wanted, least = HUGE_VAL;
    for (const auto& body : base.scene.bodies) {
        const auto* box = std::get_if<scene::Box>(&body.shape);
        if (!box) continue;
        const Vector side = box->high - box->low;
        for (const double length : {side.x, side.y, side.z}) {
            const double n0 = length / wanted;
            for (double n = std::max(1.0, std::floor(0.75 * n0)); n <= std::ceil(1.3 * n0); ++n) {
                const double dx = length / n;
                double excess = 0;
                for (const auto& other : base.scene.bodies)
                    if (const auto* b = std::get_if<scene::Box>(&other.shape)) {
                        const Vector d = b->high - b->low;
                        double volume = 1;
                        for (const double l : {d.x, d.y, d.z}) volume *= std::max(1.0, std::round(l / dx)) * dx / l;
                        excess += std::fabs(volume - 1);
                    }
                if (const double cost = excess + 0.1 * std::fabs(std::log(dx / wanted)); cost < least - 1e-12) least = cost, best = dx;
            }
        }
    }
    return best;
}

scene::Maps maps_for(const Scene& s, double coarsest)
{
    scene::Maps m = *s.maps;
    // Cells narrower than particles stand apart would have holes.
    const double least = std::max(1.5 * coarsest, m.cell);
    m.cell *= std::ceil(least / m.cell - 1e-9);
    if (m.wet == s.space.spacing) m.wet = std::max(m.wet, coarsest); // it was not asked for
    return m;
}

scene::Maps maps_of_runs(const Base& base)
{
    scene::Maps m = maps_for(base.scene, base.coarsest);
    if (base.wet > 0) m.wet = base.wet;
    return m;
}

RunScene run_scene(const Base& base, double spacing, const Member& m, const std::string& title, const io::Path& inputs)
{
    RunScene out;
    Scene s = base.scene.space.spacing == spacing || !base.scene.start.from.empty()
                  ? base.scene
                  : study::with_spacing(base.scene, spacing / base.scene.space.spacing, out.notes);
    if (base.scene.start.from.empty()) s.space.spacing = spacing;
    s.title = fmt::format("{} ({})", base.scene.title, title);
    s.output = {};
    s.output.fields = {"velocity"};
    s.output.history = s.time.end / 200;
    s.output.checkpoint_minutes = 2;
    s.maps = maps_of_runs(base);
    s.maps->wet *= base.recorded;
    s.time.retry = true;

    const auto inputs_of_all = inputs_of(base.uncertain);
    double factor = 1;
    for (std::size_t k = 0; k < inputs_of_all.size(); ++k) {
        const auto& name = inputs_of_all[k].name;
        const double value = m.values[k];
        if (name == "friction") {
            for (auto& soil : s.soils) soil.friction_angle = value * radians;
        } else if (name == "bed_friction") {
            if (s.terrain && s.terrain->surface == scene::Surface::Coulomb) s.terrain->friction_angle = value * radians;
            for (auto& wall : s.walls)
                if (wall.surface == scene::Surface::Coulomb) wall.friction_angle = value * radians;
        } else if (name == "thickness") {
            factor = value;
        } else {
            out.sets.push_back(fmt::format("{}={}", name, value));
        }
    }
    if (s.terrain) {
        s.terrain->window = window_of(base.scene);
        GroundChange(base, m, factor, inputs).apply(s);
    }
    if (factor != 1) scale_bodies(s, base.scene, factor);
    out.text = io::write_scene(s);
    return out;
}

} // namespace kuzure::hazard
