// Whole runs against closed forms, on any number of ranks: free fall, walls, an elastic column, the energy ledger.
#include "io/scene_file.hpp"
#include "solver/run/simulation.hpp"
#include "tests/mpi/world.hpp"
#include <fmt/format.h>
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

struct SceneText {
    std::string end = "1.0", step = "step = 1.0e-4", bodies, walls, effects = "gravity = [0.0, 0.0, -9.81]", space, soil, accuracy;
    int dimensions = 3;
    double spacing = 0.04;
    Scene scene() const
    {
        const std::string text =
            fmt::format("title = \"test\"\ndimensions = {}\n[space]\nspacing = {}\nh = 1.2\n{}\n[time]\nend = {}\n{}\n[soil.s]\ndensity = "
                        "1850.0\nyoung = 1.8e6\n"
                        "poisson = 0.3\nfriction_angle = 25.0\n{}\n{}\n{}\n[effects]\n{}\n[accuracy]\nkernel = \"cubic spline\"\n{}\n",
                        dimensions, spacing, space, end, step, soil, bodies, walls, effects, accuracy);
        return io::parse_scene(text, "test");
    }
};
std::string box(const char* what, const std::string& low, const std::string& high, const std::string& more)
{
    return fmt::format("[[{}]]\nbox = {{ low = [{}], high = [{}] }}\n{}\n", what, low, high, more);
}
Vector mean_velocity(const Simulation& sim)
{
    double sums[4] = {0, 0, 0, double(sim.particles().size())};
    for (Index i = 0; i < sim.particles().size(); ++i) {
        const Vector v = sim.particles()[field::velocity][i];
        sums[0] += v.x, sums[1] += v.y, sums[2] += v.z;
    }
    world().sum(std::span<double>(sums));
    return {sums[0] / sums[3], sums[1] / sums[3], sums[2] / sums[3]};
}

} // namespace

// SPH-2: z = z0 - g t^2/2, and not a pascal of stress.
TEST(FreeFall, IsExactAndStressFree)
{
    SceneText t;
    t.end = "0.05";
    t.bodies = box("body", "0, 0, 0", "0.24, 0.24, 0.24", "soil = \"s\"\nvelocity = [1.0, 0.0, 2.0]");
    t.effects += "\nviscosity = { alpha = 0.1, beta = 0.0 }";
    Simulation sim(world(), t.scene());
    while (!sim.finished()) sim.step();
    const double fallen = 2.0 * 0.05 - 0.5 * 9.81 * 0.05 * 0.05;
    for (Index i = 0; i < sim.particles().size(); ++i) {
        const Vector d = sim.particles()[field::position][i] - sim.particles()[field::origin][i];
        EXPECT_NEAR(d.z, fallen, 1e-12);
        EXPECT_NEAR(d.x, 0.05, 1e-12);
        EXPECT_LE(std::fabs(sim.particles()[field::stress][i].zz), 1e-6);
    }
    EXPECT_EQ(world().sum(std::int64_t(sim.particles().size())), 216);
    EXPECT_LT(std::fabs(sim.residual(sim.ledger())), 1e-9);
}

// A cohesive block slides on: a smooth floor leaves its speed, a rough one takes it, friction is in between.
TEST(Walls, SmoothLetsSlideRoughHolds)
{
    double left[3];
    const char* surfaces[3] = {"\"smooth\"", "\"rough\"", "{ friction_angle = 20.0 }"};
    for (int k = 0; k < 3; ++k) {
        SceneText t;
        t.end = "0.1";
        t.soil = "cohesion = 2.0e4";
        t.bodies = box("body", "0, 0, 0", "0.4, 0.24, 0.16", "soil = \"s\"\nvelocity = [0.5, 0.0, 0.0]");
        t.walls = box("wall", "-0.4, -0.4, -0.16", "1.2, 0.64, 0", fmt::format("surface = {}", surfaces[k]));
        t.effects += "\nviscosity = { alpha = 0.1, beta = 0.0 }";
        Simulation sim(world(), t.scene());
        while (!sim.finished()) sim.step();
        left[k] = mean_velocity(sim).x / 0.5;
    }
    EXPECT_GT(left[0], 0.98) << "a smooth wall must not brake";
    EXPECT_LT(left[1], 0.60) << "a rough wall must brake";
    // v = v0 - tan(20 deg) g t, while the block bounces on its first contact with gravity
    EXPECT_NEAR(left[2], 1 - std::tan(20 * std::acos(-1.0) / 180) * 9.81 * 0.1 / 0.5, 0.1);
    EXPECT_GT(left[2], left[1]) << "friction cannot brake more than no slip";
}

