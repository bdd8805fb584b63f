#pragma once
// What stands between the brackets of the momentum equation besides the stresses, one published equation a struct:
//
//     dv_i/dt = 1/rho_i sum_j V_j [ sigma_i + sigma_j + terms ] . grad_i W_ij  +  g
//
// Law (tests/unit/terms_test.cpp): a term whose coefficient is zero changes no bit of the result.
#include "solver/core/tensor.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

/// What a term may know of a pair. V_approach = max(0, -(v_i - v_j).(x_i - x_j)).
template <class V> struct Pair {
    V approach;
    V inverse; // 1/((r^2 + 0.01 h^2) (rho_i + rho_j))
    V rho_sum; // rho_i + rho_j
    V rho_i, rho_j;
    V c_i, c_j; // P-wave speeds, m/s
};

/// Artificial viscosity rho_i rho_j Pi_ij of approaching pairs, linear part only (beta = 0). Monaghan (1992), eq. 4.8.
struct LinearViscosity {
    double alpha, h;
    static LinearViscosity from(const Scene& s, double h) { return {s.effects.viscosity.value_or(scene::Viscosity{0, 0}).alpha, h}; }
    static bool covers(const scene::Effects& e) { return !e.viscosity || e.viscosity->beta == 0; }

    // mu = h approach/(r^2 + 0.01 h^2),  Pi = alpha c_ij mu/rho_ij,  rho_ij = (rho_i + rho_j)/2,  c_ij = (c_i + c_j)/2
    template <class V> KUZURE_INLINE V operator()(const Pair<V>& p) const
    {
        return (p.approach * p.inverse * p.rho_j) * (p.rho_i * (V(number<V>(alpha * h)) * (p.c_i + p.c_j)));
    }
};

/// The same with Monaghan's quadratic part: Pi = (alpha c_ij mu + beta mu^2)/rho_ij.
struct Viscosity {
    double alpha, beta, h;
    static Viscosity from(const Scene& s, double h)
    {
        const auto v = s.effects.viscosity.value_or(scene::Viscosity{0, 0});
        return {v.alpha, v.beta, h};
    }
    static bool covers(const scene::Effects&) { return true; }

    template <class V> KUZURE_INLINE V operator()(const Pair<V>& p) const
    {
        const V a = p.approach * p.inverse;
        const V mu = a * p.rho_sum * V(number<V>(h));
        const V strength = fma(V(number<V>(2 * beta)), mu, V(number<V>(alpha)) * (p.c_i + p.c_j));
        return (a * p.rho_j) * (p.rho_i * V(number<V>(h)) * strength);
    }
};

/// Artificial stress f^n (tau_i + tau_j) against clumping under tension: tau = -epsilon sum_k <sigma_k> n_k n_k over the
/// tensile principal stresses, f = W(r)/W(spacing). Monaghan (2000); Gray et al. (2001); Bui et al. (2008), eq. 34.
struct ArtificialStress {
    double epsilon, exponent, spacing_value; // 1/W(spacing)
    template <class Kernel> static ArtificialStress from(const Scene& s, const Kernel& kernel, double spacing)
    {
        const auto a = s.effects.artificial_stress.value_or(scene::ArtificialStress{0, 1});
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
};
/// tau of one particle: zero unless a principal stress is tensile.
Stress tension(const Stress& sigma, double epsilon);

} // namespace kuzure
