#pragma once
// Stress "at rest": the weight of the soil above a point, and K0 times it sideways.
#include "solver/effects/pore_water.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

class InitialStress {
public:
    InitialStress(const Scene& s, const scene::Filling& f, std::span<const Material> soils)
        : scene_(s), filling_(f), soils_(soils), water_(PoreWater::from(s.effects))
    {
        gravity_ = s.effects.gravity ? -s.effects.gravity->z : 0;
    }

    /// Stress at a soil particle's initial position. Vertical: the column one spacing wide above it. Sideways: K0 times that.
    Stress operator()(Vector x, int soil) const
    {
        const double dx = scene_.space.spacing, half = 0.499999 * dx, top = filling_.soil_bounds().high.z;
        double load = 0, surface = x.z; // Pa, m
        filling_.for_each_soil_in({{x.x - half, x.y - half, x.z - half}, {x.x + half, x.y + half, top + half}},
                                  [&](std::int64_t, Vector above, int body) {
                                      const double part = above.z < x.z + 0.25 * dx ? 0.5 : 1.0;
                                      surface = std::max(surface, above.z + 0.5 * dx);
                                      load += part * soils_[scene_.bodies[body].soil].density * gravity_ * dx;
                                  });
        // What the pore water carries is not the skeleton's; water standing above the soil weighs on both.
        load -= water_.at(x).value - water_.at({x.x, x.y, surface}).value;
        if (load <= 0) return {};
        const double sideways = -load * soils_[soil].sideways_at_rest(load);
        return {sideways, sideways, -load, 0, 0, 0};
    }

private:
    const Scene& scene_;
    const scene::Filling& filling_;
    std::span<const Material> soils_;
    double gravity_;
    PoreWater water_;
};

} // namespace kuzure
