#pragma once
// Correction of the velocity gradient.
#include "solver/pairs/batch.hpp"

namespace kuzure {

/// Correction of the velocity gradient, exact for linear velocity fields whatever the neighbours:
///     grad v <- (grad v) M^-1,  M = sum_j V_j (x_j - x_i) (x) grad W.  Bonet & Lok (1999); Bui & Nguyen (2021).
/// Where the support is too empty or lopsided for M to be trusted (spray, a toe one particle thin) the plain gradient is
/// kept: there the correction would turn noise into density. tr M/d is 1 inside, 3/4 at a plane surface, 1/2 in a corner.
/// It is kept beside walls too, whose mirrored velocities fill the support but are not linear.
struct GradientCorrection {
    static constexpr double least_isotropy = 0.5; // det M over (tr M/dimensions)^dimensions
    static constexpr double least_trace = 0.4;    // tr M/dimensions
    template <class V> struct Inverse {
        Sym3<V> K;
        V trusted; // 1 or 0
    };
    /// M^-1 of a symmetric M (3-D, or 2-D in x-z), or 1 where M is not to be trusted or allowed (1 or 0) is 0.
    template <class V> static KUZURE_INLINE Inverse<V> inverse(Sym3<V> m, int dimensions, V allowed)
    {
        using T = number<V>;
        const V one(1), zero(0), half(T(0.5));
        if (dimensions == 2) m.yy = half * (m.xx + m.zz);
        const V third(T(1.0 / 3)), mean = third * trace(m);
        const V cxx = fnma(m.yz, m.yz, m.yy * m.zz), cyy = fnma(m.xz, m.xz, m.xx * m.zz), czz = fnma(m.xy, m.xy, m.xx * m.yy);
        const V cxy = fnma(m.xy, m.zz, m.xz * m.yz), cyz = fnma(m.xx, m.yz, m.xy * m.xz), cxz = fnma(m.xz, m.yy, m.xy * m.yz);
        const V det = fma(m.xx, cxx, fma(m.xy, cxy, m.xz * cxz));
        const auto good = [&](V a) {
            return select(less(V(T(least_isotropy)) * mean * mean * mean, det), select(less(V(T(least_trace)), mean), a, zero), zero);
        };
        const V use = good(allowed), keep = one - use;
        const V per_det = use / fma(det, use, keep);
        return {{fma(cxx, per_det, keep), fma(cyy, per_det, keep), fma(czz, per_det, keep), cxy * per_det, cyz * per_det, cxz * per_det},
                use};
    }

    template <class V> struct Sums {
        Sym3<V> moment; // sum V_j grad W (x) r
    };
    static constexpr double flops = 12;
    template <class V> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const Vec3<V> g = batch.at[k].grad, r = batch.at[k].r;
            Sym3<V>& M = to.moment;
            M = {fma(g.x, r.x, M.xx), fma(g.y, r.y, M.yy), fma(g.z, r.z, M.zz),
                 fma(g.x, r.y, M.xy), fma(g.y, r.z, M.yz), fma(g.x, r.z, M.xz)};
        }
    }
};

struct NoCorrection {
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&) const {}
};

} // namespace kuzure
