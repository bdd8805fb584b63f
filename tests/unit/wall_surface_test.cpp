// Walls as one surface: which faces a wall point lies behind, however the ground is drawn, and at which of them it mirrors a particle.
#include "solver/walls/surface.hpp"
#include <cmath>
#include <gtest/gtest.h>

using namespace kuzure;
using scene::Box, scene::Polygon, scene::Surface, scene::Wall;

namespace {

constexpr double reach = 2.6; // spacings, of one metre

Scene ground_of(int dimensions, std::vector<Wall> walls)
{
    Scene s;
    s.dimensions = dimensions, s.space.spacing = 1, s.walls = std::move(walls);
    return s;
}
Scene repeated(Scene s, double low, double high)
{
    s.space.low = Vector{low, -50, -50}, s.space.high = Vector{high, 50, 50}, s.space.periodic = {true, false, false};
    return s;
}
std::vector<Face> faces(const Scene& s, Vector x)
{
    std::vector<Face> found;
    WallSurface(s).faces(x, reach, found);
    return found;
}
/// One face at this depth with this normal.
void expect_one(const Scene& s, Vector x, double depth, Vector normal)
{
    const auto found = faces(s, x);
    ASSERT_EQ(found.size(), 1u) << x.x << " " << x.y << " " << x.z;
    EXPECT_NEAR(found[0].depth, depth, 1e-12);
    EXPECT_LT(length(found[0].normal - normal), 1e-12);
}
Wall ground(scene::Shape shape, Surface surface = Surface::Smooth) { return {std::move(shape), surface}; }

constexpr double ramp = 0.3; // spacings
/// Along which normal a point behind faces mirrors a particle.
Vector normal_for(const std::vector<Face>& faces, Vector point, Vector particle)
{
    const auto front = [&](const Face& f) { return dot(particle - point, f.normal) - f.depth; };
    FacesInFront<double> in_front(ramp);
    for (const Face& f : faces) in_front.add(f.normal, front(f), f.tied);
    return in_front.normal(faces[mirroring_face(faces, ramp, front)].normal);
}
/// A bank that rises by a quarter from (-10, z - 2.5) through (0, z), from its foot up; `cuts`: where it is divided, upright.
std::vector<Wall> bank(double z, const std::vector<double>& cuts)
{
    std::vector<Wall> walls;
    std::vector<double> x{-10};
    x.insert(x.end(), cuts.begin(), cuts.end()), x.push_back(10);
    for (std::size_t k = 0; k + 1 < x.size(); ++k)
        walls.push_back(ground(Polygon{{{x[k], -8}, {x[k + 1], -8}, {x[k + 1], z + x[k + 1] / 4}, {x[k], z + x[k] / 4}}, {-10, 10}}));
    return walls;
}

} // namespace

// The end of a piece touches a slope in one line, on whose height a wall point may lie: by last digits it was a face.
TEST(WallSurface, AFaceThatTouchesTheSurfaceInALineIsNone)
{
    for (const int dimensions : {2, 3})
        for (const double z : {0.5, 0.3})
            for (const double seam : {0.0, 1.0, -3.0}) {
                const double top = z + seam / 4;
                for (const double beside : {0.5, 1.5, 2.5}) {
                    const Vector at{seam + beside, 0, top}; // the top of the seam is as high
                    const Vector normal = (1 / std::hypot(0.25, 1)) * Vector{-0.25, 0, 1};
                    for (const auto& seams : {std::vector<double>{}, {seam}, {seam - 2, seam}, {seam, seam + 2}})
                        expect_one(ground_of(dimensions, bank(z, seams)), at, normal.z * beside / 4, normal);
                }
            }
}
TEST(WallSurface, ThePeriodBeginsAnywhere)
{
    // a saw of slopes up and down, whose period begins on a slope, at a height of the lattice
    const auto saw = [](double begin) {
        const auto piece = [](double a, double b, double za, double zb) {
            return ground(Polygon{{{a, -8}, {b, -8}, {b, zb}, {a, za}}, {-10, 10}});
        };
        std::vector<Wall> walls{piece(begin, 8, 0.25 * begin, 2), piece(8, 16, 2, 0)};
        if (begin > 0) walls.push_back(piece(16, 16 + begin, 0, 0.25 * begin));
        return repeated(ground_of(2, walls), begin, begin + 16);
    };
    for (const double begin : {0.0, 2.0, 6.0})
        for (const double beside : {0.5, 1.5}) {
            const double z = 0.25 * begin;
            for (const double image : {0.0, 16.0})
                if (begin > 0)
                    expect_one(saw(begin), {begin + image + beside, 0, z}, beside / 4 / std::hypot(0.25, 1),
                               {-0.25 / std::hypot(0.25, 1), 0, 1 / std::hypot(0.25, 1)});
        }
}

// Where two walls that cover a face touch each other there is no face.
TEST(WallSurface, AJointBehindAFaceIsNoAir)
{
    for (const double joint : {-1.5, -1.5 + 1e-16, -1.5 - 1e-16}) {
        const Scene s = ground_of(
            2, {ground(Box{{0, 0, -8}, {8, 0, 0}}), ground(Box{{-8, 0, joint}, {0, 0, 0}}), ground(Box{{-8, 0, -8}, {0, 0, joint}})});
        expect_one(s, {0.5, 0, -1.5}, 1.5, {0, 0, 1});
    }
}

