// The particles of a scene against brute force over the lattice, and regions that must add up to the whole.
#include "io/scene_file.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/fill.hpp"
#include <ctime>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <set>

using namespace kuzure;
using namespace kuzure::scene;
using ::testing::HasSubstr;

namespace {

const double far = std::numeric_limits<double>::infinity();
const Box everywhere{{-far, -far, -far}, {far, far, far}};

Scene made(double spacing, std::vector<Shape> bodies, std::vector<Shape> walls = {}, int dimensions = 3)
{
    Scene s;
    s.dimensions = dimensions;
    s.space.spacing = spacing;
    s.time.end = 1;
    s.soils.resize(1);
    for (auto& shape : bodies) s.bodies.push_back({0, shape});
    for (auto& shape : walls) s.walls.push_back({shape});
    return s;
}

struct Particle {
    std::int64_t id;
    Vector x;
    int of;
    bool operator==(const Particle&) const = default;
};
std::vector<Particle> soil_in(const Filling& filling, const Box& region)
{
    std::vector<Particle> all;
    filling.for_each_soil_in(region, [&](std::int64_t id, Vector x, int body) { all.push_back({id, x, body}); });
    return all;
}
std::vector<Particle> walls_in(const Filling& filling, const Box& region)
{
    std::vector<Particle> all;
    filling.for_each_wall_in(region, [&](std::int64_t id, Vector x, int wall) { all.push_back({id, x, wall}); });
    return all;
}
bool within(const Box& b, Vector x, int dimensions)
{
    return x.x >= b.low.x && x.x <= b.high.x && x.z >= b.low.z && x.z <= b.high.z &&
           (dimensions == 2 || (x.y >= b.low.y && x.y <= b.high.y));
}

const Polygon slope{{{0, 0}, {1, 0}, {1, 1}}, {2.0, 2.7}};
const Polygon comb{{{2, 0}, {4, 0}, {4, 1}, {3.3, 0.3}, {3.0, 1.0}, {2.7, 0.3}, {2, 1}}, {0.0, 0.5}};

Scene mixed(int dimensions)
{
    const Box cube{{-1.03, -1.01, 0.02}, {-0.03, -0.51, 1.02}};
    std::vector<Shape> bodies{cube, Sphere{{0.5, 0.5, 2.1}, 0.43}, slope, comb};
    if (dimensions == 3) bodies.push_back(Cylinder{{3, 3, 0.1}, 0.55, 0.72});
    return made(0.1, bodies, {Box{{-2, -2, -0.4}, {5, 5, 0}}}, dimensions);
}

} // namespace

class Fill : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimensions, Fill, ::testing::Values(2, 3));

TEST_P(Fill, HoldsExactlyTheLatticePointsInside)
{
    const int dimensions = GetParam();
    const Scene scene = mixed(dimensions);
    const Filling filling(scene);
    const double dx = scene.space.spacing;
    const auto all = soil_in(filling, everywhere);
    std::int64_t expected_id = 0;
    std::size_t at = 0;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const Shape& shape = scene.bodies[b].shape;
        const auto* box = std::get_if<Box>(&shape);
        const Vector o = box ? box->low : Vector{};
        for (int kz = -20; kz < 60; ++kz)
            for (int ky = dimensions == 2 ? 0 : -20; ky < (dimensions == 2 ? 1 : 60); ++ky)
                for (int kx = -20; kx < 60; ++kx) {
                    const Vector x{o.x + (kx + 0.5) * dx, dimensions == 2 ? 0.0 : o.y + (ky + 0.5) * dx, o.z + (kz + 0.5) * dx};
                    if (signed_distance(shape, x, dimensions) >= -1e-9 * dx) continue;
                    ASSERT_LT(at, all.size());
                    ASSERT_EQ(all[at++], (Particle{expected_id++, x, int(b)}));
                }
    }
    EXPECT_EQ(at, all.size());
    EXPECT_EQ(filling.soil_count(), std::int64_t(all.size()));
}

TEST_P(Fill, PositionsByIdAreTheSameBits)
{
    const Filling filling(mixed(GetParam()));
    for (const auto& p : soil_in(filling, everywhere)) {
        ASSERT_EQ(filling.soil_position(p.id), p.x);
        ASSERT_EQ(filling.body_of(p.id), p.of);
    }
    const auto walls = walls_in(filling, everywhere);
    EXPECT_EQ(std::int64_t(walls.size()), filling.wall_count());
    EXPECT_EQ(walls.front().id, filling.soil_count());
    for (const auto& p : walls) {
        ASSERT_EQ(filling.wall_position(p.id), p.x);
        ASSERT_EQ(filling.wall_of(p.id), p.of);
    }
    EXPECT_THROW(filling.soil_position(-1), Broken);
    EXPECT_THROW(filling.soil_position(filling.soil_count()), Broken);
    EXPECT_THROW(filling.wall_position(filling.soil_count() + filling.wall_count()), Broken);
}

