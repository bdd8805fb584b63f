#pragma once
// What stands between the brackets of the momentum equation besides the stresses, one published equation a struct:
//
//     dv_i/dt = 1/rho_i sum_j V_j [ sigma_i + sigma_j + terms ] . grad_i W_ij  +  g
//
// Law (tests/unit/terms_test.cpp): a term whose coefficient is zero changes no bit of the result.
#include "solver/core/tensor.hpp"
#include "solver/scene/parts.hpp"

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
};
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
        const V one(1), rest = one - K0;
        using T = number<V>;
        return {fma(rest, V(T(n.x * n.x)), K0), fma(rest, V(T(n.y * n.y)), K0), fma(rest, V(T(n.z * n.z)), K0),
                rest * V(T(n.x * n.y)),         rest * V(T(n.y * n.z)),         rest * V(T(n.x * n.z))};
    }
};

/// Correction of the velocity gradient, exact for linear velocity fields whatever the neighbours:
///     grad v <- (grad v) M^-1,  M = sum_j V_j (x_j - x_i) (x) grad W.  Bonet & Lok (1999); Bui & Nguyen (2021).
/// Where the support is too empty or lopsided for M to be trusted (spray, a toe one particle thin) the plain gradient is
/// kept: there the correction would turn noise into density. tr M/d is 1 inside, 3/4 at a plane surface, 1/2 in a corner.
/// It is kept beside walls too, whose mirrored velocities fill the support but are not linear.
struct GradientCorrection {
    static constexpr double least_isotropy = 0.5; // det M over (tr M/dimensions)^dimensions
    static constexpr double least_trace = 0.4;    // tr M/dimensions
    /// M^-1 of a symmetric M (3-D, or 2-D in x-z), or 1 where M is not to be trusted or allowed (1 or 0) is 0.
    template <class V> static KUZURE_INLINE Sym3<V> inverse(Sym3<V> m, int dimensions, V allowed)
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
        return {fma(cxx, per_det, keep), fma(cyy, per_det, keep), fma(czz, per_det, keep), cxy * per_det, cyz * per_det, cxz * per_det};
    }
};

/// Still pore water: p_w = rho_w g (z_w(x) - z) below the table, whose gradient drives the skeleton (buoyancy, seepage):
///     rho dv/dt = div sigma' - grad p_w + rho g.  Bui et al. (2011), with the gradient of the given table itself.
struct PoreWater {
    std::vector<std::array<double, 2>> table; // x, z in m
    double unit_weight = 0;                   // N/m^3
    static PoreWater from(const scene::Effects& e)
    {
        const auto& p = e.pore_pressure;
        if (!p) return {};
        return {p->table, p->density * length(e.gravity.value_or(Vector{}))};
    }
    bool present() const { return !table.empty(); }
    /// Pressure (Pa) and its gradient (Pa/m) at a point.
    struct Pressure {
        double value = 0;
        Vector gradient{};
    };
    Pressure at(Vector x) const;
};

/// tau of one particle: zero unless a principal stress is tensile.
Stress tension(const Stress& sigma, double epsilon);

} // namespace kuzure
