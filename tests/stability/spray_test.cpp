// Soil that has opened and flies: its opened volume is a state of the place, not of the way there, and has a bound; so a rough slope sheds
// soil for as long as it likes, and soil that was thrown and lands keeps its volume.
#include "solver/physics/smoothing.hpp"
#include "tests/stability/hard.hpp"
#include <map>
#include <random>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// What fills a particle's support: its neighbours' volumes, and twice the wall's, V sum_j W + 2 V sum_w W.
double filled(const Simulation& sim, Index i, std::span<const Vector> wall)
{
    const CubicSpline kernel(sim.scene().smoothing_length(), 2);
    const auto W = [&](Vector there) { return kernel.value(std::max(2 * kernel.h - length(position(sim, i) - there), 0.0)); };
    double sum = 0;
    each(sim, [&](Index j) { sum += W(position(sim, j)); });
    for (const Vector& w : wall) sum += 2 * W(w);
    return sim.scene().particle_volume() * sum;
}
double opened(const Simulation& sim, Index i) { return sim.particles()[field::opened_volume][i]; }

/// A dry block that flies apart from a rough floor, or from nothing: the worst difference of opened volume from what its support has lost,
/// the most that has opened, and the worst density of the soil itself.
struct Burst {
    double error = 0, most = 0, density = 0;
};
Burst burst(bool floor, const std::string& scheme)
{
    SceneText t;
    t.spacing = 0.02, t.end = 0.06, t.strength = "friction_angle = 30.0",
    t.accuracy += "\nkernel_norm = \"continuum\"\nscheme = \"" + scheme + "\"\ncfl = 0.2";
    t.bodies = box("body", {0, 0, 0}, {0.2, 0, 0.2});
    std::vector<Vector> points;
    if (floor) {
        t.walls = box("wall", {-0.1, 0, -0.08}, {0.3, 0, 0}, "");
        for (int k = 0; k < 20; ++k)
            for (int l = 0; l < 4; ++l) points.push_back({-0.09 + 0.02 * k, 0, -0.01 - 0.02 * l});
    }
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> u(-0.1, 0.1);
    Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                       set_velocity(p, i, {20 * (x.x - 0.1) + u(random), 0, 1 + 20 * x.z + u(random)});
                   }));
    std::map<std::int64_t, double> before;
    const auto id = [&](Index i) { return sim.particles()[field::id][i]; };
    each(sim, [&](Index i) { before[id(i)] = filled(sim, i, points); });
    Burst b;
    while (!sim.finished()) {
        sim.step();
        if (sim.steps() % 10) continue;
        each(sim, [&](Index i) {
            b.error = std::max(b.error, std::fabs(opened(sim, i) - (before[id(i)] - filled(sim, i, points))));
            b.most = std::max(b.most, opened(sim, i));
            b.density = std::max(b.density, std::fabs(sim.particles()[field::density][i] / t.density - 1));
        });
    }
    return b;
}

/// Dry soil let fall into a smooth-sided box with a rough floor and a ceiling.
struct Dropped {
    double high = 0, residual = 0, given = 0; // spacings above where it would be whole; of the drop; J, not above 0
};
Dropped drop(double spacing)
{
    SceneText t;
    t.spacing = spacing, t.end = 1.5, t.young = 2e6;
    t = t.with_default_kernel();
    t.strength = "friction_angle = 30.0\ncone = \"plane strain, no dilation\"", t.effects = weight + mild;
    t.bodies = box("body", {0, 0, 0.3}, {0.5, 0, 0.8});
    t.walls = box("wall", {-0.2, 0, -0.2}, {0.7, 0, 0}, "") + box("wall", {-0.2, 0, 1}, {0.7, 0, 1.2}, "") +
              box("wall", {-0.2, 0, 0}, {0, 0, 1}, "surface = \"smooth\"") + box("wall", {0.5, 0, 0}, {0.7, 0, 1}, "surface = \"smooth\"");
    Simulation sim(Comm::world(), t.scene());
    Dropped d;
    const Outcome o = outcome(sim, [&](const Simulation& s) { d.given = std::min(d.given, s.ledger().dissipated.wall); });
    EXPECT_TRUE(o.held()) << o.failure;
    double z = 0;
    each(sim, [&](Index i) { z += position(sim, i).z / sim.particles().size(); });
    d.high = (z - 0.25) / spacing, d.residual = ledger_error(sim);
    return d;
}

} // namespace

