// Soil on real ground: blocks on inclines however they lie in the grid, a round foot, rest on waves, volume.
#include "solver/scene/ground.hpp"
#include "solver/walls/surface.hpp"
#include "tests/validation/terrain.hpp"
#include <gmock/gmock.h>
#include <map>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// A cohesive block, four layers thick, on a plane that falls along `turn` (deg from x).
GroundScene block(double slope, double delta, double turn = 0, double cell = 1)
{
    GroundScene g;
    g.text.spacing = 0.25, g.text.young = 2e7, g.text.end = 2;
    g.text.strength = "cohesion = 1.0e4\nfriction_angle = 40.0";
    g.text.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 1.0, beta = 0.0 }\nartificial_stress = \"auto\"";
    g.thickness = 1, g.friction = delta;
    const double cx = std::cos(radians(turn)), cy = std::sin(radians(turn)), fall = std::tan(radians(slope));
    g.ground = heights([=](double x, double y) { return -fall * (x * cx + y * cy); }, {-20, -20}, {20, 20}, cell);
    g.outline = rectangle(0.1, 0.05, 6 * std::cos(radians(slope)), 4, radians(turn));
    return g;
}
/// Way (m) of the centre of mass until the end, and how far it leaves the plumb line of the slope there.
struct Way {
    double along, aside;
};
Way slide(const GroundScene& g, double turn = 0)
{
    const Scene scene = g.scene();
    Simulation sim(Comm::world(), scene);
    const Vector from = centre(sim);
    run_to(sim, g.text.end);
    const Vector way = centre(sim) - from;
    const double a = radians(turn);
    return {length(way), -way.x * std::sin(a) + way.y * std::cos(a)};
}
double by_coulomb(double slope, double delta, double t)
{
    return 0.5 * gravity * (std::sin(radians(slope)) - std::tan(radians(delta)) * std::cos(radians(slope))) * t * t;
}

/// The same block or sand on level ground under tilted gravity: its sides, plumb on the slope, lean there.
double slide_by_tilted_gravity(const GroundScene& on_slope, double slope)
{
    const double a = radians(slope), thick = on_slope.thickness * std::cos(a), lean = on_slope.thickness * std::sin(a);
    const double half = 3.0; // along the slope
    SceneText t = on_slope.text;
    t.bodies = fmt::format("[[body]]\npolygon = {{ points = [[{}, 0.0], [{}, 0.0], [{}, {}], [{}, {}]], y = [-2.0, 2.0] }}\n"
                           "soil = \"s\"\nstress = \"{}\"\n",
                           -half, half, half - lean, thick, -half - lean, thick,
                           on_slope.stress == scene::InitialStress::AtRest ? "at rest" : "none");
    t.walls = box("wall", {-10, -10, -1.25}, {20, 10, 0}, fmt::format("surface = {{ friction_angle = {} }}", on_slope.friction));
    t.effects =
        fmt::format("gravity = [{}, 0.0, {}]{}", gravity * std::sin(a), -gravity * std::cos(a), t.effects.substr(t.effects.find('\n')));
    Simulation sim(Comm::world(), t.scene());
    const Vector from = centre(sim);
    run_to(sim, t.end);
    return length(centre(sim) - from);
}

/// Slope of 35 degrees, an arc of radius 20 m, level from x = 100 m on.
double foot(double x)
{
    const double b = radians(35), r = 20, flat = 100, begin = flat - r * std::sin(b);
    if (x >= flat) return 0;
    if (x >= begin) return r - std::sqrt(r * r - (flat - x) * (flat - x));
    return r * (1 - std::cos(b)) + std::tan(b) * (begin - x);
}

} // namespace

