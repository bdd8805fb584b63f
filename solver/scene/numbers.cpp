#include "solver/scene/numbers.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/step_limits.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::scene {

double resting_speed(const Scene& s) { return 0.05 * std::sqrt(length(s.effects.gravity.value_or(Vector{})) * s.space.spacing); }

std::vector<Indicator> dimensionless_numbers(const Scene& s, const Filling& f)
{
    std::vector<Indicator> all;
    const auto add = [&](const char* name, double value, std::string about, bool doubtful, std::string warning) {
        all.push_back({name, value, std::move(about), doubtful ? std::move(warning) : std::string()});
    };
    const Box b = f.soil_bounds();
    const double dx = s.space.spacing, height = f.soil_height(), width = b.high.x - b.low.x + dx;
    const double g = s.effects.gravity ? length(*s.effects.gravity) : 0;
    double softest = std::numeric_limits<double>::infinity(), slowest = softest, fastest_body = 0, cohesion = 0;
    bool rate = true;
    for (const auto& soil : s.soils) {
        const Material m = Material::from(soil);
        softest = std::min(softest, m.c_p * m.c_p); // M/rho
        slowest = std::min(slowest, m.c_p);
        cohesion = std::max(cohesion, soil.cohesion);
        rate = rate && soil.rate_friction.has_value();
    }
    for (const auto& body : s.bodies) fastest_body = std::max(fastest_body, length(body.velocity));

    if (g > 0) {
        // strain of the lowest layer under the whole weight: rho g H/M
        const double strain = g * height / softest;
        add("base_strain", strain, "rho g H/M, strain of the lowest soil under its weight; below 0.02 stiffness does not show",
            strain > 0.05,
            fmt::format(
                "the soil is so soft that its own weight strains it by {:.1f} %: a stiffer one (young) would be nearer to rigid grains",
                100 * strain));
    }
    double drop = height; // real ground: as far as it goes down
    for (const auto& wall : s.walls)
        if (const auto* ground = std::get_if<Ground>(&wall.shape)) drop = std::max(drop, b.high.z - ground->field->lowest());
    const double fall = std::sqrt(2 * g * drop), speed = std::max(fall, fastest_body);
    if (speed > 0)
        add("mach", speed / slowest, "sqrt(2 g H)/c_p or the fastest body's; below 0.1 the P-wave's speed does not show, above 0.3 it does",
            speed / slowest > 0.3,
            fmt::format("the soil may move at {:.2f} of its P-wave speed: raise young, or read impacts with care", speed / slowest));
    add("layers", height / dx, "H/spacing, layers of particles over the height; 20 and more for profiles, 50 for stresses", height / dx < 8,
        fmt::format("{:.0f} layers of particles are too few for profiles and stresses; 20 and more are for that", height / dx));
    const double dt = step_at_rest(s);
    add("courant", dt / crossing_time(s),
        fmt::format("dt c_p/h, step against the P-wave; recommended up to {:.3g}", recommended_courant(s)), false, {});
    const double slender = height / (0.5 * width);
    if (g > 0)
        add("slenderness", slender, "H over half the width", slender > 2.7 && cohesion == 0 && !rate,
            fmt::format(
                "a dry column with H over half-width {:.1f} > 2.7 runs out too far and piles up too high with rate-independent friction "
                "(no collisions take energy); rate_friction in the soil brings it nearer",
                slender));
    double grain = 0;
    for (const auto& soil : s.soils)
        if (soil.rate_friction) grain = std::max(grain, soil.rate_friction->grain);
    if (grain > 0)
        add("inertial", grain / height, "d/H, the inertial number of a free collapse; above 1e-3 rate_friction changes the answer", false,
            {});
    return all;
}

std::vector<SoilNumbers> soil_numbers(const Scene& s, const Filling& f)
{
    const double height = f.soil_height();
    const double g = s.effects.gravity ? length(*s.effects.gravity) : 0;
    std::vector<SoilNumbers> all;
    for (const auto& soil : s.soils) {
        const Material m = Material::from(soil);
        const double weight = soil.density * g;
        all.push_back({soil.name, weight, m.sideways_at_rest(weight > 0 ? 0.5 * weight * height : std::numeric_limits<double>::infinity()),
                       weight > 0 ? soil.cohesion / (weight * height) : 0, m.c_p, std::sqrt(m.shear / soil.density)});
    }
    return all;
}

} // namespace kuzure::scene
