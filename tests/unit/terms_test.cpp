// Artificial stress from principal stresses (effects/artificial_stress.cpp): against stresses whose axes are known, and where rotations end
// in nothing.
#include "solver/effects/artificial_stress.hpp"
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