TEST(Terrain, SurfaceGoesThroughItsHeightsWithContinuousSlopes)
{
    // Quadratic polynomials come back exactly, values and slopes; a wave of 20 cells to a thousandth of its height.
    const auto parabola = [](double x, double y) { return 0.3 * x * x - 0.2 * x * y + 0.1 * y * y + x - 2 * y + 5; };
    const scene::HeightField f(heights(parabola, {-10, -10}, {10, 10}, 2.0));
    const auto wave = [](double x, double) { return std::sin(2 * pi * x / 40); };
    const scene::HeightField w(heights(wave, {-40, -10}, {40, 10}, 2.0));
    double worst = 0, jump = 0, slope_jump = 0;
    for (double x = -7.9; x < 8; x += 0.37)
        for (double y = -7.8; y < 8; y += 0.41) {
            const auto p = f.at(x, y);
            ASSERT_NEAR(p.z, parabola(x, y), 1e-12);
            ASSERT_NEAR(p.dz_dx, 0.6 * x - 0.2 * y + 1, 1e-12);
            ASSERT_NEAR(p.dz_dy, -0.2 * x + 0.2 * y - 2, 1e-12);
            worst = std::max(worst, std::fabs(w.at(x, y).z - wave(x, y)));
        }
    EXPECT_LT(worst, 2e-3);
    for (double edge = -31; edge < 32; edge += 2) { // where pieces meet
        jump = std::max(jump, std::fabs(w.at(edge + 1e-9, 0).z - w.at(edge - 1e-9, 0).z));
        slope_jump = std::max(slope_jump, std::fabs(w.at(edge + 1e-9, 0).dz_dx - w.at(edge - 1e-9, 0).dz_dx));
    }
    EXPECT_LT(jump, 1e-8);
    EXPECT_LT(slope_jump, 1e-8);
    // Beyond the grid, and where a height is missing, there is no surface.
    auto holed = heights(wave, {-40, -10}, {40, 10}, 2.0);
    holed.at(20, 5) = std::numeric_limits<double>::quiet_NaN();
    const scene::HeightField h(holed);
    EXPECT_TRUE(std::isnan(h.at(0.3, 0.2).z));
    EXPECT_FALSE(std::isnan(h.at(8, 0.2).z));
    EXPECT_TRUE(std::isnan(h.at(41, 0).z));
}

TEST(Terrain, NearestPointIsTheFootOfThePerpendicular)
{
    const auto dune = [](double x, double y) { return 2 * std::sin(2 * pi * x / 25) * std::cos(2 * pi * y / 30); };
    const scene::HeightField f(heights(dune, {-30, -30}, {30, 30}, 1.0));
    for (double x = -20; x < 20; x += 1.7)
        for (double y = -20; y < 20; y += 2.3)
            for (const double up : {-1.5, -0.2, 0.3, 1.0}) {
                const Vector at{x, y, f.at(x, y).z + up};
                const auto n = f.nearest(at);
                ASSERT_NEAR(std::fabs(n.distance), length(at - n.point), 1e-9);
                ASSERT_EQ(n.distance < 0, up < 0);
                ASSERT_NEAR(f.at(n.point.x, n.point.y).z, n.point.z, 1e-9);
                ASSERT_NEAR(length(at - n.point - n.distance * n.normal), 0, 1e-7); // straight below
                for (double a = 0; a < 6; a += 1)                                   // and nothing around is nearer
                    for (const double r : {0.05, 0.4}) {
                        const double u = n.point.x + r * std::cos(a), v = n.point.y + r * std::sin(a);
                        ASSERT_GE(length(at - Vector{u, v, f.at(u, v).z}), std::fabs(n.distance) - 1e-9);
                    }
            }
}

