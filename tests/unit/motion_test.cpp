// Walls that move: where they stand and how fast they go, and that a wall turned is the wall drawn turned.
#include "solver/scene/events.hpp"
#include "solver/scene/motion.hpp"
#include "solver/walls/surface.hpp"
#include <gtest/gtest.h>
#include <numbers>
#include <random>

using namespace kuzure;

namespace {

scene::Event moved(double from, double to, Vector velocity, std::optional<scene::Turn> turn = {})
{
    scene::Event e;
    e.from = from, e.to = to;
    e.move = scene::WallMove{"plate", velocity, turn};
    return e;
}
Scene plate(int dimensions)
{
    Scene s;
    s.dimensions = dimensions;
    s.space.spacing = 0.1;
    s.walls = {{scene::Box{{-1, -2, -0.5}, {2, 2, 0}}, scene::Surface::Rough, 0, "floor"},
               {scene::Box{{0, -1, 0}, {0.4, 1, 1.5}}, scene::Surface::Smooth, 0, "plate"}};
    return s;
}

} // namespace

TEST(Motion, FollowsItsEventsInTheirOrder)
{
    Scene s = plate(3);
    s.events = {moved(3, 4, {0, 2, 0}), moved(1, 2, {1, 0, 0}, scene::Turn{{0, 0, 0}, {0, 0, 2}, std::numbers::pi / 2})};
    const Vector corner{0.4, 0, 1.5};
    const auto at = [&](int begun, double t) { return scene::placed(scene::pose_at(s, 1, begun, t), corner); };
    const auto near = [](Vector a, Vector b) { return length(a - b) < 1e-12; };
    EXPECT_TRUE(near(at(0, 9), corner)); // nothing has begun
    EXPECT_TRUE(near(at(1, 1), corner));
    // a quarter about z while the center goes a metre
    EXPECT_TRUE(near(at(1, 2), {1, 0.4, 1.5}));
    EXPECT_TRUE(near(at(1, 3), {1, 0.4, 1.5}));
    EXPECT_TRUE(near(at(2, 3.5), {1, 1.4, 1.5}));
    EXPECT_TRUE(near(scene::as_drawn(scene::pose_at(s, 1, 2, 3.5), {1, 1.4, 1.5}), corner));
    EXPECT_EQ(scene::pose_at(s, 0, 2, 9), scene::Pose{}); // the other wall
    EXPECT_EQ(scene::moving_walls(s), std::vector{1});
}

TEST(Motion, GoesAsItsEventsSay)
{
    Scene s = plate(3);
    const scene::Turn turn{{0.1, 0.2, 0.3}, {1, 2, -1}, 0.7};
    const Vector velocity{0.3, -0.2, 0.5}, spin = (turn.rate / length(turn.axis)) * turn.axis;
    s.events = {moved(1, 2, velocity, turn), moved(2, 3, {-1, 0, 0})};
    for (const double t : {0.5, 1.2, 1.9, 2.4, 3.5}) {
        const double d = 1e-5;
        for (const Vector x : {Vector{0, 0, 0}, Vector{0.4, 1, 1.5}}) {
            const Vector a = scene::placed(scene::pose_at(s, 1, 2, t - d), x), b = scene::placed(scene::pose_at(s, 1, 2, t + d), x);
            Vector v{};
            if (t > 1 && t < 2) v = velocity + cross(spin, 0.5 * (a + b) - (turn.center + (t - 1) * velocity));
            if (t > 2 && t < 3) v = {-1, 0, 0};
            EXPECT_LT(length((1 / (2 * d)) * (b - a) - v), 1e-9) << t;
        }
    }
    EXPECT_GT(scene::fastest_wall(s), 1);
    // of a step that a motion ends in, the mean
    const auto way = scene::placed(scene::pose_at(s, 1, 2, 3.1), {}) - scene::placed(scene::pose_at(s, 1, 2, 2.9), {});
    EXPECT_NEAR(way.x / 0.2, -0.5, 1e-12);
}