// SPH-8: an elastic column under sudden gravity swings with T = 4 H/c_p.
TEST(Column, SwingsWithThePeriodOfItsPWave)
{
    SceneText t;
    t.end = "0.2";
    t.soil = "cohesion = 1.0e6";
    t.space = "low = [0.0, 0.0, -1.0]\nhigh = [0.24, 0.24, 3.0]\nperiodic = [\"x\", \"y\"]";
    t.bodies = box("body", "0, 0, 0", "0.24, 0.24, 1.2", "soil = \"s\"");
    t.walls = box("wall", "0, 0, -0.16", "0.24, 0.24, 0", "");
    t.effects += "\nartificial_stress = \"auto\"";
    Simulation sim(world(), t.scene());
    const double period = 4 * 1.2 / sim.soils()[0].c_p;
    double before = -1, last = 0, half = 0;
    while (!sim.finished()) {
        sim.step();
        if (sim.steps() % 5) continue;
        const double kinetic = sim.ledger().state.kinetic;
        if (sim.time() > 0.3 * period && before >= last && kinetic > last) {
            half = sim.time() - 5e-4; // the lower turning point
            break;
        }
        before = last, last = kinetic;
    }
    EXPECT_NEAR(half / (0.5 * period), 1, 0.04);
    EXPECT_LT(std::fabs(sim.residual(sim.ledger())), 0.01);
}

// SPH-13: the ledger of a collapse closes, in 3-D and in plane strain, with fixed and following steps.
TEST(Ledger, ClosesInACollapse)
{
    for (const int dimensions : {3, 2})
        for (const bool fixed : {true, false}) {
            SceneText t;
            t.dimensions = dimensions;
            t.end = "0.25";
            if (!fixed) t.step.clear();
            t.bodies = box("body", "0, 0, 0", dimensions == 3 ? "0.32, 0.32, 0.32" : "0.64, 0, 0.64", "soil = \"s\"");
            t.walls = box("wall", "-0.8, -0.8, -0.16", dimensions == 3 ? "1.12, 1.12, 0" : "2.0, 0, 0", "");
            t.effects += "\nviscosity = { alpha = 0.1, beta = 0.0 }";
            Simulation sim(world(), t.scene());
            while (!sim.finished()) sim.step();
            const Ledger l = sim.ledger();
            EXPECT_LT(std::fabs(sim.residual(l)), 0.01) << dimensions << "-D, fixed step " << fixed;
            EXPECT_LT(l.state.potential, 0);
            EXPECT_GT(l.dissipated.plastic, 0.3 * -l.state.potential);
            EXPECT_GT(l.dissipated.viscous, 0);
            EXPECT_DOUBLE_EQ(sim.time(), 0.25);
            if (dimensions == 2)
                for (Index i = 0; i < sim.particles().size(); ++i) ASSERT_EQ(sim.particles()[field::velocity][i].y, 0);
        }
}

// Still water carries its part: effective stress is (rho g - gamma_w) times the depth, and a column at rest stays there.
TEST(PoreWater, ASubmergedColumnRestsOnItsBuoyantWeight)
{
    for (const bool wet : {true, false}) {
        SceneText t;
        t.end = "0.1";
        t.space = "low = [0.0, 0.0, -1.0]\nhigh = [0.24, 0.24, 3.0]\nperiodic = [\"x\", \"y\"]";
        t.bodies = box("body", "0, 0, 0", "0.24, 0.24, 0.8", "soil = \"s\"\nstress = \"at rest\"");
        t.walls = box("wall", "0, 0, -0.16", "0.24, 0.24, 0", "");
        t.effects += "\nviscosity = { alpha = 0.1, beta = 0.0 }";
        if (wet) t.effects += "\npore_pressure = { table = [[0.0, 2.0]] }";
        Simulation sim(world(), t.scene());
        double fastest = 0;
        while (!sim.finished()) sim.step(), fastest = std::max(fastest, sim.max_speed());
        const double weight = wet ? 1850 * 9.81 - 9810 : 1850 * 9.81;
        double error = 0, reference = 0;
        for (Index i = 0; i < sim.particles().size(); ++i) {
            const double depth = 0.8 - sim.particles()[field::position][i].z, e = sim.particles()[field::stress][i].zz + weight * depth;
            error += e * e, reference += weight * depth * weight * depth;
        }
        EXPECT_LT(std::sqrt(world().sum(error) / world().sum(reference)), 0.05) << (wet ? "wet" : "dry");
        EXPECT_LT(fastest, 0.03) << "m/s, of 4 m/s in free fall";
    }
}

// A polygon's faces on lattice points at the ends of a period: each particle belongs to one rank, by the face of the lower end.
TEST(Filling, FacesOnTheEndsOfAPeriodAreHeldOnce)
{
    SceneText t;
    t.end = "0.004";
    t.space = "low = [-1.0, -0.14, -1.0]\nhigh = [2.0, 0.14, 1.0]\nperiodic = [\"y\"]";
    t.bodies = "[[body]]\nsoil = \"s\"\npolygon = { points = [[0, 0.02], [0.8, 0.02], [0.8, 0.34], [0, 0.34]], y = [-0.14, 0.14] }\n"
               "velocity = [0.0, 1.0, 0.0]\n";
    t.walls = "[[wall]]\npolygon = { points = [[-0.2, -0.2], [1.0, -0.2], [1.0, 0.02], [-0.2, 0.02]], y = [-0.14, 0.14] }\n";
    Simulation sim(world(), t.scene());
    EXPECT_EQ(world().sum(std::int64_t(sim.particles().size())), 20 * 7 * 8);
    while (!sim.finished()) sim.step();
    EXPECT_EQ(world().sum(std::int64_t(sim.particles().size())), 20 * 7 * 8);
}
