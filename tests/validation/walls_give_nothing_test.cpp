// No energy from nothing: fixed walls of any surface under soil of any kind on generated ground (drawing.hpp), and artificial stress in a
// bar that swings freely.
#include "tests/validation/drawing.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// The first generated ground from a seed on of so many dimensions and this surface alone.
Generated ground_of(unsigned seed, int dimensions, scene::Surface surface)
{
    for (;; ++seed)
        if (Generated g = generate(seed); g.dimensions == dimensions && g.surface == surface && !g.mixed) {
            g.drawings.resize(1);
            return g;
        }
}

} // namespace

TEST(FixedWalls, GiveNothing)
{
    Case c("walls-give-nothing");
    struct Kind {
        const char* name;
        std::string strength;
        double young;
    };
    const Kind kinds[] = {{"elastic", "cohesion = 1.0e12", 2e6},
                          {"clay", "cohesion = 5.0e3\nfriction_angle = 20.0\ncone = \"plane strain, no dilation\"", 2e7},
                          {"dry", "friction_angle = 25.0", 2e6}};
    for (const auto& kind : kinds)
        for (const int dimensions : {2, 3}) {
            double given = 0;
            std::string where;
            for (int surface = 0; surface < 3; ++surface)
                for (unsigned seed = 40; seed < 140; seed += dimensions == 3 ? 50 : 25) {
                    const Generated g = ground_of(seed, dimensions, scene::Surface(surface));
                    Draw draw(g.seed + 3000);
                    const Placed soil = block_above(g, draw);
                    SceneText t;
                    t.young = kind.young, t.strength = kind.strength;
                    const double least = motion(g, soil, kind.young > 1e7 ? 0.15 : 0.3, t).given;
                    if (least < given) given = least, where = g.what;
                }
            EXPECT_TRUE(c.at_least(fmt::format("work taken by fixed walls, {}, {}-D", kind.name, dimensions), given,
                                   "of the largest energy", -1e-3, {.note = "second order in the step; " + where, .achieved = -4e-3}));
        }
}

// Normals turn from face to face, and Coulomb walls let go in force and strain at once: work is of second order in the step. Where a
// point's face came and went at a jump, or soil was let go between force and strain, it was of first order.
TEST(FixedWalls, WorkIsOfSecondOrderInTheStep)
{
    const auto work = [](unsigned seed, double cfl) {
        Generated g = generate(seed);
        g.drawings.resize(1), g.drawings[0].cfl = cfl;
        Draw draw(seed + 2000);
        SceneText t;
        t.young = 2e6;
        return motion(g, block_above(g, draw), 0.15, t);
    };
    for (const unsigned seed : {3u, 4u, 112u, 257u}) { // smooth; of bricks in 2-D, of slopes, in 3-D
        const Motions one = work(seed, 1), quarter = work(seed, 0.25);
        EXPECT_LT(std::max(quarter.taken, -quarter.given), 0.12 * std::max(one.taken, -one.given)) << seed;
    }
    for (const unsigned seed : {214u, 223u, 231u}) EXPECT_GT(work(seed, 1).given, -1e-3) << seed; // Coulomb
}

TEST(ArtificialStress, GivesNothingToABarThatSwingsFreely)
{
    Case c("artificial-stress-gives-nothing");
    struct Found {
        double given = 0, most = 0, left = 0; // energy of the start
    };
    const auto swing = [](const char* artificial_stress, double end, const char* accuracy = "") {
        SceneText t;
        t.spacing = 0.05, t.h = 1.3, t.end = end, t.young = 2e6, t.accuracy = accuracy;
        t.bodies = box("body", {-1, 0, -0.15}, {1, 0, 0.15});
        t.effects = std::string("viscosity = { alpha = 0.1 }\n") + artificial_stress;
        RunOptions options = starting_with([](Particles& p, Index i, Vector x) {
            set_velocity(p, i, {0.5 * std::sin(pi * x.x / 2), 0, std::cos(pi * x.x) + 0.1});
        });
        options.guard = false;
        Simulation sim(Comm::world(), t.scene(), options);
        const double start = sim.ledger().state.kinetic;
        Found f;
        while (!sim.finished()) {
            sim.step();
            f.given = std::min(f.given, sim.ledger().dissipated.stabilising / start);
            const double now = (sim.ledger().state.kinetic + sim.ledger().state.elastic) / start;
            f.most = std::max(f.most, now);
            if (sim.time() > 0.8 * end) f.left = std::max(f.left, now);
        }
        return f;
    };
    const Found with = swing("artificial_stress = { epsilon = 0.5, exponent = 2.55 }", 8), without = swing("", 8);
    EXPECT_TRUE(c.at_least("energy taken by artificial stress, at its least", with.given, "of the start's", -1e-2));
    EXPECT_TRUE(c.at_most("kinetic and elastic energy at its most", with.most, "of the start's", 1.001));
    c.report("kinetic and elastic energy left in the last fifth of 8 s, with", with.left, "of the start's");
    c.report("kinetic and elastic energy left in the last fifth of 8 s, without", without.left, "of the start's");
    // The control: the published form, in one pass, is a spring of negative stiffness that does not take back all that it gives.
    const Found published = swing("artificial_stress = { epsilon = 0.5, exponent = 2.55 }", 2, "scheme = \"leap-frog\"\ncfl = 0.2");
    EXPECT_FALSE(c.control("kinetic and elastic energy at its most, published form", published.most, "of the start's", "<= 1.001",
                           published.most <= 1.001));
}
