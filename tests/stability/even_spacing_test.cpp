// Particles that are shifted where soil flows keep an even spacing: nothing is lost, moved or paid for but that.
#include "tests/stability/hard.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

struct Fallen {
    double clumped = 0, energy = 0, given = 0;  // C; E; stabilising over plastic work
    double reach = 0, height = 0, momentum = 0; // m; sideways of all, over the sum of sizes
    bool held = false;
};
/// A cube of dry sand, 20 spacings wide, 0.8 s after it was let go; `resting`: held together by cohesion.
Fallen fall(double constant, const std::string& more = "", bool resting = false)
{
    constexpr double dx = 0.04, side = 20 * dx;
    SceneText t;
    t.dimensions = 3, t.spacing = dx, t.end = resting ? 0.2 : 0.8;
    t.effects = weight + mild, t.strength = resting ? "cohesion = 1.0e12" : "friction_angle = 25.0";
    t.bodies = box("body", {0, 0, 0}, {side, side, side});
    t.walls = box("wall", {-side, -side, -4 * dx}, {2 * side, 2 * side, 0}, "");
    t = t.with_default_kernel();
    t.accuracy = fmt::format("shifting = {}\n{}", constant, more);
    Simulation sim(Comm::world(), t.scene());
    Fallen f;
    f.held = outcome(sim).held();
    f.clumped = clumped(sim), f.energy = ledger_error(sim), f.height = top(sim);
    const auto e = sim.ledger().dissipated;
    f.given = e.stabilising / std::max(e.plastic, 1e-300);
    double sum[2] = {}, sizes = 0;
    each(sim, [&](Index i) {
        const Vector x = position(sim, i) - Vector{side / 2, side / 2, 0}, v = velocity(sim, i);
        f.reach += std::hypot(x.x, x.y) / sim.particles().size();
        sum[0] += v.x, sum[1] += v.y, sizes += length(v);
    });
    f.momentum = std::hypot(sum[0], sum[1]) / std::max(sizes, 1e-300);
    return f;
}

/// A block that yields as it meets the floor, with everything that shifts and corrects, as x -> x turned and moved on sees it, and seen
/// from there again: its particles' places after five shifts, in a fixed order.
std::vector<Vector> thrown(Vector x_axis, Vector y_axis, Vector moved, double joint,
                           const std::string& accuracy = "shifting = 2.0\ncorrection = \"adjoint\"\nhourglass = 0.1")
{
    constexpr double dx = 0.04;
    const auto to = [&](Vector a) { return a.x * x_axis + a.y * y_axis + Vector{0, 0, a.z}; };
    const auto placed = [&](const char* what, Vector low, Vector high, const std::string& more) {
        const Vector a = to(dx * low) + moved, b = to(dx * high) + moved;
        return box(what, {std::min(a.x, b.x), std::min(a.y, b.y), a.z}, {std::max(a.x, b.x), std::max(a.y, b.y), b.z}, more);
    };
    SceneText t;
    t.dimensions = 3, t.spacing = dx, t.end = 0.05;
    t.effects = weight + mild + "artificial_stress = { epsilon = 0.5 }\n", t.strength = "friction_angle = 25.0\ncohesion = 200.0";
    const Vector v = to({1.0, 0.6, -2.0});
    const std::string soil = fmt::format("soil = \"s\"\nvelocity = [{}, {}, {}]", v.x, v.y, v.z);
    t.bodies = placed("body", {0, 0, 0}, {joint, 5, 6}, soil) + placed("body", {joint, 0, 0}, {7, 5, 6}, soil);
    t.walls = placed("wall", {-12, -12, -4}, {20, 20, 0}, "");
    t = t.with_default_kernel();
    t.accuracy = accuracy;
    t.time = "step = 1.0e-3";
    Simulation sim(Comm::world(), t.scene());
    run_to(sim, t.end);
    double plastic = 0;
    std::vector<Vector> all;
    each(sim, [&](Index i) {
        const Vector x = position(sim, i) - moved;
        all.push_back({dot(x, x_axis), dot(x, y_axis), x.z});
        plastic = std::max(plastic, sim.particles()[field::plastic_strain][i]);
    });
    EXPECT_GT(plastic, 0.05);
    return all;
}
/// The farthest that a place of one lies from the nearest of the other, m.
double apart(const std::vector<Vector>& a, const std::vector<Vector>& b)
{
    double most = 0;
    for (const Vector x : a) {
        double least = 1e300;
        for (const Vector y : b) least = std::min(least, length(x - y));
        most = std::max(most, least);
    }
    return most;
}

} // namespace

