// Flows on real ground do not know how it lies in its grid: the same bowl from three sides, a dune from coarse and fine cells.
#include "tests/validation/terrain.hpp"
#include <map>
#include <set>
#include <tuple>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

GroundScene sand(double spacing)
{
    GroundScene g;
    g.text.spacing = spacing, g.text.young = 1e7;
    g.text.strength = "friction_angle = 32.0";
    g.friction = 18;
    return g;
}
/// Where the soil is at the end, turned back by an angle (rad).
struct Deposit {
    Vector centre;
    double reach = -1e300;                   // m, of the foremost hundredth
    std::set<std::pair<long, long>> covered; // squares of two spacings with soil half a spacing thick and more
};
Deposit flow(const GroundScene& g, double turn = 0)
{
    Simulation sim(Comm::world(), g.scene());
    run_to(sim, g.text.end);
    Deposit d;
    std::vector<double> along;
    const double cell = 2 * g.text.spacing, c = std::cos(turn), s = std::sin(turn);
    std::map<std::pair<long, long>, double> layers; // each particle shared by the four squares around it
    each(sim, [&](Index i) {
        const Vector x = position(sim, i), back{c * x.x + s * x.y, -s * x.x + c * x.y, x.z};
        d.centre = d.centre + (1 / double(sim.particles().size())) * back;
        along.push_back(back.x);
        const double u = std::floor(back.x / cell), v = std::floor(back.y / cell), a = back.x / cell - u, b = back.y / cell - v;
        for (const auto& [i, j, share] : {std::tuple{0, 0, (1 - a) * (1 - b)}, {1, 0, a * (1 - b)}, {0, 1, (1 - a) * b}, {1, 1, a * b}})
            layers[{long(u) + i, long(v) + j}] += share / 4;
    });
    for (const auto& [square, many] : layers)
        if (many >= 0.5) d.covered.insert(square);
    const auto foremost = along.begin() + std::ptrdiff_t(along.size() * 99 / 100);
    std::nth_element(along.begin(), foremost, along.end());
    d.reach = *foremost;
    return d;
}
/// Cells that both cover over cells that any covers.
double overlap(const Deposit& a, const Deposit& b)
{
    std::size_t both = 0;
    for (const auto& cell : a.covered) both += b.covered.count(cell);
    return double(both) / double(a.covered.size() + b.covered.size() - both);
}

} // namespace

TEST(TerrainFlow, BowlIsTheSameFromEverySide)
{
    Case c("terrain-bowl");
    const double dx = 0.25;
    const auto from = [&](double degrees) {
        const double turn = radians(degrees);
        GroundScene g = sand(dx);
        g.text.end = 2.5;
        g.ground = heights([](double x, double y) { return (x * x + y * y) / 40; }, {-22, -22}, {22, 22}, 0.5);
        g.outline = rectangle(-12 * std::cos(turn), -12 * std::sin(turn), 5, 6, turn), g.thickness = 1.6;
        return flow(g, turn);
    };
    const Deposit straight = from(0);
    EXPECT_GT(straight.centre.x, -8); // it has come far
    for (const double degrees : {120.0, 225.0}) {
        const Deposit turned = from(degrees);
        EXPECT_TRUE(c.at_most(fmt::format("centre of mass, from {} deg against 0", degrees), length(turned.centre - straight.centre) / dx,
                              "spacings", 1));
        EXPECT_TRUE(c.at_least(fmt::format("covered by both over covered by any, {} deg", degrees), overlap(straight, turned), "1", 0.95,
                               {.note = "squares of two spacings: the rim counts", .achieved = 0.94}));
    }
    // Control: another friction is seen.
    GroundScene g = sand(dx);
    g.text.end = 2.5, g.friction = 15;
    g.ground = heights([](double x, double y) { return (x * x + y * y) / 40; }, {-22, -22}, {22, 22}, 0.5);
    g.outline = rectangle(-12, 0, 5, 6), g.thickness = 1.6;
    EXPECT_FALSE(
        c.control("centre of mass with friction 15 for 18", straight.centre.x, flow(g).centre.x, "m", dx / std::fabs(straight.centre.x)));
}

TEST(TerrainFlow, DuneOfTwentyCellsIsFineEnough)
{
    Case c("terrain-dune");
    const auto over = [](double cell) {
        GroundScene g = sand(0.4);
        g.text.end = 3;
        g.ground = heights([](double x, double y) { return -0.45 * x + 0.5 * std::sin(2 * pi * x / 20) * std::cos(2 * pi * y / 20); },
                           {-16, -16}, {48, 16}, cell);
        g.outline = rectangle(-4, 0, 6, 6), g.thickness = 1.6;
        return flow(g);
    };
    const Deposit usual = over(1), fine = over(0.25);
    EXPECT_TRUE(c.at_most("reach, waves of 20 cells against 80", std::fabs(usual.reach - fine.reach) / 0.4, "spacings", 1));
    EXPECT_FALSE(c.control("reach, waves of 2.5 cells", fine.reach, over(8).reach, "m", 0.4 / fine.reach));
}
