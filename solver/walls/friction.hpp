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

/// `moved`: displacement of the step (m); `normal`: of the surface; `limit`: the largest friction, tan(delta) times what presses (N/m^3);
/// `stiffness`: of the spring, N/m^4. A negative limit takes back what the surface pressed too much before soil came off it: friction
/// along the slip remembered until then is taken back with it, so that its mean is tan(delta) times the mean load.
inline Friction return_to_coulomb(Vector slip, Vector moved, Vector normal, double limit, double stiffness)
{
    if (limit == 0 || !(stiffness > 0)) return {};
    Vector s = slip + moved;
    s = s - dot(s, normal) * normal;
    if (limit < 0) {
        const double l = length(s);
        return {{}, l > 0 && dot(slip, slip) > 0 ? (-limit / l) * s : Vector{}};
    }
    const double trial = stiffness * length(s);
    if (trial > limit) s = (limit / trial) * s;
    return {s, -stiffness * s};
}

} // namespace kuzure