TEST(Terrain, ParticlesStandOnTheGroundWithItsVolume)
{
    Case c("terrain-volume");
    for (const double slope : {15.0, 30.0, 45.0}) {
        auto g = block(slope, 20, 30);
        g.thickness = 1.1; // no whole number of spacings
        g.outline = rectangle(0.3, -0.2, 13.1, 9.7, radians(20));
        const scene::Release r = g.release();
        const scene::Draped soil(r, g.text.spacing), ground(std::get<scene::Ground>(g.wall().shape), g.text.spacing);
        const double volume = double(soil.size()) * std::pow(g.text.spacing, 3);
        EXPECT_TRUE(c.near(fmt::format("volume of particles, {} deg", slope), 13.1 * 9.7 * 1.1, volume, "m^3", 0.005));
        // Every point by its id, by region and counted alike; soil above, ground below, both on one lattice.
        const scene::Box all{{-100, -100, -100}, {100, 100, 100}}, part{{-1.1, -2, -1}, {2.3, 1.4, 1}};
        std::int64_t next = 0, inside = 0;
        soil.for_each_in(all, [&](std::int64_t id, Vector x) {
            EXPECT_EQ(id, next++);
            const Vector again = soil.position(id);
            EXPECT_TRUE(again.x == x.x && again.y == x.y && again.z == x.z);
            EXPECT_GT(x.z, r.bed->at(x.x, x.y).z);
            inside += x.x >= part.low.x && x.y >= part.low.y && x.z >= part.low.z && x.x <= part.high.x && x.y <= part.high.y &&
                      x.z <= part.high.z;
        });
        EXPECT_EQ(next, soil.size());
        EXPECT_EQ(soil.count_in(part), inside);
        ground.for_each_in(part, [&](std::int64_t, Vector x) { EXPECT_LT(x.z, r.bed->at(x.x, x.y).z); });
    }
    // Control: the plain cubic lattice, bounded by a slope of 45 degrees, misses the volume.
    const double dx = 0.25;
    const scene::Lattice plain(scene::Polygon{{{0, 0}, {4, -4}, {4, -3.3}, {0, 0.7}}, {0.0, 4.0}}, dx, 3);
    EXPECT_FALSE(
        c.control("volume on the plain lattice, 45 deg, 0.7 m thick", 4 * 4 * 0.7, double(plain.size()) * dx * dx * dx, "m^3", 0.005));
}

TEST(Terrain, WhatShowsOfTheGroundIsItsSurfaceWithoutHoles)
{
    // Level, then ever steeper to 60 degrees.
    GroundScene g = block(0, 20);
    g.ground = heights([](double x, double) { return x < 0 ? 0 : 0.045 * x * x; }, {-20, -10}, {20, 10}, 0.5);
    const scene::HeightField field(g.ground);
    const double dx = g.text.spacing, depth = scene::ground_depth(field, 2 * 1.3 * dx);
    const scene::Draped points(scene::Ground{std::make_shared<scene::HeightField>(field), depth}, dx);
    std::map<std::pair<double, double>, std::pair<double, double>> columns; // lowest and highest of each
    std::int64_t last = -1, n = 0;
    points.for_each_shown(0, points.shown(), [&](std::int64_t id, Vector x) {
        ASSERT_GT(id, last) << "by rising id";
        const Vector same = points.position(id);
        ASSERT_TRUE(same.x == x.x && same.y == x.y && same.z == x.z);
        auto& c = columns.try_emplace({x.x, x.y}, x.z, x.z).first->second;
        c.first = std::min(c.first, x.z), c.second = std::max(c.second, x.z);
        last = id, ++n;
    });
    EXPECT_LT(n, points.size() / 2) << "not all that soil feels";
    for (const auto& [at, c] : columns) {
        const double surface = field.at(at.first, at.second).z;
        EXPECT_NEAR(c.second, surface - 0.5 * dx, 1e-9);
        EXPECT_LE(c.first, surface - 1.5 * dx + 1e-9) << "two layers at least";
        const auto beside = columns.find({at.first - dx, at.second}); // lower: its top reaches this column's foot
        if (beside != columns.end()) EXPECT_GT(beside->second.second + dx, c.first) << "a hole in the slope at x = " << at.first;
    }
    std::int64_t all = 0;
    points.for_each_in(points.bounds(), [&](std::int64_t, Vector) { ++all; });
    EXPECT_EQ(all, points.size()) << "control: the layer that soil feels";
}

TEST(Terrain, BlockSlidesDownHoweverTheGridLies)
{
    Case c("terrain-block");
    const double expected = by_coulomb(30, 20, 2);
    const Way straight = slide(block(30, 20));
    EXPECT_TRUE(c.near("way in 2 s, 30 deg, delta 20", expected, straight.along, "m", 0.01));
    auto begin = block(30, 20);
    begin.text.end = 0.1;
    EXPECT_TRUE(c.near("way in 0.1 s: friction holds from the first moment", by_coulomb(30, 20, 0.1), slide(begin).along, "m", 0.02));
    const Way turned = slide(block(30, 20, 45), 45);
    EXPECT_TRUE(c.near("the grid turned by 45 deg", straight.along, turned.along, "m", 0.01));
    EXPECT_TRUE(c.at_most("how far it leaves the line of fall", std::fabs(turned.aside), "m", 0.25));
    const Way coarse = slide(block(30, 20, 0, 2));
    EXPECT_TRUE(c.near("cells of 2 m for 1 m", straight.along, coarse.along, "m", 0.001));
    EXPECT_TRUE(c.at_most("way with delta 35: it stays", slide(block(30, 35)).along, "m", 0.01 * 0.25));
    EXPECT_FALSE(c.control("way with delta 22 for 20", expected, slide(block(30, 22)).along, "m", 0.01));
}

