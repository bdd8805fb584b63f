#pragma once
// Stress "at rest": the weight of the soil above a point, and K0 times it sideways. Where scene::no_closed_form() says that this is no
// equilibrium (slopes, terraces), it is the state that a settling run has to start from.
#include "solver/effects/pore_water.hpp"
#include "solver/scene/at_rest.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

class InitialStress {
public:
    InitialStress(const Scene& s, const scene::Filling& f, std::span<const Material> soils)
        : columns_(s, f), soils_(soils), water_(PoreWater::from(s.effects))
    {
        gravity_ = s.effects.gravity ? -s.effects.gravity->z : 0;
    }

    /// Stress at a soil particle's initial position. Vertical: the columns above it. Sideways: K0 times that.
    Stress operator()(Vector x, int body, int soil) const
    {
        const auto above = columns_.above(x, body);
        // What the pore water carries is not the skeleton's; water standing above the soil weighs on both.
        const double load = above.mass * gravity_ - (water_.at(x).value - water_.at({x.x, x.y, above.surface}).value);
        if (load <= 0) return {};
        const double sideways = -load * soils_[soil].sideways_at_rest(load);
        return {sideways, sideways, -load, 0, 0, 0};
    }

private:
    scene::Columns columns_;
    std::span<const Material> soils_;
    double gravity_;
    PoreWater water_;
};

} // namespace kuzure
