// What changes the cone during a run, at one material point: softening, dilation decay, mu(I), still pore water.
#include "solver/core/simd.hpp"
#include "solver/effects/pore_water.hpp"
#include "solver/physics/drucker_prager.hpp"
#include "solver/scene/scene.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

const double degree = std::acos(-1.0) / 180;

scene::Soil clay()
{
    scene::Soil s;
    s.density = 1850, s.young = 5e6, s.poisson = 0.3, s.cohesion = 2e4, s.friction_angle = 20 * degree;
    s.cone = scene::Cone::PlaneStrain;
    return s;
}

/// Simple shear at constant volume under an isotropic pressure; V is double or lanes.
template <class V> struct SimpleShear {
    Elastoplastic<V> soil;
    Evolution<V> evolution;
    Sym3<V> sigma;
    double plastic_strain = 0, work = 0;
    SimpleShear(const scene::Soil& s, double h, double pressure)
        : soil(Elastoplastic<V>::from(Material::from(s))),
          evolution(Evolution<V>::from(Material::from(s), h)), sigma{V(-pressure), V(-pressure), V(-pressure), V(0.0), V(0.0), V(0.0)}
    {
    }
    /// A step of engineering shear d_gamma taken at `rate` 1/s; the plastic volume change of it.
    double shear(double d_gamma, double rate = 0)
    {
        const auto now = evolved(soil, evolution, V(plastic_strain), V(rate), trace(sigma) * V(-1.0 / 3));
        const Sym3<V> e{V(0.0), V(0.0), V(0.0), V(0.0), V(0.0), V(0.5 * d_gamma)};
        const Sym3<V> trial = sigma + hooke(e, now);
        const auto y = return_to_cone(trial, now);
        const double volume = lane(trace(trial) - trace(y.sigma), 0) / (3 * lane(soil.bulk, 0));
        sigma = y.sigma;
        plastic_strain += lane(y.d_lambda, 0);
        work += lane(y.plastic_work, 0);
        return volume;
    }
    double tau() const { return lane(sigma.xz, 0); }
};

template <class V> class Evolving : public testing::Test {
};
using Numbers = testing::Types<double, Simd<double, 4>, Simd<double, 8>>;
TYPED_TEST_SUITE(Evolving, Numbers);

} // namespace

TYPED_TEST(Evolving, SofteningFallsLinearlyToTheResidualStrength)
{
    auto s = clay();
    s.softening = scene::Softening{5e3, 10 * degree, 0.02};
    const double h = 0.05, p = 1e5, full = 0.02 / (2 * h);
    const auto residual = [&] {
        auto r = s;
        r.cohesion = 5e3, r.friction_angle = 10 * degree;
        return Material::from(r);
    }();
    const Material peak = Material::from(s);
    SimpleShear<TypeParam> point(s, h, p);
    const double elastic = (3 * peak.alpha * p + peak.k) / peak.shear;
    const int n = 20000;
    for (int k = 0; k < n; ++k) point.shear((0.5 * full + elastic) / n);
    const double share = point.plastic_strain / full;
    EXPECT_NEAR(point.tau(), (3 * p) * (peak.alpha + share * (residual.alpha - peak.alpha)) + peak.k + share * (residual.k - peak.k),
                1e-3 * point.tau());
    EXPECT_NEAR(share, 0.5, 0.1);
    for (int k = 0; k < n; ++k) point.shear(2 * full / n);
    EXPECT_NEAR(point.tau(), 3 * residual.alpha * p + residual.k, 1e-9 * point.tau());
}

// The work that takes a shear band, 2 h wide, to residual strength does not depend on h.
TYPED_TEST(Evolving, SofteningDissipatesTheSamePerAreaOfShearBandAtAnyResolution)
{
    auto s = clay();
    s.softening = scene::Softening{5e3, 10 * degree, 0.02};
    double per_area[2];
    for (int k = 0; k < 2; ++k) {
        const double h = k == 0 ? 0.05 : 0.0125;
        SimpleShear<TypeParam> point(s, h, 1e5);
        while (point.plastic_strain < 0.02 / (2 * h)) point.shear(0.02 / (2 * h) / 5000);
        per_area[k] = point.work * 2 * h;
    }
    EXPECT_NEAR(per_area[1], per_area[0], 2e-3 * per_area[0]);
}

TYPED_TEST(Evolving, DilationDiesOut)
{
    auto s = clay();
    s.cohesion = 0, s.dilation_angle = 10 * degree, s.dilation_decay = 0.05;
    SimpleShear<TypeParam> point(s, 0.05, 1e5);
    // Volume held by hand: what plastic flow adds is given back as expansion, so the pressure stays.
    double swollen = 0;
    for (int k = 0; k < 40000; ++k) {
        const double v = point.shear(0.3 / 40000);
        swollen += v;
        const TypeParam back(lane(point.soil.bulk, 0) * v);
        point.sigma = plus_isotropic(point.sigma, back);
    }
    // int 3 alpha_psi (1 - g/g_d) dg from 0 to g_d
    EXPECT_NEAR(swollen, 3 * Material::from(s).alpha_psi * 0.05 / 2, 2e-4 * swollen);
}