TEST(Terrain, TiltedGroundIsTiltedGravity)
{
    Case c("terrain-tilt");
    for (const double slope : {15.0, 30.0, 45.0}) {
        auto g = block(slope, slope - 10);
        g.text.end = 1;
        g.thickness = 7 * g.text.spacing; // 6.8, 6.1, 4.9 rows across; on level ground 7, 6, 5: 3.5 % more, 1 % less, 1 % more soil
        EXPECT_TRUE(c.near(fmt::format("block, {} deg: way in 1 s against tilted gravity", slope), slide_by_tilted_gravity(g, slope),
                           slide(g).along, "m", 0.005));
        g.stress = scene::InitialStress::None;
        EXPECT_TRUE(c.near(fmt::format("block without stress at the start, {} deg", slope), slide_by_tilted_gravity(g, slope),
                           slide(g).along, "m", 0.001));
        // Sand is let go without stress: on level ground nothing holds it while it settles, and it starts from the stress of sliding.
        g.text.strength = "friction_angle = 35.0";
        g.text.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
        EXPECT_TRUE(c.near(fmt::format("dry sand, {} deg: way in 1 s against tilted gravity", slope), slide_by_tilted_gravity(g, slope),
                           slide(g).along, "m", 0.01, {.note = "less soil by 3.5 %, more by 1 %, less by 1 %", .achieved = 0.015}));
    }
}

TEST(Terrain, RoundFootTakesItsShare)
{
    Case c("terrain-foot");
    auto g = block(35, 25);
    g.text.spacing = 0.5, g.text.end = 14, g.thickness = 2;
    g.text.strength = "cohesion = 2.0e4\nfriction_angle = 40.0";
    g.ground = heights([](double x, double) { return foot(x); }, {-10, -20}, {150, 20}, 1.0);
    g.outline = rectangle(10, 0, 8 * std::cos(radians(35)), 4);
    Simulation sim(Comm::world(), g.scene());
    double residual = 0;
    while (!sim.finished() && (sim.time() < 5 || sim.max_speed() > 0.02)) {
        sim.step();
        if (sim.time() > 1 && sim.steps() % 50 == 0) residual = std::max(residual, std::fabs(sim.residual(sim.ledger())));
    }
    const double stop = centre(sim).x;
    EXPECT_TRUE(c.near("where it stops, from x = 10 m", 118.83, stop, "m", 0.02));
    EXPECT_TRUE(c.at_most("residual of energy, 30 heights down", residual, "1", 1e-3));
    EXPECT_FALSE(c.control("the energy line without v^2/R", 135.67, stop, "m", 0.02));
}

TEST(Terrain, SandRestsOnWavesAndAtAStep)
{
    Case c("terrain-rest");
    const double dx = 0.25;
    const auto at_rest = [&](auto ground, const std::string& what) {
        GroundScene g;
        g.text.spacing = dx, g.text.young = 2e7, g.text.end = 1.5;
        g.text.strength = "friction_angle = 38.0";
        g.friction = 35;
        g.ground = heights(ground, {-12, -8}, {12, 8}, 0.5);
        // A lens that thins out to its rim, so that its surface nowhere is steeper than its friction.
        g.thicknesses = std::make_shared<scene::Grid>(
            heights([](double x, double y) { return std::max(0.0, 1.25 * (1 - (x * x + y * y) / 25)); }, {-10, -7}, {10, 7}, 0.5));
        Simulation sim(Comm::world(), g.scene());
        const auto from = positions(sim);
        run_to(sim, g.text.end);
        double farthest = 0, deepest = 0;
        each_way(sim, from, [&](double way) { farthest = std::max(farthest, way); });
        const scene::HeightField field(g.ground);
        each(sim, [&](Index i) { deepest = std::min(deepest, field.nearest(position(sim, i)).distance); });
        EXPECT_TRUE(c.at_most(what + ": greatest speed over sqrt(g h)", sim.max_speed() / std::sqrt(gravity * 1.25), "1", 0.01));
        EXPECT_TRUE(c.at_most(what + ": farthest way", farthest, "m", dx));
        EXPECT_TRUE(c.at_most(what + ": depth below the ground", -deepest, "m", 0));
    };
    at_rest([](double x, double y) { return 0.25 * std::sin(2 * pi * x / 10) * std::cos(2 * pi * y / 12); }, "waves");
    // A step of 0.9 m at 60 degrees beneath the middle.
    at_rest([](double x, double) { return std::clamp(x * std::tan(radians(60)), -0.45, 0.45); }, "step of 60 deg");
}

