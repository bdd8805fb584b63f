#include "solver/scene/check.hpp"
#include "solver/core/field.hpp"
#include "solver/scene/at_rest.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/map_grid.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/nearby.hpp"
#include "solver/scene/numbers.hpp"
#include "solver/scene/shape.hpp"
#include <fmt/format.h>
#include <numbers>

namespace kuzure::scene {
namespace {

double degrees(double angle) { return angle * 180 / std::numbers::pi; }
const char* name_of(Cone cone)
{
    static constexpr const char* names[] = {"compression", "extension", "plane strain", "plane strain, no dilation", "shear"};
    return names[int(cone)];
}

/// Friction angle (rad) up to which a cone without cohesion bears no tensile principal stress.
double widest_angle_without_tension(Cone cone)
{
    const double limit = Material::widest_cone_without_tension();
    double low = 0, high = std::numbers::pi / 2;
    if (Material::slope(cone, high * (1 - 1e-12)) <= limit) return high;
    while (high - low > 1e-12) {
        const double middle = 0.5 * (low + high);
        (Material::slope(cone, middle) <= limit ? low : high) = middle;
    }
    return low;
}

/// Why a soil can bear a tensile principal stress, or empty if none can exist inside its cone.
std::string tension_in(const Soil& soil)
{
    const Material m = Material::from(soil);
    if (soil.cohesion > 0) return fmt::format("soil {} has cohesion: c = {:.6g} Pa", soil.name, soil.cohesion);
    // The common limit of all cones, with room for the rounding of the angle.
    if (m.alpha > Material::widest_cone_without_tension() * (1 + 1e-12))
        return fmt::format("soil {} has phi = {:.4g} deg > {:.1f} deg, where the {} cone reaches tensile principal stress", soil.name,
                           degrees(soil.friction_angle), degrees(widest_angle_without_tension(soil.cone)), name_of(soil.cone));
    return {};
}
std::string why_no_tension(const Scene& scene)
{
    double least = std::numbers::pi / 2;
    bool cohesion = false;
    for (const auto& soil : scene.soils) {
        least = std::min(least, widest_angle_without_tension(soil.cone));
        cohesion = cohesion || soil.cohesion > 0;
    }
    const std::string strength = cohesion ? "no tension beyond the cut-off" : "c = 0";
    if (least > 1.57) return strength + ": no tensile principal stress can exist inside the cone at any phi";
    return fmt::format("{} and phi < {:.1f} deg: no tensile principal stress can exist", strength, degrees(least));
}

/// Why the static part that stress diffusion takes out is not that of this scene, or empty.
std::string no_static_part(const Scene& scene)
{
    const auto& g = scene.effects.gravity;
    if (g && (g->x != 0 || g->y != 0)) return "gravity is not vertical, so the ground is not level";
    for (const auto& e : scene.events) {
        if (e.gravity || !e.shaking.file.empty()) return "gravity changes while the run goes on";
        if (!e.add.empty() || !e.remove.empty()) return "walls or bodies come or go, so the ground may not stay level";
    }
    if (scene.soils.size() > 1) return "there are several soils, between which stress jumps";
    for (const auto& body : scene.bodies)
        if (!std::holds_alternative<Box>(body.shape) && !std::holds_alternative<Cylinder>(body.shape))
            return "a body is no box or cylinder, so the ground may not be level";
    if (scene.effects.pore_pressure) return "effective stress under water does not grow with the soil's own weight";
    return {};
}

template <class... Args> std::string text(fmt::format_string<Args...> pattern, Args&&... args)
{
    return fmt::format(pattern, std::forward<Args>(args)...);
}

/// Collects issues by key.
struct Rules {
    Issues issues;
    void error(std::string key, std::string text, std::string other = {})
    {
        issues.push_back({Severity::Error, std::move(key), std::move(text), std::move(other)});
    }
    void warning(std::string key, std::string text, std::string other = {})
    {
        issues.push_back({Severity::Warning, std::move(key), std::move(text), std::move(other)});
    }
};

void check_soils(const Scene& scene, Rules& rules)
{
    for (std::size_t i = 0; i < scene.soils.size(); ++i) {
        const Soil& soil = scene.soils[i];
        const std::string key = "soil." + soil.name;
        const Material m = Material::from(soil);
        if (soil.cohesion == 0 && soil.friction_angle == 0)
            rules.error(key, "expected a soil with strength, found cohesion and friction_angle both 0; give one of them");
        if (soil.dilation_angle > soil.friction_angle)
            rules.error(key + ".dilation_angle", text("expected at most the friction angle, found {:.6g} deg > {:.6g} deg; with more, "
                                                      "plastic flow would create energy",
                                                      degrees(soil.dilation_angle), degrees(soil.friction_angle)));
        else if (soil.dilation_angle > 0)
            rules.warning(key + ".dilation_angle", "a constant dilation angle lets sheared soil swell "
                                                   "without end: read long run-outs with care");
        if (soil.tension_cutoff && m.alpha > 0 && 3 * *soil.tension_cutoff > m.k / m.alpha * (1 + 1e-12))
            rules.error(key + ".tension_cutoff", text("expected at most the cone's apex c cot(phi) = {:.6g} "
                                                      "Pa, found {:.6g} Pa; lower it or leave it out",
                                                      m.k / m.alpha / 3, *soil.tension_cutoff));
        if (soil.dilation_decay && soil.dilation_angle == 0)
            rules.warning(key + ".dilation_decay", "it changes nothing: dilation_angle is 0");
        if (const auto& s = soil.softening; s && (s->cohesion > soil.cohesion || s->friction_angle > soil.friction_angle))
            rules.error(key + ".softening", text("expected a residual strength of at most the first, found {:.6g} Pa and {:.6g} deg "
                                                 "against {:.6g} Pa and {:.6g} deg; lower it",
                                                 s->cohesion, degrees(s->friction_angle), soil.cohesion, degrees(soil.friction_angle)));
        if (const auto& r = soil.rate_friction) {
            if (soil.friction_angle == 0)
                rules.error(key + ".rate_friction", "expected a soil with a friction_angle above 0, which this law raises; give one");
            else if (r->friction_angle < soil.friction_angle)
                rules.error(key + ".rate_friction.friction_angle",
                            text("expected at least the friction angle at rest, found {:.6g} deg < {:.6g} deg; friction that falls with "
                                 "the rate of shear is unstable",
                                 degrees(r->friction_angle), degrees(soil.friction_angle)));
        }
        if (m.alpha == 0 && !soil.tension_cutoff)
            rules.warning(key, "without friction the cone has no apex, so the soil bears any mean tension; give a "
                               "tension_cutoff if it should not");
        if (soil.cone == Cone::Compression && scene.dimensions == 2 && m.alpha > 0)
            rules.warning(key + ".cone",
                          text("in plane strain the compression cone acts like a friction angle of {:.1f} deg on a rough bed "
                               "(atan 3 alpha) and {} instead of {:.4g}; the plane strain and shear cones are nearer",
                               degrees(m.angle_on_a_rough_bed()),
                               m.circle_is_limited()
                                   ? text("{:.1f} deg by its stress circle (asin 3 alpha)", degrees(m.angle_of_the_stress_circle()))
                                   : std::string("no limit by its stress circle (3 alpha >= 1)"),
                               degrees(soil.friction_angle)));
        if (std::none_of(scene.bodies.begin(), scene.bodies.end(), [&](const Body& b) { return b.soil == int(i); }))
            rules.warning(key, "no body is made of this soil");
    }
}

void check_shape(const Scene& scene, const Shape& shape, const std::string& key, Rules& rules)
{
    const bool flat = scene.dimensions == 2;
    if (flat && std::holds_alternative<Cylinder>(shape))
        rules.error(key + ".cylinder", "expected a box, sphere (a disc) or polygon in 2-D, found a cylinder; use dimensions = 3");
    if (const auto* p = std::get_if<Polygon>(&shape)) {
        const std::size_t most_corners = 10000;
        if (p->points.size() < 3) rules.error(key + ".polygon.points", text("expected at least 3 corners, found {}", p->points.size()));
        else if (p->points.size() > most_corners)
            rules.error(key + ".polygon.points",
                        text("expected at most {} corners, found {}; leave out some", most_corners, p->points.size()));
        else if (crosses_itself(*p))
            rules.error(key + ".polygon.points", "expected a polygon whose edges meet at their corners only, found one that crosses "
                                                 "or repeats itself; name the corners in order, the first not again at the end");
        if (!flat && !(p->y[0] < p->y[1]))
            rules.error(key + ".polygon.y",
                        p->y[0] == 0 && p->y[1] == 0
                            ? std::string("expected y = [from, to] in 3-D, found none; give the polygon's extent along y")
                            : text("expected y = [from, to] with from < to, found [{}, {}]; exchange them", p->y[0], p->y[1]));
    }
}

void check_space(const Scene& scene, Rules& rules)
{
    const Space& space = scene.space;
    const char* names = "xyz";
    const auto at = [](const Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
    const bool flat = scene.dimensions == 2;
    if (space.low.has_value() != space.high.has_value())
        rules.error(
            space.low ? "space.low" : "space.high",
            text("expected space.low and space.high together, found only space.{}; give both or neither", space.low ? "low" : "high"));
    if (space.low && space.high)
        for (int axis = 0; axis < 3; ++axis)
            if (!(flat && axis == 1) && !(at(*space.low, axis) < at(*space.high, axis)))
                rules.error("space.high", text("expected high above low along {}, found {} and {}; exchange them", names[axis],
                                               at(*space.low, axis), at(*space.high, axis)));
    if (flat && space.periodic[1])
        rules.error("space.periodic", "expected no periodic y in 2-D, which has no y; leave it out or use dimensions = 3");
    for (int axis = 0; axis < 3; ++axis) {
        if (!space.periodic[std::size_t(axis)] || (flat && axis == 1)) continue;
        if (!space.low || !space.high) {
            rules.error("space.periodic", text("expected space.low and space.high with periodic {}, found none; their "
                                               "distance is the period",
                                               names[axis]));
            continue;
        }
        const double period = at(*space.high, axis) - at(*space.low, axis), n = period / space.spacing;
        const double least = 2 * scene.support() * (1 + scene.accuracy.skin);
        if (!(period > 0)) continue;
        const double largest = std::max(std::abs(at(*space.low, axis)), std::abs(at(*space.high, axis)));
        if (std::abs(n - std::round(n)) > std::max(1e-6, rounding_of(largest) / space.spacing))
            rules.error("space.periodic", text("expected a period of whole spacings along {}, found {:.9g} spacings of {} m; "
                                               "change space.high",
                                               names[axis], n, space.spacing));
        if (period < least)
            rules.error("space.periodic", text("expected a period of at least {:.6g} m along {} (two supports and skin, so "
                                               "that no particle meets itself), found {:.6g} m; widen it",
                                               least, names[axis], period));
    }
    if (scene.accuracy.kernel == Kernel::CubicSpline && space.h > 1.25)
        rules.warning("space.h", text("with the cubic spline, soil at rest swings in rows of alternating velocity above h = 1.25 "
                                      "spacings, and pairs up above 1.5; found {}. Use 1.2, or a wendland kernel, which does neither",
                                      space.h));
}

void check_bodies(const Scene& scene, Rules& rules)
{
    const bool flat = scene.dimensions == 2;
    if (scene.bodies.empty()) rules.error("body", "expected at least one [[body]], found none");
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const Body& body = scene.bodies[b];
        const std::string key = text("body.{}", b);
        check_shape(scene, body.shape, key, rules);
        if (flat && body.velocity.y != 0)
            rules.error(key + ".velocity", text("expected no velocity along y in 2-D, found {}; set it to 0", body.velocity.y));
        if (rests(body)) {
            const auto& g = scene.effects.gravity;
            if (!g || !(g->z < 0))
                rules.error(key + ".stress",
                            text("expected gravity that points down for a stress \"at rest\", found {}; let effects.gravity "
                                 "be [0, 0, -9.81] or the stress \"none\"",
                                 g ? text("[{}, {}, {}]", g->x, g->y, g->z) : std::string("none")));
        }
    }
    for (std::size_t w = 0; w < scene.walls.size(); ++w) {
        const std::string key = text("wall.{}", w);
        const Shape& shape = scene.walls[w].shape;
        check_shape(scene, shape, key, rules);
        if (std::holds_alternative<Ground>(shape)) continue; // as deep as soil can feel it
        const Box box = bounds(shape);
        double thickness = std::min(box.high.x - box.low.x, box.high.z - box.low.z);
        if (!flat) thickness = std::min(thickness, box.high.y - box.low.y);
        if (thickness < scene.support() * (1 - 1e-9))
            rules.warning(key, text("the wall is {:.6g} m thick, thinner than the support of {:.6g} m: soil at its face feels "
                                    "only a part of it; make it {} spacings thick",
                                    thickness, scene.support(), int(std::ceil(2 * scene.space.h - 1e-9))));
    }
}

void check_effects(const Scene& scene, Rules& rules)
{
    const Effects& effects = scene.effects;
    if (scene.dimensions == 2 && effects.gravity && effects.gravity->y != 0)
        rules.error("effects.gravity", text("expected no gravity along y in 2-D, found {}; set it to 0", effects.gravity->y));
    if (const auto& water = effects.pore_pressure) {
        const auto& g = effects.gravity;
        if (!g || !(g->z < 0) || g->x != 0 || g->y != 0)
            rules.error("effects.pore_pressure", "expected gravity along -z with still water; let effects.gravity be [0, 0, -9.81]");
        if (water->table.empty())
            rules.error("effects.pore_pressure.table", "expected at least one corner [x, z], found none; one is a level table");
        for (std::size_t k = 1; k < water->table.size(); ++k)
            if (!(water->table[k - 1][0] < water->table[k][0]))
                rules.error("effects.pore_pressure.table", text("expected corners with increasing x, found {} after {}; reorder them",
                                                                water->table[k][0], water->table[k - 1][0]));
    }
    if (effects.stress_diffusion && effects.stress_diffusion_decision == Decision::AsWritten)
        if (const auto reason = no_static_part(scene); !reason.empty())
            rules.warning("effects.stress_diffusion", "it smooths what should not be smooth: " + reason);
    if (effects.damping && effects.damping->until > scene.time.end)
        rules.warning("effects.damping.until",
                      text("damping lasts beyond the end of the run ({} s > {} s)", effects.damping->until, scene.time.end));
    if (effects.artificial_stress && effects.artificial_stress_decision == Decision::AsWritten &&
        std::all_of(scene.soils.begin(), scene.soils.end(), [](const Soil& s) { return tension_in(s).empty(); }))
        rules.warning("effects.artificial_stress", "it is asked for and costs time, but " + why_no_tension(scene));
}

/// Numbers that are allowed but hardly ever meant: nearly always a unit, a factor of 1e3 or radians.
void check_plausible(const Scene& scene, Rules& rules)
{
    const auto angle_in_radians = [&](const std::string& key, double angle) {
        if (angle > 0 && degrees(angle) < 2)
            rules.warning(key, text("{:.4g} deg is nearly no friction: angles are in degrees (is it {:.4g} deg?)", degrees(angle),
                                    degrees(degrees(angle))));
    };
    for (const auto& soil : scene.soils) {
        const std::string key = "soil." + soil.name;
        const double c_p = Material::from(soil).c_p, rho = soil.density;
        // Below and above, squares and steps leave the range of double precision.
        if (!(c_p > 1e-6 && c_p < 1e12)) {
            rules.error(key + ".young", text("expected a P-wave speed between 1e-6 and 1e12 m/s, found {:.3g} m/s from young = {:.6g} Pa "
                                             "and density = {:.6g} kg/m^3; correct them",
                                             c_p, soil.young, rho));
        } else if (rho < 100 || rho > 20000) {
            const double factor = rho < 100 ? 1000 : 0.001;
            rules.warning(key + ".density",
                          text("{:.6g} kg/m^3 is no soil's density (100 .. 20000): is it in other units?{}", rho,
                               rho * factor >= 100 && rho * factor <= 20000 ? text(" Then write {:.6g}", rho * factor) : std::string()));
        } else if (c_p < 3 || c_p > 10000) {
            rules.warning(key + ".young", text("with {:.6g} Pa the P-wave runs at {:.3g} m/s, in soils and rocks at 30 .. 6000 m/s: young "
                                               "is in Pa (1 MPa = 1e6, 1 kPa = 1e3)",
                                               soil.young, c_p));
        }
        if (soil.cohesion > 0.1 * soil.young)
            rules.warning(key + ".cohesion", text("{:.6g} Pa is more than a tenth of young = {:.6g} Pa, where soils fail at strains of "
                                                  "a percent: both are in Pa",
                                                  soil.cohesion, soil.young));
        if (soil.poisson > 0.49)
            rules.warning(key + ".poisson", text("at {:.6g} the soil is nearly incompressible: its bulk modulus is {:.0f} times the "
                                                 "shear modulus and shortens the step as its root; 0.49 is enough for undrained clay",
                                                 soil.poisson, 2 * (1 + soil.poisson) / (3 * (1 - 2 * soil.poisson))));
        angle_in_radians(key + ".friction_angle", soil.friction_angle);
        if (const auto& w = soil.softening; w && w->slip < 1e-4 * scene.support())
            rules.warning(key + ".softening.slip", text("a slip of {:.4g} m is nothing against the width of a shear band here, {:.4g} m: "
                                                        "strength is lost at once; it is in m",
                                                        w->slip, scene.support()));
        if (const auto& r = soil.rate_friction; r && r->grain > 2 * scene.space.spacing)
            rules.warning(key + ".rate_friction.grain",
                          text("grains of {:.4g} m are larger than the particles they make up, {:.4g} m apart: it is in m", r->grain,
                               scene.space.spacing));
    }
    for (std::size_t w = 0; w < scene.walls.size(); ++w)
        if (scene.walls[w].surface == Surface::Coulomb)
            angle_in_radians(text("wall.{}.surface.friction_angle", w), scene.walls[w].friction_angle);

    const Effects& effects = scene.effects;
    const bool all_rest = std::all_of(scene.bodies.begin(), scene.bodies.end(), [](const Body& b) { return length(b.velocity) == 0; });
    if (const auto& g = effects.gravity; g && length(*g) > 0) {
        if (g->z > 0) rules.warning("effects.gravity", text("it points up ({} m/s^2 along z, which is up): write a minus", g->z));
        if (length(*g) > 3000)
            rules.warning("effects.gravity", text("{:.4g} m/s^2 is more than any centrifuge reaches: it is in m/s^2", length(*g)));
        if (scene.walls.empty() && !(scene.space.periodic[2] && g->z != 0))
            rules.warning("wall", "there is gravity and no wall: all soil falls without end; write a [[wall]] below it");
    } else if (all_rest) {
        rules.warning("effects.gravity", "there is no gravity and every body rests: nothing will move; write gravity = [0.0, 0.0, -9.81]");
    }
    if (const auto& water = effects.pore_pressure; water && (water->density < 500 || water->density > 3000))
        rules.warning("effects.pore_pressure.density", text("{:.6g} kg/m^3 is no water's density: water has 1000", water->density));

    const double step = step_at_rest(scene), steps = scene.time.end / step;
    if (steps > 1e8)
        rules.warning("time.end", text("{:.3g} s are {:.3g} steps of {:.3g} s: times are in seconds", scene.time.end, steps, step));
    const auto interval = [&](const char* key, const std::optional<double>& every, const char* what) {
        if (every && *every > scene.time.end)
            rules.warning(key, text("{:.6g} s is longer than the run ({:.6g} s): only the first and the last {} are written", *every,
                                    scene.time.end, what));
        else if (every && *every < 0.999 * step)
            rules.warning(
                key, text("{:.3g} s is shorter than a step ({:.3g} s): every step writes a {}, {:.3g} of them", *every, step, what, steps));
    };
    interval("output.every", scene.output.every, "snapshot");
    if (const auto& p = scene.output.picture; p && p->range != std::array<double, 2>{} && !(p->range[0] < p->range[1]))
        rules.error("output.picture.range", text("expected [least, largest], found [{}, {}]; exchange them", p->range[0], p->range[1]));
    if (scene.output.movie && !scene.output.picture)
        rules.error("output.movie", "a film is made of pictures, and there are none; add picture = {} to [output]");
    interval("output.history", scene.output.history, "row");
}

void check_maps(const Scene& scene, const Filling& filling, Rules& rules)
{
    const auto& maps = scene.maps;
    if (!maps) return;
    if (maps->cell < scene.space.spacing * (1 - 1e-9))
        rules.warning("maps.cell",
                      text("cells of {:.4g} m are narrower than a particle ({:.4g} m): between particles they stay empty; take "
                           "two spacings or more",
                           maps->cell, scene.space.spacing));
    for (std::size_t k = 0; k < maps->limits.size(); ++k)
        if (std::find(maps->limits.begin(), maps->limits.begin() + std::ptrdiff_t(k), maps->limits[k]) !=
            maps->limits.begin() + std::ptrdiff_t(k))
            rules.error("maps.limits", text("expected each limit once, found {} again; leave it out", maps->limits[k]));
    const MapGrid grid = map_grid(scene, filling);
    if (const double cells = double(grid.columns) * double(grid.rows); cells > most_map_cells)
        rules.error("maps.cell",
                    text("expected at most {:.3g} cells over all walls and soil, found {:.3g} of {:.4g} m; let maps.cell be {:.2g} "
                         "or more",
                         most_map_cells, cells, maps->cell, 1.05 * maps->cell * std::sqrt(cells / most_map_cells)));
}

void check_time(const Scene& scene, StepLimit limit, Rules& rules)
{
    const auto severity = limit == StepLimit::Enforce ? Severity::Error : Severity::Warning;
    if (const auto step = scene.time.step) {
        if (std::round(scene.time.end / *step) < 1)
            rules.error("time.step", text("expected a step of at most time.end = {} s, found {} s", scene.time.end, *step));
        else if (scene.time.end / *step > 1e12)
            rules.error("time.step", text("expected fewer than 1e12 steps, found {:.3g}; is the step in seconds?", scene.time.end / *step));
        if (*step > stable_step(scene))
            rules.issues.push_back({severity,
                                    "time.step",
                                    text("expected a step below the stable limit {:.4g} s ({:.3g} h/c_p), found {:.4g} s; use "
                                         "{:.4g} s or less, or leave the key out",
                                         stable_step(scene), unstable_courant(scene), *step, recommended_step(scene)),
                                    {}});
        else if (*step > recommended_step(scene))
            rules.warning("time.step", text("the step {:.4g} s is stable but above the recommended {:.4g} s ({:.3g} h/c_p)", *step,
                                            recommended_step(scene), recommended_courant(scene)));
    } else if (const double steps = scene.time.end / (scene.accuracy.cfl * crossing_time(scene)); steps > 1e12) {
        rules.error("time.end",
                    text("expected fewer than 1e12 steps, found {:.3g} of {:.3g} s; is time.end in seconds, and young in Pa? Or "
                         "is accuracy.cfl too small",
                         steps, scene.accuracy.cfl * crossing_time(scene)));
    } else if (scene.accuracy.cfl > unstable_courant(scene)) {
        rules.issues.push_back({severity,
                                "accuracy.cfl",
                                text("expected a number below the stable limit {:.3g}, found {}; use {:.3g} or less",
                                     unstable_courant(scene), scene.accuracy.cfl, recommended_courant(scene)),
                                {}});
    } else if (scene.accuracy.cfl > recommended_courant(scene)) {
        rules.warning("accuracy.cfl",
                      text("{} is stable but above the recommended {:.3g}", scene.accuracy.cfl, recommended_courant(scene)));
    }
    if (scene.accuracy.sleep_below > 0 && sleep_interval(scene) < 3)
        rules.warning("accuracy.sleep_below",
                      "nothing will sleep: in steps this long a P-wave crosses half a support; 0, or a smaller step");
}

/// The soils, effects and steps of every stage obey the rules of a start.
void check_stages(const Scene& scene, StepLimit limit, Rules& rules)
{
    const auto order = order_of_events(scene);
    for (std::size_t k = 0; k < order.size(); ++k) {
        const Event& e = scene.events[std::size_t(order[k])];
        const Scene stage = stage_of(scene, int(k) + 1, end_of(e));
        Rules then;
        check_soils(stage, then);
        check_effects(stage, then);
        check_time(stage, limit, then);
        for (const auto& issue : then.issues)
            if (issue.severity == Severity::Error)
                rules.error(text("event.{}", order[k]),
                            text("{} ({}): {}: {}", time_in_words(e), in_words(scene, e), issue.key, issue.text));
    }
    if (!scene.events.empty() && scene.accuracy.scheme == Scheme::LeapFrog &&
        std::ranges::any_of(scene.walls, [](const Wall& w) { return !w.name.empty(); }))
        rules.warning("wall", "the leap-frog scheme does not tell the force on each wall: there will be no forces.csv");
}

void check_inside(const Scene& scene, Rules& rules)
{
    const Space& space = scene.space;
    if (!space.low || !space.high) return;
    const auto at = [](const Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
    const auto outside = [&](const Shape& shape, const std::string& key, bool only_periodic) {
        const Box box = bounds(shape);
        for (int axis = 0; axis < 3; ++axis) {
            if ((axis == 1 && scene.dimensions == 2) || (only_periodic && !space.periodic[std::size_t(axis)])) continue;
            const double low = at(*space.low, axis), high = at(*space.high, axis),
                         slack = std::max(1e-6 * space.spacing, rounding_of(std::max(std::abs(low), std::abs(high))));
            if (at(box.low, axis) < low - slack || at(box.high, axis) > high + slack)
                return rules.error(key,
                                   text("expected it inside space.low .. space.high = {:.6g} .. {:.6g} m along {}, found {:.6g} "
                                        ".. {:.6g} m; move it or widen the space",
                                        low, high, "xyz"[axis], at(box.low, axis), at(box.high, axis)),
                                   "space.low");
        }
    };
    for (std::size_t b = 0; b < scene.bodies.size(); ++b)
        outside(scene.bodies[b].shape, text("body.{}.{}", b, name_of(scene.bodies[b].shape)), false);
    for (std::size_t w = 0; w < scene.walls.size(); ++w)
        outside(scene.walls[w].shape, text("wall.{}.{}", w, name_of(scene.walls[w].shape)), true);
}

} // namespace

double step_at_rest(const Scene& scene) { return scene.time.step.value_or(scene.accuracy.cfl * crossing_time(scene)); }
double crossing_time(const Scene& scene)
{
    double least = std::numeric_limits<double>::infinity();
    for (const auto& soil : scene.soils) least = std::min(least, scene.smoothing_length() / Material::from(soil).c_p);
    return least;
}
double courant_limit(const Scene& scene)
{
    if (scene.accuracy.scheme == Scheme::LeapFrog) return 0.6;
    // Staggered: a lattice wave has omega = c_p |q(k)|, q = sum_j V grad W sin(k.x_j), and half of the viscous operator acts on it:
    // stable for (omega dt)^2 + 2 (nu + d) dt < 4, nu h/c_p = 0.45 alpha on every lattice looked at, and d(k) of the stress diffusion,
    // which is largest where neighbours alternate and q vanishes.
    const double dx = scene.space.spacing, h = scene.smoothing_length(), pi = std::numbers::pi;
    const auto slope = [&](double r) { // -dW/dr but for a factor, which the long wave gives: q -> k
        const double q = r / h;
        switch (scene.accuracy.kernel) {
        case Kernel::CubicSpline:
            return q < 1 ? 3 * q - 2.25 * q * q : 0.75 * (2 - q) * (2 - q);
        case Kernel::WendlandC2:
            return 5 * q * std::pow(1 - q / 2, 3);
        default:
            return 14.0 / 3 * q * std::pow(1 - q / 2, 5) * (1 + 2.5 * q);
        }
    };
    const int n = int(std::ceil(2 * scene.space.h)), across = scene.dimensions == 3 ? n : 0;
    const double nu = 0.45 * (scene.effects.viscosity ? scene.effects.viscosity->alpha : 0);
    double diffusion = 0; // 2 zeta c/c_p, c = sqrt(E/rho)
    if (scene.effects.stress_diffusion)
        for (const auto& soil : scene.soils)
            diffusion = std::max(diffusion, 2 * scene.effects.stress_diffusion->zeta * std::sqrt(soil.young / soil.density) /
                                                Material::from(soil).c_p);
    double limit = std::numeric_limits<double>::infinity();
    for (const Vector way : {Vector{1, 0, 0}, Vector{1, 0, 1}, Vector{1, 1, 1}}) {
        if (scene.dimensions == 2 && way.y != 0) continue;
        const Vector unit = (1 / length(way)) * way;
        struct Symbol {
            double wave = 0, diffusion = 0;
        };
        const auto symbol = [&](double k) {
            Symbol q;
            for (int a = -n; a <= n; ++a)
                for (int b = -across; b <= across; ++b)
                    for (int c = -n; c <= n; ++c) {
                        const Vector x{a * dx, b * dx, c * dx};
                        const double r = length(x), along = dot(x, unit);
                        if (r == 0 || r >= 2 * h) continue;
                        q.wave += slope(r) * along / r * std::sin(k * along);
                        q.diffusion += slope(r) * r / (r * r + 0.01 * h * h) * (1 - std::cos(k * along));
                    }
            return q;
        };
        const double tiny = 1e-4 / dx, scale = tiny / symbol(tiny).wave;
        for (int k = 1; k <= 64; ++k) {
            const Symbol q = symbol(k * length(way) * pi / (64 * dx));
            const double kappa = scale * h * q.wave, damped = nu + scale * h * h * diffusion * q.diffusion;
            limit = std::min(limit, 4 / (std::sqrt(damped * damped + 4 * kappa * kappa) + damped));
        }
    }
    // Corrected gradients are larger at free surfaces than those of the lattice: an elastic bar stood 0.84 of its limit (0.80 at alpha =
    // 1).
    return scene.accuracy.correction == Correction::Gradient ? 0.85 * limit : limit;
}
double unstable_courant(const Scene& scene) { return scene.accuracy.scheme == Scheme::LeapFrog ? 0.6 : 0.93 * courant_limit(scene); }
double recommended_courant(const Scene& scene) { return scene.accuracy.scheme == Scheme::LeapFrog ? 0.3 : 0.8 * courant_limit(scene); }
double recommended_step(const Scene& scene) { return recommended_courant(scene) * crossing_time(scene); }
std::int64_t sleep_interval(const Scene& scene)
{
    // n steps after all particles were checked for calm, the first neighbours may have changed: n dt c_p <= 2 h
    const double courant = scene.time.step ? *scene.time.step / crossing_time(scene) : scene.accuracy.cfl;
    return 1 + std::int64_t(std::min(2 / courant, 1e6));
}
double stable_step(const Scene& scene) { return unstable_courant(scene) * crossing_time(scene); }

void resolve(Scene& scene)
{
    if (auto& maps = scene.maps) {
        if (maps->cell == 0) maps->cell = 2 * scene.space.spacing;
        if (maps->wet == 0) maps->wet = scene.space.spacing;
    }
    resolve_presence(scene);
    auto& notes = scene.notes;
    notes.clear();
    const auto note = [&](const char* name, bool on, std::string why) { notes.push_back({name, std::move(why), on}); };
    Effects& effects = scene.effects;
    const std::string unwritten = "not in the scene";

    if (const auto& g = effects.gravity) note("gravity", true, text("[{:.6g}, {:.6g}, {:.6g}] m/s^2", g->x, g->y, g->z));
    else note("gravity", false, unwritten);

    if (const auto& v = effects.viscosity)
        note("viscosity", true, text("alpha = {:.6g}, beta = {:.6g} against c_p: damps shocks and zero-energy modes", v->alpha, v->beta));
    else note("viscosity", false, unwritten);

    std::string tension;
    for (const auto& soil : scene.soils)
        if (tension.empty()) tension = tension_in(soil);
    for (std::size_t k = 1; k <= scene.events.size() && tension.empty(); ++k)
        for (const auto& soil : stage_of(scene, int(k), std::numeric_limits<double>::infinity()).soils)
            if (tension.empty() && !tension_in(soil).empty()) tension = "after an event " + tension_in(soil);
    const bool automatic = effects.artificial_stress_decision == Decision::Auto;
    if (automatic) {
        effects.artificial_stress.reset();
        if (!tension.empty()) effects.artificial_stress = ArtificialStress{};
    }
    if (const auto& a = effects.artificial_stress)
        note("artificial_stress", true,
             text("epsilon = {:.6g}, exponent = {:.6g}: {}", a->epsilon, a->exponent,
                  automatic ? tension + ", so tensile instability is possible" : "as written in the scene"));
    else note("artificial_stress", false, automatic ? why_no_tension(scene) : unwritten);

    const bool smoothing = effects.stress_diffusion_decision == Decision::Auto;
    const std::string reason = no_static_part(scene);
    if (smoothing) {
        effects.stress_diffusion.reset();
        if (reason.empty()) effects.stress_diffusion = StressDiffusion{};
    }
    if (const auto& d = effects.stress_diffusion)
        note("stress_diffusion", true,
             text("zeta = {:.6g}: {}", d->zeta,
                  smoothing ? "one soil on level ground, noise of the spacing's length can be told from stress"
                            : "as written in the scene"));
    else note("stress_diffusion", false, smoothing ? reason : unwritten);

    if (const auto& w = effects.pore_pressure)
        note("pore_pressure", true,
             text("still water of {:.6g} kg/m^3 below a table of {} corners; stresses are effective", w->density, w->table.size()));
    else note("pore_pressure", false, unwritten);

    note("gradient_correction", scene.accuracy.correction == Correction::Gradient,
         scene.accuracy.correction == Correction::Gradient
             ? "velocity gradients exact for linear fields; stress power no longer that of the pair forces"
             : "accuracy.correction = \"none\"");

    note("sleep", scene.accuracy.sleep_below > 0,
         scene.accuracy.sleep_below > 0 ? text("soil slower than {:.3g} m/s among soil as slow keeps its state, looked at every {} steps",
                                               scene.accuracy.sleep_below, sleep_interval(scene))
                                        : "accuracy.sleep_below = 0");

    if (const auto& d = effects.damping) note("damping", true, text("{:.6g} of critical until t = {:.6g} s", d->ratio, d->until));
    else note("damping", false, unwritten);

    const auto list_soils = [&](auto wanted) {
        std::string names;
        for (const auto& soil : scene.soils)
            if (wanted(soil)) names += (names.empty() ? "" : ", ") + soil.name;
        return names;
    };
    const auto dilating = list_soils([](const Soil& s) { return s.dilation_angle > 0; });
    note("dilation", !dilating.empty(), dilating.empty() ? "psi = 0: plastic flow keeps the volume" : "psi > 0 in " + dilating);
    const auto cut = list_soils([](const Soil& s) { return s.tension_cutoff.has_value(); });
    note("tension_cutoff", !cut.empty(), cut.empty() ? "mean tension is limited by the cone's apex only" : "written for " + cut);

    const auto decaying = list_soils([](const Soil& s) { return s.dilation_decay.has_value() && s.dilation_angle > 0; });
    note("dilation_decay", !decaying.empty(), decaying.empty() ? unwritten : "dilation dies out in " + decaying);
    const auto weak = list_soils([](const Soil& s) { return s.softening.has_value(); });
    note("softening", !weak.empty(),
         weak.empty() ? unwritten : text("{}: residual strength after a slip, bands taken {:.4g} m wide", weak, scene.support()));
    const auto fast = list_soils([](const Soil& s) { return s.rate_friction.has_value(); });
    note("rate_friction", !fast.empty(), fast.empty() ? unwritten : "mu(I) in " + fast);

    for (const int k : order_of_events(scene)) {
        const Event& e = scene.events[std::size_t(k)];
        note("event", true, text("{}: {}", time_in_words(e), in_words(scene, e)));
    }

    const auto resting = std::count_if(scene.bodies.begin(), scene.bodies.end(), rests);
    note("stress_at_rest", resting > 0,
         resting ? text("{} of {} bodies start with K0 stress under their own weight", resting, scene.bodies.size())
                 : "every body starts without stress: gravity acts suddenly");

    const auto walls_with = [&](Surface surface) {
        return std::count_if(scene.walls.begin(), scene.walls.end(), [&](const Wall& w) { return w.surface == surface; });
    };
    const auto wall_note = [&](const char* name, Surface surface, const char* meaning) {
        const auto n = walls_with(surface);
        note(name, n > 0, n ? text("{} of {} walls: {}", n, scene.walls.size(), meaning) : "no such wall in the scene");
    };
    wall_note("rough_walls", Surface::Rough, "no slip");
    wall_note("smooth_walls", Surface::Smooth, "free slip");
    wall_note("coulomb_walls", Surface::Coulomb, "shear limited by friction");

    std::string periodic;
    for (int axis = 0; axis < 3; ++axis)
        if (scene.space.periodic[std::size_t(axis)]) periodic += (periodic.empty() ? "" : ", ") + std::string(1, "xyz"[axis]);
    note("periodic", !periodic.empty(), periodic.empty() ? unwritten : "along " + periodic);
    note("mixed_precision", scene.accuracy.precision == Precision::Mixed,
         scene.accuracy.precision == Precision::Mixed ? "pair sums in single, state in double precision"
                                                      : "everything in double precision");
}

namespace {

/// Soil that stands where its floor ends and no wall holds it: what runs over the edge falls without end.
void check_edges(const Scene& scene, Rules& rules)
{
    if (!scene.effects.gravity || !(scene.effects.gravity->z < 0) || scene.walls.empty()) return;
    const double dx = scene.space.spacing, reach = scene.support();
    const bool flat = scene.dimensions == 2;
    const Nearby walls = nearby(scene.walls, scene.dimensions), bodies = nearby(scene.bodies, scene.dimensions);
    const auto in_wall = [&](Vector x) {
        return walls.any(x, [&](std::size_t w) { return signed_distance(scene.walls[w].shape, x, scene.dimensions) <= 0; });
    };
    const auto in_body = [&](Vector x) {
        return bodies.any(x, [&](std::size_t k) { return contains(scene.bodies[k].shape, x, scene.dimensions); });
    };
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (std::holds_alternative<Release>(scene.bodies[b].shape)) continue; // its rim is the ground's
        const Box body = bounds(scene.bodies[b].shape);
        const double floor = body.low.z - 0.5 * dx, foot = body.low.z + 0.5 * dx;
        std::string sides;
        for (const int axis : {0, 1})
            for (const bool high : {false, true}) {
                if ((axis == 1 && flat) || scene.space.periodic[std::size_t(axis)]) continue;
                const double low_end = axis == 0 ? body.low.x : body.low.y, high_end = axis == 0 ? body.high.x : body.high.y;
                const double edge = high ? high_end : low_end, out = high ? 1 : -1;
                const auto at = [&](double beyond, double along, double z) {
                    const double x = edge + out * beyond;
                    return axis == 0 ? Vector{x, body.low.y + along * (body.high.y - body.low.y), z}
                                     : Vector{body.low.x + along * (body.high.x - body.low.x), x, z};
                };
                bool open = false;
                for (const double along : {0.5, 0.25, 0.75}) {
                    if (!in_wall(at(-0.5 * dx, along, floor)) || in_wall(at(reach, along, floor))) continue;
                    bool held = false;
                    for (double beyond = 0.5 * dx; beyond <= reach && !held; beyond += 0.5 * dx) {
                        const Vector x = at(beyond, along, foot);
                        held = in_wall(x) || in_body(x);
                    }
                    open = open || !held;
                }
                if (open) sides += fmt::format("{}{} {}", sides.empty() ? "" : ", ", high ? "high" : "low", axis == 0 ? "x" : "y");
            }
        if (!sides.empty())
            rules.warning(text("body.{}", b), text("the soil stands at an open edge of its floor (at {}): what runs over it falls without "
                                                   "end; make the floor wider, or stand a wall there",
                                                   sides));
    }
}

} // namespace

Issues check(const Scene& scene, StepLimit limit)
{
    Issues issues;
    check_and_fill(scene, limit, issues);
    return issues;
}

std::optional<CheckedScene> check_and_fill(Scene scene, StepLimit limit, Issues& issues)
{
    Rules rules;
    check_space(scene, rules);
    check_names_and_events(scene, rules.issues);
    check_soils(scene, rules);
    check_bodies(scene, rules);
    check_effects(scene, rules);
    check_time(scene, limit, rules);
    check_plausible(scene, rules);
    check_inside(scene, rules);
    if (std::none_of(rules.issues.begin(), rules.issues.end(), [](const Issue& i) { return i.severity == Severity::Error; }))
        check_stages(scene, limit, rules);
    if (scene.maps && scene.dimensions == 2)
        rules.error("maps",
                    "expected dimensions = 3 with [maps], which are drawn in plan, found 2; use dimensions = 3 or leave [maps] out");
    // Filling asks for shapes that make sense.
    std::optional<Filling> filling;
    if (std::none_of(rules.issues.begin(), rules.issues.end(), [](const Issue& i) { return i.severity == Severity::Error; })) {
        Issues problems;
        filling = Filling::of(scene, problems);
        for (auto& issue : problems) rules.issues.push_back(std::move(issue));
    }
    if (filling) {
        check_edges(scene, rules);
        check_maps(scene, *filling, rules);
        for (auto& n : dimensionless_numbers(scene, *filling))
            if (!n.warning.empty()) rules.warning(n.name, n.warning);
        for (std::size_t k = 0; k < scene.probes.size(); ++k)
            if (const auto& p = scene.probes[k].particle; p && *p >= filling->soil_count())
                rules.error(text("probe.{}.particle", k),
                            text("expected a particle of soil, an id from 0 to {}, found {}", filling->soil_count() - 1, *p));
        for (std::size_t b = 0; b < scene.bodies.size(); ++b)
            if (const double excess = excess_of_mass(scene, *filling, int(b)); std::abs(excess) > most_excess + 1e-9)
                rules.warning(text("body.{}.{}", b, name_of(scene.bodies[b].shape)),
                              text("its particles hold {:.2g} % {} mass than its volume would: lattice points and faces do not fit; a "
                                   "smaller space.spacing, or faces moved by part of one, come nearer",
                                   100 * std::abs(excess), excess > 0 ? "more" : "less"));
        if (const auto why = scene.start.from.empty() ? no_closed_form(scene, *filling) : std::string(); !why.empty())
            scene.notes.push_back(
                {"settling",
                 text("the stress \"at rest\" is no closed form: {}; the soil settles under damping before t = 0, about {:.0f} steps", why,
                      steps_to_settle(scene, *filling)),
                 true});
        if (!scene.start.from.empty()) scene.notes.push_back({"start", "from the last state of " + scene.start.from, true});
        const double height = filling->soil_height();
        if (scene.output.grain && *scene.output.grain > height)
            rules.warning("output.grain",
                          text("no column of soil is {:.4g} m high, all of it {:.4g} m: fronts in history.csv will be empty",
                               *scene.output.grain, height));
    }
    issues = rules.issues;
    if (!filling || std::ranges::any_of(rules.issues, [](const Issue& i) { return i.severity == Severity::Error; })) return {};
    return CheckedScene{std::move(scene), std::move(rules.issues), std::move(*filling)};
}

double excess_of_mass(const Scene& scene, const Filling& filling, int body)
{
    const double held = double(filling.body_count(body)) * scene.particle_volume();
    return held / volume(scene.bodies[std::size_t(body)].shape, scene.dimensions) - 1;
}

double column_bytes(const Scene& scene, const Filling& filling)
{
    const bool leap_frog = scene.accuracy.scheme == Scheme::LeapFrog;
    const bool coulomb = std::ranges::any_of(scene.walls, [](const Wall& w) { return w.surface == Surface::Coulomb; });
    const bool remembers = std::ranges::any_of(scene.soils, [](const Soil& s) { return s.opened_volume == OpenedVolume::Kept; });
    const auto carried = [&]<class F>(F) {
        const auto is = [](auto... f) { return (std::is_same_v<F, std::remove_const_t<decltype(f)>> || ...); };
        if (is(field::half_velocity, field::half_density, field::half_stress)) return leap_frog;
        if (is(field::acceleration)) return !leap_frog;
        if (is(field::stress_rate)) return !leap_frog && scene.effects.stress_diffusion.has_value();
        if (is(field::wall_slip, field::wall_pressure, field::wall_friction)) return !leap_frog && coulomb;
        if (is(field::wall_force)) return !leap_frog && std::ranges::any_of(scene.walls, [](const Wall& w) { return !w.name.empty(); });
        if (is(field::opened_volume)) return remembers;
        if (is(field::activity)) return scene.accuracy.sleep_below > 0;
        return true;
    };
    double bytes = 0;
    std::apply([&](auto... f) { ((bytes += carried(f) ? double(sizeof(typename decltype(f)::Number)) * f.components : 0), ...); },
               AllFields{});
    return bytes * double(filling.soil_count());
}

} // namespace kuzure::scene
