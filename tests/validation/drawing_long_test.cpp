// How the ground is drawn does not show: two hundred generated scenes, and flows, which are chaotic: within the scatter of nudged runs.
#include "tests/validation/drawing_cases.hpp"

using namespace kuzure;
using namespace kuzure::validation;

TEST(DrawingLong, FacesAreTheSame) { expect_same_faces(100, 200); }
TEST(DrawingLong, OneStepIsTheSame) { expect_same_step("drawing-200", 100, 200); }
TEST(DrawingLong, MotionOfSoilThatDoesNotYieldIsTheSame) { expect_same_motion("drawing-200", 100, 200); }

namespace {

/// Where soil lies: the middle of its mass and its spread, m.
struct Lie {
    double x = 0, z = 0, spread = 0;
};
Lie flow(const Generated& g, const Drawing& d, Placed soil, unsigned nudge)
{
    Draw draw(nudge);
    if (nudge > 0)
        for (auto& x : soil.x)
            x = x + 1e-6 * spacing * Vector{draw.between(-1, 1), g.dimensions == 3 ? draw.between(-1, 1) : 0, draw.between(-1, 1)};
    SceneText t;
    t.young = 2e6, t.strength = "friction_angle = 25.0", t.end = 0.6;
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1 }";
    Simulation sim(Comm::world(), scene_of(g, d, soil.x.size(), t), placed(g, d, soil));
    run_to(sim, t.end);
    Lie lie;
    const double n = double(soil.x.size());
    std::vector<Vector> at(soil.x.size());
    each(sim, [&](Index i) { // ways from the start: the same whatever the motion and the period
        const auto k = std::size_t(sim.particles()[field::id][i]);
        at[k] = d.motion.turn(position(sim, i) - origin(sim, i));
        if (d.motion.turned) at[k] = d.motion.turn(d.motion.turn(at[k]));
    });
    for (const Vector& a : at) lie.x += a.x / n, lie.z += a.z / n;
    for (const Vector& a : at) lie.spread += (a.x - lie.x) * (a.x - lie.x) / n;
    lie.spread = std::sqrt(lie.spread);
    return lie;
}

} // namespace

TEST(DrawingLong, FlowsAreWithinTheScatterOfNudgedRuns)
{
    Case c("drawing-flow");
    double worst = 0;
    for (unsigned seed = 300; seed < 312; ++seed) {
        const Generated g = generate(seed);
        if (g.dimensions == 3) continue;
        Draw draw(seed + 2000);
        const Placed soil = block_above(g, draw);
        std::vector<Lie> measure;
        for (unsigned nudge = 0; nudge < 4; ++nudge) measure.push_back(flow(g, g.drawings[0], soil, nudge));
        for (std::size_t q = 1; q < g.drawings.size(); ++q) {
            const Lie is = flow(g, g.drawings[q], soil, 0);
            for (const auto member : {&Lie::x, &Lie::z, &Lie::spread}) {
                double low = 1e9, high = -1e9;
                for (const Lie& m : measure) low = std::min(low, m.*member), high = std::max(high, m.*member);
                // Four runs show about two standard deviations; three times that is as far as a fifth goes.
                const double off = std::fabs(is.*member - 0.5 * (low + high)), scatter = 0.5 * (high - low) + 1e-9 * spacing;
                worst = std::max(worst, off / scatter);
                EXPECT_LT(off, 4 * scatter) << g.what << ", " << g.drawings[q].what << ": " << is.*member << " for " << low << " .. "
                                            << high;
            }
        }
    }
    c.report("farthest of a redrawn flow from the middle of four nudged runs, over their half range", worst, "1");
}
