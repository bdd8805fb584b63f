#pragma once
// Drucker-Prager soil: Hooke's law with the Jaumann rate, the yield cone and the closed-form return mapping.
// Tension is positive. Legend: sigma Cauchy stress [Pa], s its deviator, I1 = tr sigma, J2 = s:s/2, L velocity gradient
// [1/s], D and W its symmetric and skew parts, K and G bulk and shear modulus [Pa].
#include "solver/core/tensor.hpp"
#include "solver/scene/material.hpp"

namespace kuzure {

/// What the constitutive law needs of a soil, one number or one lane of numbers each.
template <class V> struct Elastoplastic {
    V shear, bulk;         // Pa
    V alpha, k;            // cone: sqrt(J2) + alpha I1 <= k
    V nine_k_alpha_psi;    // 9 K alpha_psi: fall of I1 per unit of plastic multiplier
    V inverse_denominator; // 1/(G + 9 K alpha alpha_psi)
    V apex;                // largest I1 that the soil bears, Pa
    V remembers;           // 1: opened volume bears no pressure until it is closed; 0: at once
    static Elastoplastic from(const Material& m)
    {
        using T = number<V>;
        return {V(T(m.shear)),
                V(T(m.bulk)),
                V(T(m.alpha)),
                V(T(m.k)),
                V(T(9 * m.bulk * m.alpha_psi)),
                V(T(1 / (m.shear + 9 * m.bulk * m.alpha * m.alpha_psi))),
                V(T(m.apex)),
                V(T(m.remembers))};
    }
};

/// What changes a soil's cone with plastic strain and with the rate of shear, one number or one lane of numbers each.
template <class V> struct Evolution {
    V residual_alpha, residual_k;
    V per_softening, per_dilation; // 1 over the plastic strain of residual strength, and of dilation's end
    V alpha_psi;
    V fast_alpha, inertial_number, grain, per_grain_density;
    V cutoff;
    /// Shear bands are taken to be 2 h wide; h in m.
    static Evolution from(const Material& m, double h)
    {
        using T = number<V>;
        return {V(T(m.residual_alpha)),    V(T(m.residual_k)), V(T(2 * h / m.softening_slip)), V(T(1 / m.dilation_decay)),
                V(T(m.alpha_psi)),         V(T(m.fast_alpha)), V(T(m.inertial_number)),        V(T(m.grain)),
                V(T(1 / m.grain_density)), V(T(m.cutoff))};
    }
};

/// The cone of now. Softening (linear in alpha and k) and dilation decay with the plastic shear strain gamma_p:
///     alpha = alpha_0 + (alpha_r - alpha_0) min(gamma_p/gamma_r, 1),  k alike,  alpha_psi = alpha_psi_0 max(1 - gamma_p/gamma_d, 0)
/// mu(I) with the rate of shear |D| = sqrt(2 D':D') and the pressure p (Jop et al. 2006): from the softened cone to that of the angle
/// phi_2, which fast flow reaches whatever strength it has lost (alpha is not proportional to tan(phi) in every cone):
///     alpha += (slope(cone, phi_2) - alpha)/(1 + I_0/I),  I = |D| d/sqrt(p/rho_grain)
template <class V>
KUZURE_INLINE Elastoplastic<V> evolved(const Elastoplastic<V>& soil, const Evolution<V>& e, V plastic_strain, V shear_rate, V pressure)
{
    const V one(1), zero(0);
    const V softened = min(plastic_strain * e.per_softening, one);
    const V slide = shear_rate * e.grain;
    const V tiny(number<V>(1e-280)); // the quotient stays finite
    const V fast = slide / (slide + e.inertial_number * sqrt(max(pressure, zero) * e.per_grain_density) + tiny);
    Elastoplastic<V> now = soil;
    now.alpha = fma(softened, e.residual_alpha - soil.alpha, soil.alpha);
    now.alpha = fma(fast, e.fast_alpha - now.alpha, now.alpha);
    now.k = fma(softened, e.residual_k - soil.k, soil.k);
    const V alpha_psi = e.alpha_psi * max(one - plastic_strain * e.per_dilation, zero);
    const V nine_k = V(9) * soil.bulk;
    now.nine_k_alpha_psi = nine_k * alpha_psi;
    now.inverse_denominator = one / (soil.shear + nine_k * now.alpha * alpha_psi);
    now.apex = min(now.k / max(now.alpha, tiny), e.cutoff);
    return now;
}

/// sqrt(J2) + alpha I1 - k: positive outside the cone.
template <class V> V yield_function(Sym3<V> sigma, const Elastoplastic<V>& soil)
{
    return fma(soil.alpha, trace(sigma), sqrt(J2(deviator(sigma)))) - soil.k;
}

/// dt times Hooke's stress rate: 2 G dev(D) + K tr(D) 1. Bui et al. (2008), eq. 7.
template <class V> KUZURE_INLINE Sym3<V> hooke(Sym3<V> strain, const Elastoplastic<V>& soil)
{
    const V two_shear = soil.shear + soil.shear;
    const V lambda = fma(soil.shear, V(number<V>(-2.0 / 3)), soil.bulk);
    return plus_isotropic(two_shear * strain, lambda * trace(strain));
}

/// W.sigma - sigma.W, the spin part of the Jaumann rate; w = (W_xy, W_xz, W_yz) times a time.
template <class V> KUZURE_INLINE Sym3<V> spin(Vec3<V> w, Sym3<V> s)
{
    const V xx = fma(w.x, s.xy, w.y * s.xz), yy = fnma(w.x, s.xy, w.z * s.yz), zz = fma(w.y, s.xz, w.z * s.yz);
    return {xx + xx,
            yy + yy,
            -(zz + zz),
            fma(w.y, s.yz, fma(w.z, s.xz, w.x * (s.yy - s.xx))),
            fnma(w.x, s.xz, fnma(w.y, s.xy, w.z * (s.zz - s.yy))),
            fma(w.x, s.yz, fnma(w.z, s.xy, w.y * (s.zz - s.xx)))};
}

/// Skew part of L times dt, as (W_xy, W_xz, W_yz), W_ij = (dv_i/dx_j - dv_j/dx_i)/2.
template <class V> KUZURE_INLINE Vec3<V> spin_increment(const Mat3<V>& L, V dt)
{
    const V half = dt * V(number<V>(0.5));
    return {half * (L.x.y - L.y.x), half * (L.x.z - L.z.x), half * (L.y.z - L.z.y)};
}

/// R sigma R^T with the rotation R = (1 - W/2)^-1 (1 + W/2) of a spin increment W (Hughes & Winget 1980): the principal
/// stresses are kept to round-off however large the increment.
template <class V> KUZURE_INLINE Sym3<V> rotate(Vec3<V> w, Sym3<V> s)
{
    // axial vector t of W/2, with W.a = 2 t x a:  R = 1 + 2/(1 + t.t) (T + T.T),  T.a = t x a
    const V half(number<V>(0.5));
    const Vec3<V> t{-(half * w.z), half * w.y, -(half * w.x)};
    const V f = V(2) / (V(1) + dot(t, t));
    const V fx = f * t.x, fy = f * t.y, fz = f * t.z;
    const V rxx = V(1) - fma(fy, t.y, fz * t.z), ryy = V(1) - fma(fx, t.x, fz * t.z), rzz = V(1) - fma(fx, t.x, fy * t.y);
    const V xy = fx * t.y, xz = fx * t.z, yz = fy * t.z;
    const V rxy = xy - fz, ryx = xy + fz, rxz = xz + fy, rzx = xz - fy, ryz = yz - fx, rzy = yz + fx;
    const Vec3<V> ax{rxx, rxy, rxz}, ay{ryx, ryy, ryz}, az{rzx, rzy, rzz};
    const Vec3<V> bx = s * ax, by = s * ay, bz = s * az;
    return {dot(ax, bx), dot(ay, by), dot(az, bz), dot(ax, by), dot(ay, bz), dot(ax, bz)};
}

template <class V> struct ReturnMapping {
    Sym3<V> sigma;
    V d_lambda;     // increment of the plastic multiplier
    V plastic_work; // sigma : d(eps_p), J/m^3
    V opened;       // volume strain that tension at the apex has opened and pressure has not closed
};

/// Bring an elastic trial stress back to the cone, exactly, for any increment, dilation and apex or tension cut-off:
///     d_lambda = <F>/(G + 9 K alpha alpha_psi),  I1 = min(I1_tr - 9 K alpha_psi d_lambda, apex),
///     s = s_tr min(1, (k - alpha I1)/sqrt(J2_tr)).
/// Bui et al. (2008) with the return map of de Souza Neto et al. (2008). What tension opens at the apex is remembered, and I1 stays at zero
/// under pressure until it is closed (Tampubolon et al. 2017; Dunatunga & Kamrin 2015): soil torn apart keeps its volume.
///     opened += (I1 - apex)+/(3 K);  closed = min(opened, (-I1)+/(3 K)),  I1 += 3 K closed,  opened -= closed.
template <class V> KUZURE_INLINE ReturnMapping<V> return_to_cone(Sym3<V> trial, const Elastoplastic<V>& soil, V opened = V(0))
{
    const V third(number<V>(1.0 / 3)), one(1);
    const V I1_trial = trace(trial);
    const Sym3<V> s = plus_isotropic(trial, -(I1_trial * third));
    const V shear2 = J2(s);
    const V shear = sqrt(shear2);
    const V overshoot = max(fma(soil.alpha, I1_trial, shear) - soil.k, V(0));
    const V I1_cone = fnma(soil.nine_k_alpha_psi, overshoot * soil.inverse_denominator, I1_trial);
    const V I1_borne = min(I1_cone, soil.apex), zero(0), three_k = V(3) * soil.bulk;
    const V closed = min(opened, max(-I1_borne, zero) / three_k);
    const V I1 = fma(three_k, closed, I1_borne);
    const V open = soil.remembers * (opened + max(I1_cone - soil.apex, zero) / three_k - closed);
    const V limit = max(fnma(soil.alpha, I1, soil.k), V(0));
    const V tiny(number<V>(1e-280)); // the quotient stays finite
    const V keep = min(limit / max(shear, tiny), one);
    // eps_p = C^-1 (trial - sigma);  sigma : eps_p = keep (1 - keep) J2_tr/G + I1 (I1_tr - I1)/(9 K)
    // keep = 1 in the elastic range gives exactly zero work and strain.
    const V lost = one - keep;
    const V work = fma(keep * lost, shear2 / soil.shear, I1 * (I1_trial - I1) / (V(9) * soil.bulk));
    return {plus_isotropic(keep * s, I1 * third), lost * shear / soil.shear, work, open};
}

} // namespace kuzure
