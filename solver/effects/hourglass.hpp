#pragma once
// Hourglass control: against motion of neighbours that the velocity gradient does not see.
#include "solver/pairs/batch.hpp"

namespace kuzure {

/// Viscous force on the part of the relative velocities that is not affine, of the velocity gradients L of the strain stage, as in Zhang et
/// al. (2024), eq. 17, with a rate instead of its memory, so that it only takes energy:
///     rho_i dv_i/dt += 2 xi h sum_j V_j min(w_i, w_j) [v_ij - (L_i + L_j) x_ij/2] (x_ij . grad W)/(r^2 + 0.01 h^2),
///     w_i = k_i rho_i c_i.
/// k_i is 0 where the particle yields or has opened, else 1 where gradients are corrected, and by the share of neighbours that shifting
/// has too (effects/shifting.hpp) where they are not: L misses the motion there.
struct HourglassControl {
    double strength; // xi

    template <class V> struct Sums {
        Vec3<V> apart; // sum q min(w_i, w_j) (v_ij - L_j x_ij/2), q of the batch
        Vec3<V> arm;   // sum q min(w_i, w_j) x_ij
    };
    static constexpr double flops = 36;
    /// `affine`: L rows and w of neighbours; `v` and `own` w: of the lanes; `half_unit`: m, of the positions.
    template <class V, class R, class K>
    KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const R* affine, const K* kinematics, Vec3<V> v, V own, V half_unit) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const R& a = affine[batch.neighbour[k]];
            const K& j = kinematics[batch.neighbour[k]];
            const Vec3<V> r = batch.at[k].r, half{half_unit * r.x, half_unit * r.y, half_unit * r.z};
            const V q = batch.at[k].q * min(own, V(a.weight));
            const Vec3<V> turned{dot(Vec3<V>{V(a.xx), V(a.xy), V(a.xz)}, half), dot(Vec3<V>{V(a.yx), V(a.yy), V(a.yz)}, half),
                                 dot(Vec3<V>{V(a.zx), V(a.zy), V(a.zz)}, half)};
            to.apart = fma(q, Vec3<V>{v.x - j.vx, v.y - j.vy, v.z - j.vz} - turned, to.apart);
            to.arm = fma(q, r, to.arm);
        }
    }
};

struct NoHourglass {
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
};

} // namespace kuzure
