// A hard case in full size: a heap that rests for 100 sqrt(H/g) (H13).
#include "tests/stability/heap.hpp"

using namespace kuzure;
using namespace kuzure::validation;

TEST(HeapAtRest, InFullLength)
{
    Case c("H13-long");
    struct Kernel {
        const char* name;
        double h;
        Extra extra = {};
    };
    const Extra creeps{.note = "neighbours in a row move up and down in turn, a zero-energy mode that grows", .achieved = 0.1};
    for (const Kernel& k :
         {Kernel{"cubic spline", 1.2}, Kernel{"cubic spline", 1.3, creeps}, Kernel{"wendland c2", 1.3}, Kernel{"wendland c2", 1.5}}) {
        const auto r = heap(0.02, 1.4, 100, k.name, k.h);
        const std::string name = fmt::format("100 sqrt(H/g), {} h {}: ", k.name, k.h);
        EXPECT_TRUE(c.at_most(name + "drift", r.drift, "dx", 0.1));
        EXPECT_TRUE(c.at_most(name + "kinetic over potential energy", r.kinetic, "1", 1e-8));
        EXPECT_TRUE(c.at_most(name + "drift of the last quarter less that of the first", r.late - r.early, "dx", 1e-6, k.extra));
    }
}

TEST(HeapAtRest, OfTheSeed)
{
    Case c("H13-seed");
    // The cube of 0.8 m of jobs/scenes/quickstart.toml as 15^3 particles; it has come to rest after 4.4 s.
    Scene s = io::read_scene(KUZURE_SOURCE_DIR "/jobs/scenes/quickstart.toml",
                             std::vector<std::string>{fmt::format("space.spacing={}", 0.8 / 15), "time.end=31.0"});
    s.time.step.reset();
    Simulation sim(Comm::world(), s);
    const auto r = watch(sim, 4.4, potential_energy(sim));
    EXPECT_TRUE(
        c.at_most("100 sqrt(H/g), the seed's cube, 15^3: drift", r.drift, "dx", 0.1,
                  {.note = "of the farthest of 3375 particles: probably loose soil that closes what flight had opened", .achieved = 1}));
    EXPECT_TRUE(c.at_most("the seed's cube: particles that drift more than 0.1 dx", r.moved, "1", 0, {.note = "of 3375", .achieved = 600}));
    c.report("the seed's cube: drift in the first quarter, from 4.4 s", r.early, "dx");
    c.report("the seed's cube: drift in the last quarter, to 31 s", r.late, "dx");
    EXPECT_TRUE(c.at_most("the seed's cube: drift of the last quarter less that of the first", r.late - r.early, "dx", 1e-6));
    EXPECT_TRUE(c.at_most("the seed's cube: kinetic over potential energy", r.kinetic, "1", 1e-8));
}
