// Whole units that no run can outgrow: the same value however they are added up, beyond what 64 bits hold.
#include "solver/run/exact_sums.hpp"
#include <gtest/gtest.h>
#include <random>

using namespace kuzure;

TEST(WideUnits, HoldMoreThan64Bits)
{
    WideUnits up, down;
    for (int k = 0; k < 1000; ++k) up.add(std::int64_t(1) << 61), down.add(-(std::int64_t(1) << 61));
    EXPECT_EQ(up.value(), 1000 * 0x1p61);
    EXPECT_EQ(down.value(), -1000 * 0x1p61);
    for (int k = 0; k < 1000; ++k) up.add(-(std::int64_t(1) << 61));
    EXPECT_EQ(up.value(), 0);
}

TEST(WideUnits, AreTheSameInAnyOrder)
{
    std::mt19937_64 g(5);
    std::vector<std::int64_t> units;
    for (int k = 0; k < 5000; ++k) units.push_back(std::int64_t(g()) >> (2 + g() % 60));
    WideUnits all;
    for (const auto u : units) all.add(u);
    __int128 sum = 0;
    for (const auto u : units) sum += u;
    EXPECT_EQ(all.value(), double(sum));
    // by three that add a part each, in another order
    std::shuffle(units.begin(), units.end(), g);
    std::array<WideUnits, 3> part;
    for (std::size_t k = 0; k < units.size(); ++k) part[k % 3].add(units[k]);
    WideUnits together;
    for (const auto& p : part) together.add(p);
    EXPECT_EQ(together.high, all.high);
    EXPECT_EQ(together.low, all.low);
}