TEST_P(Fill, RegionsAreExactAndCountedWithoutAVisit)
{
    const Filling filling(mixed(GetParam()));
    const auto all = soil_in(filling, everywhere), walls = walls_in(filling, everywhere);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> u(-2.5, 5);
    for (int k = 0; k < 300; ++k) {
        const auto pick = [&] { return k % 3 ? u(random) : std::round(u(random) * 20) / 20; }; // a third on the lattice
        Box r{{pick(), pick(), pick()}, {pick(), pick(), pick()}};
        if (k % 7 == 0) r.low.x = -far;
        if (k % 11 == 0) r.high.z = far;
        std::vector<Particle> expected, expected_walls;
        for (const auto& p : all)
            if (within(r, p.x, GetParam())) expected.push_back(p);
        for (const auto& p : walls)
            if (within(r, p.x, GetParam())) expected_walls.push_back(p);
        EXPECT_EQ(soil_in(filling, r), expected);
        EXPECT_EQ(filling.soil_count_in(r), std::int64_t(expected.size()));
        EXPECT_EQ(walls_in(filling, r), expected_walls);
        EXPECT_EQ(filling.wall_count_in(r), std::int64_t(expected_walls.size()));
    }
}

TEST_P(Fill, HalfOpenRegionsPartitionTheWhole)
{
    const Filling filling(mixed(GetParam()));
    std::set<std::int64_t> seen;
    const double cut[] = {-far, -0.7, 0.05, 0.85, 2.15, far}; // some lie on lattice points
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j) {
            const Box r{{cut[i], -far, cut[j]}, {cut[i + 1], far, cut[j + 1]}};
            filling.for_each_soil_in(r, [&](std::int64_t id, Vector x, int) {
                if (x.x < r.high.x && x.z < r.high.z) {
                    EXPECT_TRUE(seen.insert(id).second);
                }
            });
        }
    EXPECT_EQ(std::int64_t(seen.size()), filling.soil_count());
}

TEST_P(Fill, BoundsAreThoseOfTheParticles)
{
    const Filling filling(mixed(GetParam()));
    Box soil{{far, far, far}, {-far, -far, -far}};
    const auto widen = [](Box& b, Vector x) {
        b.low = {std::min(b.low.x, x.x), std::min(b.low.y, x.y), std::min(b.low.z, x.z)};
        b.high = {std::max(b.high.x, x.x), std::max(b.high.y, x.y), std::max(b.high.z, x.z)};
    };
    for (const auto& p : soil_in(filling, everywhere)) widen(soil, p.x);
    EXPECT_EQ(filling.soil_bounds(), soil);
    for (const auto& p : walls_in(filling, everywhere)) widen(soil, p.x);
    EXPECT_EQ(filling.bounds(), soil);
}

