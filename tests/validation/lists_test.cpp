// What the running program's lists, pruned and kept for many steps, hold against all pairs there are: 2-D and 3-D, open and
// periodic, double and mixed precision, with walls.
#include "tests/validation/case.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// Directed pairs nearer than two smoothing lengths, of soil with soil, its periodic images, and walls.
std::int64_t all_pairs(const Simulation& sim)
{
    const Scene& scene = sim.scene();
    std::vector<Vector> soil, others;
    each(sim, [&](Index i) { soil.push_back(position(sim, i)); });
    const auto& periodic = scene.space.periodic;
    const Vector period = scene.space.low ? *scene.space.high - *scene.space.low : Vector{};
    for (int a = -periodic[0]; a <= periodic[0]; ++a)
        for (int b = -periodic[1]; b <= periodic[1]; ++b) {
            const Vector shift{a * period.x, b * period.y, 0};
            for (const Vector& x : soil) others.push_back(x + shift);
            const double all = 1e9;
            sim.filling().for_each_wall_in({{-all, -all, -all}, {all, all, all}},
                                           [&](std::int64_t, Vector x, int) { others.push_back(x + shift); });
        }
    const double reach = scene.support();
    std::int64_t pairs = -std::int64_t(soil.size()); // everybody is near itself
    for (const Vector& x : soil)
        for (const Vector& y : others) {
            const Vector r = x - y;
            pairs += dot(r, r) < reach * reach;
        }
    return pairs;
}

} // namespace

TEST(Lists, PairsOfAStepAreThoseOfAllParticles)
{
    struct Case {
        const char* name;
        int dimensions;
        char periodic; // axis, or 0
    };
    for (const Case& c : {Case{"3-D", 3, 0}, {"3-D periodic in y", 3, 'y'}, {"2-D", 2, 0}, {"2-D periodic in x", 2, 'x'}})
        for (const char* precision : {"double", "mixed"})
            for (const char* kernel : {"cubic spline", "wendland c2"}) {
                SceneText t;
                t.dimensions = c.dimensions, t.spacing = 0.04, t.h = std::string(kernel) == "cubic spline" ? 1.2 : 1.4;
                const double d = t.spacing, n = c.dimensions == 3 ? 8 * d : 16 * d;
                if (c.periodic)
                    t.space = fmt::format("low = [{}, 0.0, -1.0]\nhigh = [{}, {}, 3.0]\nperiodic = [\"{}\"]",
                                          c.periodic == 'x' ? 0.0 : -3.0, c.periodic == 'x' ? n : 5.0, n, c.periodic);
                t.strength = "friction_angle = 25.0";
                t.bodies = box("body", {0, 0, 0}, {n, n, n},
                               fmt::format("soil = \"s\"\nvelocity = [2.0, {}, -1.0]", c.dimensions == 3 ? 1.0 : 0.0));
                t.walls = box("wall", {0, 0, -4 * d}, {n, n, 0}, "");
                if (!c.periodic) t.walls += box("wall", {n + 4 * d, 0, 0}, {n + 8 * d, n, n}, "");
                t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.5, beta = 1.0 }\n";
                t.accuracy = fmt::format("kernel = \"{}\"\nprecision = \"{}\"\nskin = 0.1\ncfl = 0.4\n", kernel, precision);
                Simulation sim(Comm::world(), t.scene());
                const std::string name = fmt::format("{}, {}, {}", c.name, precision, kernel);
                for (int round = 0; round < 6; ++round) {
                    for (int k = 0; k < 37; ++k) sim.step();
                    const auto before = sim.pairs();
                    sim.step();
                    const auto expected = all_pairs(sim); // forces are those of where the step leads
                    // in mixed precision positions are rounded to h/2^20: a pair on the very edge may count or not
                    EXPECT_NEAR(double(sim.pairs() - before), double(expected), std::string(precision) == "mixed" ? 2 : 0)
                        << name << ", step " << sim.steps();
                    ASSERT_GT(expected, 1000) << name;
                }
                EXPECT_GT(sim.rebuilds(), 3) << name;
            }
}
