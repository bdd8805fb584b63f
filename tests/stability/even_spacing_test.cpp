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

} // namespace

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
