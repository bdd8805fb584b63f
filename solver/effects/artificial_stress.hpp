#pragma once
// Artificial stress between particles of which one is in tension.
#include "solver/pairs/batch.hpp"
#include "solver/pairs/record.hpp"
#include "solver/scene/parts.hpp"

namespace kuzure {

/// Artificial stress f^n (tau_i + tau_j) against clumping under tension: tau = -epsilon sum_k <sigma_k> n_k n_k over the
/// tensile principal stresses, f = W(r)/W(spacing). Monaghan (2000); Gray et al. (2001); Bui et al. (2008), eq. 34.
struct ArtificialStress {
    double epsilon, exponent, spacing_value; // 1/W(spacing)
    template <class Kernel> static ArtificialStress from(const scene::Effects& e, const Kernel& kernel, double spacing)
    {
        const auto a = e.artificial_stress.value_or(scene::ArtificialStress{0, 1});
        return {a.epsilon, a.exponent, 1 / kernel.value(2 * kernel.h - spacing)};
    }
    /// (W(r)/W(spacing))^n from W(r).
    template <class V> V closeness(V w) const
    {
        using T = number<V>;
        if constexpr (width<V> == 1) return std::pow(w * T(spacing_value), T(exponent));
        else {
            V f;
            for (int k = 0; k < width<V>; ++k) f.v[k] = std::pow(lane(w, k) * T(spacing_value), T(exponent));
            return f;
        }
    }

    template <class V> struct Sums {
        Vec3<V> closeness_grad; // sum V_j f^n grad W
        Vec3<V> art_stress_j;   // sum V_j f^n tau_j . grad W
    };
    static constexpr double flops = 40;
    /// Pairs of which neither is in tension are passed over; `own`: one of the cluster's particles is.
    template <class V, class T> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const Tension<T>* tension, bool own) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const Tension<T>& j = tension[batch.neighbour[k]];
            if (!own && j.any == 0) continue;
            const Vec3<V> near_j = closeness(batch.at[k].w) * batch.at[k].grad;
            to.art_stress_j = to.art_stress_j + Sym3<V>{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)} * near_j;
            to.closeness_grad = to.closeness_grad + near_j;
        }
    }
};
struct NoArtificialStress {
    template <class Kernel> static NoArtificialStress from(const scene::Effects&, const Kernel&, double) { return {}; }
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V, class T> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&, const Tension<T>*, bool) const {}
};

/// tau of one particle: zero unless a principal stress is tensile.
Stress tension(const Stress& sigma, double epsilon);
/// The same as a record.
template <class T> Tension<T> make_tension(const Stress&, double epsilon);

} // namespace kuzure
