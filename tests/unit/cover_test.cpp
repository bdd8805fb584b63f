// Where soil is in plan: everything near it is held, what is far is not, and every wall point is visited once.
#include "solver/run/cover.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

Particles at(const std::vector<Vector>& points)
{
    Particles p;
    p.require(field::sorted_position);
    p.resize(Index(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) p[field::sorted_position].set(Index(i), points[i]);
    return p;
}

/// Two lumps far from each other, below and above zero.
std::vector<Vector> lumps()
{
    std::vector<Vector> points;
    for (int k = 0; k < 60; ++k) {
        const double a = 0.7 * k, r = 0.05 * k;
        points.push_back({-40.2 + r * std::cos(a), -7.7 + r * std::sin(a), -3 + 0.1 * k});
        points.push_back({55.1 + r * std::sin(a), 23.3 + r * std::cos(a), 12 - 0.1 * k});
    }
    return points;
}

} // namespace

TEST(Cover, HoldsWhatIsNearAndNotWhatIsFar)
{
    const auto points = lumps();
    const Cover cover(at(points), 2.0, 1.5);
    for (const Vector& p : points)
        for (const double a : {-1.49, 0.0, 1.49})
            for (const double b : {-1.49, 0.0, 1.49})
                for (const double c : {-1.49, 0.0, 1.49}) EXPECT_TRUE(cover.holds(p + Vector{a, b, c}));
    EXPECT_FALSE(cover.holds({0, 0, 0})) << "between the lumps";
    EXPECT_FALSE(cover.holds({-40.2, -7.7, 6})) << "above one";
    EXPECT_FALSE(cover.holds({-40.2, -7.7, -6})) << "below it";
}

TEST(Cover, ALargerMarginHoldsASmallerOneUntilSoilHasGoneTheDifference)
{
    auto points = lumps();
    const Cover wide(at(points), 2.0, 4.0), narrow(at(points), 2.0, 1.0);
    EXPECT_TRUE(wide.holds(narrow));
    EXPECT_FALSE(narrow.holds(wide));
    for (Vector& p : points) p = p + Vector{2.9, -2.9, 2.9};
    EXPECT_TRUE(wide.holds(Cover(at(points), 2.0, 1.0)));
    points[7] = points[7] + Vector{0, 0, 40};
    EXPECT_FALSE(wide.holds(Cover(at(points), 2.0, 1.0))) << "one grain that flies";
}

TEST(Cover, APointAtTheEdgeOfSquaresIsOfOne)
{
    const Cover cover(at(lumps()), 2.0, 3.0);
    std::vector<Vector> walls; // many of them on the edges and corners of squares
    for (int i = -60; i < 70; ++i)
        for (int j = -30; j < 40; ++j) walls.push_back({double(i), double(j), i < 0 ? -1.0 : 10.0});
    std::vector<int> visits(walls.size());
    cover.for_each([&](Cover::Square square, const scene::Box& box) {
        for (std::size_t k = 0; k < walls.size(); ++k) {
            const Vector& x = walls[k];
            const bool in =
                x.x >= box.low.x && x.y >= box.low.y && x.z >= box.low.z && x.x <= box.high.x && x.y <= box.high.y && x.z <= box.high.z;
            if (in && cover.square_of(x) == square) ++visits[k];
        }
    });
    int held = 0;
    for (std::size_t k = 0; k < walls.size(); ++k) {
        EXPECT_EQ(visits[k], cover.holds(walls[k]) ? 1 : 0) << walls[k].x << ", " << walls[k].y;
        held += visits[k];
    }
    EXPECT_GT(held, 100);
    EXPECT_LT(held, int(walls.size()) / 4);
}