// A wall that stands on the ground, as high as the wall point beside it: its face begins there.
TEST(WallSurface, AFaceThatBeginsAsHighAsThePointCounts)
{
    for (const double digit : {0.0, 1e-16, -1e-16}) {
        const Scene joined = ground_of(2, {ground(Box{{0, 0, -8}, {8, 0, 8}}), ground(Box{{-8, 0, -8}, {0, 0, 0.5 + digit}})});
        const Scene split = ground_of(2, {ground(Box{{0, 0, 0.5 + digit}, {8, 0, 8}}), ground(Box{{-8, 0, -8}, {8, 0, 0.5 + digit}})});
        for (const Scene* s : {&joined, &split}) expect_one(*s, {1.5, 0, 0.5}, 1.5, {-1, 0, 0});
    }
}

// Of two walls that meet in an edge that with more grip counts, whichever ends there: a tank's side on its floor or beside it.
TEST(WallSurface, WhichWallEndsAtAnEdgeDoesNotShow)
{
    for (const int dimensions : {2, 3})
        for (const bool rough_floor : {true, false}) {
            const Surface floor = rough_floor ? Surface::Rough : Surface::Smooth, side = rough_floor ? Surface::Smooth : Surface::Rough;
            const Scene on = ground_of(dimensions, {ground(Box{{-8, -8, -8}, {8, 8, 0}}, floor), ground(Box{{0, -8, 0}, {8, 8, 8}}, side)});
            const Scene beside =
                ground_of(dimensions, {ground(Box{{-8, -8, -8}, {0, 8, 0}}, floor), ground(Box{{0, -8, -8}, {8, 8, 8}}, side)});
            for (const Scene* s : {&on, &beside}) {
                const auto found = faces(*s, {0.5, 0, -0.5});
                ASSERT_EQ(found.size(), 1u);
                EXPECT_NEAR(found[0].depth, std::sqrt(0.5), 1e-12);
                EXPECT_EQ(s->walls[std::size_t(found[0].wall)].surface, Surface::Rough);
                EXPECT_LT(length(found[0].side - (rough_floor ? Vector{0, 0, 1} : Vector{-1, 0, 0})), 1e-12);
            }
        }
}

// Behind an edge faces are as near as each other: where the particle lies decides what mirrors it, not how they are turned.
TEST(WallSurface, EquallyNearFacesCountByHowFarTheParticleLiesInFrontOfEach)
{
    const Scene s = ground_of(3, {ground(Box{{-8, -8, -8}, {0, 0, 0}})});
    const Vector at{-0.5, -0.5, -0.5};
    const auto found = faces(s, at);
    ASSERT_EQ(found.size(), 3u);
    EXPECT_FALSE(found[0].tied);
    EXPECT_TRUE(found[1].tied && found[2].tied);
    // beyond the corner the way from it; beyond an edge that from the edge; beyond a face its normal
    for (const Vector x :
         {Vector{0.3, 0.2, 0.1}, Vector{0.01, 0.02, 1}, Vector{-0.3, 0.2, 0.1}, Vector{0.5, 0.2, -2}, Vector{-1, -2, 0.1}}) {
        const Vector way{std::max(x.x, 0.0), std::max(x.y, 0.0), std::max(x.z, 0.0)};
        EXPECT_LT(length(normal_for(found, at, x) - (1 / length(way)) * way), 1e-12) << x.x << " " << x.y << " " << x.z;
    }
    // behind all of them the least deep
    EXPECT_EQ(normal_for(found, at, {-0.3, -0.2, -0.4}), (Vector{0, 1, 0}));
    EXPECT_EQ(normal_for(found, at, {-0.3, -0.4, -0.2}), (Vector{0, 0, 1}));
}

// The nearest face that has the particle in front mirrors it, and no normal jumps where a particle comes in front of a face.
TEST(WallSurface, NormalsTurnAsAParticlePassesThePlaneOfAFace)
{
    const Scene s = ground_of(3, {ground(Box{{-8, -8, -8}, {0, 0, 0}})});
    const Vector at{-0.5, -5, -1.5};
    const auto found = faces(s, at);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(normal_for(found, at, {ramp, 0, 2}), (Vector{1, 0, 0}));
    EXPECT_EQ(normal_for(found, at, {2, 0, -0.1}), (Vector{1, 0, 0}));
    EXPECT_EQ(normal_for(found, at, {-0.1, 0, 0.1}), (Vector{0, 0, 1}));
    EXPECT_EQ(normal_for(found, at, {-0.1, 0, -0.2}), (Vector{1, 0, 0})); // behind both
    EXPECT_LT(length(normal_for(found, at, {ramp / 2, 0, 2}) - std::sqrt(0.5) * Vector{1, 0, 1}), 1e-12);
    for (const Vector& point : {at, Vector{-0.5, -0.7, -0.7}, Vector{-0.5, -0.5, -0.5}}) {
        const auto of = faces(s, point);
        const double step = 1e-3;
        for (int line = 0; line < 3; ++line) {
            const auto on_line = [&](double t) {
                return normal_for(of, point, line == 0 ? Vector{t, -1, 0.6} : line == 1 ? Vector{0.8, -1, t} : Vector{t, 0.3 - 2 * t, 0.3});
            };
            for (double t = -1; t < 1; t += step)
                EXPECT_LT(length(on_line(t + step) - on_line(t)), 8 * step / ramp) << "line " << line << " at " << t;
        }
    }
}