TEST(Fill, CountsOfTheHirataScenes)
{
    const std::pair<const char*, std::array<std::int64_t, 2>> cases[] = {{"hirata_52", {140'608, 186'624}},
                                                                         {"hirata_104", {1'124'864, 746'496}},
                                                                         {"hirata_208", {8'998'912, 2'985'984}},
                                                                         {"quickstart", {8'000, 40'000}}};
    for (const auto& [name, counts] : cases) {
        const Filling filling(io::read_scene(std::string(KUZURE_SOURCE_DIR "/jobs/scenes/") + name + ".toml"));
        EXPECT_EQ(filling.soil_count(), counts[0]) << name;
        EXPECT_EQ(filling.wall_count(), counts[1]) << name;
    }
}

TEST(Fill, TwelveMillionParticlesAreListed)
{
    const Filling filling(io::read_scene(KUZURE_SOURCE_DIR "/jobs/scenes/hirata_208.toml"));
    double sum = 0;
    std::int64_t n = 0;
    filling.for_each_soil_in(everywhere, [&](std::int64_t, Vector x, int) { sum += x.x + x.y + x.z, ++n; });
    filling.for_each_wall_in(everywhere, [&](std::int64_t, Vector x, int) { sum += x.x + x.y + x.z, ++n; });
    EXPECT_EQ(n, 11'984'896);
    EXPECT_GT(sum, 0);
}

// Bodies and shapes of so many points that looking at each of them would take minutes: this program's time limit.
TEST(Fill, LargeBodiesInsideConcaveWallsAreChecked)
{
    // A trough whose bounds hold 8 million particles of soil.
    const Polygon trough{{{-1, -1}, {21, -1}, {21, 20}, {20, 20}, {20, 0}, {0, 0}, {0, 20}, {-1, 20}}, {0, 20}};
    EXPECT_TRUE(Filling::problems(made(0.1, {Box{{0, 0, 0}, {20, 20, 20}}}, {trough})).empty());
    EXPECT_FALSE(Filling::problems(made(0.1, {Sphere{{10, 10, 9.5}, 10}}, {trough})).empty());
}

TEST(Fill, LongAndThinShapesAreFilledByRows)
{
    const Lattice wedge(Polygon{{{1e6, 0}, {4, 0}, {4, 1}}, {0, 1}}, 0.1, 3), disc(Cylinder{{0, 0, 0}, 5e3, 0.2}, 0.1, 3);
    EXPECT_NEAR(double(wedge.size()), (1e6 - 4) / 2 * 1e3, 1e-6 * 5e8);
    EXPECT_NEAR(double(disc.size()), 3.14159265 * 5e3 * 5e3 * 0.2 * 1e3, 1e-5 * 1.6e10);
}

TEST(Fill, RoundShapesAreCountedExactly)
{
    // Centred on a lattice point, so that many points lie on the surface and do not count: whole numbers tell how many are inside.
    const auto expected = [](std::int64_t r, int across) {
        const auto inside = [r](std::int64_t rest) { // whole x with x^2 < rest
            std::int64_t x = r;
            while (x >= 0 && x * x >= rest) --x;
            return x < 0 ? 0 : 2 * x + 1;
        };
        std::int64_t sum = 0;
        for (std::int64_t a = -r; a <= r; ++a)
            for (std::int64_t b = across == 2 ? -r : 0; b <= (across == 2 ? r : 0); ++b) sum += inside(r * r - a * a - b * b);
        return sum;
    };
    for (const std::int64_t r : {1, 5, 13, 25, 65, 145})
        for (const double dx : {0.1, 0.125, 1e-3}) {
            const Vector c{(100 + 0.5) * dx, (-30 + 0.5) * dx, (7 + 0.5) * dx};
            const Lattice ball(Sphere{c, double(r) * dx}, dx, 3), disc(Sphere{c, double(r) * dx}, dx, 2);
            const Lattice rod(Cylinder{c - Vector{0, 0, dx / 2}, double(r) * dx, 3 * dx}, dx, 3);
            EXPECT_EQ(ball.size(), expected(r, 2)) << r << " " << dx;
            EXPECT_EQ(disc.size(), expected(r, 1)) << r << " " << dx;
            EXPECT_EQ(rod.size(), 3 * expected(r, 1)) << r << " " << dx;
        }
}

TEST(Fill, GiganticShapesAreCountedOrRefusedAtOnce)
{
    const std::clock_t start = std::clock();
    // 809 million particles, none of which is looked at.
    const Scene ball = made(0.1, {Sphere{{0, 0, 0}, 57.8}});
    EXPECT_NEAR(double(Filling(ball).soil_count()), 4.18879 * 578 * 578 * 578, 1e4);
    const auto problem = [](const Scene& scene) {
        const Issues issues = Filling::problems(scene);
        return issues.empty() ? std::string("accepted") : issues.front().key + ": " + issues.front().text;
    };
    // Each of them could be held.
    std::vector<Shape> row;
    for (int k = 0; k < 50; ++k) row.push_back(Sphere{{300.0 * k, 0, 0}, 100});
    EXPECT_EQ(problem(made(0.1, row)), "body.5.sphere: expected shapes that a computer can hold together, found 2.4e+07 rows of particles "
                                       "up to this one at a spacing of 0.1 m; is space.spacing in metres?");
    Polygon saw{{{0, 0}}, {0, 1}};
    for (int k = 0; k < 4000; ++k) saw.points.push_back({1 + 0.001 * k, k % 2 ? 100.0 : 1.0});
    EXPECT_EQ(problem(made(0.1, {saw})), "body.0.polygon: expected a polygon that can be filled in a minute, found 4001 corners and "
                                         "1.98e+07 particles next to its edges at a spacing of 0.1 m; leave out corners, or is "
                                         "space.spacing in metres?");
    // An edge on a row of particles, which are looked at one by one.
    EXPECT_THAT(problem(made(0.1, {Polygon{{{0, 0.05}, {1e9, 0.05}, {1e9, 1}}, {}}}, {}, 2)), HasSubstr("can be filled in a minute"));
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 5);
}

TEST(Fill, TouchingIsAllowedOverlappingIsNot)
{
    const Box cube{{0, 0, 0}, {1, 1, 1}};
    const auto problems = [&](Shape other, int dimensions = 3) { return Filling::problems(made(0.1, {cube}, {other}, dimensions)).size(); };
    EXPECT_EQ(problems(Box{{1, 0, 0}, {2, 1, 1}}), 0u);
    EXPECT_EQ(problems(Box{{-1, -1, -0.4}, {2, 2, 0}}), 0u);
    EXPECT_EQ(problems(Box{{1, 1, 1}, {2, 2, 2}}), 0u);
    EXPECT_EQ(problems(Box{{0.95, 0, 0}, {1.95, 1, 1}}), 1u);
    EXPECT_EQ(problems(Box{{0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}}), 1u);
    EXPECT_EQ(problems(Box{{0.2, 5, 0.2}, {0.5, 6, 0.5}}), 0u);
    EXPECT_EQ(problems(Box{{0.2, 5, 0.2}, {0.5, 6, 0.5}}, 2), 1u); // y does not count in 2-D
    EXPECT_EQ(problems(Sphere{{0.5, 0.5, 2}, 1}), 0u);
    EXPECT_EQ(problems(Sphere{{0.5, 0.5, 1.8}, 1}), 1u);
    EXPECT_EQ(problems(Cylinder{{0.5, 0.5, 1}, 0.5, 1}), 0u);
    EXPECT_EQ(problems(Cylinder{{0.5, 0.5, 0.5}, 0.2, 0.2}), 1u);
    EXPECT_EQ(problems(Polygon{{{1, 0}, {2, 0}, {1, 1}}, {0, 1}}), 0u);
    EXPECT_EQ(problems(Polygon{{{0.8, 0}, {2, 0}, {0.8, 1}}, {0, 1}}), 1u);
    // Two slopes on one slanted face share no lattice point.
    EXPECT_TRUE(Filling::problems(made(0.1, {slope, Polygon{{{0, 0}, {1, 1}, {0, 1}}, {2.0, 2.7}}})).empty());
    // Where shapes do not overlap, particles are at least half a spacing apart.
    const Filling filling(made(0.1, {cube}, {Sphere{{0.53, 0.48, 1.571}, 0.57}}));
    double nearest = far;
    for (const auto& w : walls_in(filling, everywhere))
        for (const auto& s : soil_in(filling, everywhere)) nearest = std::min(nearest, length(w.x - s.x));
    EXPECT_GE(nearest, 0.05);
}

TEST(Fill, ProblemsAreNamed)
{
    const auto text = [](const Scene& scene) {
        try {
            Filling f(scene);
        } catch (const BadInput& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    const Box cube{{0, 0, 0}, {1, 1, 1}};
    EXPECT_THAT(text(made(0.1, {Box{{0, 0, 0}, {1, 1.05, 1}}})),
                HasSubstr("body.0.box: expected a whole number of spacings (0.1 m) a side, found 10.5 along y"));
    EXPECT_EQ(text(made(0.1, {Box{{0, 0, 0}, {1, 1.05, 1}}}, {}, 2)), "accepted");
    EXPECT_EQ(text(made(0.1, {Box{{0, 7, 0}, {1, 3, 1}}}, {}, 2)), "accepted");
    EXPECT_EQ(text(made(0.1, {Box{{0, 0, 0}, {1, 1 + 5e-8, 1}}})), "accepted");
    EXPECT_THAT(text(made(0.1, {cube}, {Sphere{{3, 3, 3}, 0.01}})), HasSubstr("wall.0.sphere: expected particles strictly inside"));
    EXPECT_THAT(text(made(1e-5, {Box{{0, 0, 0}, {1e3, 1e3, 1e3}}})), HasSubstr("computer can hold"));
    EXPECT_THAT(text(made(0.1, {cube, cube})), HasSubstr("an overlap of body.1 with body.0 by 1 m"));
}

TEST(Fill, ShapesThatMissEveryLatticePointAreEmpty)
{
    for (const Shape& shape : {Shape{Cylinder{{0, 0, 0.06}, 1, 0.08}}, Shape{Polygon{{{0, 0}, {1, 0}, {0, 1}}, {0.06, 0.14}}},
                               Shape{Polygon{{{0, 0.06}, {1, 0.06}, {1, 0.14}}, {0, 1}}}, Shape{Sphere{{0, 0, 0}, 0.05}}}) {
        const Lattice lattice(shape, 0.1, 3);
        EXPECT_EQ(lattice.size(), 0);
        EXPECT_EQ(lattice.count_in(everywhere), 0);
        lattice.for_each_in(everywhere, [](std::int64_t, Vector) { ADD_FAILURE(); });
    }
}
