#include "solver/app/scaling/predict.hpp"
#include <cmath>
#include <gtest/gtest.h>

namespace kuzure {
namespace {

/// Round numbers: 10 ns a pair, 100 ns a particle, 4 cores and 2 ranks a node, 1 us, 1 GB/s, 10 GB/s of memory.
io::MachineProfile plain()
{
    io::MachineProfile m{};
    m.node = {.count = 8, .cores = 4, .threads_per_core = 1, .ranks = 2, .memory = 1e10};
    m.cost = {.pair_ns_double = 10, .pair_ns_mixed = 5, .particle_ns = 100, .memory_bandwidth = 10e9, .latency = 1e-6, .bandwidth = 1e9};
    return m;
}

TEST(Predict, OneRankOnlyComputes)
{
    const auto m = plain();
    const RankLoad r{.pairs = 1e6, .particles = 2e4};
    const auto s = predict_step(std::span(&r, 1), {m, 1, 1});
    EXPECT_DOUBLE_EQ(s.pairs, 1e6 * 10e-9 / 4);
    EXPECT_DOUBLE_EQ(s.particles, 2e4 * 100e-9 / 4);
    EXPECT_DOUBLE_EQ(s.total(), s.pairs + s.particles);
    EXPECT_DOUBLE_EQ(predict_step(std::span(&r, 1), {.machine = m, .mixed = true}).pairs, 1e6 * 5e-9 / 4);
}

TEST(Predict, TwoRanksOfTwoNodesByHand)
{
    const auto m = plain();
    RankLoad r{
        .pairs = 1e6, .particles = 2e4, .rim = 2000, .sent = 1000, .ghosts = 1000, .messages = 1, .far_messages = 1, .node_ghosts = 1000};
    const std::vector<RankLoad> even{r, r};
    Deployment at{.machine = m, .ranks = 2, .ranks_per_node = 1, .ghost_bytes = 100};
    auto s = predict_step(even, at);
    // 1000 rows of 100 bytes: 0.1 ms on the wire and one latency, hidden behind 2.5 ms of pairs, 85 % of them interior.
    EXPECT_DOUBLE_EQ(s.network, 1e-6 + 1e-4);
    EXPECT_NEAR(s.halo, 2 * 2000 * 100 / 10e9 + 1e-6, 1e-12);
    EXPECT_DOUBLE_EQ(s.imbalance, 0);
    EXPECT_DOUBLE_EQ(s.reduction, 2e-6);
    EXPECT_GT(s.rebuild, 0);
    EXPECT_EQ(s.recut, 0) << "nothing is known of blocks";

    // All sums wait for ghosts: nothing hides the wire.
    r.rim = 2e4;
    const std::vector<RankLoad> bare{r, r};
    EXPECT_NEAR(predict_step(bare, at).halo - s.halo, 1e-6 + 1e-4, 1e-12);
    at.bandwidth_times = 0.5, at.latency_times = 2;
    EXPECT_NEAR(predict_step(bare, at).halo, 2 * 2000 * 100 / 10e9 + 2 * 2e-6 + 2e-4, 1e-12);

    // The slowest counts.
    RankLoad slow = even[0];
    slow.pairs *= 1.2;
    at.bandwidth_times = at.latency_times = 1;
    s = predict_step(std::vector{even[0], slow}, at);
    EXPECT_NEAR(s.imbalance, 0.1 * 2.5e-3, 1e-12);
}

TEST(Predict, AStepOfTwoPassesExchangesTwiceAndMakesListsOftener)
{
    const auto m = plain();
    const RankLoad r{
        .pairs = 1e6, .particles = 2e4, .rim = 2e4, .sent = 1000, .ghosts = 1000, .messages = 1, .far_messages = 1, .node_ghosts = 1000};
    const std::vector<RankLoad> ranks{r, r};
    Deployment at{.machine = m, .ranks = 2, .ranks_per_node = 1, .ghost_bytes = 100};
    const auto one = predict_step(ranks, at);
    at.scheme = scene::Scheme::Staggered;
    const auto two = predict_step(ranks, at);
    EXPECT_NEAR(two.halo - one.halo, 2 * 1e-6, 1e-12) << "a latency of the wire and one of handling more; the bytes are given";
    EXPECT_DOUBLE_EQ(two.reduction, one.reduction);
    EXPECT_NEAR(two.rebuild, one.rebuild * 17 / 3.16, 1e-12);
    EXPECT_NEAR(two.pairs, 1.75 * one.pairs, 1e-12);
    EXPECT_GT(two.particles, 2 * one.particles);
    EXPECT_EQ(exchanges(scene::Scheme::Staggered), 2);
}

TEST(Predict, CutsAsOftenAsItPays)
{
    const auto m = plain();
    const RankLoad r{.pairs = 1e7, .particles = 2e5, .messages = 1};
    const std::vector<RankLoad> ranks(64, r);
    Deployment at{.machine = m, .ranks = 64, .ranks_per_node = 2, .blocks = 64000};
    const auto few = predict_step(ranks, at);
    // A cut's seconds C come every sqrt(2 C/(d t)) steps of t seconds, d = 6.1e-5 (35152/n)^0.56.
    const auto cut_of = [](const StepSeconds& s) { return 0.5 * s.recut * s.recut_steps; };
    EXPECT_NEAR(few.recut_steps, std::sqrt(2 * cut_of(few) / (6.1e-5 * std::pow(35152 / 2e5, 0.56) * (few.total() - few.recut))),
                1e-6 * few.recut_steps);
    // More blocks on each rank cost more, and are cut less often.
    at.blocks *= 100;
    const auto many = predict_step(ranks, at);
    EXPECT_GT(cut_of(many), 2 * cut_of(few));
    EXPECT_GT(many.recut_steps, few.recut_steps);
    // As many on each of 256 times the ranks: only sums over all ranks and their boxes cost more.
    at.ranks *= 256, at.blocks *= 256;
    EXPECT_LT(cut_of(predict_step(ranks, at)), 1.5 * cut_of(many));
}

TEST(Predict, LoadsKnowNodes)
{
    CutShare cut;
    cut.rank.resize(4);
    for (auto& r : cut.rank) r.work = {.particles = 10, .soil_pairs = 100, .wall_pairs = 20}, r.messages = 2;
    cut.message = {{0, 1, 5}, {0, 2, 7}, {1, 0, 5}, {1, 3, 2}, {2, 0, 8}, {2, 3, 5}, {3, 1, 2}, {3, 2, 5}};
    const auto two = loads(cut, 2);
    EXPECT_EQ(two[0].far_messages, 1);
    EXPECT_EQ(two[0].node_ghosts, 10) << "8 + 2 come in, 7 + 2 go out";
    EXPECT_EQ(two[3].node_ghosts, 10) << "8 + 2 go out";
    EXPECT_DOUBLE_EQ(two[0].pairs, 100 + StepWork::wall * 20);
    EXPECT_EQ(loads(cut, 4)[0].far_messages, 0);
    EXPECT_EQ(loads(cut, 1)[0].far_messages, 2);
}

} // namespace
} // namespace kuzure
