// The particles of a scene against brute force over the lattice, and regions that must add up to the whole.
// Beyond 400 lines: one test a shape and a rule of filling.
#include "io/scene_file.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/fill.hpp"
#include <algorithm>
#include <ctime>
#include <fmt/format.h>
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
                    // A face belongs to the side of greater coordinates: inside is what is inside a little further along x, then y, then z.
                    if (signed_distance(shape, x + Vector{1e-6, 1e-8, 1e-10}, dimensions) >= 0) continue;
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
    const double bound[] = {-far, -0.7, 0.05, 0.85, 2.15, far}; // some lie on lattice points
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j) {
            const Box r{{bound[i], -far, bound[j]}, {bound[i + 1], far, bound[j + 1]}};
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
    // Centred on a lattice point, so that many points lie on the surface: whole numbers tell how many are inside, and half of those on
    // the surface count, for of two opposite ones the interior is on the greater side of one.
    const auto expected = [](std::int64_t r, int across) {
        const auto inside = [r](std::int64_t most) { // twice the whole x with x^2 < most, once those with x^2 = most
            std::int64_t x = r, on = 0;
            while (x >= 0 && x * x >= most) on += x * x == most ? (x > 0 ? 2 : 1) : 0, --x;
            return (x < 0 ? 0 : 2 * (2 * x + 1)) + on;
        };
        std::int64_t sum = 0;
        for (std::int64_t a = -r; a <= r; ++a)
            for (std::int64_t b = across == 2 ? -r : 0; b <= (across == 2 ? r : 0); ++b) sum += inside(r * r - a * a - b * b);
        return sum / 2;
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
    EXPECT_THAT(text(made(0.1, {cube}, {Sphere{{3, 3, 3}, 0.01}})), HasSubstr("wall.0.sphere: expected particles inside"));
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

namespace {

/// Random numbers of the generated scenes below.
struct Draw {
    std::mt19937 random;
    explicit Draw(unsigned seed) : random(seed) {}
    double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); }
    bool once_in(int n) { return whole(1, n) == 1; }
    /// Half the time on a lattice point, a quarter of the time half way between two, else anywhere.
    double coordinate(double low, double high, double dx)
    {
        const double x = real(low, high);
        const int kind = whole(0, 3);
        return kind < 2 ? (std::round(x / dx) + 0.5) * dx : kind == 2 ? std::round(x / dx) * dx : x;
    }
    double spacing() { return std::array{0.1, 0.125, 0.04, 1.0 / 3, 0.7}[std::size_t(whole(0, 4))]; }
};
using Corners = std::vector<std::array<double, 2>>;

/// The triangles from a point inside to the edges of a random polygon around it; empty if the draw was none.
struct Star {
    Polygon whole;
    std::vector<Polygon> parts;
};
std::optional<Star> star(Draw& draw, double dx)
{
    const std::array<double, 2> middle{draw.coordinate(-2 * dx, 2 * dx, dx), draw.coordinate(-2 * dx, 2 * dx, dx)};
    const int n = draw.whole(3, 9);
    Corners around;
    for (int k = 0; k < n; ++k) {
        const double angle = (k + draw.real(0.1, 0.9)) * 2 * std::acos(-1.0) / n, r = draw.real(3 * dx, 9 * dx);
        const double x = middle[0] + r * std::cos(angle), z = middle[1] + r * std::sin(angle);
        around.push_back({draw.coordinate(x, x, dx), draw.coordinate(z, z, dx)});
    }
    Star all{{around, {}}, {}};
    // Pieces of two or three edges at times, bounded by two lines from the middle.
    double sum = 0;
    for (int k = 0; k < n;) {
        const int edges = std::min(draw.whole(1, 3), n - k);
        Corners piece{middle};
        for (int e = 0; e <= edges; ++e) piece.push_back(around[std::size_t((k + e) % n)]);
        k += edges;
        if (crosses_itself({piece, {}}) || area({piece, {}}) <= 0.01 * dx * dx) return {};
        sum += area({piece, {}});
        if (draw.once_in(2)) std::reverse(piece.begin(), piece.end());
        all.parts.push_back({piece, {}});
    }
    if (crosses_itself(all.whole) || std::abs(sum - area(all.whole)) > 1e-9 * dx * dx) return {};
    return all;
}

std::vector<std::array<double, 3>> sorted_points(const std::vector<Shape>& shapes, double dx, int dimensions)
{
    std::vector<std::array<double, 3>> all;
    for (const auto& shape : shapes)
        Lattice(shape, dx, dimensions).for_each_in(everywhere, [&](std::int64_t, Vector x) { all.push_back({x.x, x.y, x.z}); });
    std::sort(all.begin(), all.end());
    return all;
}
/// The pieces hold what the whole holds, each point once, the same bits.
void expect_the_same(const std::vector<Shape>& pieces, const Shape& whole, double dx, int dimensions, const std::string& what)
{
    const auto a = sorted_points(pieces, dx, dimensions), b = sorted_points({whole}, dx, dimensions);
    EXPECT_EQ(a.size(), b.size()) << what;
    EXPECT_TRUE(a == b) << what;
}

} // namespace

