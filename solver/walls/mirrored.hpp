#pragma once
// Walls as three choices: a surface (scene/shape.hpp: distance and normal), a law (what a wall particle shows of itself) and a
// contact (what of force and motion crosses the surface).
#include "solver/core/memory.hpp"
#include "solver/pairs/record.hpp"
#include "solver/scene/shape.hpp"

namespace kuzure {

/// Points of one wall as the pair loop reads them.
template <class T> struct MirroredWall {
    scene::Wall wall; // its own: the scene's are others after an event
    Array<Coordinate<T>> x, y, z;
};

/// One wall point as a law sees it: where it is, r = x_i - x_j, and which point of which wall it is.
template <class V> struct WallPoint {
    Vec3<V> r;
    Index wall, point;
};

/// A particle at the surface of one wall: distance d_A and normal, a lane each; lengths in the unit of the pair sums.
template <class V> struct AtWall {
    Vec3<V> normal;
    V inverse_distance;
};

/// Law: a wall particle takes the soil particle's density and stress and the mirrored velocity -(d_B/d_A) v, the factor
/// 1 + d_B/d_A = r.n/d_A between 1 and 1.5. Morris et al. (1997); Bui et al. (2008), eq. 45.
struct Mirrored {
    static constexpr double cap = 1.5;
    /// (v_i - v_j)/v_i at this wall point.
    template <class V> KUZURE_INLINE V factor(const WallPoint<V>& j, const AtWall<V>& i) const
    {
        return min(max(dot(j.r, i.normal) * i.inverse_distance, V(number<V>(1))), V(number<V>(cap)));
    }
};

/// Contact: how one particle meets one wall, the surface's distance and normal, and what its velocity and stress look like there.
struct WallContact {
    double distance;
    Vector normal, mirrored; // m, 1, m/s: the velocity that the wall mirrors,
    Vector colliding;        // m/s: and its part that viscosity acts on
    Stress stress;           // the stress that both sides of the surface carry
};

/// Rough and Coulomb walls mirror all of the motion and carry the soil's stress; smooth ones mirror its normal part, and no shear
/// crosses them.
inline WallContact wall_contact(const scene::Wall& wall, Vector x, Vector v, const Stress& s, int dimensions)
{
    const auto c = scene::contact(wall.shape, x, dimensions);
    WallContact w{c.distance, c.normal, v, v, s};
    if (wall.surface == scene::Surface::Rough) return w;
    const Vector n = c.normal;
    w.colliding = dot(v, n) * n;
    if (wall.surface == scene::Surface::Coulomb) return w;
    // Free slip: no shear crosses the surface, sigma - (tau (x) n + n (x) tau) with tau = sigma.n - (n.sigma.n) n
    w.mirrored = w.colliding;
    const Vector traction = s * n;
    const Vector tau = traction - dot(n, traction) * n;
    w.stress = s - Stress{2 * tau.x * n.x,           2 * tau.y * n.y,           2 * tau.z * n.z,
                          tau.x * n.y + tau.y * n.x, tau.y * n.z + tau.z * n.y, tau.x * n.z + tau.z * n.x};
    return w;
}

/// Coulomb's law for the force density (N/m^3) a particle gets from a surface: along the surface at most tan(delta) times
/// the force along the normal; a surface that would pull gives none. Where the soil slips, friction opposes the slip v_t;
/// where it sticks, the stress of the no-slip wall holds it. Between the two the soil's impedance rho c_p decides: slip
/// counts as sliding once rho c_p v_t alone would need the whole friction.
struct WallFriction {
    Vector force;
    double drag; // share of the no-slip wall's velocity gradient: slip along a surface is no strain of the soil
    bool pulls;  // then the soil does not feel the surface at all: strain without force would make energy
};
inline WallFriction limit_to_friction(Vector force, Vector normal, double friction_angle, Vector slip, double impedance)
{
    const double pressing = dot(force, normal);
    if (!(pressing > 0)) return {{}, 0, true};
    const double limit = std::tan(friction_angle) * pressing;
    const Vector sticking = force - pressing * normal, opposing = -impedance * slip;
    const double needed = length(opposing), sliding = needed < limit ? needed / limit : 1.0;
    Vector shear = (needed > limit ? limit / needed : 1.0) * opposing + (1 - sliding) * sticking;
    if (const double size = length(shear); size > limit) shear = (limit / size) * shear;
    return {pressing * normal + shear, 1 - sliding, false};
}

} // namespace kuzure
