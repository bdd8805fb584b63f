#pragma once
// Artificial viscosity: what stands between the brackets of the momentum equation besides the stresses,
//
//     dv_i/dt = 1/rho_i sum_j V_j [ sigma_i + sigma_j - rho_i rho_j Pi_ij ] . grad_i W_ij  +  g
//
// Law of every effect (tests/unit/pass_test.cpp): a coefficient of zero changes no bit of the result.
#include "solver/core/tensor.hpp"
#include "solver/pairs/batch.hpp"
#include "solver/scene/parts.hpp"

namespace kuzure {

/// What a term may know of a pair. approach = max(0, -(v_i - v_j).(x_i - x_j)).
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
    static LinearViscosity from(const scene::Effects& e, double h) { return {e.viscosity.value_or(scene::Viscosity{0, 0}).alpha, h}; }
    static bool covers(const scene::Effects& e) { return !e.viscosity || e.viscosity->beta == 0; }

    // mu = h approach/(r^2 + 0.01 h^2),  Pi = alpha c_ij mu/rho_ij,  rho_ij = (rho_i + rho_j)/2,  c_ij = (c_i + c_j)/2
    template <class V> KUZURE_INLINE V operator()(const Pair<V>& p) const
    {
        const V strength = V(number<V>(alpha * h)) * p.rho_i; // of i alone
        return (p.approach * p.inverse * p.rho_j) * fma(strength, p.c_j, strength * p.c_i);
    }
};

/// The same with Monaghan's quadratic part: Pi = (alpha c_ij mu + beta mu^2)/rho_ij.
struct Viscosity {
    double alpha, beta, h;
    static Viscosity from(const scene::Effects& e, double h)
    {
        const auto v = e.viscosity.value_or(scene::Viscosity{0, 0});
        return {v.alpha, v.beta, h};
    }
    static bool covers(const scene::Effects&) { return true; }

    template <class V> KUZURE_INLINE V operator()(const Pair<V>& p) const
    {
        const V a = p.approach * p.inverse;
        const V mu = a * p.rho_sum * V(number<V>(h));
        const V linear = V(number<V>(alpha * h)) * p.rho_i, quadratic = V(number<V>(2 * beta * h)) * p.rho_i; // of i alone
        return (a * p.rho_j) * fma(quadratic, mu, fma(linear, p.c_j, linear * p.c_i));
    }
};

struct NoViscosity {
    static NoViscosity from(const scene::Effects&, double) { return {}; }
    static bool covers(const scene::Effects& e) { return !e.viscosity; }
};

/// sum V_j rho_i rho_j Pi grad W: the force of viscosity, against the particle's.
struct ViscousForce {
    template <class V> struct Sums {
        Vec3<V> viscous;
    };
    static constexpr double flops = 6;
    template <class V> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch) const
    {
        for (int k = 0; k < batch.size; ++k) to.viscous = fma(batch.at[k].rho2_Pi, batch.at[k].grad, to.viscous);
    }
};
struct NoViscousForce {
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&) const {}
};

} // namespace kuzure
