// Level ground "at rest" stays there, however it is drawn and whatever hangs in the air above it.
#include "tests/validation/case.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// A bed 1 m deep and 2 m wide between smooth sides, its foot at a height, drawn as boxes or as polygons; run to its end.
struct Bed {
    double fastest = 0, farthest = 0; // m/s, m
    std::int64_t particles = 0;
};
Bed lie(bool boxes, double foot, const std::string& above, double end)
{
    SceneText t;
    t.spacing = 0.1, t.h = 1.3, t.end = end, t.young = 2e6, t.accuracy = "";
    t.strength = "friction_angle = 25.0\ncone = \"plane strain, no dilation\"";
    const auto draw = [&](const char* what, double x1, double z1, double x2, double z2, const std::string& more) {
        return boxes ? box(what, {x1, 0, foot + z1}, {x2, 0, foot + z2}, more)
                     : polygon(what, {{x1, foot + z1}, {x2, foot + z1}, {x2, foot + z2}, {x1, foot + z2}}, more);
    };
    t.bodies = draw("body", 0, 0, 2, 1, "soil = \"s\"\nstress = \"at rest\"") + above;
    t.walls = draw("wall", -1, -0.4, 3, 0, "") + draw("wall", -0.4, 0, 0, 2, "surface = \"smooth\"") +
              draw("wall", 2, 0, 2.4, 2, "surface = \"smooth\"");
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1 }";
    Simulation sim(Comm::world(), t.scene());
    Bed bed;
    for (int k = 1; k <= 10; ++k) {
        run_to(sim, k * end / 10);
        bed.particles = 0;
        each(sim, [&](Index i) {
            if (origin(sim, i).z > foot + 1) return; // what is above
            ++bed.particles;
            bed.fastest = std::max(bed.fastest, length(velocity(sim, i)));
            bed.farthest = std::max(bed.farthest, length(position(sim, i) - origin(sim, i)));
        });
    }
    return bed;
}

} // namespace

TEST(Ground, RestsHoweverItIsDrawn)
{
    // At 0.05 m the foot and the top of polygons lie on lattice points.
    for (const auto& [boxes, foot] : {std::pair{true, 0.0}, std::pair{false, 0.0}, std::pair{false, 0.05}, std::pair{false, 0.03}}) {
        const Bed bed = lie(boxes, foot, "", 0.3);
        EXPECT_EQ(bed.particles, 200) << boxes << " " << foot;
        EXPECT_LT(bed.fastest, 0.04) << boxes << " " << foot;
        EXPECT_LT(bed.farthest, 0.002) << boxes << " " << foot;
    }
}

TEST(Ground, RestsUntilABoulderHitsIt)
{
    const std::string boulder = box("body", {0.5, 0, 3}, {1.5, 0, 4});
    const Bed alone = lie(true, 0, "", 0.3), below = lie(true, 0, boulder, 0.3);
    EXPECT_EQ(below.particles, 200);
    EXPECT_NEAR(below.fastest, alone.fastest, 0.05 * alone.fastest);
    EXPECT_NEAR(below.farthest, alone.farthest, 0.05 * alone.farthest);
}
