// Artificial stress from principal stresses (effects/artificial_stress.cpp): against stresses whose axes are known, and where rotations end
// in nothing.
#include "solver/effects/artificial_stress.hpp"
#include "solver/physics/smoothing.hpp"
#include <cfenv>
#include <cmath>
#include <gtest/gtest.h>

using namespace kuzure;

TEST(Tension, ActsAgainstTensilePrincipalStressAlongItsAxis)
{
    for (const double angle : {0.0, 0.3, 0.785, 1.2, 2.9}) {
        // 400 Pa of tension along (cos, sin, 0), 900 and 200 Pa of pressure across.
        const double c = std::cos(angle), s = std::sin(angle);
        const Stress tau = tension({400 * c * c - 900 * s * s, 400 * s * s - 900 * c * c, -200, 1300 * s * c, 0, 0}, 0.5);
        EXPECT_NEAR(tau.xx, -200 * c * c, 1e-10);
        EXPECT_NEAR(tau.yy, -200 * s * s, 1e-10);
        EXPECT_NEAR(tau.xy, -200 * s * c, 1e-10);
        EXPECT_NEAR(std::fabs(tau.zz) + std::fabs(tau.yz) + std::fabs(tau.xz), 0, 1e-10);
    }
    EXPECT_EQ(tension({-900, -400, -200, 0, 0, 0}, 0.5), Stress{});
}

TEST(Tension, ThePartAlongTensileAxesIsCutOut)
{
    for (const double angle : {0.0, 0.3, 0.785, 1.2, 2.9}) {
        const double c = std::cos(angle), s = std::sin(angle);
        const Stress sigma{400 * c * c - 900 * s * s, 400 * s * s - 900 * c * c, -200, 1300 * s * c, 0, 0};
        const Stress a{0.3, -0.7, 1.1, 0.2, 0.5, -0.4};
        const double along = a.xx * c * c + a.yy * s * s + 2 * a.xy * c * s; // n . a n
        const Stress part = tensile_part(sigma, a);
        EXPECT_NEAR(part.xx, along * c * c, 1e-14);
        EXPECT_NEAR(part.yy, along * s * s, 1e-14);
        EXPECT_NEAR(part.xy, along * s * c, 1e-14);
        EXPECT_NEAR(std::fabs(part.zz) + std::fabs(part.yz) + std::fabs(part.xz), 0, 1e-14);
        // adjoint to tau: sigma : N a N = -tau : a for epsilon = 1
        EXPECT_NEAR(contract(sigma, part), -contract(tension(sigma, 1), a), 1e-11);
    }
    const Stress a{0.3, -0.7, 1.1, 0.2, 0.5, -0.4};
    EXPECT_EQ(tensile_part({-900, -400, -200, 0, 0, 0}, a), Stress{});
    EXPECT_NEAR(tensile_part({900, 400, 200, 0, 0, 0}, a).xz, a.xz, 1e-15);
}

TEST(Tension, PolynomialsStandForThePower)
{
    for (const double n : {0.5, 2.55, 4.0, 20.0})
        for (const int dimensions : {2, 3}) {
            const WendlandC2 kernel(1.3, dimensions);
            scene::Effects e;
            e.artificial_stress = scene::ArtificialStress{0.4, n};
            const auto term = ArtificialStress::from(e, kernel, 1, dimensions);
            const auto power = [&](double t) { return std::pow(kernel.value(t) / kernel.value(1.6), n); };
            double worst = 0;
            for (int k = 1; k <= 10007; ++k) {
                const double t = 2.6 * k / 10007;
                worst = std::max(worst, std::fabs(term.closeness(t) - power(t)) / power(2.6));
            }
            EXPECT_LT(worst, n < 1 ? 1e-8 : 1e-11) << n; // the root has no slope at the support's end, where grad W is nothing
            // the mean on the lattice: sum f x dW/dx = 0
            double sum = 0;
            for (int x = -3; x <= 3; ++x)
                for (int y = -3; y <= 3; ++y)
                    for (int z = dimensions == 3 ? -3 : 0; z <= (dimensions == 3 ? 3 : 0); ++z) {
                        const double r = std::sqrt(double(x * x + y * y + z * z)), t = std::max(2.6 - r, 0.0);
                        if (r > 0) sum += (power(t) - term.mean) * kernel.F(t, r, 1 / r) * x * x;
                    }
            EXPECT_NEAR(sum, 0, 1e-12);
            EXPECT_NEAR(term.adjoint_epsilon, 0.4 / (1 - 0.4 * term.mean), 1e-15);
        }
}

TEST(Tension, NearlyAlignedStressRaisesNoException)
{
    const int traps = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
    for (const double shear : {1e-100, 1e-150, 1e-155, 1e-200, 1e-300, 5e-324}) {
        std::feclearexcept(FE_ALL_EXCEPT);
        const Stress tau = tension({500, -1000, -300, shear, -shear, shear}, 0.5);
        EXPECT_FALSE(std::fetestexcept(traps)) << shear;
        EXPECT_EQ(tau.xx, -250) << shear;
        EXPECT_LE(std::fabs(tau.yy) + std::fabs(tau.zz) + std::fabs(tau.xy) + std::fabs(tau.yz) + std::fabs(tau.xz), shear);
    }
}
