// Bodies and walls whose faces lie on lattice points at the ends of a period: each particle belongs to one rank, by the face of the
// lower end, and is still there once the ranks have exchanged theirs.
#include "io/scene_file.hpp"
#include "solver/run/simulation.hpp"
#include "tests/mpi/world.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

TEST(Filling, FacesOnTheEndsOfAPeriodAreHeldOnce)
{
    Simulation sim(world(), io::parse_scene(R"(title = "faces on the ends of a period"
dimensions = 3
[space]
spacing = 0.04
h = 1.2
low = [-1.0, -0.14, -1.0]
high = [2.0, 0.14, 1.0]
periodic = ["y"]
[time]
end = 0.004
step = 1.0e-4
[soil.s]
density = 1850.0
young = 1.8e6
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "s"
polygon = { points = [[0, 0.02], [0.8, 0.02], [0.8, 0.34], [0, 0.34]], y = [-0.14, 0.14] }
velocity = [0.0, 1.0, 0.0]
[[wall]]
polygon = { points = [[-0.2, -0.2], [1.0, -0.2], [1.0, 0.02], [-0.2, 0.02]], y = [-0.14, 0.14] }
[effects]
gravity = [0.0, 0.0, -9.81]
)",
                                            "test"));
    EXPECT_EQ(world().sum(std::int64_t(sim.particles().size())), 20 * 7 * 8);
    while (!sim.finished()) sim.step();
    EXPECT_EQ(world().sum(std::int64_t(sim.particles().size())), 20 * 7 * 8);
}
