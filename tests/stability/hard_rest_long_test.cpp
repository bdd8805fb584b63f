// A hard case in full size: a heap that rests for 100 sqrt(H/g) (H13).
#include "tests/stability/heap.hpp"

using namespace kuzure;
using namespace kuzure::validation;

TEST(H13Long, HeapAtRest)
{
    Case c("H13-long");
    struct Kernel {
        const char* name;
        double h;
        Extra extra = {};
    };
    for (const Kernel& k : {Kernel{"cubic spline", 1.2}, Kernel{"cubic spline", 1.3, {.note = "known to creep", .achieved = 0.2}},
                            Kernel{"wendland c2", 1.5}}) {
        const auto r = heap(0.02, 1.4, 100, k.name, k.h);
        const std::string name = fmt::format("100 sqrt(H/g), {} h {}: ", k.name, k.h);
        EXPECT_TRUE(c.at_most(name + "drift", r.drift, "dx", 0.1, k.extra));
        EXPECT_TRUE(c.at_most(name + "kinetic over potential energy", r.kinetic, "1", 1e-8));
        EXPECT_TRUE(c.at_most(name + "drift of the last quarter less that of the first", r.late - r.early, "dx", 1e-6, k.extra));
    }
}
