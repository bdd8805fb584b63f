#pragma once
// Walls in the pair loop. Three choices: the surface (surface.hpp: tangent planes at wall points), the law (how a wall point mirrors
// what it sees of a particle), the contact (what of force and motion crosses the surface).
//
// Force and strain are adjoint: with the mirror factor f_ij and the projection P_j of the contact
//
//     rho_i dv_i/dt += sum_j V_j f_ij P_j (sigma_i . grad W_ij),     L_i -= sum_j V_j f_ij (P_j v_i) (x) grad W_ij
//
// the force's power v . f equals -sigma : L, so that a fixed wall neither gives nor takes energy. Rough: P = 1; smooth and Coulomb:
// P = n (x) n. Coulomb's friction is a traction of its own (friction.hpp).
// Where a wall moves, v_i - v_w stands for v_i, v_w the velocity of the surface: the force's power is then -sigma : L and that of
// the wall, f . v_w, which is booked apart (moved_wall).
#include "solver/core/memory.hpp"
#include "solver/pairs/cluster.hpp"
#include "solver/scene/parts.hpp"
#include "solver/walls/surface.hpp"
#include <array>

namespace kuzure {

/// What exposed faces are like, as lanes see them: of a plane wall all alike.
template <class T> struct FaceKind {
    T nx, ny, nz;
    T stick;   // 1: all of the motion is mirrored (rough), 0: its normal part
    T coulomb; // 1 where Coulomb's law holds
    T tangent; // tan(friction angle)
    T holds;   // 1 where sunk soil is held out: real ground
    T drag;    // traction over rho v^2
};
/// One of them behind which a wall point lies, by its depth in the unit of the pair sums.
template <class T> struct FaceRecord {
    T depth;
    Index kind;              // in WallRecords::kinds
    std::int16_t last, tied; // 1 for the last face of its point; where it is as near as the one before it
};
/// How the surface moves there, m/s: in this step, and in the step to come.
template <class T> struct FaceMotion {
    T vx, vy, vz, next_x, next_y, next_z;
};

/// Points of one wall as the pair loop reads them, and the faces of each, one at least.
template <class T> struct WallRecords {
    const Coordinate<T>*x = nullptr, *y = nullptr, *z = nullptr; // the run's own points where those serve, else `made`
    std::array<Array<Coordinate<T>>, 3> made;
    std::vector<Index> first; // of each point in `faces`
    std::vector<FaceRecord<T>> faces;
    std::vector<FaceKind<T>> kinds;
    std::vector<FaceMotion<T>> motion; // of each face, where walls move; else empty
    std::size_t bytes() const
    {
        std::size_t b = 0;
        for (const auto& m : made) b += m.capacity() * sizeof(Coordinate<T>);
        return b + first.capacity() * sizeof(Index) + faces.capacity() * sizeof(FaceRecord<T>) + kinds.capacity() * sizeof(FaceKind<T>) +
               motion.capacity() * sizeof(FaceMotion<T>);
    }
};

/// What the lanes of a cluster see of one wall point.
template <class V> struct Mirror {
    Vec3<V> normal;
    V factor; // (v_i - v_j)/v_i of what is mirrored
    V stick, coulomb, tangent, drag;
    Vec3<V> v{}, next{}; // of the surface, m/s, in this step and in the one to come; only where walls move
    V sunk;              // of the particle behind the face where sunk soil is held out, in the unit of the pair sums; else 0
};

/// Law: a wall point moves as the particle's mirror image, v_j = -v_i of what is mirrored, f = 2. Summed over the particles on one side and
/// the points on the other this is the linear profile of Morris et al. (1997), f = 1 + d_B/d_A, for each pair of distances counts twice,
/// once either way; unlike that it has no singularity, needs no cap, and holds a uniform stress in equilibrium particle by particle.
struct MirrorImage {
    template <class V> KUZURE_INLINE V factor(V, V) const { return V(number<V>(2)); }
};

/// How a point mirrors each lane (FacesInFront). `ramp`: face_ramp in the unit of the pair sums; `motion`: of the faces, where walls move.
template <bool moving, class Law, class V, class T>
KUZURE_INLINE Mirror<V> mirror(const Law& law, Vec3<V> r, const FaceRecord<T>* face, const FaceKind<T>* kinds, V ramp,
                               const FaceMotion<T>* motion)
{
    const auto of = [&](const FaceRecord<T>& one) {
        const FaceKind<T>& f = kinds[one.kind];
        const Vec3<V> n{V(f.nx), V(f.ny), V(f.nz)};
        const V along = dot(r, n), depth(one.depth);
        Mirror<V> m{n,
                    law.factor(along, depth),
                    V(f.stick),
                    V(f.coulomb),
                    V(f.tangent),
                    V(f.drag),
                    {},
                    {},
                    V(f.holds) * max(depth - along, V(T(0)))};
        if constexpr (moving) {
            m.v = {V(motion->vx), V(motion->vy), V(motion->vz)};
            m.next = {V(motion->next_x), V(motion->next_y), V(motion->next_z)};
        }
        return m;
    };
    Mirror<V> m = of(*face);
    if (face->last) return m;
    FacesInFront<V> faces(ramp);
    faces.add(m.normal, dot(r, m.normal) - V(face->depth), false);
    do {
        ++face;
        if constexpr (moving) ++motion;
        const Mirror<V> next = of(*face);
        const auto use = faces.add(next.normal, dot(r, next.normal) - V(face->depth), face->tied != 0);
        m.normal = faces.chosen(use, next.normal, m.normal);
        m.factor = select(use, next.factor, m.factor), m.stick = select(use, next.stick, m.stick);
        m.coulomb = select(use, next.coulomb, m.coulomb), m.tangent = select(use, next.tangent, m.tangent);
        m.sunk = select(use, next.sunk, m.sunk), m.drag = select(use, next.drag, m.drag);
        if constexpr (moving) m.v = faces.chosen(use, next.v, m.v), m.next = faces.chosen(use, next.next, m.next);
    } while (!face->last);
    m.normal = faces.normal(m.normal);
    return m;
}
/// Acceleration (m/s^2) along the normal of real ground of soil that lies `depth` (m) behind the face of the wall point nearest to it. Soil
/// torn open bears no pressure, so no wall could hold it: a spring of its own does, omega = 0.3 c_p/h.
inline double hold_out(double depth, double c_p, double h) { return 0.09 * (c_p / h) * (c_p / h) * depth; }
/// P a: all of a at a rough wall, else its normal part.
template <class V> KUZURE_INLINE Vec3<V> project(const Mirror<V>& m, Vec3<V> a)
{
    const Vec3<V> normal = dot(a, m.normal) * m.normal;
    return fma(m.stick, a - normal, normal);
}

} // namespace kuzure
