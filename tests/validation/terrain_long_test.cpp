// A parabolic cap that slides down a plane keeps its shape: the similarity solution of Hutter, Siegel, Savage & Nohguchi (1993).
#include "tests/validation/terrain.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

constexpr double slope = 35 * pi / 180, friction = 25 * pi / 180, half_axis = 80, depth = 4; // m, along and across the slope

struct Cap {
    double centre, half_axis; // m along the slope
};
/// After a time (s), by the shallow layer equations, K the ratio of stresses along and across the slope.
Cap similar(double K, double end)
{
    const double across = gravity * std::cos(slope), dt = 1e-4;
    double g = 1, f = 1, dg = 0, df = 0; // growth along and aside
    for (double t = 0; t < end; t += dt) {
        dg += dt * 2 * K * across * depth / (half_axis * half_axis) / (g * g * f);
        df += dt * 2 * K * across * depth / (half_axis * half_axis) / (g * f * f);
        g += dt * dg, f += dt * df;
    }
    return {0.5 * gravity * (std::sin(slope) - std::tan(friction) * std::cos(slope)) * end * end, half_axis * g};
}

} // namespace

TEST(TerrainLong, CapKeepsItsShape)
{
    Case c("terrain-similarity");
    const double end = 5, c35 = std::cos(slope), fall = std::tan(slope);
    const double spacing = 4 / c35 / 8; // eight layers
    GroundScene g;
    g.text.spacing = spacing, g.text.end = end, g.text.young = 5e7, g.text.density = 2000;
    g.text.strength = "friction_angle = 25.0\ncone = \"shear\""; // sheared, it carries what the bed does: the theory's phi = delta
    g.friction = 25;
    g.ground = heights([&](double x, double) { return -fall * x; }, {-110, -130}, {160, 130}, 2.0);
    g.thicknesses = std::make_shared<scene::Grid>(heights(
        [&](double x, double y) {
            const double s = x / c35;
            return depth / c35 * std::max(0.0, 1 - (s * s + y * y) / (half_axis * half_axis));
        },
        {-100, -100}, {100, 100}, 1.0));
    Simulation sim(Comm::world(), g.scene());
    const Vector from = centre(sim);
    run_to(sim, end);
    const Vector way = centre(sim) - from;
    double square = 0;
    each(sim, [&](Index i) { square += std::pow((position(sim, i).x - centre(sim).x) / c35, 2); });
    // of a cap h (1 - (r/L)^2): the mean of s^2 is L^2/6
    const double found = std::sqrt(6 * square / double(sim.particles().size()));
    const Cap narrow = similar(1, end), wide = similar(1.435, end); // K of a bed as rough as the soil: 2/cos^2(phi) - 1
    EXPECT_TRUE(c.near("way of the centre in 5 s", narrow.centre, length(way), "m", 0.01));
    const double middle = (narrow.half_axis + wide.half_axis) / 2, half = (wide.half_axis - narrow.half_axis) / 2 + 0.03 * middle;
    EXPECT_TRUE(c.near("half axis after 5 s", middle, found, "m", half / middle,
                       {.note = "stresses along the slope are 0.9 of those across", .achieved = 0.06}));
    EXPECT_FALSE(c.control("half axis of a cap that does not spread", middle, half_axis, "m", half / middle));
}
