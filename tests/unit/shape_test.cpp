// Distances and normals against brute force over points of the surface.
#include "solver/scene/shape.hpp"
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace kuzure;
using namespace kuzure::scene;

namespace {

const Box box{{-0.3, 0.1, -0.2}, {0.7, 0.5, 0.6}};
const Cylinder cylinder{{0.1, 0.2, -0.3}, 0.4, 0.7};
const Sphere sphere{{0.2, 0.3, 0.1}, 0.5};
const Polygon triangle{{{-0.4, -0.3}, {0.8, -0.2}, {0.1, 0.7}}, {-0.1, 0.6}};
const Polygon concave{{{0, 0}, {1, 0}, {1, 1}, {0.5, 0.2}, {0, 1}}, {-0.2, 0.5}};
Polygon reversed(Polygon p)
{
    std::reverse(p.points.begin(), p.points.end());
    return p;
}
const std::vector<Shape> shapes{box, cylinder, sphere, triangle, concave, reversed(concave)};

std::vector<Vector> random_points(int n)
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> u(-1.2, 1.6);
    std::vector<Vector> points;
    for (int k = 0; k < n; ++k) points.push_back({u(random), u(random), u(random)});
    return points;
}

/// Independent of the code under test: plain inequalities, and winding by summed angles for polygons.
bool inside(const Shape& shape, Vector x, int dimensions)
{
    const bool flat = dimensions == 2;
    if (const auto* b = std::get_if<Box>(&shape))
        return x.x > b->low.x && x.x < b->high.x && x.z > b->low.z && x.z < b->high.z && (flat || (x.y > b->low.y && x.y < b->high.y));
    if (const auto* c = std::get_if<Cylinder>(&shape))
        return std::pow(x.x - c->base.x, 2) + std::pow(x.y - c->base.y, 2) < c->radius * c->radius && x.z > c->base.z &&
               x.z < c->base.z + c->height;
    if (const auto* s = std::get_if<Sphere>(&shape))
        return std::pow(x.x - s->center.x, 2) + (flat ? 0 : std::pow(x.y - s->center.y, 2)) + std::pow(x.z - s->center.z, 2) <
               s->radius * s->radius;
    const auto& p = std::get<Polygon>(shape);
    double turn = 0;
    for (std::size_t k = 0; k < p.points.size(); ++k) {
        const auto a = p.points[k], b = p.points[(k + 1) % p.points.size()];
        const double ax = a[0] - x.x, az = a[1] - x.z, bx = b[0] - x.x, bz = b[1] - x.z;
        turn += std::atan2(ax * bz - az * bx, ax * bx + az * bz);
    }
    return std::abs(turn) > 3 && (flat || (x.y > p.y[0] && x.y < p.y[1]));
}

} // namespace

TEST(Shape, InsideIsInside)
{
    for (const auto& shape : shapes)
        for (const int dimensions : {2, 3}) {
            if (dimensions == 2 && std::holds_alternative<Cylinder>(shape)) continue;
            int n = 0;
            for (const auto& x : random_points(5000)) {
                EXPECT_EQ(contains(shape, x, dimensions), inside(shape, x, dimensions)) << name_of(shape);
                n += inside(shape, x, dimensions);
            }
            EXPECT_GT(n, 20);
        }
}

TEST(Shape, FollowingTheNormalLeadsToTheSurface)
{
    for (const auto& shape : shapes)
        for (const int dimensions : {2, 3}) {
            if (dimensions == 2 && std::holds_alternative<Cylinder>(shape)) continue;
            for (const auto& x : random_points(3000)) {
                const auto c = contact(shape, x, dimensions);
                EXPECT_NEAR(length(c.normal), 1, 1e-12);
                if (dimensions == 2) {
                    EXPECT_EQ(c.normal.y, 0);
                }
                const Vector foot = x - c.distance * c.normal;
                EXPECT_NEAR(signed_distance(shape, foot, dimensions), 0, 1e-12) << name_of(shape);
                // Just before the surface the side is the one we came from.
                const Vector before = x - 0.999 * c.distance * c.normal;
                EXPECT_EQ(inside(shape, before, dimensions), c.distance < 0) << name_of(shape);
            }
        }
}

TEST(Shape, NoPointOfTheSurfaceIsNearer)
{
    // Walking from x by less than the distance never crosses the surface; by a little more it does in some direction.
    std::mt19937 random(3);
    std::normal_distribution<double> g;
    for (const auto& shape : shapes)
        for (const auto& x : random_points(300)) {
            const double d = std::abs(signed_distance(shape, x));
            for (int k = 0; k < 100; ++k) {
                Vector way{g(random), g(random), g(random)};
                way = (0.999999 * d / length(way)) * way;
                EXPECT_EQ(inside(shape, x + way, 3), inside(shape, x, 3)) << name_of(shape);
            }
        }
}

