// What an ensemble is drawn from and what fits into a time: numbers alone, nothing is run.
#include "solver/app/hazard/plan.hpp"
#include "solver/app/hazard/run_scene.hpp"
#include "solver/app/hazard/sample.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

namespace kuzure::hazard {
namespace {

scene::Uncertain three_inputs()
{
    scene::Uncertain u;
    u.seed = 5;
    u.friction = {20, 30, 34}, u.bed_friction = {16, 20, 28};
    u.keys = {{"soil.sand.cohesion", {0, 0, 2000}}};
    return u;
}

/// Share of a triangle below a value.
double share_of(const scene::Triangle& t, double x)
{
    if (x < t.likely) return (x - t.low) * (x - t.low) / ((t.high - t.low) * (t.likely - t.low));
    return 1 - (t.high - x) * (t.high - x) / ((t.high - t.low) * (t.high - t.likely));
}

TEST(Hazard, ValuesOfATriangleFollowItsShares)
{
    for (const scene::Triangle t : {scene::Triangle{16, 20, 28}, {0, 0, 1}, {0, 1, 1}})
        for (double p = 0; p < 1; p += 0.01) EXPECT_NEAR(share_of(t, value_at(t, p)), p, 1e-12);
    EXPECT_EQ(value_at({16, 20, 28}, 0), 16);
}

TEST(Hazard, EveryPartOfEveryInputIsTakenOnce)
{
    const auto u = three_inputs();
    const auto inputs = inputs_of(u);
    ASSERT_EQ(inputs.size(), 3u);
    for (const int n : {2, 7, 24}) {
        const auto members = draw_members(u, n, 2 * n);
        for (int group = 0; group < 2; ++group)
            for (std::size_t k = 0; k < inputs.size(); ++k) {
                std::set<int> parts;
                for (int m = 0; m < n; ++m)
                    parts.insert(int(std::floor(n * share_of(inputs[k].range, members[std::size_t(group * n + m)].values[k]) + 1e-9)));
                EXPECT_EQ(int(parts.size()), n);
            }
    }
}

TEST(Hazard, MoreMembersLeaveTheFirstAndOneInputTheOthers)
{
    auto u = three_inputs();
    const auto few = draw_members(u, 6, 4), many = draw_members(u, 6, 20);
    for (std::size_t k = 0; k < few.size(); ++k) {
        EXPECT_EQ(few[k].values, many[k].values);
        EXPECT_EQ(few[k].error, many[k].error);
    }
    EXPECT_EQ(many.back().number, 20);
    u.keys.clear();
    EXPECT_EQ(draw_members(u, 6, 1)[0].values[1], few[0].values[1]);
    u.seed = 6;
    EXPECT_NE(draw_members(u, 6, 1)[0].values[1], few[0].values[1]);
}

TEST(Hazard, DrawsAreTheSameOnEveryMachine)
{
    Draws d(1, "friction");
    std::vector<std::uint64_t> first{d.bits(), d.bits()};
    Draws again(1, "friction"), other(1, "frictioN");
    EXPECT_EQ(again.bits(), first[0]);
    EXPECT_NE(other.bits(), first[0]);
    // FNV-1a and splitmix64 by hand.
    std::uint64_t s = 14695981039346656037ull;
    for (const int byte : {1, 0, 0, 0, 0, 0, 0, 0, int('a')}) s = (s ^ std::uint64_t(byte)) * 1099511628211ull;
    s += 0x9e3779b97f4a7c15ull;
    s = (s ^ (s >> 30)) * 0xbf58476d1ce4e5b9ull, s = (s ^ (s >> 27)) * 0x94d049bb133111ebull;
    EXPECT_EQ(Draws(1, "a").bits(), s ^ (s >> 31));
}

TEST(Hazard, RankCorrelationKnowsOrderAlone)
{
    const std::vector<double> x{1, 2, 3, 4, 5, 6, 7, 8}, up{1, 4, 9, 16, 25, 36, 49, 64}, down{8, 7, 6, 5, 4, 3, 2, 1}, flat(8, 1.0),
        ties{1, 1, 2, 2, 3, 3, 4, 4};
    EXPECT_DOUBLE_EQ(rank_correlation(x, up), 1);
    EXPECT_DOUBLE_EQ(rank_correlation(x, down), -1);
    EXPECT_TRUE(std::isnan(rank_correlation(x, flat)));
    EXPECT_NEAR(rank_correlation(x, ties), std::sqrt(40.0 / 42.0), 1e-12); // by hand: sum of squares 40 against 42
    const auto sure = rank_correlation_interval(x, up);
    EXPECT_DOUBLE_EQ(sure[0], 1);
    EXPECT_DOUBLE_EQ(sure[1], 1);
    const std::vector<double> chance{3, 1, 4, 1, 5, 9, 2, 6};
    const auto wide = rank_correlation_interval(x, chance);
    EXPECT_LT(wide[0], 0.2);
    EXPECT_GT(wide[1], 0.6);
    EXPECT_EQ(wide, rank_correlation_interval(x, chance));
    EXPECT_TRUE(std::isnan(rank_correlation_interval(std::span(x).first(3), std::span(up).first(3))[0]));
}

TEST(Hazard, QuantilesAreValuesThatWereFound)
{
    const std::vector<float> v{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
    const std::span<const float> s(v);
    EXPECT_EQ(quantile(s, 0.1), 1);
    EXPECT_EQ(quantile(s, 0.5), 5);
    EXPECT_EQ(quantile(s, 0.9), 9);
    EXPECT_EQ(quantile(s, 0.95), 10);
    EXPECT_EQ(quantile(s.first(1), 0.05), 1);
    EXPECT_EQ(quantile(s.first(3), 0.5), 2);
}

TEST(Hazard, ErrorsOfHeightsHaveTheirSizeAndLength)
{
    const scene::HeightError e{2.0, 50.0};
    double square = 0, near = 0, far = 0, mean = 0;
    int n = 0;
    for (int i = 0; i < 100; ++i)
        for (int j = 0; j < 100; ++j) {
            const double x = 317.0 * i, y = 211.0 * j, a = height_error(e, 77, x, y);
            mean += a, square += a * a, near += a * height_error(e, 77, x + 50, y), far += a * height_error(e, 77, x + 400, y), ++n;
        }
    EXPECT_NEAR(mean / n, 0, 0.1);
    EXPECT_NEAR(std::sqrt(square / n), 2, 0.06);
    EXPECT_NEAR(near / square, 0.4, 0.07);
    EXPECT_NEAR(far / square, 0, 0.05);
    EXPECT_NE(height_error(e, 77, 1, 2), height_error(e, 78, 1, 2));
    EXPECT_LT(std::fabs(height_error(e, 77, 24.999, 0) - height_error(e, 77, 25.001, 0)), 1e-3) << "it has no step";
}

TEST(Hazard, PlansKeepTheTime)
{
    for (const double left : {20.0, 100.0, 1000.0, 30000.0})
        for (const int members : {0, 5}) {
            const Cost c{0.3, 2.0, 4};
            const Plan p = make_plan(c, left, members);
            EXPECT_GE(p.layers, 4);
            EXPECT_LE(p.layers, most_layers);
            EXPECT_TRUE(p.finer == 0 || p.finer >= 1.15 * p.layers);
            if (members == 0 || left > 50) EXPECT_LE(p.seconds, left) << left << " s, " << members;
            if (members > 0) EXPECT_EQ(p.members, members);
        }
    EXPECT_GT(make_plan({0.3, 2, 4}, 3000, 0).members, make_plan({0.3, 2, 4}, 40, 0).members);
    EXPECT_EQ(finer_layers({0.3, 2, 4}, 2, 4), 0);
}

TEST(Hazard, TimesAndLayersAreReadOrRefused)
{
    EXPECT_EQ(parse_within("30m"), 1800);
    EXPECT_EQ(parse_within("90s"), 90);
    EXPECT_EQ(parse_within("1h30m"), 5400);
    EXPECT_EQ(parse_within("45"), 2700);
    EXPECT_EQ(parse_within("0.5h"), 1800);
    for (const char* bad : {"", "m", "soon", "-5m", "0", "30x", "1h30", "nan", "inf", "1e9h", "30 m", "30mm", "9999h"})
        EXPECT_THROW(parse_within(bad), BadInput) << bad;
    EXPECT_EQ(parse_layers("4,6,8").finer, 8);
    EXPECT_EQ(parse_layers("4").ensemble, 4);
    EXPECT_FALSE(parse_layers("").given);
    for (const char* bad : {"0", "4,", "6,4", "four", "4,6,8,10", "4;6", "-4", "nan"}) EXPECT_THROW(parse_layers(bad), BadInput) << bad;
}

} // namespace
} // namespace kuzure::hazard
