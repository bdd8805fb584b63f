// Soil "at rest" where no closed form holds: it settles before t = 0 and is in equilibrium when it is released.
#include "tests/validation/case.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

const std::string at_rest = "soil = \"s\"\nstress = \"at rest\"";

/// A bank of 4 m with a slope in front, between smooth walls on a rough floor; of cohesive soil, 2-D. Mirrored: at -x; moved along x by
/// `shift` m.
SceneText bank(double top, const std::string& strength, int side = 1, double shift = 0)
{
    SceneText t;
    t.spacing = 0.25, t.density = 1900, t.young = 2e7, t.strength = strength;
    const auto x = [&](double a) { return side * a + shift; };
    const auto wall = [&](double a, double b, double low, double high, const char* surface) {
        return box("wall", {std::min(x(a), x(b)), 0, low}, {std::max(x(a), x(b)), 0, high}, fmt::format("surface = \"{}\"", surface));
    };
    t.bodies = polygon("body", {{x(0), 0}, {x(14), 0}, {x(14), 1}, {x(top + 3.1), 1}, {x(top), 4}, {x(0), 4}}, at_rest);
    t.walls = wall(-1, 15, -1, 0, "rough") + wall(-1, 0, 0, 5, "smooth") + wall(14, 15, 0, 5, "smooth");
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1 }\n";
    t.end = 1;
    return t;
}
double peak_speed(Simulation& sim)
{
    double v = 0;
    while (!sim.finished()) sim.step(), v = std::max(v, sim.max_speed());
    return v;
}

} // namespace

TEST(Settling, ABankStandsAndStartsFromNothing)
{
    Simulation sim(Comm::world(), bank(5, "cohesion = 1.0e4\nfriction_angle = 25.0").scene());
    ASSERT_TRUE(sim.settled().has_value());
    const Settling s = *sim.settled();
    EXPECT_TRUE(s.at_rest);
    EXPECT_FALSE(s.held);
    EXPECT_LT(s.steps, 2 * steps_to_settle(sim.scene(), sim.filling()));
    EXPECT_EQ(sim.steps(), 0);
    EXPECT_EQ(sim.time(), 0);
    double moved = 0, sheared = 0, deepest = 0;
    each(sim, [&](Index i) {
        moved = std::max(moved, length(position(sim, i) - origin(sim, i)));
        sheared = std::max(sheared, sim.particles()[field::plastic_strain][i]);
        deepest = std::min(deepest, stress(sim, i).zz);
    });
    EXPECT_EQ(moved, 0);
    EXPECT_EQ(sheared, 0);
    const Ledger l = sim.ledger();
    EXPECT_EQ(l.state.potential, 0);
    EXPECT_EQ(l.dissipated.plastic, 0);
    // it carries the weight of 4 m
    EXPECT_NEAR(deepest, -1900 * gravity * 4, 0.1 * 1900 * gravity * 4);
    EXPECT_LT(peak_speed(sim), 5 * settled_speed(sim.scene()));
    EXPECT_LT(std::abs(sim.residual(sim.ledger())), 1e-2);
}

// Closed form of a layer on an infinite slope, here drawn level under tilted gravity.
TEST(Settling, ALayerUnderTiltedGravityHangsOnItsFloor)
{
    SceneText t = SceneText{}.with_default_kernel();
    t.spacing = 0.1, t.density = 2000, t.young = 2e7;
    t.space = periodic(0.8, -1, 3);
    t.bodies = box("body", {0, 0, 0}, {0.8, 0, 2}, at_rest);
    t.walls = box("wall", {0, 0, -0.4}, {0.8, 0, 0}, "");
    const double slope = 20 * pi / 180, gx = gravity * std::sin(slope), gz = gravity * std::cos(slope);
    t.effects = fmt::format("gravity = [{}, 0.0, {}]\n", gx, -gz);
    Simulation sim(Comm::world(), t.scene());
    ASSERT_TRUE(sim.settled().has_value());
    EXPECT_TRUE(sim.settled()->at_rest);
    each(sim, [&](Index i) {
        const double depth = t.density * (2 - sim.filling().soil_position(sim.particles()[field::id][i]).z);
        EXPECT_NEAR(stress(sim, i).zz, -depth * gz, 0.05 * t.density * 2 * gz);
        EXPECT_NEAR(stress(sim, i).xz, depth * gx, 0.05 * t.density * 2 * gx);
    });
}

