// How the ground is drawn does not show: twenty generated scenes from fixed seeds (drawing.hpp); two hundred in drawing_long_test.cpp.
#include "tests/validation/drawing_cases.hpp"

using namespace kuzure::validation;

TEST(Drawing, FacesAreTheSame) { expect_same_faces(0, 20); }
TEST(Drawing, OneStepIsTheSame) { expect_same_step("drawing", 0, 20); }
TEST(Drawing, MotionOfSoilThatDoesNotYieldIsTheSame) { expect_same_motion("drawing", 0, 20); }

// What a comparison as sharp as this must notice: one piece of the ground a thousandth of a spacing lower, or of another surface.
TEST(Drawing, NoticesOtherGround)
{
    int noticed = 0, scenes = 0;
    for (unsigned seed = 0; seed < 20; ++seed) {
        Generated g = generate(seed);
        Draw draw(seed + 1000);
        const Placed soil = soil_beside(g, draw);
        g.drawings.resize(2);
        for (auto& w : g.drawings[1].walls) {
            if (const auto* b = std::get_if<kuzure::scene::Box>(&w.shape); b && b->high.z < g.foot + 3.5 * spacing) continue; // far below
            w.surface = kuzure::scene::Surface((int(w.surface) + 1) % 3),
            w.friction_angle = w.surface == kuzure::scene::Surface::Coulomb ? 0.3 : 0;
        }
        ++scenes, noticed += one_step(g, soil).largest() > 1e-6;
    }
    EXPECT_EQ(noticed, scenes);
}