const scene::Cone cones[] = {scene::Cone::Compression, scene::Cone::Extension, scene::Cone::PlaneStrain, scene::Cone::PlaneStrainNoDilation,
                             scene::Cone::Shear};

// In every cone: from its own slope at phi to its own slope at phi_2, in between as mu(I).
TYPED_TEST(Evolving, FrictionGrowsWithTheInertialNumber)
{
    auto s = clay();
    s.cohesion = 0;
    s.rate_friction = scene::RateFriction{33 * degree, 0.3, 1e-3, 2600};
    const double p = 1e4;
    for (const auto cone : cones) {
        s.cone = cone;
        const double slow = Material::slope(cone, 20 * degree), fast = Material::slope(cone, 33 * degree);
        for (const double I : {1e-4, 0.03, 0.3, 3.0, 1e4}) {
            const double rate = I * std::sqrt(p / 2600) / 1e-3;
            SimpleShear<TypeParam> point(s, 0.05, p);
            for (int k = 0; k < 2000; ++k) point.shear(0.05 / 2000, rate);
            EXPECT_NEAR(point.tau() / (3 * p), slow + (fast - slow) / (1 + 0.3 / I), 1e-9 * fast) << "I = " << I << ", cone " << int(cone);
        }
    }
}

// The cone "shear" is Jop's definition itself: tau = mu(I) p with mu = tan(phi).
TYPED_TEST(Evolving, TheShearConeIsTheLawAsPublished)
{
    auto s = clay();
    s.cohesion = 0, s.cone = scene::Cone::Shear, s.friction_angle = std::atan(0.382);
    s.rate_friction = scene::RateFriction{std::atan(0.6435), 0.279, 1e-3, 2600};
    const double p = 1e4, I = 0.1;
    SimpleShear<TypeParam> point(s, 0.05, p);
    for (int k = 0; k < 2000; ++k) point.shear(0.05 / 2000, I * std::sqrt(p / 2600) / 1e-3);
    EXPECT_NEAR(point.tau() / p, 0.382 + (0.6435 - 0.382) / (1 + 0.279 / I), 1e-9);
}

// Soil that has lost strength and flows fast has the friction of fast flow, and half way it is half way from what is left.
TYPED_TEST(Evolving, RateFrictionStartsFromTheSoftenedCone)
{
    auto s = clay();
    s.softening = scene::Softening{5e3, 10 * degree, 0.02};
    s.rate_friction = scene::RateFriction{33 * degree, 0.3, 1e-3, 2600};
    const double h = 0.05, p = 1e4;
    for (const auto cone : cones) {
        s.cone = cone;
        const double lost = Material::slope(cone, 10 * degree), fast = Material::slope(cone, 33 * degree);
        const double k = Material::strength(cone, 10 * degree, 5e3);
        for (const double I : {1e-9, 0.3, 1e9}) {
            SimpleShear<TypeParam> point(s, h, p);
            for (int n = 0; n < 20000; ++n) point.shear(1.0 / 20000, I * std::sqrt(p / 2600) / 1e-3);
            ASSERT_GT(point.plastic_strain, 0.02 / (2 * h));
            EXPECT_NEAR(point.tau(), 3 * p * (lost + (fast - lost) / (1 + 0.3 / I)) + k, 1e-7 * point.tau()) << "I = " << I;
        }
    }
}

TEST(PoreWater, IsHydrostaticBelowItsTable)
{
    Scene s;
    s.effects.gravity = Vector{0, 0, -9.81};
    s.effects.pore_pressure = scene::PorePressure{{{0.0, 4.0}, {10.0, 2.0}}, 1000};
    const auto w = PoreWater::from(s.effects);
    EXPECT_NEAR(w.at({-3, 0, 1}).value, 9810 * 3, 1e-9);
    EXPECT_NEAR(w.at({5, 0, 1}).value, 9810 * 2, 1e-9);
    EXPECT_NEAR(w.at({5, 0, 1}).gradient.x, 9810 * -0.2, 1e-9);
    EXPECT_NEAR(w.at({5, 0, 1}).gradient.z, -9810, 1e-9);
    EXPECT_NEAR(w.at({20, 0, 0}).value, 9810 * 2, 1e-9);
    EXPECT_EQ(w.at({20, 0, 0}).gradient.x, 0);
    EXPECT_EQ(w.at({5, 0, 3.5}).value, 0);
}