TEST(Spray, OpensByWhatItsSupportHasLost)
{
    Case c("spray");
    for (const bool floor : {false, true}) {
        const std::string where = floor ? "off a rough floor" : "in the open";
        const Burst b = burst(floor, "staggered");
        EXPECT_TRUE(c.at_most("opened volume less what the support has lost, " + where, b.error, "1", 1e-4));
        // a support is full where it is 1, and a wall counts twice
        EXPECT_TRUE(c.at_most("the most that opens, " + where, b.most, "1", floor ? 1.3 : 0.8));
        EXPECT_GT(b.most, 0.5);
        EXPECT_TRUE(c.at_most("density of the soil between the gaps, " + where, b.density, "of its own", 1e-9));
    }
    // The book's walls are none of one surface, but grains in the open are the same.
    const Burst b = burst(false, "leap-frog");
    EXPECT_LE(b.error, 1e-2);
    EXPECT_LE(b.density, 1e-6);
}

// A block on a rough slope of 45 degrees, drawn with gravity turned: it thins out to single grains and goes on.
TEST(Spray, ARoughSlopeShedsSoilForAsLongAsItLikes)
{
    Case c("spray");
    SceneText t;
    t.spacing = 0.1, t.end = 5.8, t.density = 1800, t.young = 2e7;
    t = t.with_default_kernel();
    t.strength = "friction_angle = 30.0\ncone = \"shear\"";
    t.effects = fmt::format("gravity = [{0}, 0.0, -{0}]\n", gravity * std::sqrt(0.5)) + mild;
    t.bodies = box("body", {0, 0, 0}, {3, 0, 0.8}), t.walls = box("wall", {-1, 0, -0.4}, {110, 0, 0}, "");
    Simulation sim(Comm::world(), t.scene());
    double density = 0, most = 0;
    const Outcome o = outcome(sim, [&](const Simulation& s) {
        if (s.steps() % 20) return;
        each(s, [&](Index i) {
            density = std::max(density, std::fabs(s.particles()[field::density][i] / t.density - 1));
            most = std::max(most, opened(s, i));
        });
    });
    EXPECT_TRUE(o.held()) << o.failure;
    EXPECT_TRUE(c.at_most("rough slope of 45 degrees: density of the soil between the gaps", density, "of its own", 0.01));
    EXPECT_TRUE(c.at_most("rough slope of 45 degrees: the most that opens", most, "1", 1.5));
    EXPECT_TRUE(c.at_most("rough slope of 45 degrees: energy residual", ledger_error(sim), "1", 1e-4));
    EXPECT_TRUE(c.at_least("rough slope of 45 degrees: work taken by the wall",
                           sim.ledger().dissipated.wall / sim.ledger().dissipated.viscous, "of the viscous", -1e-3));
}

// Whatever has opened on the way closes again: what is left is the layers at free faces, a part of a spacing at any resolution.
TEST(Spray, SoilThatIsThrownLandsWithItsOwnVolume)
{
    Case c("spray");
    for (const double spacing : {0.05, 0.025}) {
        const Dropped d = drop(spacing);
        const std::string what = fmt::format("soil dropped into a box, {} layers: ", std::lround(0.5 / spacing));
        EXPECT_TRUE(c.at_most(what + "centre above that of its own volume", d.high, "spacings", 0.8));
        EXPECT_TRUE(c.at_most(what + "energy residual", d.residual, "1", 0.01));
        EXPECT_TRUE(c.at_least(what + "work taken by walls", d.given, "J", -0.5));
    }
}
