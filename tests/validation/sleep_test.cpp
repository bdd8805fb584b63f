// Soil that sleeps (accuracy.sleep_below): what it saves, what it changes, and that it wakes.
#include "solver/scene/step_limits.hpp"
#include "tests/validation/case.hpp"
#include <map>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// A hundredth of sqrt(g H): what docs/performance.md recommends.
constexpr double slow = 2e-2; // m/s

/// Level ground at rest; a block falls on its middle.
SceneText struck_ground(double sleep_below)
{
    SceneText t;
    t.spacing = 0.02;
    t.space = periodic(2, -1, 3);
    t.strength = "friction_angle = 25.0\ncone = \"plane strain\"";
    t.bodies = box("body", {0, 0, 0}, {2, 0, 0.4}, "soil = \"s\"\nstress = \"at rest\"") +
               box("body", {0.9, 0, 0.6}, {1.1, 0, 0.8}, "soil = \"s\"");
    t.walls = box("wall", {0, 0, -0.08}, {2, 0, 0}, "");
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1 }\n";
    t.accuracy = fmt::format("kernel = \"cubic spline\"\ncfl = 0.2\nsleep_below = {}\n", sleep_below);
    t.end = 0.5;
    return t;
}
double asleep(const Simulation& sim) { return double(sim.work_done().asleep) / double(sim.work_done().particle_steps); }

} // namespace

TEST(Sleep, BelowASpeedThatNothingHasNoBitChanges)
{
    Simulation off(Comm::world(), struck_ground(0).scene()), on(Comm::world(), struck_ground(1e-30).scene());
    for (int k = 0; k < 200; ++k) off.step(), on.step();
    EXPECT_EQ(asleep(on), 0);
    each(off, [&](Index i) {
        const Vector a = position(off, i), b = position(on, i), v = velocity(off, i), w = velocity(on, i);
        ASSERT_TRUE(a.x == b.x && a.z == b.z && v.x == w.x && v.z == w.z);
    });
}

TEST(Sleep, GroundSleepsUntilTheBlowComesAndAnswersItAsIfItHadNotSlept)
{
    Simulation off(Comm::world(), struck_ground(0).scene()), on(Comm::world(), struck_ground(slow).scene());
    const double fall = std::sqrt(2 * 0.2 / gravity);
    run_to(off, 0.9 * fall), run_to(on, 0.9 * fall);
    const double before = asleep(on);
    EXPECT_GT(before, 0.5) << "ground at rest lies awake";
    run_to(off, 0.5), run_to(on, 0.5);

    const auto expected = positions(off), found = positions(on);
    double moved = 0;
    std::vector<double> apart; // a few grains of the splash go their own ways
    each(on, [&](Index i) {
        const auto id = on.particles()[field::id][i];
        apart.push_back(length(found.at(id) - expected.at(id)));
        if (origin(on, i).z < 0.4) moved = std::max(moved, length(found.at(id) - origin(on, i)));
    });
    std::sort(apart.begin(), apart.end());
    const double spacing = 0.02, most = apart[apart.size() * 98 / 100];
    const auto a = off.ledger(), b = on.ledger();
    std::printf("asleep %.3f before the blow, %.3f in all; 98 of 100 places differ by less than %.3f spacings, the ground moved by %.2f; "
                "potential energy differs by %.1e, plastic work by %.1e of itself\n",
                before, asleep(on), most / spacing, moved / spacing, std::abs(b.state.potential / a.state.potential - 1),
                std::abs(b.dissipated.plastic / a.dissipated.plastic - 1));
    EXPECT_GT(moved, 0.5 * spacing) << "the ground did not wake";
    EXPECT_LT(most, 0.5 * spacing);
    EXPECT_NEAR(b.dissipated.plastic / a.dissipated.plastic, 1, 0.02);
    EXPECT_LT(std::abs(on.residual(b)), std::abs(off.residual(a)) + 0.01);
}

TEST(Sleep, NoSleeperIsMissedByAWave)
{
    // What sleeps at a check was calm with calm neighbours: until the next check no particle may have come to move fast.
    Simulation sim(Comm::world(), struck_ground(slow).scene());
    const auto every = scene::sleep_interval(sim.scene());
    ASSERT_GT(every, 3);
    double fastest = 0;
    std::int64_t sleepers = 0;
    while (!sim.finished()) {
        std::map<std::int64_t, bool> slept;
        const bool before_detection = sim.steps() % every == 0 && sim.steps() > 0;
        if (before_detection)
            each(sim, [&](Index i) {
                slept[sim.particles()[field::id][i]] = sim.particles()[field::activity][i] == std::int32_t(Activity::Asleep);
            });
        sim.step();
        if (before_detection)
            each(sim, [&](Index i) {
                if (!slept[sim.particles()[field::id][i]]) return;
                ++sleepers;
                fastest = std::max(fastest, length(velocity(sim, i)));
            });
    }
    EXPECT_GT(sleepers, 1000);
    std::printf("fastest sleeper when woken: %.2e m/s\n", fastest);
    EXPECT_LT(fastest, 2 * slow);
}