TEST(Shape, FacesEdgesAndCornersOfABoxAreDefined)
{
    const Box unit{{0, 0, 0}, {1, 1, 1}};
    const auto top = contact(unit, {0.3, 0.4, 1.0});
    EXPECT_EQ(top.distance, 0);
    EXPECT_EQ(top.normal, (Vector{0, 0, 1}));
    EXPECT_EQ(contact(unit, {0, 0.4, 0.5}).normal, (Vector{-1, 0, 0}));
    EXPECT_EQ(contact(unit, {0.4, 1, 0.5}).normal, (Vector{0, 1, 0}));
    EXPECT_EQ(contact(unit, {1, 1, 1}).normal, (Vector{0, 0, 1}));
    EXPECT_EQ(contact(unit, {1, 0.5, 1}).distance, 0);
    EXPECT_EQ(contact(unit, {0.5, 0.5, 0.5}).distance, -0.5);
    EXPECT_EQ(contact(unit, {0.5, 0.5, 0.5}).normal, (Vector{0, 0, 1}));
    const auto corner = contact(unit, {2, 3, 3});
    EXPECT_DOUBLE_EQ(corner.distance, 3);
    EXPECT_DOUBLE_EQ(corner.normal.x, 1.0 / 3);
    EXPECT_DOUBLE_EQ(corner.normal.y, 2.0 / 3);
    const auto flat = contact(unit, {2, 99, 2}, 2);
    EXPECT_DOUBLE_EQ(flat.distance, std::sqrt(2.0));
    EXPECT_EQ(flat.normal.y, 0);
    // The smallest step away from an edge still has a direction.
    const auto hair = contact(unit, {1 + 1e-16, 0.5, -5e-324});
    EXPECT_TRUE(std::isfinite(hair.distance));
    EXPECT_NEAR(length(hair.normal), 1, 1e-12);
    EXPECT_FALSE(contains(unit, {1, 0.5, 0.5}));
    EXPECT_FALSE(contains(unit, {0.5, 0.5, 0}));
}

TEST(Shape, CentresCornersAndEdgesOfOthersAreDefined)
{
    EXPECT_EQ(contact(sphere, sphere.center).distance, -0.5);
    EXPECT_EQ(contact(sphere, sphere.center).normal, (Vector{0, 0, 1}));
    const Cylinder thin{{0, 0, 0}, 0.1, 10};
    EXPECT_EQ(contact(thin, {0, 0, 5}).normal, (Vector{1, 0, 0}));
    EXPECT_EQ(contact(thin, {0, 0, 10}).normal, (Vector{0, 0, 1}));
    EXPECT_NEAR(contact(thin, {3.1, 0, 14}).distance, 5, 1e-12);
    const Polygon square{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {0, 1}};
    const auto corner = contact(square, {1, 0.5, 1}, 2);
    EXPECT_EQ(corner.distance, 0);
    EXPECT_NEAR(corner.normal.x, std::sqrt(0.5), 1e-15);
    EXPECT_NEAR(corner.normal.z, std::sqrt(0.5), 1e-15);
    EXPECT_FALSE(contains(square, {1, 0.5, 1}));
    EXPECT_FALSE(contains(square, {0.5, 0.5, 0}));
    EXPECT_TRUE(contains(square, {0.5, 0.5, 1e-9}));
    // A polygon that is a box behaves like the box.
    for (const auto& x : random_points(2000)) {
        const auto a = contact(square, x), b = contact(Box{{0, 0, 0}, {1, 1, 1}}, x);
        EXPECT_NEAR(a.distance, b.distance, 1e-14);
        if (a.distance > 0) {
            EXPECT_NEAR(length(a.normal - b.normal), 0, 1e-12);
        }
    }
}

TEST(Shape, BoundsHoldTheShape)
{
    for (const auto& shape : shapes) {
        const Box b = bounds(shape);
        for (const auto& x : random_points(5000))
            if (inside(shape, x, 3)) {
                EXPECT_TRUE(inside(Shape{b}, x, 3));
            }
    }
    EXPECT_EQ(bounds(cylinder).high.z, -0.3 + 0.7);
    EXPECT_EQ(bounds(concave).low, (Vector{0, -0.2, 0}));
}

TEST(Shape, PolygonsThatAreNoneAreFound)
{
    EXPECT_FALSE(crosses_itself(triangle));
    EXPECT_FALSE(crosses_itself(concave));
    EXPECT_FALSE(crosses_itself(reversed(concave)));
    EXPECT_TRUE(crosses_itself({{{0, 0}, {1, 1}, {1, 0}, {0, 1}}, {}}));
    EXPECT_TRUE(crosses_itself({{{0, 0}, {1, 0}, {1, 1}, {0, 0}}, {}}));
    EXPECT_TRUE(crosses_itself({{{0, 0}, {1, 0}, {0.5, 0}}, {}}));
    EXPECT_TRUE(crosses_itself({{{0, 0}, {0, 0}, {1, 1}}, {}}));
    EXPECT_TRUE(crosses_itself({{{0, 0}, {2, 0}, {2, 1}, {1, 0}, {0, 1}}, {}})); // a corner on another edge
    EXPECT_FALSE(crosses_itself({{{0, 0}, {1, 0}, {2, 0}, {1, 1}}, {}}));        // a corner on a straight line
    EXPECT_DOUBLE_EQ(area({{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}}), 1);
    EXPECT_DOUBLE_EQ(area(reversed({{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}})), -1);
}