TEST(FillOfPieces, PolygonsSplitFromAPointNeitherShareNorLoseAPoint)
{
    Draw draw(18);
    int done = 0;
    std::int64_t points = 0;
    while (done < 400) {
        const double dx = draw.spacing();
        const auto s = star(draw, dx);
        if (!s) continue;
        const int dimensions = done % 4 ? 2 : 3;
        Polygon whole = s->whole;
        whole.y = {draw.coordinate(-3 * dx, 0, dx), draw.coordinate(2 * dx, 4 * dx, dx)};
        std::vector<Shape> pieces;
        for (auto part : s->parts) {
            const double y = draw.coordinate(0, 1.4 * dx, dx); // split along y too
            if (dimensions == 2 || draw.once_in(2) || y < whole.y[0] + 1e-6 * dx || y > whole.y[1] - 1e-6 * dx) {
                part.y = whole.y;
                pieces.push_back(part);
                continue;
            }
            part.y = {whole.y[0], y};
            pieces.push_back(part);
            part.y = {y, whole.y[1]};
            pieces.push_back(part);
        }
        expect_the_same(pieces, whole, dx, dimensions, fmt::format("polygon {} at a spacing of {}", done, dx));
        points += Lattice(whole, dx, dimensions).size();
        // As a scene: the bodies touch, and the count of each adds up to the whole's.
        std::erase_if(pieces, [&](const Shape& p) { return Lattice(p, dx, dimensions).size() == 0; });
        const Scene scene = made(dx, pieces, {}, dimensions);
        for (const auto& issue : Filling::problems(scene)) ADD_FAILURE() << in_words(issue);
        ++done;
    }
    EXPECT_GT(points, 10'000);
}

// The ends of some pieces lie on the middle of other edges, where corners are known to rounding only.
TEST(FillOfPieces, PiecesThatMeetInTheMiddleOfAnEdge)
{
    Draw draw(19);
    for (int n = 0; n < 300; ++n) {
        const double dx = draw.spacing();
        const auto on = [&](std::array<double, 2> a, std::array<double, 2> b, double t) {
            return std::array<double, 2>{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
        };
        const double x = draw.coordinate(-5 * dx, 5 * dx, dx), z = draw.coordinate(-5 * dx, 5 * dx, dx), w = draw.whole(4, 12) * dx;
        const std::array<double, 2> a{x, z}, b{x + w, z}, c{x + w, z + w}, d{x, z + w};
        const auto share = [&] { return draw.once_in(2) ? draw.whole(1, 3) * 0.25 : draw.real(0.2, 0.8); };
        // One half whole, the other split from its corner to the middle of the diagonal, and one of those once more.
        const auto m = on(a, c, share()), q = on(d, m, share());
        expect_the_same({Polygon{{a, b, c}, {}}, Polygon{{a, m, d}, {}}, Polygon{{m, c, q}, {}}, Polygon{{q, c, d}, {}}},
                        Polygon{{a, b, c, d}, {}}, dx, 2, fmt::format("square {} at a spacing of {}", n, dx));
    }
}

TEST(FillOfPieces, CylindersSplitAcrossTheirAxis)
{
    Draw draw(20);
    for (int n = 0; n < 100; ++n) {
        const double dx = draw.spacing(), radius = draw.once_in(2) ? draw.whole(2, 6) * dx : draw.real(2 * dx, 6 * dx);
        const Vector base{draw.coordinate(-dx, dx, dx), draw.coordinate(-dx, dx, dx), draw.coordinate(-dx, dx, dx)};
        const double low = draw.coordinate(2 * dx, 4 * dx, dx) - base.z, high = draw.coordinate(6 * dx, 9 * dx, dx) - base.z;
        expect_the_same({Cylinder{base, radius, low}, Cylinder{base + Vector{0, 0, low}, radius, high - low}}, Cylinder{base, radius, high},
                        dx, 3, fmt::format("cylinder {}", n));
    }
}

TEST(FillOfPieces, BoxesSplitAtWholeSpacings)
{
    Draw draw(21);
    for (int n = 0; n < 100; ++n) {
        const double dx = draw.spacing();
        const Vector low{draw.real(-9, 9), draw.real(-9, 9), draw.real(-9, 9)};
        const int nx = draw.whole(2, 9), middle = draw.whole(1, nx - 1);
        const auto box = [&](int from, int to) {
            return Box{{low.x + from * dx, low.y, low.z}, {low.x + to * dx, low.y + 3 * dx, low.z + 2 * dx}};
        };
        EXPECT_EQ(Lattice(box(0, middle), dx, 3).size() + Lattice(box(middle, nx), dx, 3).size(), Lattice(box(0, nx), dx, 3).size());
    }
}

// Round shapes, polygons and boxes that touch in a point, along a line or on a face: at most one of them has a point.
TEST(FillOfPieces, TouchingShapesOfDifferentKindsShareNoPoint)
{
    Draw draw(22);
    for (int n = 0; n < 200; ++n) {
        const double dx = draw.spacing();
        const Vector at{(draw.whole(-5, 5) + 0.5) * dx, (draw.whole(-5, 5) + 0.5) * dx, (draw.whole(-5, 5) + 0.5) * dx};
        const double r1 = draw.whole(1, 5) * dx, r2 = draw.whole(1, 5) * dx;
        const int axis = draw.whole(0, 2);
        const Vector along = axis == 0 ? Vector{1, 0, 0} : axis == 1 ? Vector{0, 1, 0} : Vector{0, 0, 1};
        // Two balls that touch in a lattice point: it belongs to the one behind, seen along the axis.
        const Sphere before{at - r1 * along, r1}, behind{at + r2 * along, r2};
        EXPECT_FALSE(holds(before, at, 3, 1e-9 * dx)) << n;
        EXPECT_TRUE(holds(behind, at, 3, 1e-9 * dx)) << n;
        // A ball on a prism's face through lattice points.
        const Polygon prism{{{at.x - 4 * dx, at.z - 3 * dx}, {at.x + 4 * dx, at.z - 3 * dx}, {at.x + 4 * dx, at.z}, {at.x - 4 * dx, at.z}},
                            {at.y - 2 * dx, at.y + 2 * dx}};
        const auto all =
            sorted_points({prism, Sphere{at + Vector{0, 0, r2}, r2}, Cylinder{at + Vector{-4 * dx - r1, 0, -2 * dx}, r1, 2 * dx}}, dx, 3);
        EXPECT_TRUE(std::adjacent_find(all.begin(), all.end()) == all.end()) << n;
        EXPECT_TRUE(std::binary_search(all.begin(), all.end(), std::array<double, 3>{at.x, at.y, at.z})) << n;
    }
}

// A body that spans a period along lattice points fills it once, and so do two that meet in the middle.
TEST(FillOfPieces, AcrossAPeriod)
{
    const Corners bank{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (const double dx : {0.1, 0.07, 1.0 / 3})
        for (const int n : {7, 12}) {
            const double low = -3.5 * dx, high = low + n * dx, middle = low + 3 * dx;
            const Lattice whole(Polygon{bank, {low, high}}, dx, 3);
            const Lattice section(Polygon{bank, {}}, dx, 2);
            EXPECT_EQ(whole.size(), n * section.size());
            EXPECT_EQ(Lattice(Polygon{bank, {low, middle}}, dx, 3).size() + Lattice(Polygon{bank, {middle, high}}, dx, 3).size(),
                      whole.size());
        }
}

// Points on the lower face of the space are in it, not an ulp outside, where they would belong to the other end of the period.
TEST(FillOfPieces, NoPointLiesOutsideTheSpaceByRounding)
{
    int on_the_face = 0;
    for (const double dx : {0.1, 0.07, 1.0 / 3})
        for (int n = -40; n < 40; ++n) {
            const double low = std::stod(fmt::format("{:.14g}", (n + 0.5) * dx)), high = low + 9 * dx; // as a file has it
            Scene s = made(dx, {Polygon{{{low, low}, {high, low}, {high, high}, {low, high}}, {low, high}}},
                           {Polygon{{{low - 3 * dx, low - 3 * dx}, {high, low - 3 * dx}, {high, low}, {low - 3 * dx, low}}, {low, high}}});
            s.space.low = Vector{low, low, low}, s.space.high = Vector{high, high, high};
            s.space.periodic[1] = true;
            const Filling filling(s);
            EXPECT_EQ(filling.soil_count(), 9 * 9 * 9);
            EXPECT_EQ(filling.wall_count(), 12 * 3 * 9);
            for (const auto& p : soil_in(filling, everywhere)) {
                ASSERT_GE(p.x.x, low);
                ASSERT_GE(p.x.y, low);
                ASSERT_GE(p.x.z, low);
                ASSERT_EQ(filling.soil_position(p.id), p.x);
                on_the_face += p.x.y == low;
            }
            for (const auto& p : walls_in(filling, everywhere)) ASSERT_GE(p.x.y, low);
            EXPECT_EQ(filling.soil_count_in({{low, low, low}, {high, high, high}}), 9 * 9 * 9);
        }
    EXPECT_GT(on_the_face, 1000);
}

namespace {
Shape shifted(Shape shape, Vector by)
{
    if (auto* b = std::get_if<Box>(&shape)) b->low = b->low + by, b->high = b->high + by;
    else if (auto* c = std::get_if<Cylinder>(&shape)) c->base = c->base + by;
    else if (auto* s = std::get_if<Sphere>(&shape)) s->center = s->center + by;
    else if (auto* p = std::get_if<Polygon>(&shape)) {
        for (auto& q : p->points) q[0] += by.x, q[1] += by.z;
        p->y[0] += by.y, p->y[1] += by.y;
    }
    return shape;
}
} // namespace

// By whole spacings, up to map coordinates: the same points with the same ids, to the rounding of the coordinates.
TEST(FillOfShifts, TheSamePointsRelativeToTheBody)
{
    Draw draw(23);
    for (int n = 0; n < 300;) {
        const double dx = draw.spacing();
        const double far_away = draw.once_in(2) ? 4e6 : draw.real(10, 1e6);
        const auto shift = [&] { return std::round(draw.real(-1, 1) * far_away / dx) * dx; };
        const Vector by{shift(), shift(), shift()};
        const auto s = star(draw, dx);
        if (!s) continue;
        Polygon prism = s->whole;
        prism.y = {draw.coordinate(-3 * dx, 0, dx), draw.coordinate(dx, 4 * dx, dx)};
        const Vector c{draw.coordinate(-dx, dx, dx), draw.coordinate(-dx, dx, dx), draw.coordinate(-dx, dx, dx)};
        const double r = draw.once_in(2) ? draw.whole(2, 5) * dx : draw.real(2 * dx, 5 * dx);
        for (const Shape& shape : {Shape(prism), Shape(Sphere{c, r}), Shape(Cylinder{c, r, draw.whole(2, 5) * dx}),
                                   Shape(Box{c, c + Vector{3 * dx, 4 * dx, 5 * dx}})}) {
            const Lattice here(shape, dx, 3), there(shifted(shape, by), dx, 3);
            ASSERT_EQ(here.size(), there.size()) << name_of(shape) << " " << n << " at " << by.x << " " << by.y << " " << by.z;
            const double rounding = std::max({rounding_of(by.x), rounding_of(by.y), rounding_of(by.z), 1e-12});
            for (std::int64_t k = 0; k < here.size(); ++k)
                ASSERT_LT(length(there.position(k) - by - here.position(k)), rounding) << name_of(shape) << " " << n;
        }
        ++n;
    }
}

// A bank, a tank of polygons with faces on lattice points, and a cylinder as they were reported: the counts that are right.
TEST(FillOfShifts, ReportedScenes)
{
    const auto bank = [](double x, double z) {
        return Polygon{{{x + 0.05, z + 0.05}, {x + 3.05, z + 0.05}, {x + 2.05, z + 2.05}, {x + 0.05, z + 2.05}}, {}};
    };
    EXPECT_EQ(Lattice(bank(0, 0), 0.1, 2).size(), 510);
    EXPECT_EQ(
        Lattice(Polygon{{{4000000.05, 1000.05}, {4000003.05, 1000.05}, {4000002.05, 1002.05}, {4000000.05, 1002.05}}, {}}, 0.1, 2).size(),
        510);
    EXPECT_EQ(Lattice(Polygon{{{0, 0.05}, {2, 0.05}, {2, 1.05}, {0, 1.05}}, {}}, 0.1, 2).size(), 200);
    EXPECT_EQ(Lattice(Polygon{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {-0.35, 0.35}}, 0.1, 3).size(), 700);
    // What rounding moves further than particles tell apart is refused, not guessed.
    const auto issues = Filling::problems(made(1e-7, {Box{{4e6, 0, 0}, {4e6 + 1e-5, 1e-5, 1e-5}}}));
    ASSERT_EQ(issues.size(), 1u);
    EXPECT_THAT(issues[0].text, HasSubstr("move the scene nearer to the origin"));
}