TEST(Settling, TheMirroredAndTheMovedBankGetTheSameStress)
{
    const std::string strength = "cohesion = 1.0e4\nfriction_angle = 25.0";
    const auto index = [](const Simulation& s, Index i, int side, double shift) {
        const Vector x = s.filling().soil_position(s.particles()[field::id][i]);
        return std::pair{std::lround(side * (x.x - shift) * 100), std::lround(x.z * 100)};
    };
    std::map<std::pair<long, long>, Stress> first;
    Simulation a(Comm::world(), bank(5, strength).scene());
    each(a, [&](Index i) { first[index(a, i, 1, 0)] = stress(a, i); });
    for (const auto& [side, shift] : {std::pair{-1, 0.0}, std::pair{1, 1000.0}, std::pair{-1, -2500.0}}) {
        Simulation b(Comm::world(), bank(5, strength, side, shift).scene());
        ASSERT_EQ(a.particles().size(), b.particles().size());
        each(b, [&](Index i) {
            ASSERT_TRUE(first.contains(index(b, i, side, shift)));
            const Stress s = first[index(b, i, side, shift)], m = stress(b, i);
            EXPECT_NEAR(s.zz, m.zz, 1e-6 * 8e4);
            EXPECT_NEAR(s.xx, m.xx, 1e-6 * 8e4);
            EXPECT_NEAR(s.xz, side * m.xz, 1e-6 * 8e4);
        });
    }
}

// What does not stand is held, like soil behind a gate, and let go at t = 0.
TEST(Settling, ASlopeThatDoesNotStandIsHeldUntilItStarts)
{
    Simulation sim(Comm::world(), bank(1, "friction_angle = 15.0").scene());
    ASSERT_TRUE(sim.settled().has_value());
    EXPECT_TRUE(sim.settled()->held);
    each(sim, [&](Index i) { EXPECT_EQ(sim.particles()[field::plastic_strain][i], 0); });
    EXPECT_GT(peak_speed(sim), 0.5);
}

TEST(Settling, SoilThatFailsOnItsWayDownIsHeld)
{
    RunOptions options;
    int failures = 0;
    options.settling = [&](const Settling& s) {
        if (s.steps == 5 && failures++ == 0) throw NumbersFailed("a wall gave energy");
        return false;
    };
    Simulation sim(Comm::world(), bank(5, "cohesion = 1.0e4\nfriction_angle = 25.0").scene(), options);
    ASSERT_TRUE(sim.settled().has_value());
    EXPECT_TRUE(sim.settled()->held);
    EXPECT_TRUE(sim.settled()->at_rest);
    // What fails while it is held fails.
    options.settling = [](const Settling& s) -> bool { return s.steps % 5 == 0 ? throw NumbersFailed("a wall gave energy") : false; };
    EXPECT_THROW(Simulation(Comm::world(), bank(5, "cohesion = 1.0e4").scene(), options), NumbersFailed);
}

TEST(Settling, BodiesThatAreNotAtRestStayAsTheSceneDrawsThem)
{
    SceneText t = bank(5, "cohesion = 1.0e4\nfriction_angle = 25.0");
    // before it in the file, so that numbers of particles differ from those of the settling run
    t.bodies = box("body", {8, 0, 6}, {9, 0, 7}, "soil = \"s\"\nvelocity = [0.0, 0.0, -3.0]") + t.bodies;
    Simulation sim(Comm::world(), t.scene());
    ASSERT_TRUE(sim.settled().has_value());
    EXPECT_EQ(sim.particles().size(), sim.filling().soil_count());
    std::set<std::int64_t> seen;
    int boulder = 0;
    each(sim, [&](Index i) {
        const auto id = sim.particles()[field::id][i];
        seen.insert(id);
        const Vector drawn = sim.filling().soil_position(id);
        if (sim.filling().body_of(id) == 0) {
            ++boulder;
            EXPECT_EQ(position(sim, i), drawn);
            EXPECT_EQ(velocity(sim, i), (Vector{0, 0, -3}));
            EXPECT_EQ(stress(sim, i), Stress{});
        } else EXPECT_LT(length(position(sim, i) - drawn), 0.1 * t.spacing);
    });
    EXPECT_EQ(boulder, 16);
    EXPECT_EQ(std::int64_t(seen.size()), sim.filling().soil_count());
}

TEST(Settling, ItCanBeStopped)
{
    RunOptions options;
    options.settling = [](const Settling& s) { return s.steps == 5; };
    EXPECT_THROW(Simulation(Comm::world(), bank(5, "cohesion = 1.0e4").scene(), options), SettlingStopped);
}