TEST(Terrain, SoilTornOpenAtTheRimOfItsPitDoesNotSink)
{
    // A mass set two metres into a slope climbs over the lower rim and is torn open there: it bears no pressure, the ground holds it out.
    Case c("terrain-pit");
    GroundScene g;
    g.text.spacing = 0.5, g.text.young = 1e7, g.text.end = 3.5;
    g.text.strength = "friction_angle = 30.0";
    g.ground =
        heights([](double x, double y) { return -0.6 * x - (std::fabs(x) <= 6 && std::fabs(y) <= 5 ? 2 : 0); }, {-20, -15}, {40, 15}, 1.0);
    g.outline = rectangle(0.01, 0.01, 12, 10), g.thickness = 2;
    Simulation sim(Comm::world(), g.scene());
    const scene::HeightField field(g.ground);
    double deepest = 0;
    while (!sim.finished()) {
        sim.step();
        if (sim.steps() % 10 == 0) each(sim, [&](Index i) { deepest = std::max(deepest, -field.nearest(position(sim, i)).distance); });
    }
    EXPECT_TRUE(c.at_most("depth below the ground", deepest / g.text.spacing, "spacings", 0.25));
    EXPECT_GT(centre(sim).x, 0.5);
}

TEST(Terrain, BlockWithDragTendsToTheSpeedOfVoellmy)
{
    // h dv/dt = g h (sin b - tan delta cos b) - g v^2/xi: v = w tanh(a t/w), way = w^2/a ln cosh(a t/w)
    const double xi = 20, slope = 30, delta = 20, t = 2, b = radians(slope);
    auto g = block(slope, delta);
    const double h = g.thickness * std::cos(b), a = gravity * (std::sin(b) - std::tan(radians(delta)) * std::cos(b));
    const double w = std::sqrt(xi * h * a / gravity), expected = w * w / a * std::log(std::cosh(a * t / w));
    g.drag = 9.81 / xi;
    const double way = slide(g).along;
    EXPECT_NEAR(way / expected, 1, 0.02) << way << " m, by Voellmy " << expected << " m";
    EXPECT_GT(by_coulomb(slope, delta, t) / expected, 1.3) << "the control: without drag";
}

TEST(Terrain, FrictionIsThatOfTheMap)
{
    // Half of the slope holds the block, the other lets it go; a map of one number is that number.
    auto g = block(30, 20);
    const double all = slide(g).along;
    g.frictions = heights([](double, double) { return radians(20); }, {-20, -20}, {20, 20}, 1.0);
    g.friction = 89; // where the map has none
    EXPECT_EQ(slide(g).along, all);
    g.frictions = heights([](double, double y) { return radians(y < 8 ? 35 : 5); }, {-20, -20}, {20, 20}, 1.0);
    EXPECT_LT(slide(g).along, 0.01 * g.text.spacing);
    g.frictions = heights([](double, double y) { return radians(y < 8 ? 20 : 35); }, {-20, -20}, {20, 20}, 1.0);
    EXPECT_EQ(slide(g).along, all) << "what lies where the block never comes does not count";
}