TEST(Motion, ComesToItsSpeedInItsRamp)
{
    Scene s = plate(3);
    s.events = {moved(1, 2, {3, 0, 0}, scene::Turn{{0, 0, 0}, {0, 1, 0}, 0.5})};
    s.events[0].move->ramp = 0.2;
    const auto way = [&](double t) { return scene::placed(scene::pose_at(s, 1, 1, t), {0, 0, 0}).x; };
    const auto speed = [&](double t) { return (way(t + 1e-5) - way(t - 1e-5)) / 2e-5; };
    for (const auto& [t, v] : {std::pair{0.9, 0.0}, {1.1, 1.5}, {1.15, 2.25}, {1.5, 3.0}, {1.9, 1.5}, {1.95, 0.75}, {2.1, 0.0}})
        EXPECT_NEAR(speed(t), v, 1e-8) << t;
    EXPECT_NEAR(way(2), 3 * 0.8, 1e-12); // velocity times (duration less ramp)
    // the turn keeps pace
    EXPECT_NEAR(std::atan2(scene::pose_at(s, 1, 1, 2).turn.x.z, scene::pose_at(s, 1, 1, 2).turn.x.x), 0.5 * 0.8, 1e-12);
    EXPECT_NEAR(scene::fastest_wall(s), 3 + 0.5 * std::hypot(0.4, 1.5), 0.2);
    s.events[0].move->ramp = 0.5;
    EXPECT_NEAR(way(2), 3 * 0.5, 1e-12);
    EXPECT_NEAR(speed(1.5), 3, 1e-3);
}

TEST(Motion, FollowsAPath)
{
    Scene s = plate(3);
    scene::Event e;
    e.at = 1.0;
    e.move = scene::WallMove{"plate"};
    using Rows = std::vector<std::array<double, 4>>;
    e.move->path = {"path.csv", std::make_shared<const Rows>(Rows{{0, 0, 0, 0}, {0.5, 1, 0, 0}, {1.5, 1, -1, 2}})};
    s.events = {e, moved(3, 4, {1, 0, 0})};
    const auto at = [&](double t) { return scene::placed(scene::pose_at(s, 1, 2, t), {}); };
    for (const auto& [t, x] : {std::pair{0.5, Vector{}},
                               {1.25, Vector{0.5, 0, 0}},
                               {2.0, Vector{1, -0.5, 1}},
                               {2.5, Vector{1, -1, 2}},
                               {2.9, Vector{1, -1, 2}},
                               {3.5, Vector{1.5, -1, 2}}})
        EXPECT_LT(length(at(t) - x), 1e-12) << t;
    EXPECT_NEAR(scene::fastest_wall(s), std::sqrt(5.0), 1e-9);
    EXPECT_EQ(scene::end_of(e), 2.5);
    EXPECT_FALSE(scene::has_course(e)); // the wall alone
}

TEST(Motion, AWallTurnedIsTheWallDrawnTurned)
{
    for (const int dimensions : {2, 3}) {
        Scene s = plate(dimensions), drawn = s;
        s.events = {moved(0, 1, {0.3, 0, 0.2}, scene::Turn{{0.2, 0, 0}, {0, 1, 0}, 0.5})};
        s = scene::stage_of(s, 1, 1);
        const auto box = std::get<scene::Box>(drawn.walls[1].shape);
        scene::Polygon p{{}, {box.low.y, box.high.y}};
        for (const auto [x, z] : {std::array{0.0, 0.0}, {0.4, 0.0}, {0.4, 1.5}, {0.0, 1.5}}) {
            const Vector a = scene::placed(s.walls[1].pose, {x, 0, z});
            p.points.push_back({a.x, a.z});
        }
        drawn.walls[1].shape = p;
        const WallSurface turned(s), same(drawn);
        std::mt19937 g(3);
        const auto u = [&](double a, double b) { return std::uniform_real_distribution(a, b)(g); };
        std::vector<Face> f, e;
        int several = 0;
        for (int k = 0; k < 3000; ++k) {
            const Vector x{u(-0.5, 2), dimensions == 3 ? u(-1.2, 1.2) : 0, u(-0.4, 2)};
            ASSERT_NEAR(turned.depth(x, 0.4), same.depth(x, 0.4), 1e-9);
            if (turned.depth(x, 0.4) == 0) continue;
            turned.faces(x, 0.4, f), same.faces(x, 0.4, e);
            ASSERT_EQ(f.size(), e.size()) << x.x << " " << x.y << " " << x.z;
            several += f.size() > 1;
            for (std::size_t j = 0; j < f.size(); ++j) {
                EXPECT_NEAR(f[j].depth, e[j].depth, 1e-9);
                EXPECT_LT(length(f[j].normal - e[j].normal), 1e-6);
                EXPECT_EQ(f[j].wall, e[j].wall);
            }
            EXPECT_NEAR(scene::signed_distance(s.walls[1], x, dimensions), scene::signed_distance(p, x, dimensions), 1e-9);
        }
        EXPECT_GT(several, 100);
    }
}
