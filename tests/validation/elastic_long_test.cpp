// The swinging plate (SPH-5) and the colliding rings (SPH-6) at the spacings of their criteria.
#include "tests/validation/beam.hpp"
#include "tests/validation/rings.hpp"

using namespace kuzure;
using namespace kuzure::validation;

TEST(Elastic, PlatesPeriodFallsTowardsTheThinPlate)
{
    Case c("SPH-5-long");
    const double T10 = swing(c, 10, 0.05, 0.5).period, T14 = swing(c, 14, 0.05, 0.5).period;
    EXPECT_TRUE(c.near("period, H/dx = 10", 0.2540, T10, "s", 0.10, {.note = soft_surface, .achieved = 0.32}));
    EXPECT_TRUE(c.near("period, H/dx = 14", 0.2540, T14, "s", 0.10, {.note = soft_surface, .achieved = 0.28}));
    EXPECT_TRUE(c.at_most("period at H/dx = 14 over that at 10", T14 / T10, "1", 1));
    const double C10 = swing(c, 10, 0.05, 0.5, 0.3, 0.1, "correction = \"gradient\"").period;
    EXPECT_TRUE(c.near("period, H/dx = 10, corrected", 0.2540, C10, "s", 0.10));
    const double S10 = swing(c, 10, 0.01, 0.5, 0.3, 0.1, "correction = \"gradient\"").period;
    c.report("period, H/dx = 10, corrected, V_f = 0.01", S10, "s");
    const double A10 = swing(c, 10, 0.05, 0.5, 0.3, 0.1, adjoint).period, A14 = swing(c, 14, 0.05, 0.5, 0.3, 0.1, adjoint).period;
    EXPECT_TRUE(c.near("period, H/dx = 10, forces adjoint to the corrected gradient", 0.2540, A10, "s", 0.08));
    EXPECT_TRUE(c.near("period, H/dx = 14, forces adjoint to the corrected gradient", 0.2540, A14, "s", 0.05,
                       {.note = "closed form of the corrected operator 2 %"}));
    // order of the distance to the thin plate
    c.report("observed order, 10 to 14", observed_order(T10 - 0.2540, T14 - 0.2540, 1.4), "1");
}

TEST(Elastic, PlateStaysInOnePiece)
{
    Case c("SPH-5-long");
    const auto s = swing(c, 6, 0.05, 5);
    EXPECT_TRUE(c.at_least("periods swung before it flies apart, H/dx = 6", s.swings, "1", 5,
                           {.note = s.failed_at > 0 ? fmt::format("flew apart at t = {:.4g} s, cause not found", s.failed_at) : ""}));
    c.report("pieces at the end", s.pieces, "1");
}

TEST(Elastic, RingsRebound)
{
    Case c("SPH-6-long");
    const double dx = 0.001;
    const auto r = collide(c, dx, own_epsilon, 4.0e-4), gray = collide(c, dx, 0.3, 4.0e-4);
    EXPECT_TRUE(c.near("pieces after the rebound, dx = r/10", 2, r.pieces, "1", 0));
    EXPECT_TRUE(c.at_least("least distance, dx = r/10", r.least_distance, "dx", 0.5));
    c.report("the same, old criterion: eps = 0.3", gray.least_distance, "dx", old_epsilon);
    c.report("particles with a neighbour nearer than 0.6 dx, share, dx = r/10", r.clumped, "1");
    EXPECT_TRUE(c.at_least("speed of parting over that of meeting, dx = r/10", r.speed, "1", 0.5));
    const auto paired = collide(c, 0.00125, own_epsilon, 4.0e-4, "kernel = \"cubic spline\"");
    EXPECT_TRUE(c.at_least("least distance, cubic spline, dx = r/8", paired.least_distance, "dx", 0.5,
                           {.note = "the cubic spline pairs particles at h = 1.5 dx", .achieved = 0.1}));
}
