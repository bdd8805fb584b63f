#pragma once
// The numbers the constitutive law works with, derived from a soil as it stands in the scene.
#include "solver/scene/parts.hpp"
#include <algorithm>
#include <cmath>
#include <limits>

namespace kuzure {

/// Drucker-Prager cone sqrt(J2) + alpha I1 <= k over isotropic linear elasticity, tension positive.
struct Material {
    double density;     // kg/m^3
    double bulk, shear; // K, G in Pa
    double c_p;         // P-wave: sqrt((K + 4 G/3)/rho), m/s
    double alpha, k;    // 1, Pa
    double alpha_psi;   // 1, slope of the plastic potential sqrt(J2) + alpha_psi I1
    double apex;        // Pa, largest trace I1: k/alpha or 3 p_t of the cut-off; infinite without friction and cut-off
    double cutoff;      // Pa, 3 p_t; infinite without
    double c_bar;       // wave in a bar: sqrt(E/rho), m/s
    double K0;          // sideways_at_rest() of ground so deep that cohesion does not count
    double remembers;   // 1: volume opened at the apex bears no pressure until it is closed; 0: at once
    // What changes the cone during a run; where it does not, the residual values are the first ones.
    double residual_alpha, residual_k;
    double softening_slip = std::numeric_limits<double>::infinity(); // m
    double dilation_decay = std::numeric_limits<double>::infinity(); // 1
    double fast_alpha;                                               // slope of the cone through phi_2; alpha without rate friction
    double inertial_number = 1, grain = 0, grain_density = 1;        // I_0, m, kg/m^3

    /// True if cone or dilation change with strain or its rate.
    bool evolves() const { return std::isfinite(softening_slip) || std::isfinite(dilation_decay) || grain > 0; }

    /// K0, horizontal over vertical stress of level ground at rest, under a vertical stress in Pa: nu/(1 - nu), or where that lies
    /// outside the cone, the ratio on it.
    double sideways_at_rest(double load) const
    {
        // nu/(1 - nu) = (3 K - 2 G)/(3 K + 4 G); on the cone (1 - K0)/sqrt3 = alpha (1 + 2 K0) + k/load
        const double root3 = std::sqrt(3.0), elastic = (3 * bulk - 2 * shear) / (3 * bulk + 4 * shear);
        return std::max(elastic, (1 - root3 * (alpha + k / load)) / (1 + 2 * root3 * alpha));
    }

    /// Slope angle (rad) at which soil on a rough bed starts and stops to flow in shear at constant volume, where sqrt(J2) is the shear
    /// stress and -I1/3 the pressure on the bed: tan = 3 alpha.
    double angle_on_a_rough_bed() const { return std::atan(3 * alpha); }
    /// Friction angle (rad) of the Mohr circle in plane strain at psi = 0: sin = 3 alpha. Where that is 1 or more, no circle is too large.
    double angle_of_the_stress_circle() const { return std::asin(std::min(3 * alpha, 1.0)); }
    bool circle_is_limited() const { return 3 * alpha < 1; }

    /// Slope alpha of the cone through a friction (or dilation) angle in rad.
    static double slope(scene::Cone cone, double angle)
    {
        const double s = std::sin(angle), t = std::tan(angle), root3 = std::sqrt(3.0);
        switch (cone) {
        case scene::Cone::Compression:
            return 2 * s / (root3 * (3 - s));
        case scene::Cone::Extension:
            return 2 * s / (root3 * (3 + s));
        case scene::Cone::PlaneStrain:
            return t / std::sqrt(9 + 12 * t * t);
        case scene::Cone::PlaneStrainNoDilation:
            return s / 3;
        case scene::Cone::Shear:
            return t / 3;
        }
        return 0;
    }
    /// Strength k (Pa) of the cone at I1 = 0.
    static double strength(scene::Cone cone, double angle, double cohesion)
    {
        const double s = std::sin(angle), c = std::cos(angle), t = std::tan(angle), root3 = std::sqrt(3.0);
        switch (cone) {
        case scene::Cone::Compression:
            return 6 * cohesion * c / (root3 * (3 - s));
        case scene::Cone::Extension:
            return 6 * cohesion * c / (root3 * (3 + s));
        case scene::Cone::PlaneStrain:
            return 3 * cohesion / std::sqrt(9 + 12 * t * t);
        case scene::Cone::PlaneStrainNoDilation:
            return cohesion * c;
        case scene::Cone::Shear:
            return cohesion;
        }
        return 0;
    }
    /// The numbers of one soil of a scene.
    static Material from(const scene::Soil& soil)
    {
        Material m;
        m.density = soil.density;
        m.bulk = soil.young / (3 * (1 - 2 * soil.poisson));
        m.shear = soil.young / (2 * (1 + soil.poisson));
        m.c_p = std::sqrt((m.bulk + 4 * m.shear / 3) / m.density);
        m.alpha = slope(soil.cone, soil.friction_angle);
        m.k = strength(soil.cone, soil.friction_angle, soil.cohesion);
        m.alpha_psi = slope(soil.cone, soil.dilation_angle);
        m.remembers = soil.opened_volume == scene::OpenedVolume::Kept;
        m.apex = m.alpha > 0 ? m.k / m.alpha : std::numeric_limits<double>::infinity();
        m.cutoff = soil.tension_cutoff ? 3 * *soil.tension_cutoff : std::numeric_limits<double>::infinity();
        m.apex = std::min(m.apex, m.cutoff);
        m.c_bar = std::sqrt(soil.young / m.density);
        m.K0 = m.sideways_at_rest(std::numeric_limits<double>::infinity());
        m.residual_alpha = m.alpha, m.residual_k = m.k, m.fast_alpha = m.alpha;
        if (const auto& s = soil.softening) {
            m.residual_alpha = slope(soil.cone, s->friction_angle);
            m.residual_k = strength(soil.cone, s->friction_angle, s->cohesion);
            m.softening_slip = s->slip;
        }
        if (soil.dilation_decay) m.dilation_decay = *soil.dilation_decay;
        if (const auto& r = soil.rate_friction) {
            m.fast_alpha = slope(soil.cone, r->friction_angle);
            m.inertial_number = r->inertial_number, m.grain = r->grain, m.grain_density = r->grain_density;
        }
        return m;
    }
    /// Largest alpha for which a soil without cohesion bears no tensile principal stress: 1/(2 sqrt 3),
    /// reached by the stress (0, -p, -p), which is the first with a zero principal stress to enter a widening cone.
    static double widest_cone_without_tension() { return 0.5 / std::sqrt(3.0); }
};

} // namespace kuzure
