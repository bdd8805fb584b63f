// The constitutive law at one material point, against closed forms: MAT-1 to MAT-12 of docs/verification.md, for double
// and for lanes alike.
#include "solver/core/simd.hpp"
#include "solver/physics/drucker_prager.hpp"
#include <gtest/gtest.h>
#include <random>

using namespace kuzure;

namespace {

const double degree = std::acos(-1.0) / 180;

Material material(scene::Cone cone, double phi, double c = 0, double psi = 0, double young = 1.8e6, double poisson = 0.3)
{
    scene::Soil s;
    s.density = 1850, s.young = young, s.poisson = poisson, s.cohesion = c;
    s.friction_angle = phi * degree, s.dilation_angle = psi * degree, s.cone = cone;
    return Material::from(s);
}

/// One material point driven by strain increments; V is double, or lanes that all do the same.
template <class V> struct Point {
    Elastoplastic<V> soil;
    Sym3<V> sigma{V(0.0), V(0.0), V(0.0), V(0.0), V(0.0), V(0.0)};
    double plastic_work = 0, work = 0, gamma = 0;

    explicit Point(const Material& m) : soil(Elastoplastic<V>::from(m)) {}
    void strain(Stress e)
    {
        const Sym3<V> d{V(e.xx), V(e.yy), V(e.zz), V(e.xy), V(e.yz), V(e.xz)};
        const Sym3<V> before = sigma;
        const auto y = return_to_cone(sigma + hooke(d, soil), soil);
        sigma = y.sigma;
        plastic_work += lane(y.plastic_work, 0), gamma += lane(y.d_lambda, 0);
        work += 0.5 * lane(contract(before + sigma, d), 0);
    }
    Stress at() const
    {
        return {lane(sigma.xx, 0), lane(sigma.yy, 0), lane(sigma.zz, 0), lane(sigma.xy, 0), lane(sigma.yz, 0), lane(sigma.xz, 0)};
    }
};

template <class V> class DruckerPrager : public testing::Test {
};
using Numbers = testing::Types<double, Simd<double, 4>, Simd<double, 8>>;
TYPED_TEST_SUITE(DruckerPrager, Numbers);

/// Deviatoric stress at failure: axial strain in small steps, lateral stress held at -cell by Newton's method.
template <class V> double triaxial(const Material& m, double cell, double axial_step, int steps)
{
    Point<V> p(m);
    p.sigma = {V(-cell), V(-cell), V(-cell), V(0.0), V(0.0), V(0.0)};
    for (int k = 0; k < steps; ++k) {
        const auto start = p;
        double lateral = -0.3 * axial_step;
        for (int it = 0; it < 60; ++it) {
            auto probe = [&](double e) {
                auto q = start;
                q.strain({e, e, axial_step, 0, 0, 0});
                return q.at().xx + cell;
            };
            const double f = probe(lateral), h = 1e-9, slope = (probe(lateral + h) - f) / h;
            if (std::fabs(f) < 1e-7 * cell || slope == 0) break;
            lateral -= f / slope;
        }
        p.strain({lateral, lateral, axial_step, 0, 0, 0});
    }
    return p.at().xx - p.at().zz;
}

} // namespace

