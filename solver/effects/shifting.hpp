#pragma once
// Shifting of particles towards even spacing where soil flows.
#include "solver/pairs/batch.hpp"

namespace kuzure {

/// Particle shifting after Lind et al. (2012), eqs. 22 to 26, by the rate of plastic shear instead of a diffusion of given size, and of
/// their grad C only the part that is between near neighbours: the whole of it lifts the second row below a free surface.
///     w_i = -n C h^2 gamma' k_i grad C_i,  grad C_i = sum_j V_j 0.2 (W_ij/W(spacing))^4 grad W,  gamma' = d lambda/dt,
/// in one of n = 8 steps, decided in the one before it.
/// k_i is 1 inside, 0 at free surfaces, by m = tr M_i/d, M_i = sum_j V_j (x_j - x_i) (x) grad W: between (m - 0.75)/0.15 of 0 and 1.
/// Walls count among the neighbours. A particle that moves by w dt beside its velocity takes there what the soil has there:
///     dv_i/dt += L_i w_i,  d sigma_i/dt += sum_j V_j (sigma_j - sigma_i) (w_i . grad W).
struct Shifting {
    /// One step in so many shifts, for all of them: every step would cost 1.4 of one without, the eighth 1.1 (perf/JOURNAL.md).
    static constexpr int every = 8;
    double constant;   // C
    double at_spacing; // 1/W(spacing), m^3 (m^2 in 2-D), or in the model's unit
    static constexpr double least_trace = 0.75, full_trace = 0.9;

    template <class Kernel> static Shifting from(double constant, const Kernel& kernel, double spacing)
    {
        return {constant, 1 / kernel.value(2 * kernel.h - spacing)};
    }
    /// 0.2 (W/W(spacing))^4.
    template <class V> KUZURE_INLINE V crowding(V w) const
    {
        using T = number<V>;
        const V f = w * V(T(at_spacing)), f2 = f * f;
        return V(T(0.2)) * f2 * f2;
    }
    /// k of the mean of M's diagonal.
    template <class V> static KUZURE_INLINE V inside(V mean)
    {
        using T = number<V>;
        return min(max((mean - V(T(least_trace))) * V(T(1 / (full_trace - least_trace))), V(T(0))), V(T(1)));
    }

    template <class V> struct Sums { // of the strain stage, without the kernel's constant
        Vec3<V> crowd;               // sum V_j crowding grad W
        V spread;                    // sum V_j r . grad W
    };
    static constexpr double flops = 18;
    template <class V> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const Entry<V>& e = batch.at[k];
            to.crowd = fma(crowding(e.w), e.grad, to.crowd);
            to.spread = to.spread + dot(e.r, e.grad);
        }
    }
};
/// sum V_j sigma_j (w_i . grad W), of the force stage: what shifting at velocity w carries along.
struct CarriedStress {
    template <class V> struct Sums {
        Sym3<V> carried;
    };
    static constexpr double flops = 17;
    template <class V, class R> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const R* stress, Vec3<V> w) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const R& j = stress[batch.neighbour[k]];
            to.carried = fma(dot(w, batch.at[k].grad), Sym3<V>{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)}, to.carried);
        }
    }
};

struct NoShifting {
    template <class Kernel> static NoShifting from(double, const Kernel&, double) { return {}; }
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&) const {}
};
struct NothingCarried {
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
};

} // namespace kuzure
