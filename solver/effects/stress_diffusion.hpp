#pragma once
// Diffusion of stress between neighbours.
#include "solver/pairs/batch.hpp"
#include "solver/scene/parts.hpp"

namespace kuzure {

/// Stress diffusion against noise of the spacing's length, Feng et al. (2021), eq. 24:
///     D_i = 2 zeta h c sum_j V_j psi_ij x_ij . grad W/(r^2 + 0.01 h^2),  psi_ij = sigma_i - sigma_j - static part,
/// c = sqrt(E/rho). The static part is that of level ground, -rho (g . x_ij) (K0 1 + (1 - K0) g^ g^), g^ = g/|g|, so that a
/// column at rest is left alone. Neighbours in walls do not count.
struct StressDiffusion {
    double zeta;
    Vector gravity; // m/s^2
    static StressDiffusion from(const scene::Effects& e)
    {
        return {e.stress_diffusion.value_or(scene::StressDiffusion{0}).zeta, e.gravity.value_or(Vector{})};
    }
    /// Static stress per unit of -rho g . x_ij: K0 1 + (1 - K0) g^ g^.
    template <class V> Sym3<V> at_rest(V K0) const
    {
        const double g = length(gravity);
        const Vector n = g > 0 ? (1 / g) * gravity : Vector{};
        const V one(1), anisotropy = one - K0;
        using T = number<V>;
        return {fma(anisotropy, V(T(n.x * n.x)), K0), fma(anisotropy, V(T(n.y * n.y)), K0), fma(anisotropy, V(T(n.z * n.z)), K0),
                anisotropy * V(T(n.x * n.y)),         anisotropy * V(T(n.y * n.z)),         anisotropy * V(T(n.x * n.z))};
    }

    template <class V> struct Sums {
        Sym3<V> q_sigma; // sum q sigma_j;  q = V_j grad W . r/(r^2 + 0.01 h^2)
        V q, q_along;    // sum q, sum q g.r
    };
    static constexpr double flops = 23;
    template <class V, class R> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const R* stress) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const R& j = stress[batch.neighbour[k]];
            const V q = batch.at[k].q;
            to.q_sigma = fma(q, Sym3<V>{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)}, to.q_sigma);
            to.q = to.q + q;
            to.q_along = fma(q, batch.at[k].along, to.q_along);
        }
    }
    /// D_i from the sums, Pa/s: `strength` is 2 zeta h c and all constants of the sums, `unit` the length of r in m.
    template <class V> KUZURE_INLINE Sym3<V> rate(const Sums<V>& sums, Sym3<V> sigma, V rho, V K0, V strength, V unit) const
    {
        const V along = unit * sums.q_along;
        return strength * fma(rho * along, at_rest(K0), sums.q * sigma - sums.q_sigma);
    }
};

struct NoStressDiffusion {
    static NoStressDiffusion from(const scene::Effects&) { return {}; }
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V, class R> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&, const R*) const {}
};

} // namespace kuzure
