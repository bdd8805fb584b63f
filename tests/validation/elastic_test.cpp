// Elastic bodies in tension: the swinging plate (SPH-5) and the colliding rings (SPH-6). Finer spacings: elastic_long_test.cpp.
#include "tests/validation/beam.hpp"
#include "tests/validation/rings.hpp"

using namespace kuzure;
using namespace kuzure::validation;

TEST(Elastic, PlateSwings)
{
    Case c("SPH-5");
    for (const int across : {6, 10})
        for (const double v : {0.05, 0.01}) {
            if (across == 10 && v < 0.02) continue;
            const auto s = swing(c, across, v, 1);
            c.report(fmt::format("period, H/dx = {}, V_f = {}", across, v), s.period, "s",
                     fmt::format("amplitude {}, pieces {}", s.amplitude, s.pieces));
        }
}

TEST(Elastic, RingsRebound)
{
    Case c("SPH-6");
    for (const double epsilon : {0.3, 0.0}) {
        const auto r = collide(c, 0.00125, epsilon, 6e-4);
        c.report(fmt::format("rings, eps {}", epsilon), r.speed, "1", fmt::format("pieces {}, least {}", r.pieces, r.least_distance));
    }
}
