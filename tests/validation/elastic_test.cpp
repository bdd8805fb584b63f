// Elastic bodies in tension: the swinging plate (SPH-5) and the colliding rings (SPH-6), on coarse spacings. The spacings of
// their criteria: elastic_long_test.cpp.
#include "tests/validation/beam.hpp"
#include "tests/validation/rings.hpp"

using namespace kuzure;
using namespace kuzure::validation;

TEST(Elastic, CoarsePlateSwingsInOnePiece)
{
    Case c("SPH-5");
    const auto s = swing(c, 6, 0.05, 0.5);
    EXPECT_TRUE(c.near("period, H/dx = 6, V_f = 0.05", 0.2540, s.period, "s", 0.10, {.note = soft_surface, .achieved = 0.36}));
    EXPECT_TRUE(c.at_least("tip deflection over L", s.amplitude / 0.2, "1", 0.5));
    EXPECT_EQ(s.pieces, 1);
}

TEST(Elastic, CoarseCorrectedPlateIsStiffer)
{
    Case c("SPH-5");
    const auto s = swing(c, 6, 0.05, 0.5, 0.3, 0.1, "correction = \"gradient\"");
    EXPECT_TRUE(c.near("period, H/dx = 6, V_f = 0.05, corrected", 0.2540, s.period, "s", 0.10,
                       {.note = "the pair force keeps the plain gradient; amplitude 0.6 L", .achieved = 0.14}));
    EXPECT_EQ(s.pieces, 1);
}

TEST(Elastic, CoarsePlateOfAdjointForcesSwingsRight)
{
    Case c("SPH-5");
    const auto s = swing(c, 6, 0.05, 0.5, 0.3, 0.1, adjoint);
    EXPECT_TRUE(c.near("period, H/dx = 6, V_f = 0.05, forces adjoint to the corrected gradient", 0.2540, s.period, "s", 0.15));
    c.report("energy residual of it, over the largest energy", s.residual, "1", "without correction 2.7e-3, in the gradient alone 6.5e-3");
    EXPECT_EQ(s.pieces, 1);
}

TEST(Elastic, CoarseRingsRebound)
{
    Case c("SPH-6");
    const double dx = 0.01 / 6;
    const auto r = collide(c, dx, own_epsilon, 4.0e-4), gray = collide(c, dx, 0.3, 4.0e-4);
    EXPECT_TRUE(c.near("pieces after the rebound, dx = r/6", 2, r.pieces, "1", 0));
    EXPECT_TRUE(c.at_least("least distance, dx = r/6", r.least_distance, "dx", 0.5));
    EXPECT_TRUE(c.at_most("particles with a neighbour nearer than 0.6 dx, share, dx = r/6", r.clumped, "1", 1e-3));
    EXPECT_TRUE(c.at_least("speed of parting over that of meeting, dx = r/6", r.speed, "1", 0.5));
    c.report("the same, old criterion: eps = 0.3", gray.clumped, "1", old_epsilon);
    // Negative control: without artificial stress the rings clump and break.
    const auto broken = collide(c, dx, 0, 2.5e-4);
    EXPECT_FALSE(c.control("least distance, eps = 0, dx = r/6", broken.least_distance, "dx", ">= 0.5", broken.least_distance >= 0.5));
    EXPECT_FALSE(c.control("pieces, eps = 0, dx = r/6", broken.pieces, "1", "at most 2", broken.pieces <= 2));
}
