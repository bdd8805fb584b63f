// Outlines: closed, with their holes, where the numbers reach the level.
#include "solver/scene/contour.hpp"
#include "solver/scene/ring.hpp"
#include <cmath>
#include <gtest/gtest.h>

using namespace kuzure::scene;

namespace {

template <class F> Grid grid_of(int columns, int rows, F f)
{
    Grid g{.x = 10, .y = 20, .cell = 0.5, .columns = columns, .rows = rows, .values = {}};
    g.values.resize(std::size_t(columns) * std::size_t(rows));
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) g.at(column, row) = f(10 + 0.5 * column, 20 + 0.5 * row);
    return g;
}
double area_of(const Area& a)
{
    double sum = 0;
    for (const auto& ring : a) sum += signed_area(ring);
    return sum;
}

} // namespace

TEST(Contour, ConeIsACircle)
{
    const auto g = grid_of(41, 41, [](double x, double y) { return 8 - std::hypot(x - 20, y - 30); });
    const auto areas = areas_above(g, 2);
    ASSERT_EQ(areas.size(), 1u);
    ASSERT_EQ(areas[0].size(), 1u);
    for (const auto& p : areas[0][0]) EXPECT_NEAR(std::hypot(p[0] - 20, p[1] - 30), 6, 0.01);
    EXPECT_NEAR(area_of(areas[0]), std::acos(-1.0) * 36, 0.3);
}

TEST(Contour, RingHasItsHoleAndWhatStandsInTheHoleIsAnArea)
{
    const auto g = grid_of(81, 81, [](double x, double y) {
        const double r = std::hypot(x - 30, y - 40);
        return std::max(2 - std::abs(r - 12), 3 - r);
    });
    const auto areas = areas_above(g, 1);
    ASSERT_EQ(areas.size(), 2u);
    const auto& ring = areas[areas[0].size() == 2 ? 0 : 1];
    const auto& island = areas[areas[0].size() == 2 ? 1 : 0];
    ASSERT_EQ(ring.size(), 2u);
    ASSERT_EQ(island.size(), 1u);
    EXPECT_GT(signed_area(ring[0]), 0);
    EXPECT_LT(signed_area(ring[1]), 0);
    EXPECT_NEAR(area_of(ring), std::acos(-1.0) * (13 * 13 - 11 * 11), 1);
    EXPECT_NEAR(area_of(island), std::acos(-1.0) * 4, 0.3);
}

TEST(Contour, WhatReachesTheEdgeIsClosedBeyondIt)
{
    const auto areas = areas_above(grid_of(4, 3, [](double, double) { return 1.0; }), 0.5);
    ASSERT_EQ(areas.size(), 1u);
    EXPECT_NEAR(area_of(areas[0]), 2.0 * 1.5 - 4 * 0.5 * 0.25 * 0.25, 1e-9);
}

TEST(Contour, NoNumberIsBelow)
{
    const auto g = grid_of(9, 9, [](double x, double y) { return std::abs(x - 12) < 0.1 && std::abs(y - 22) < 0.1 ? std::nan("") : 1.0; });
    const auto areas = areas_above(g, 0.5);
    ASSERT_EQ(areas.size(), 1u);
    EXPECT_EQ(areas[0].size(), 2u);
    EXPECT_TRUE(areas_above(g, 2).empty());
}

TEST(Contour, CheckerboardKeepsEveryRingClosedAndApart)
{
    const auto g = grid_of(7, 7, [](double x, double y) { return double((std::lround(2 * x) + std::lround(2 * y)) % 2); });
    for (const double level : {0.3, 0.5, 1.0}) {
        double sum = 0;
        for (const auto& a : areas_above(g, level)) {
            EXPECT_GT(area_of(a), 0);
            sum += area_of(a);
            for (const auto& ring : a) EXPECT_GE(ring.size(), 4u);
        }
        EXPECT_GT(sum, 0) << level;
    }
}