TEST(EvenSpacing, IsTheSameHoweverTheSceneIsDrawn)
{
    const auto as_drawn = thrown({1, 0, 0}, {0, 1, 0}, {}, 3);
    Case c("even-spacing");
    const auto same = [&](const char* how, const std::vector<Vector>& other) {
        EXPECT_TRUE(c.at_most(fmt::format("shifted and corrected, {}: places", how), apart(as_drawn, other), "m", 1e-10));
    };
    same("mirrored", thrown({-1, 0, 0}, {0, 1, 0}, {}, 3));
    same("turned", thrown({0, 1, 0}, {-1, 0, 0}, {}, 3));
    same("moved on", thrown({1, 0, 0}, {0, 1, 0}, {4, -8, 2}, 3));
    same("joined elsewhere", thrown({1, 0, 0}, {0, 1, 0}, {}, 5));
    // the controls: without each of the three
    EXPECT_GT(apart(as_drawn, thrown({1, 0, 0}, {0, 1, 0}, {}, 3, "correction = \"adjoint\"\nhourglass = 0.1")), 1e-6);
    EXPECT_GT(apart(as_drawn, thrown({1, 0, 0}, {0, 1, 0}, {}, 3, "shifting = 2.0\nhourglass = 0.1")), 1e-6);
    EXPECT_GT(apart(as_drawn, thrown({1, 0, 0}, {0, 1, 0}, {}, 3, "shifting = 2.0\ncorrection = \"adjoint\"")), 1e-6);
}

TEST(EvenSpacing, OfSoilThatFlows)
{
    Case c("even-spacing");
    const Fallen plain = fall(0), shifted = fall(2);
    EXPECT_TRUE(plain.held && shifted.held);
    EXPECT_TRUE(c.at_most("collapse of a cube, constant 2: nearer than 0.6 spacings", shifted.clumped, "1", 0.08));
    EXPECT_FALSE(c.control_at_most("the same without shifting", plain.clumped, "1", 0.08));
    EXPECT_TRUE(c.at_most("energy residual", shifted.energy, "1", 1.5e-4));
    EXPECT_TRUE(c.at_least("energy taken, over the plastic work", shifted.given, "1", 0));
    EXPECT_TRUE(c.at_most("sideways momentum of all over its sum of sizes", shifted.momentum, "1", 0.01));
    EXPECT_TRUE(c.near("mean distance from the axis against no shifting", plain.reach, shifted.reach, "m", 0.02));
    c.report("height over that without shifting", shifted.height / plain.height, "1", "the highest particle");
}

TEST(EvenSpacing, SoilThatDoesNotYieldIsLeftAlone)
{
    const Fallen plain = fall(0, "", true), shifted = fall(2, "", true);
    EXPECT_EQ(plain.reach, shifted.reach);
    EXPECT_EQ(plain.height, shifted.height);
    EXPECT_EQ(plain.energy, shifted.energy);
}

TEST(EvenSpacing, InMixedPrecision)
{
    const Fallen both[] = {fall(2), fall(2, "precision = \"mixed\"")};
    EXPECT_NEAR(both[0].reach / both[1].reach, 1, 5e-3);
    EXPECT_LT(both[1].clumped, 0.08);
    EXPECT_LT(both[1].energy, 1.5e-4);
}