// MAT-1: pure pressure never yields, and sigma = K tr(eps).
TYPED_TEST(DruckerPrager, IsotropicCompressionStaysElastic)
{
    const auto m = material(scene::Cone::Compression, 25);
    Point<TypeParam> p(m);
    for (int k = 0; k < 100; ++k) p.strain({-1e-4, -1e-4, -1e-4, 0, 0, 0});
    for (const double s : {p.at().xx, p.at().yy, p.at().zz}) EXPECT_NEAR(s / (m.bulk * -0.03), 1, 1e-10);
    EXPECT_EQ(p.gamma, 0);
}
// MAT-2 and MAT-3: oedometer, elastic with the compression cone, plastic with the plane-strain cone.
TYPED_TEST(DruckerPrager, OedometerGivesTheElasticAndThePlasticK0)
{
    Point<TypeParam> elastic(material(scene::Cone::Compression, 25));
    const auto m = material(scene::Cone::PlaneStrain, 25);
    Point<TypeParam> plastic(m);
    for (int k = 0; k < 200; ++k) elastic.strain({0, 0, -1e-4, 0, 0, 0}), plastic.strain({0, 0, -1e-4, 0, 0, 0});
    EXPECT_NEAR(elastic.at().zz, -48461.538461538, 1e-5);
    EXPECT_NEAR(elastic.at().xx / elastic.at().zz, 0.3 / 0.7, 1e-10);
    const double root3 = std::sqrt(3.0);
    EXPECT_NEAR(plastic.at().xx / plastic.at().zz, (1 - root3 * m.alpha) / (1 + 2 * root3 * m.alpha), 1e-10);
    EXPECT_NEAR(plastic.at().xx / plastic.at().zz, 0.517578, 1e-6);
    EXPECT_NEAR(plastic.at().zz, -44223, 1);
}
// MAT-4: triaxial compression at 100 kPa, c = 5 kPa, phi = 25: the deviator at failure of each cone.
TYPED_TEST(DruckerPrager, TriaxialCompressionFailsWhereEachConeSays)
{
    const std::pair<scene::Cone, double> cases[] = {{scene::Cone::Compression, 162.088e3},
                                                    {scene::Cone::PlaneStrain, 103.202e3},
                                                    {scene::Cone::PlaneStrainNoDilation, 107.207e3},
                                                    {scene::Cone::Extension, 108.932e3}};
    for (const auto& [cone, q] : cases) {
        const auto m = material(cone, 25, 5000);
        const double found = triaxial<TypeParam>(m, 100e3, -1e-3, 150);
        EXPECT_NEAR(found, q, 1);
        // closed form: q/sqrt3 = alpha (3 p + q) + k
        const double root3 = std::sqrt(3.0);
        EXPECT_NEAR(found / ((3 * m.alpha * 100e3 + m.k) / (1 / root3 - m.alpha)), 1, 1e-6);
    }
}
// MAT-5: triaxial extension.
TYPED_TEST(DruckerPrager, TriaxialExtensionFailsWhereEachConeSays)
{
    const std::pair<scene::Cone, double> cases[] = {
        {scene::Cone::Compression, 82.03e3}, {scene::Cone::Extension, 65.78e3}, {scene::Cone::PlaneStrain, 63.65e3}};
    for (const auto& [cone, q] : cases) EXPECT_NEAR(-triaxial<TypeParam>(material(cone, 25, 5000), 100e3, 1e-3, 150), q, 10);
}
// MAT-6: plane strain without dilation mobilises sin(phi) = 3 alpha in the end, with s_yy midway.
TYPED_TEST(DruckerPrager, PlaneStrainMobilisesThreeAlpha)
{
    for (const auto cone : {scene::Cone::PlaneStrain, scene::Cone::PlaneStrainNoDilation, scene::Cone::Compression}) {
        const auto m = material(cone, 25);
        Point<TypeParam> p(m);
        p.strain({-0.02, -0.02, -0.02, 0, 0, 0});
        for (int k = 0; k < 40000; ++k) p.strain({5e-5, 0, -5e-5, 0, 0, 0});
        const Stress s = p.at();
        EXPECT_NEAR((s.xx - s.zz) / -(s.xx + s.zz), 3 * m.alpha, 2e-3);
        EXPECT_NEAR(s.yy / (0.5 * (s.xx + s.zz)), 1, 5e-3);
    }
}
// MAT-7: simple shear at constant volume ends at tau = 3 alpha p0 + k, whatever the number of increments.
TYPED_TEST(DruckerPrager, SimpleShearAtConstantVolumeDoesNotDependOnTheIncrement)
{
    const auto m = material(scene::Cone::PlaneStrain, 30, 20e3, 0, 10e6);
    const double tau[] = {88.699e3, 124.728e3, 160.756e3}, p0[] = {150e3, 225e3, 300e3};
    for (int c = 0; c < 3; ++c)
        for (const int n : {1, 10, 1000}) {
            Point<TypeParam> p(m);
            const auto v = [](double x) { return TypeParam(x); };
            p.sigma = {v(-p0[c]), v(-p0[c]), v(-p0[c]), v(0.0), v(0.0), v(0.0)};
            for (int k = 0; k < n; ++k) p.strain({0, 0, 0, 0, 0, 0.05 / n});
            EXPECT_NEAR(p.at().xz / (3 * m.alpha * p0[c] + m.k), 1, 1e-10);
            EXPECT_NEAR(p.at().xz, tau[c], 1);
            EXPECT_NEAR(trace(p.at()) / (-3 * p0[c]), 1, 1e-12);
        }
}
// MAT-8: stretched beyond the apex nothing is left (c = 0) or the apex itself (c > 0); recompression is stiff at once.
TYPED_TEST(DruckerPrager, ApexIsReachedExactlyAndLeftElastically)
{
    for (const double c : {0.0, 5000.0}) {
        const auto m = material(scene::Cone::Compression, 25, c, 5);
        Point<TypeParam> p(m);
        for (int k = 0; k < 50; ++k) p.strain({1e-3, 5e-4, 2e-3, 3e-4, -2e-4, 1e-4});
        const Stress s = p.at();
        EXPECT_NEAR(trace(s), m.k / m.alpha, 1e-9 * (1 + m.k));
        EXPECT_LE(std::sqrt(J2(deviator(s))), 1e-9 * (1 + m.k));
        if (c == 0) {
            EXPECT_EQ(s.xx, 0);
            EXPECT_EQ(s.xy, 0);
        }
        p.strain({-1e-4, -1e-4, -1e-4, 0, 0, 0});
        EXPECT_NEAR((trace(p.at()) - trace(s)) / (3 * m.bulk * -3e-4), 1, 1e-10);
    }
}
// MAT-9: a rigid turn by 2 pi gives back the stress; its eigenvalues never move.
TYPED_TEST(DruckerPrager, RigidRotationKeepsThePrincipalStresses)
{
    const auto v = [](double x) { return TypeParam(x); };
    Sym3<TypeParam> s{v(-1000.0), v(-2000.0), v(-3000.0), v(0.0), v(0.0), v(0.0)};
    const int n = 1000;
    const double w = 2 * std::acos(-1.0) / n / std::sqrt(14.0);
    for (int k = 0; k < n; ++k) s = rotate(Vec3<TypeParam>{v(w), v(2 * w), v(3 * w)}, s);
    EXPECT_NEAR(lane(trace(s), 0) / -6000, 1, 1e-12);
    EXPECT_NEAR(lane(J2(deviator(s)), 0) / 1e6, 1, 1e-12);
    const double det = lane(s.xx, 0) * (lane(s.yy, 0) * lane(s.zz, 0) - lane(s.yz, 0) * lane(s.yz, 0)) -
                       lane(s.xy, 0) * (lane(s.xy, 0) * lane(s.zz, 0) - lane(s.yz, 0) * lane(s.xz, 0)) +
                       lane(s.xz, 0) * (lane(s.xy, 0) * lane(s.yz, 0) - lane(s.yy, 0) * lane(s.xz, 0));
    EXPECT_NEAR(det / -6e9, 1, 1e-12);
    EXPECT_NEAR(lane(s.xx, 0), -1000, 0.1); // the angle of a thousand increments is right to 2e-5
    EXPECT_NEAR(lane(s.zz, 0), -3000, 0.1);
}
// MAT-10: hypoelastic simple shear to gamma = 4 oscillates as the Jaumann rate must: G sin(gamma), G (1 - cos(gamma)).
TYPED_TEST(DruckerPrager, JaumannRateOscillatesInSimpleShear)
{
    const auto m = material(scene::Cone::Compression, 25);
    const auto soil = Elastoplastic<TypeParam>::from(m);
    const auto v = [](double x) { return TypeParam(x); };
    double error[2];
    for (int level = 0; level < 2; ++level) {
        const int n = 1000 << level;
        const double d = 4.0 / n;
        Sym3<TypeParam> s{v(0.0), v(0.0), v(0.0), v(0.0), v(0.0), v(0.0)};
        for (int k = 0; k < n; ++k) {
            const auto half = v(0.5) * hooke(Sym3<TypeParam>{v(0.0), v(0.0), v(0.0), v(0.5 * d), v(0.0), v(0.0)}, soil);
            s = rotate(Vec3<TypeParam>{v(0.5 * d), v(0.0), v(0.0)}, s + half) + half;
        }
        error[level] =
            std::max(std::fabs(lane(s.xy, 0) / m.shear - std::sin(4.0)), std::fabs(lane(s.xx, 0) / m.shear - (1 - std::cos(4.0))));
        EXPECT_LT(error[level], 1e-5);
    }
    EXPECT_NEAR(error[0] / error[1], 4, 0.2); // second order in time
}
// MAT-11: plastic volume strain over plastic shear strain is 3 alpha_psi.
TYPED_TEST(DruckerPrager, DilatancyFollowsItsAngle)
{
    const auto m = material(scene::Cone::PlaneStrain, 25, 0, 10);
    Point<TypeParam> p(m);
    p.strain({-0.02, -0.02, -0.02, 0, 0, 0});
    for (int k = 0; k < 100; ++k) p.strain({0, 0, 0, 0, 0, 1e-3});
    const double before = trace(p.at()), gamma = p.gamma;
    for (int k = 0; k < 100; ++k) p.strain({0, 0, 0, 0, 0, 1e-3});
    // all strain is isochoric: the plastic dilation comes out of the mean stress
    const double plastic_volume = -(trace(p.at()) - before) / (3 * m.bulk);
    EXPECT_NEAR(plastic_volume / (p.gamma - gamma), 3 * m.alpha_psi, 1e-10);
    EXPECT_NEAR(3 * m.alpha_psi, 0.17278, 5e-6);
}
// MAT-12: on random strain paths plastic work never falls, and work splits into elastic energy and plastic work.
TYPED_TEST(DruckerPrager, WorkSplitsIntoElasticAndPlastic)
{
    std::mt19937_64 g(3);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int path = 0; path < 200; ++path) {
        const auto m = material(scene::Cone::Compression, 20 + 10 * u(g), 2000 * (1 + u(g)), path % 2 ? 5 : 0);
        Point<TypeParam> p(m);
        p.strain({-0.01, -0.01, -0.01, 0, 0, 0});
        double dissipated = 0, done = p.work;
        const auto elastic = [&](const Stress& s) { return J2(deviator(s)) / (2 * m.shear) + trace(s) * trace(s) / (18 * m.bulk); };
        EXPECT_NEAR(elastic(p.at()) / p.work, 1, 1e-12);
        for (int k = 0; k < 200; ++k) {
            const Stress e{2e-4 * u(g), 2e-4 * u(g), 2e-4 * u(g), 2e-4 * u(g), 2e-4 * u(g), 2e-4 * u(g)};
            const double before = p.plastic_work, E0 = elastic(p.at());
            const Stress trial = p.at() + hooke(e, Elastoplastic<double>::from(m)), s0 = p.at();
            p.strain(e);
            EXPECT_GE(p.plastic_work - before, -1e-9);
            // with the mean stress of the increment the split is exact: eps_p = C^-1 (trial - sigma)
            const Stress gap = trial - p.at();
            const Stress eps_p = plus_isotropic((1 / (2 * m.shear)) * deviator(gap), trace(gap) / (9 * m.bulk));
            dissipated = 0.5 * contract(s0 + p.at(), eps_p);
            EXPECT_NEAR(p.work - done, elastic(p.at()) - E0 + dissipated, 1e-10 * (std::fabs(E0) + 1));
            done = p.work;
            const double F = lane(yield_function(p.sigma, p.soil), 0);
            EXPECT_LE(F, 1e-12 * std::max(std::fabs(trace(p.at())), m.k + 1));
        }
    }
}
// The cones' numbers (reference table, phi = 25 and 30 deg).
TEST(Cones, HaveTheSlopesOfTheTable)
{
    using scene::Cone;
    EXPECT_NEAR(Material::slope(Cone::Compression, 25 * degree), 0.1893, 5e-5);
    EXPECT_NEAR(Material::slope(Cone::Extension, 25 * degree), 0.1426, 5e-5);
    EXPECT_NEAR(Material::slope(Cone::PlaneStrain, 25 * degree), 0.1369, 5e-5);
    EXPECT_NEAR(Material::slope(Cone::PlaneStrainNoDilation, 25 * degree), 0.1409, 5e-5);
    EXPECT_NEAR(Material::slope(Cone::Compression, 30 * degree), 0.2309, 5e-5);
}