TEST(Terrain, ClosedEdgeEndsTheRunWhereSoilLeaves)
{
    auto g = block(30, 10);
    g.text.end = 4;
    g.ground = heights([](double x, double) { return -std::tan(radians(30)) * x; }, {-6, -6}, {6, 6}, 1.0);
    Scene s = g.scene();
    s.terrain = scene::Terrain{};
    s.terrain->edge = scene::Edge::Closed;
    try {
        Simulation sim(Comm::world(), s);
        run_to(sim, 4);
        ADD_FAILURE() << "soil left a closed ground";
    } catch (const NumbersFailed& e) {
        EXPECT_THAT(e.what(), testing::HasSubstr("has left the ground (terrain.edge = \"closed\")"));
    }
    s.terrain->edge = scene::Edge::Open;
    Simulation sim(Comm::world(), s);
    const Index all = sim.particles().size();
    run_to(sim, 2.5);
    EXPECT_GT(sim.particles().size(), 0);
    EXPECT_LT(sim.particles().size(), all);
    EXPECT_LT(std::fabs(sim.residual(sim.ledger())), 1e-3);
}

TEST(Terrain, SoilHasLeftWhereNothingIsBelowAndNoWallToFallUpon)
{
    auto g = block(30, 10);
    g.ground = heights([](double x, double) { return -0.5 * x; }, {-6, -6}, {6, 6}, 1.0);
    Scene s = g.scene();
    s.terrain = scene::Terrain{};
    const double edge = scene::ground_of(s)->high_x(), z = scene::ground_of(s)->at(edge - 0.1, 0).z, reach = 2 * s.support();
    EXPECT_FALSE(scene::has_left(s, {edge - 0.1, 0, z - 100})) << "below the ground is not beside it";
    EXPECT_FALSE(scene::has_left(s, {edge + 0.5 * reach, 0, z}));
    EXPECT_TRUE(scene::has_left(s, {edge + 0.5 * reach, 0, z - 2 * reach})) << "beside the edge, too deep to touch it";
    EXPECT_TRUE(scene::has_left(s, {edge + 1.5 * reach, 0, z + 10}));
    s.terrain->edge = scene::Edge::Closed;
    EXPECT_FALSE(scene::has_left(s, {edge + 1.5 * reach, 0, z + 10}));
    s.terrain->edge = scene::Edge::Open;
    scene::Wall basin{scene::Box{{edge, -6, z - 50}, {edge + 20, 6, z - 49}}};
    s.walls.push_back(basin);
    EXPECT_FALSE(scene::has_left(s, {edge + 1.5 * reach, 0, z + 10})) << "it falls into a basin";
    EXPECT_TRUE(scene::has_left(s, {edge + 1.5 * reach, 0, z - 50 - 2 * reach}));
    s.walls.back().present = false;
    EXPECT_TRUE(scene::has_left(s, {edge + 1.5 * reach, 0, z + 10}));
}

TEST(Terrain, FixedGroundGivesNothing)
{
    // One step of soil in a heap on a dune: a wall point's face is the tangent plane at the nearest place of the surface.
    const auto dune = [](double x, double y) { return std::sin(2 * pi * x / 12) + 0.5 * std::cos(2 * pi * y / 9); };
    GroundScene g;
    g.text.spacing = 0.25;
    g.ground = heights(dune, {-10, -10}, {10, 10}, 0.5);
    const Scene s = [&] {
        g.outline = rectangle(0, 0, 4, 4);
        return g.scene();
    }();
    const WallSurface surface(s);
    const auto& ground = std::get<scene::Ground>(s.walls[0].shape);
    const scene::Draped points(ground, g.text.spacing);
    std::int64_t seen = 0;
    std::vector<Face> faces;
    points.for_each_in({{-3, -3, -10}, {3, 3, 10}}, [&](std::int64_t, Vector x) {
        const double depth = -ground.field->nearest(x).distance;
        surface.faces(x, 2 * g.text.h * g.text.spacing, faces);
        if (depth > 2 * g.text.h * g.text.spacing) {
            EXPECT_TRUE(faces.empty());
            return;
        }
        ++seen;
        ASSERT_EQ(faces.size(), 1u) << x.x << ' ' << x.y << ' ' << x.z;
        EXPECT_NEAR(faces[0].depth, depth, 1e-9);
    });
    EXPECT_GT(seen, 1000);
}
