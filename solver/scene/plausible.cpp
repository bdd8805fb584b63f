// Numbers that are allowed but hardly ever meant.
#include "solver/scene/material.hpp"
#include "solver/scene/rules.hpp"
#include "solver/scene/step_limits.hpp"
#include <algorithm>

namespace kuzure::scene {

namespace {

void check_radians(const std::string& key, double angle, Rules& rules)
{
    if (angle > 0 && degrees(angle) < 2)
        rules.warning(key, text("{:.4g} deg is nearly no friction: angles are in degrees (is it {:.4g} deg?)", degrees(angle),
                                degrees(degrees(angle))));
}

void check_soil(const Scene& scene, const Soil& soil, Rules& rules)
{
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
    check_radians(key + ".friction_angle", soil.friction_angle, rules);
    if (const auto& w = soil.softening; w && w->slip < 1e-4 * scene.support())
        rules.warning(key + ".softening.slip", text("a slip of {:.4g} m is nothing against the width of a shear band here, {:.4g} m: "
                                                    "strength is lost at once; it is in m",
                                                    w->slip, scene.support()));
    if (const auto& r = soil.rate_friction; r && r->grain > 2 * scene.space.spacing)
        rules.warning(key + ".rate_friction.grain",
                      text("grains of {:.4g} m are larger than the particles they make up, {:.4g} m apart: it is in m", r->grain,
                           scene.space.spacing));
}

/// Something other than gravity moves the soil: a load, a wall that moves, gravity or shaking that comes later.
bool pushed(const Scene& scene)
{
    const auto moves = [](const Event& e) { return e.move || e.shaking.rows || (e.gravity && length(*e.gravity) > 0); };
    return !scene.loads.empty() || std::any_of(scene.events.begin(), scene.events.end(), moves);
}

void check_forces(const Scene& scene, Rules& rules)
{
    const Effects& effects = scene.effects;
    const bool all_rest = std::all_of(scene.bodies.begin(), scene.bodies.end(), [](const Body& b) { return length(b.velocity) == 0; });
    if (const auto& g = effects.gravity; g && length(*g) > 0) {
        if (g->z > 0) rules.warning("effects.gravity", text("it points up ({} m/s^2 along z, which is up): write a minus", g->z));
        if (length(*g) > 3000)
            rules.warning("effects.gravity", text("{:.4g} m/s^2 is more than any centrifuge reaches: it is in m/s^2", length(*g)));
        if (scene.walls.empty() && !(scene.space.periodic[2] && g->z != 0))
            rules.warning("wall", "there is gravity and no wall: all soil falls without end; write a [[wall]] below it");
    } else if (all_rest && !pushed(scene)) {
        rules.warning("effects.gravity", "there is no gravity and every body rests: nothing will move; write gravity = [0.0, 0.0, -9.81]");
    }
    if (const auto& water = effects.pore_pressure; water && (water->density < 500 || water->density > 3000))
        rules.warning("effects.pore_pressure.density", text("{:.6g} kg/m^3 is no water's density: water has 1000", water->density));
}

void check_times(const Scene& scene, Rules& rules)
{
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

} // namespace

void check_plausible(const Scene& scene, Rules& rules)
{
    for (const auto& soil : scene.soils) check_soil(scene, soil, rules);
    for (std::size_t w = 0; w < scene.walls.size(); ++w)
        if (scene.walls[w].surface == Surface::Coulomb)
            check_radians(text("wall.{}.surface.friction_angle", w), scene.walls[w].friction_angle, rules);
    check_forces(scene, rules);
    check_times(scene, rules);
}

} // namespace kuzure::scene
