#pragma once
// Coulomb friction of a particle on a surface as a return map with elastic slip: below tan(delta) times the pressure a spring holds
// the particle where it is, beyond it slides and the spring keeps the length that carries the limit. What the spring stores it gives
// back, what slides is lost: the surface never gives energy.
#include "solver/core/tensor.hpp"

namespace kuzure {

/// The slip that the spring remembers (m) and the force density of friction (N/m^3), after a step.
struct Friction {
    Vector slip, force;
};

/// `moved`: displacement of the step (m); `pressure`: force density with which the surface holds the particle along `normal`, `limit`:
/// the largest friction (both N/m^3, 0 where contact is lost); `stiffness`: of the spring, N/m^4.
inline Friction return_to_coulomb(Vector slip, Vector moved, Vector normal, double pressure, double limit, double stiffness)
{
    if (!(pressure > 0) || !(limit > 0) || !(stiffness > 0)) return {};
    Vector s = slip + moved;
    s = s - dot(s, normal) * normal;
    const double trial = stiffness * length(s);
    if (trial > limit) s = (limit / trial) * s;
    return {s, -stiffness * s};
}

} // namespace kuzure
