#pragma once
// Strength that is scaled, by an event or by a factor of safety.
#include "solver/scene/parts.hpp"
#include <cmath>

namespace kuzure::scene {

/// The angle (rad) whose tangent is so many times that of this one.
inline double with_tangent_times(double angle, double factor) { return std::atan(factor * std::tan(angle)); }

/// Cohesion, tan(phi) and tension cut-off times a factor, those of softening and of fast flow too; dilation stays as it is.
inline void scale_strength(Soil& soil, double factor)
{
    soil.cohesion *= factor, soil.friction_angle = with_tangent_times(soil.friction_angle, factor);
    if (soil.tension_cutoff) *soil.tension_cutoff *= factor;
    if (auto& s = soil.softening) s->cohesion *= factor, s->friction_angle = with_tangent_times(s->friction_angle, factor);
    if (auto& r = soil.rate_friction) r->friction_angle = with_tangent_times(r->friction_angle, factor);
}

} // namespace kuzure::scene
