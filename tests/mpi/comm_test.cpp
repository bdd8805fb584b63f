#include "decomposition/rebalance.hpp"
#include "tests/mpi/world.hpp"
#include <gtest/gtest.h>
#include <numeric>
#include <random>

namespace kuzure {
namespace {

std::vector<std::byte> bytes_of(const std::string& s)
{
    const auto b = std::as_bytes(std::span(s.data(), s.size()));
    return {b.begin(), b.end()};
}

TEST(Comm, IsATeam)
{
    const Team& team = world();
    const int rank = team.rank(), size = team.size();
    EXPECT_EQ(team.sum(std::int64_t(rank)), std::int64_t(size) * (size - 1) / 2);
    EXPECT_EQ(team.sum(0.25), 0.25 * size);
    EXPECT_EQ(team.max(double(rank)), size - 1);
    EXPECT_EQ(team.min(double(rank)), 0);
    EXPECT_EQ(team.max(std::int64_t(-rank)), 0);
    double v[2] = {1.0, double(rank)};
    team.sum(std::span(v));
    EXPECT_EQ(v[0], size);
    EXPECT_EQ(team.sum_below(rank + 1), std::int64_t(rank) * (rank + 1) / 2);
    EXPECT_TRUE(team.any(rank == size - 1));
    EXPECT_EQ(team.all(rank == 0), size == 1);
    EXPECT_EQ(team.broadcast(rank == size - 1 ? std::string("from the last") : std::string(), size - 1), "from the last");
    const auto all = team.gather(bytes_of(std::string(std::size_t(rank), 'x')), size - 1);
    if (rank == size - 1) {
        ASSERT_EQ(int(all.size()), size);
        for (int r = 0; r < size; ++r) EXPECT_EQ(int(all[r].size()), r);
    } else {
        EXPECT_TRUE(all.empty());
    }
    EXPECT_NE(team.native(), nullptr);
    team.barrier();
}

TEST(Comm, AllgatherKeepsTheOrderOfTheRanks)
{
    const int rank = world().rank(), size = world().size();
    const auto one = world().allgather(rank * 10);
    for (int r = 0; r < size; ++r) EXPECT_EQ(one[r], r * 10);
    const std::vector<double> mine(std::size_t(rank % 3), rank);
    std::vector<double> expected;
    for (int r = 0; r < size; ++r) expected.insert(expected.end(), std::size_t(r % 3), r);
    EXPECT_EQ(world().allgather(std::span<const double>(mine)), expected);
}

/// What rank a sends to rank b in a round: known to both, so the receiver can check every byte.
std::vector<std::byte> letter(int a, int b, int round)
{
    std::mt19937 random(unsigned(a * 7919 + b * 104729 + round));
    std::vector<std::byte> bytes(random() % 4 == 0 ? random() % 300000 : random() % 100);
    for (auto& c : bytes) c = std::byte(random());
    return bytes;
}
bool writes(int a, int b, int round) { return (a * 31 + b * 17 + round * 7) % 3 == 0; }

TEST(Comm, ExchangeDeliversEveryMessageOnce)
{
    const int rank = world().rank(), size = world().size();
    for (int round = 0; round < 60; ++round) { // back to back: rounds must not mix
        const std::size_t piece = round % 2 ? 1000 : Comm::largest_piece;
        std::vector<Message> out;
        for (int b = 0; b < size; ++b)
            if (writes(rank, b, round)) out.push_back({b, letter(rank, b, round)});
        const auto in = world().exchange(std::move(out), piece);
        std::size_t k = 0;
        for (int a = 0; a < size; ++a) {
            if (!writes(a, rank, round)) continue;
            ASSERT_LT(k, in.size());
            EXPECT_EQ(in[k].rank, a);
            EXPECT_TRUE(in[k].bytes == letter(a, rank, round)) << "from " << a << " in round " << round;
            ++k;
        }
        EXPECT_EQ(k, in.size());
    }
}

TEST(Comm, ExchangeKeepsTheOrderOfOneSender)
{
    const int next = (world().rank() + 1) % world().size();
    std::vector<MessageOf<int>> out;
    for (int k = 0; k < 5; ++k) out.push_back({next, std::vector<int>(std::size_t(k), k)});
    const auto in = world().exchange(out);
    ASSERT_EQ(in.size(), 5u);
    for (int k = 0; k < 5; ++k) EXPECT_EQ(in[k].items, std::vector<int>(std::size_t(k), k));
}

TEST(Comm, ExchangeRefusesARankThatDoesNotExist)
{
    if (world().size() > 1) return; // the others would wait for the one that throws
    std::vector<Message> out;
    out.push_back({1, {}});
    EXPECT_THROW(world().exchange(std::move(out)), Broken);
}

TEST(Comm, NodesCountTheirRanks)
{
    const NodePosition p = world().node_position();
    EXPECT_GE(p.rank, 0);
    EXPECT_LT(p.rank, p.size);
    EXPECT_GE(p.node, 0);
    EXPECT_LT(p.node, p.nodes);
    EXPECT_EQ(world().sum(std::int64_t(p.rank == 0)), p.nodes);
}

TEST(Rebalance, MeasuresMaxOverMean)
{
    const int size = world().size();
    EXPECT_DOUBLE_EQ(imbalance(world(), 0.0), 1.0);
    EXPECT_DOUBLE_EQ(imbalance(world(), 3.5), 1.0);
    EXPECT_NEAR(imbalance(world(), world().rank() == 0 ? 2.0 : 1.0), 2.0 * size / (size + 1.0), 1e-9);
}

TEST(Rebalance, CutsWhenTheIdleTimeHasPaidForIt)
{
    if (world().size() == 1) {
        Rebalance alone;
        for (int k = 0; k < 100; ++k) EXPECT_FALSE(alone.due(world(), 1.0 + k));
        return;
    }
    const bool last = world().rank() == world().size() - 1;
    Rebalance rule(1.0, 5.0);
    int calls = 0;
    while (calls < 1000 && !rule.due(world(), last ? 1.0 + 0.01 * calls : 1.0)) ++calls;
    EXPECT_GT(calls, 10);
    EXPECT_LT(calls, 100);
    EXPECT_GT(rule.idle_seconds(), 5.0);
    EXPECT_EQ(world().max(std::int64_t(calls)), world().min(double(calls))); // all at the same call

    // The cut achieves nothing: the rule must fall silent.
    rule.cut(world(), 5.0);
    for (int k = 0; k < 300; ++k) ASSERT_FALSE(rule.due(world(), last ? 1.4 + 0.02 * (k % 2) : 1.0));
    // It gets worse again: the rule must wake up.
    bool again = false;
    for (int k = 0; k < 300 && !again; ++k) again = rule.due(world(), last ? 2.5 : 1.0);
    EXPECT_TRUE(again);
}

} // namespace
} // namespace kuzure
