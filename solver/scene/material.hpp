#pragma once
// The numbers the constitutive law works with, derived from a soil as it stands in the scene.
#include "solver/scene/scene.hpp"
#include <algorithm>
#include <cmath>
#include <limits>

namespace kuzure {

/// Drucker-Prager cone sqrt(J2) + alpha I1 <= k over isotropic linear elasticity, tension positive.
struct Material {
    double density;     // kg/m^3
    double bulk, shear; // K, G in Pa
    double sound_speed; // c_p = sqrt((K + 4 G/3)/rho), m/s
    double alpha, k;    // 1, Pa
    double alpha_psi;   // 1, slope of the plastic potential sqrt(J2) + alpha_psi I1
    double apex;        // Pa, largest trace I1: k/alpha or 3 p_t of the cut-off; infinite without friction and cut-off

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
        m.sound_speed = std::sqrt((m.bulk + 4 * m.shear / 3) / m.density);
        m.alpha = slope(soil.cone, soil.friction_angle);
        m.k = strength(soil.cone, soil.friction_angle, soil.cohesion);
        m.alpha_psi = slope(soil.cone, soil.dilation_angle);
        m.apex = m.alpha > 0 ? m.k / m.alpha : std::numeric_limits<double>::infinity();
        if (soil.tension_cutoff) m.apex = std::min(m.apex, 3 * *soil.tension_cutoff);
        return m;
    }
    /// Largest alpha for which a soil without cohesion bears no tensile principal stress: 1/(2 sqrt 3),
    /// reached by the stress (0, -p, -p), which is the first with a zero principal stress to enter a widening
    /// cone.
    static double widest_cone_without_tension() { return 0.5 / std::sqrt(3.0); }
};

} // namespace kuzure
