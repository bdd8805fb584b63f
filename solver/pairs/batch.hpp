#pragma once
// Geometry of up to sixteen neighbours of a cluster, made once and read by every term of a stage. What no term of a stage
// reads the compiler leaves out.
#include "solver/core/tensor.hpp"

namespace kuzure {

/// One neighbour j as the lanes i see it.
template <class V> struct Entry {
    Vec3<V> grad; // V_j grad W_ij without the kernel's constant
    Vec3<V> v;    // v_j - v_i, m/s
    Vec3<V> r;    // x_i - x_j
    V rho2_Pi;    // rho_i rho_j Pi_ij, Pa
    V w;          // W_ij
    V t;          // 2h - r where positive, else 0
    V q;          // (grad W . r)/(r^2 + 0.01 h^2), as grad
    V along;      // g . r
};

template <class V> struct Batch {
    static constexpr int capacity = 16;
    Entry<V> at[capacity];
    const Index* neighbour; // their records
    int size;
};

/// sum_j V_j (v_j - v_i) (x) grad W: the velocity gradient, row by row.
struct VelocityGradient {
    template <class V> struct Sums {
        Mat3<V> grad_v;
    };
    static constexpr double flops = 18;
    template <class V> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch) const
    {
        // (unrolled in full, GCC 12 would keep five of the nine sums in memory)
#pragma GCC unroll 1
        for (int k = 0; k < batch.size; ++k) {
            const Vec3<V> g = batch.at[k].grad, v = batch.at[k].v;
            to.grad_v.x = fma(v.x, g, to.grad_v.x);
            to.grad_v.y = fma(v.y, g, to.grad_v.y);
            to.grad_v.z = fma(v.z, g, to.grad_v.z);
        }
    }
};

/// sum_j V_j sigma_j . grad W and sum_j V_j grad W: the force of the stresses is the former plus sigma_i times the latter.
struct StressForce {
    template <class V> struct Sums {
        Vec3<V> force;    // sum V_j sigma_j . grad W
        Vec3<V> grad_one; // sum V_j grad W
    };
    static constexpr double flops = 21;
    /// `stress`: records with xx ... xz; pressure(entry) is subtracted from sigma_j.
    template <class V, class R, class Pressure>
    KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const R* stress, Pressure less) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const R& j = stress[batch.neighbour[k]];
            const Vec3<V> g = batch.at[k].grad;
            const Sym3<V> s = less(Sym3<V>{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)}, batch.at[k]);
            to.force = to.force + s * g;
            to.grad_one = to.grad_one + g;
        }
    }
};

/// sum_j V_j (sigma_j K_j) grad W in place of the former, K the correction of each particle's gradients.
struct CorrectedForce {
    /// `traction`: records with the rows of sigma K, xx ... zz.
    template <class V, class R> KUZURE_INLINE void add(StressForce::Sums<V>& to, const Batch<V>& batch, const R* traction) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const R& j = traction[batch.neighbour[k]];
            const Vec3<V> g = batch.at[k].grad;
            to.force.x = fma(V(j.xz), g.z, fma(V(j.xy), g.y, fma(V(j.xx), g.x, to.force.x)));
            to.force.y = fma(V(j.yz), g.z, fma(V(j.yy), g.y, fma(V(j.yx), g.x, to.force.y)));
            to.force.z = fma(V(j.zz), g.z, fma(V(j.zy), g.y, fma(V(j.zx), g.x, to.force.z)));
            to.grad_one = to.grad_one + g;
        }
    }
};

} // namespace kuzure
