#pragma once
// Coulomb friction of a particle on a surface as a return map with elastic slip: below tan(delta) times the pressure a spring holds
// the particle where it is, beyond it slides and the spring keeps the length that carries the limit. What the spring stores it gives
// back, what slides is lost: the surface never gives energy.
//
// Soil chatters on a wall: it presses, by its stress and by its viscosity, is let go, or is pulled for a step or two. Friction must carry
// tan(delta) times the mean of all that, so its limit follows with a lag (Prakash & Clifton 1993; one time scale as Cochard & Rice 2000):
//     d limit/dt = (tan(delta) p - limit)/lag,   lag = 4 h/c_p
// by implicit Euler, sum dt limit = sum dt tan(delta) p but for what the limit holds at the end, whatever the steps.
#include "solver/core/tensor.hpp"

namespace kuzure {

/// The slip that the spring remembers (m) and the acceleration of friction (m/s^2), after a step.
struct Friction {
    Vector slip, force;
};

/// Shares of the limit before and of what presses now in the limit after a step (1, 1); at the start of a run, dt = 0, what presses.
template <class V> struct Lag {
    V keep, take;
};
template <class V> KUZURE_INLINE Lag<V> lag(double dt, V c_p, double h)
{
    const V one(1.0), passing = V(dt / (4 * h)) * c_p; // dt/lag
    if (!(dt > 0)) return {V(0.0), one};
    const V keep = one / (one + passing);
    return {keep, passing * keep};
}

/// Stiffness (1/s^2) of the spring, the soil's own shear modulus (Pa) across half a smoothing length (m), on an area (m^2) of a unit of
/// mass.
inline double spring_stiffness(double shear, double area, double h) { return shear * area / (0.5 * h); }
/// The slip (m) with which it carries a shear stress (Pa) along the face.
inline Vector slip_under(Vector stress, double shear, double h) { return (0.5 * h / shear) * stress; }

/// `moved`: displacement of the step (m); `normal`: of the surface; `limit`: the largest friction (m/s^2);
/// `stiffness`: of the spring (1/s^2).
inline Friction return_to_coulomb(Vector slip, Vector moved, Vector normal, double limit, double stiffness)
{
    if (!(limit > 0) || !(stiffness > 0)) return {};
    Vector s = slip + moved;
    s = s - dot(s, normal) * normal;
    const double trial = stiffness * length(s);
    if (trial > limit) s = (limit / trial) * s;
    return {s, -stiffness * s};
}

} // namespace kuzure
