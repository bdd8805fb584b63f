// The rules of soils and of effects.
#include "solver/scene/effects_list.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/rules.hpp"
#include <algorithm>

namespace kuzure::scene {

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

} // namespace kuzure::scene
