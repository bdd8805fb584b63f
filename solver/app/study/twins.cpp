#include "solver/app/study/twins.hpp"
#include "io/json.hpp"
#include "solver/app/study/convergence.hpp"
#include "solver/app/study/profile.hpp"
#include "solver/scene/check.hpp"
#include "solver/scene/effects_list.hpp"
#include "solver/scene/shape.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::study {
namespace {

double& axis_of(Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// Moves faces to whole spacings from one corner, all by the same rule: what touched still touches, nothing overlaps anew.
class Snap {
public:
    Snap(const Scene& s, Vector corner) : spacing_(s.space.spacing), flat_(s.dimensions == 2), corner_(corner) {}
    bool skips(int axis) const { return flat_ && axis == 1; }
    double operator()(double x, int axis)
    {
        Vector c = corner_;
        const double o = axis_of(c, axis), moved = o + std::round((x - o) / spacing_) * spacing_;
        greatest_ = std::max(greatest_, std::fabs(moved - x));
        return moved;
    }
    /// Greatest way a face was moved, m.
    double greatest() const { return greatest_; }

private:
    double spacing_;
    bool flat_;
    Vector corner_;
    double greatest_ = 0;
};

/// Thickens a wall that is thinner than the support, on the side away from the soil.
void thicken(scene::Shape& shape, const Scene& s, const Vector& soil)
{
    const double least = std::ceil(2 * s.space.h) * s.space.spacing;
    if (auto* box = std::get_if<scene::Box>(&shape)) {
        int thin = -1;
        for (const int axis : {0, 1, 2})
            if (!(s.dimensions == 2 && axis == 1) &&
                (thin < 0 || axis_of(box->high, axis) - axis_of(box->low, axis) < axis_of(box->high, thin) - axis_of(box->low, thin)))
                thin = axis;
        Vector middle = soil;
        double &low = axis_of(box->low, thin), &high = axis_of(box->high, thin);
        const double missing = std::round(std::max(0.0, least - (high - low)) / s.space.spacing) * s.space.spacing;
        if (0.5 * (low + high) < axis_of(middle, thin)) low -= missing;
        else high += missing;
    } else if (auto* c = std::get_if<scene::Cylinder>(&shape)) {
        const double missing = std::max(0.0, least - c->height);
        if (c->base.z + 0.5 * c->height < soil.z) c->base.z -= missing;
        c->height += missing;
    }
}

} // namespace

Scene with_spacing(const Scene& scene, double factor, std::vector<std::string>& notes)
{
    Scene s = scene;
    const scene::Filling filling(scene);
    const double half = 0.5 * scene.space.spacing;
    const auto& bounds = filling.soil_bounds();
    const Vector corner{bounds.low.x - half, scene.dimensions == 2 ? 0 : bounds.low.y - half, bounds.low.z - half};
    const Vector middle{0.5 * (bounds.low.x + bounds.high.x), 0.5 * (bounds.low.y + bounds.high.y), 0.5 * (bounds.low.z + bounds.high.z)};
    s.space.spacing *= factor;
    if (s.time.step) *s.time.step *= factor;

    Snap snap(s, corner);
    const auto snap_box = [&](scene::Shape& shape) {
        if (auto* box = std::get_if<scene::Box>(&shape))
            for (const int axis : {0, 1, 2})
                if (!snap.skips(axis)) {
                    double &low = axis_of(box->low, axis), &high = axis_of(box->high, axis);
                    low = snap(low, axis), high = snap(high, axis);
                }
    };
    for (auto& body : s.bodies) snap_box(body.shape);
    const double bodies_moved = snap.greatest();
    for (auto& wall : s.walls) snap_box(wall.shape), thicken(wall.shape, s, middle);
    if (s.space.low && s.space.high)
        for (const int axis : {0, 1, 2}) {
            if (snap.skips(axis)) continue;
            double &low = axis_of(*s.space.low, axis), &high = axis_of(*s.space.high, axis);
            if (s.space.periodic[std::size_t(axis)]) low = snap(low, axis), high = snap(high, axis);
            else low -= s.space.spacing, high += s.space.spacing; // snapped bodies may stand out of it
        }
    if (bodies_moved > 1e-6 * s.space.spacing)
        notes.push_back(fmt::format("the bodies do not hold whole spacings of {:g} m: faces were moved by up to {:.3g} m", s.space.spacing,
                                    bodies_moved));
    return s;
}

Twin coarsened(const Scene& scene, int factor)
{
    Twin twin{factor, scene, 1, {}};
    Scene& s = twin.scene;
    const scene::Filling filling(scene);
    s = with_spacing(scene, factor, twin.notes);
    // Of a twin only the last state and the history count.
    s.title += fmt::format(" ({} times the spacing)", factor);
    s.output.directory.clear(), s.output.every.reset(), s.output.picture.reset();
    s.output.fields = {"density"};

    scene::resolve(s);
    std::string errors;
    for (const auto& issue : scene::check(s, scene::StepLimit::Force))
        if (issue.severity == scene::Severity::Error) errors += (errors.empty() ? "" : "; ") + in_words(issue);
    if (!errors.empty()) throw BadInput(fmt::format("the scene cannot be made {} times as coarse: {}", factor, errors));
    twin.soil_volume =
        double(scene::Filling(s).soil_count()) * s.particle_volume() / (double(filling.soil_count()) * scene.particle_volume());
    if (std::fabs(twin.soil_volume - 1) > 1e-3)
        twin.notes.push_back(
            fmt::format("it has {:+.1f} % of soil: part of the difference is not the spacing's", 100 * (twin.soil_volume - 1)));
    return twin;
}

nlohmann::ordered_json error_bars(const Scene& scene, const io::Path& directory, double peak_speed, const std::vector<TwinRun>& twins)
{
    using Json = nlohmann::ordered_json;
    const int coarsest = *std::max_element(std::begin(twin_factors), std::end(twin_factors));
    const double grain = scene.output.grain.value_or(coarsest * scene.space.spacing), window = 2 * coarsest * scene.space.spacing;
    Json j{{"grain", grain}, {"window", window}, {"twins", Json::array()}};
    std::vector<Sample> runout, height, speed;
    const auto add = [&](const Scene& s, const io::Path& run, double peak) {
        const auto profile = measure_profile(s, io::read_snapshot(io::last_snapshot(run)), window);
        runout.push_back({s.space.spacing, profile.runout(grain)}), height.push_back({s.space.spacing, profile.top});
        speed.push_back({s.space.spacing, greatest_speed(run, peak)});
    };
    add(scene, directory, peak_speed);
    for (const auto& t : twins) {
        Json row{{"factor", t.twin.factor}};
        if (t.failed.empty()) {
            const auto summary = io::parse_json(io::read_text(t.directory / "summary.json"));
            add(t.twin.scene, t.directory, summary.at("peak_speed"));
            row.update(Json{{"spacing", t.twin.scene.space.spacing},
                            {"directory", t.directory.lexically_relative(directory).string()},
                            {"soil_particles", summary.at("soil_particles")},
                            {"steps", summary.at("steps")},
                            {"pairs", summary.at("pairs")},
                            {"wall_seconds", summary.at("wall_seconds")},
                            {"soil_volume", t.twin.soil_volume},
                            {"notes", t.twin.notes},
                            {"run-out", runout.back().value},
                            {"height", height.back().value},
                            {"peak speed", speed.back().value}});
        } else row["failed"] = t.failed;
        j["twins"].push_back(std::move(row));
    }
    for (const auto& [name, samples, unit] :
         {std::tuple{"run-out", &runout, "m"}, std::tuple{"height", &height, "m"}, std::tuple{"peak speed", &speed, "m/s"}}) {
        const auto c = converge(*samples);
        Json row{{"value", samples->front().value}, {"unit", unit}};
        if (c.order) row.update(Json{{"half_width", c.half_width}, {"order", *c.order}, {"limit", c.limit}});
        else row.update(Json{{"half_width", nullptr}, {"no_interval", c.why_not}});
        j[name] = std::move(row);
    }
    return j;
}

std::vector<std::string> error_bar_lines(const nlohmann::ordered_json& j)
{
    std::vector<std::string> lines;
    for (const char* name : {"run-out", "height", "peak speed"}) {
        const auto& row = j.at(name);
        const double value = row.at("value");
        const std::string unit = row.at("unit");
        if (row.contains("no_interval"))
            lines.push_back(fmt::format("{:<10} {:.4g} {}, no interval: {}", name, value, unit, row.at("no_interval").get<std::string>()));
        else
            lines.push_back(fmt::format("{:<10} {:.4g} +- {:.2g} {} (observed order {:.2f})", name, value,
                                        row.at("half_width").get<double>(), unit, row.at("order").get<double>()));
    }
    for (const auto& t : j.at("twins")) {
        if (t.contains("failed"))
            lines.push_back(
                fmt::format("the twin of {} times the spacing failed: {}", t.at("factor").get<int>(), t.at("failed").get<std::string>()));
        else
            for (const auto& note : t.at("notes"))
                lines.push_back(fmt::format("twin of {} times the spacing: {}", t.at("factor").get<int>(), note.get<std::string>()));
    }
    return lines;
}

} // namespace kuzure::study
