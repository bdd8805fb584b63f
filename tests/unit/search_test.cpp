// Where the misfit of an event is least: the search alone, on misfits that are formulas.
#include "solver/app/hazard/search.hpp"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

namespace kuzure::hazard {
namespace {

struct Done {
    std::vector<Axis> axes;
    std::vector<Trial> trials;
    std::optional<Verdict> verdict;
    double value(std::size_t axis = 0) const { return axes[axis].value(verdict->best[axis]); }
};

Done search(std::vector<Axis> axes, const std::function<double(std::vector<double>)>& misfit, double alike)
{
    choose_parts(axes);
    std::vector<Trial> trials;
    for (int round = 0; round < 50; ++round) {
        const auto next = next_trials(axes, trials, alike);
        if (next.empty()) break;
        for (const auto& at : next) {
            EXPECT_TRUE(std::ranges::none_of(trials, [&](const Trial& t) { return t.at == at; })) << "nothing is tried twice";
            std::vector<double> x;
            for (std::size_t k = 0; k < axes.size(); ++k) x.push_back(axes[k].value(at[k]));
            trials.push_back({at, misfit(x)});
        }
    }
    EXPECT_TRUE(next_trials(axes, trials, alike).empty());
    return {axes, trials, judge(axes, trials, alike)};
}

std::vector<Axis> friction(double low = 10, double high = 40, int scan = 9)
{
    return {{.name = "f", .unit = "deg", .low = low, .high = high, .scan = scan}};
}

TEST(Search, FindsTheEdgeOfAValleyOfAnyShape)
{
    for (double truth = 12; truth < 38; truth += 0.83)
        for (const bool sharp : {true, false}) {
            const auto d = search(
                friction(), [&](auto x) { return sharp ? 0.02 * std::fabs(x[0] - truth) : 1e-3 * (x[0] - truth) * (x[0] - truth); }, 0.01);
            ASSERT_TRUE(d.verdict);
            EXPECT_NEAR(d.value(), truth, 30.0 / 64);
            EXPECT_LE(d.trials.size(), 30u);
            ASSERT_EQ(d.verdict->intervals.size(), 1u);
            EXPECT_LE(d.verdict->intervals[0].low, truth);
            EXPECT_GE(d.verdict->intervals[0].high, truth);
        }
}

TEST(Search, TheIntervalEndsWhereTheMisfitLeavesWhatIsAlike)
{
    const auto d = search(
        friction(), [](auto x) { return 0.02 * std::fabs(x[0] - 25); }, 0.05);
    EXPECT_DOUBLE_EQ(d.value(), 25);
    EXPECT_NEAR(d.verdict->intervals[0].low, 22.5, 1e-9);
    EXPECT_NEAR(d.verdict->intervals[0].high, 27.5, 1e-9);
    EXPECT_FALSE(d.verdict->split || d.verdict->at_end || d.verdict->intervals[0].open_low || d.verdict->intervals[0].open_high);
}

TEST(Search, NoiseMovesTheBestByWhatIsAlikeAtMost)
{
    for (int seed = 0; seed < 40; ++seed) {
        const auto noise = [&](double x) { return 0.02 * std::sin(1e4 * x + seed); };
        const auto d = search(
            friction(), [&](auto x) { return 0.02 * std::fabs(x[0] - 23.3) + noise(x[0]); }, 0.04);
        EXPECT_NEAR(d.value(), 23.3, 2.0 + 0.5);
        EXPECT_LE(d.verdict->intervals[0].low, 23.3);
        EXPECT_GE(d.verdict->intervals[0].high, 23.3);
        EXPECT_LE(d.trials.size(), 40u);
    }
}

TEST(Search, TheScatterIsThatOfTheNoiseAndNoneOfAStraightCurve)
{
    auto axes = friction(10, 40, 65);
    choose_parts(axes);
    const auto of = [&](double noise) {
        std::vector<Trial> trials;
        std::uint64_t state = 7;
        for (int i = 0; i <= axes[0].parts; ++i) {
            double sum = -6; // of twelve numbers in [0, 1): variance 1
            for (int k = 0; k < 12; ++k)
                state = state * 6364136223846793005ull + 1442695040888963407ull, sum += double(state >> 11) * 0x1p-53;
            trials.push_back({{i}, 0.02 * std::fabs(axes[0].value(i) - 24) + noise * sum});
        }
        return scatter_of(trials);
    };
    EXPECT_LT(of(0), 1e-9);
    EXPECT_NEAR(of(0.01), 0.02, 0.006);
    EXPECT_EQ(scatter_of({{{0}, 0.3}, {{1}, 0.2}, {{2}, 0.4}}), 0);
    EXPECT_EQ(scatter_of({}), 0);
}

TEST(Search, TwoValleysAreNotOne)
{
    const auto d = search(
        friction(), [](auto x) { return std::min(std::fabs(x[0] - 15), std::fabs(x[0] - 35)) * 0.02; }, 0.02);
    EXPECT_TRUE(d.verdict->split);
    EXPECT_LT(d.verdict->intervals[0].low, 15);
    EXPECT_GT(d.verdict->intervals[0].high, 35);
}

TEST(Search, TheEndOfTheRangeHasNoInterval)
{
    for (const double truth : {5.0, 60.0}) {
        const auto d = search(
            friction(), [&](auto x) { return 0.01 * std::fabs(x[0] - truth); }, 0.01);
        EXPECT_TRUE(d.verdict->at_end);
        EXPECT_TRUE(d.verdict->intervals.empty());
        EXPECT_EQ(d.value(), truth < 10 ? 10 : 40);
    }
}

TEST(Search, WhatDecidesNothingIsOpenAtBothEnds)
{
    const auto d = search(
        friction(), [](auto) { return 0.3; }, 0.01);
    ASSERT_EQ(d.verdict->intervals.size(), 1u);
    EXPECT_TRUE(d.verdict->intervals[0].open_low && d.verdict->intervals[0].open_high);
    EXPECT_EQ(d.verdict->intervals[0].low, 10);
    EXPECT_EQ(d.verdict->intervals[0].high, 40);
}

TEST(Search, FailedRunsAreGoneAround)
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto d = search(
        friction(), [&](auto x) { return x[0] < 14 ? nan : 0.02 * std::fabs(x[0] - 20); }, 0.01);
    EXPECT_NEAR(d.value(), 20, 0.5);
    EXPECT_FALSE(search(
                     friction(), [&](auto) { return nan; }, 0.01)
                     .verdict);
}

TEST(Search, OfTwoNumbersBothAreFound)
{
    std::vector<Axis> axes{{.name = "f", .unit = "deg", .low = 10, .high = 40, .scan = 5},
                           {.name = "t", .unit = "1", .low = 0.5, .high = 2, .scan = 5}};
    for (const double a : {13.0, 24.4, 36.0}) {
        const auto d = search(
            axes, [&](auto x) { return std::hypot((x[0] - a) / 30, (x[1] - 1.13) / 1.5); }, 0.02);
        EXPECT_NEAR(d.value(0), a, 30.0 / 32);
        EXPECT_NEAR(d.value(1), 1.13, 1.5 / 32);
        EXPECT_LE(d.trials.size(), 80u);
        ASSERT_EQ(d.verdict->intervals.size(), 2u);
    }
}

TEST(Search, EveryValueIsOnTheLatticeAndTheEndsAreExact)
{
    for (const int scan : {3, 6, 9, 65}) {
        auto axes = friction(0.1, 0.7, scan);
        choose_parts(axes);
        EXPECT_EQ(axes[0].parts % (scan - 1), 0);
        EXPECT_GE(axes[0].parts, 64);
        EXPECT_EQ(axes[0].value(0), 0.1);
        EXPECT_EQ(axes[0].value(axes[0].parts), 0.7);
        EXPECT_EQ(int(next_trials(axes, {}, 0).size()), scan);
    }
}

} // namespace
} // namespace kuzure::hazard
