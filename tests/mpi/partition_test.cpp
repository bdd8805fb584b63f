#include "decomposition/domain.hpp"
#include "tests/mpi/world.hpp"
#include <gtest/gtest.h>
#include <numeric>
#include <random>
#include <set>

namespace kuzure {
namespace {

std::vector<BlockWork> box_of_blocks(int nx, int ny, int nz, Block at = {0, 0, 0})
{
    std::vector<BlockWork> b;
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j)
            for (int k = 0; k < nz; ++k) b.push_back({{at[0] + i, at[1] + j, at[2] + k}, 1.0, 1000.0});
    return b;
}
/// A slope with a rim of light blocks: what a scene's first cut looks like.
std::vector<BlockWork> floor_of_blocks(int n, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<> u(0.2, 1.0);
    std::vector<BlockWork> b;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int k = 0; k <= (n - i) / 8; ++k) {
                const double fill = u(random);
                b.push_back({{i - n / 2, j, k}, fill * 3.7e-4, fill * 1000});
            }
    return b;
}

TEST(BlockGraph, LinksTheTwentySixAround)
{
    if (world().rank() != 0) return;
    const auto g = block_graph(box_of_blocks(3, 3, 3));
    ASSERT_EQ(g.size(), 27);
    EXPECT_EQ(g.links(13).size(), 26u);
    EXPECT_EQ(g.links(0).size(), 7u);
    double face = 0, edge = 0, corner = 0;
    for (const auto& l : g.links(13)) {
        const int n = std::abs(l.d[0]) + std::abs(l.d[1]) + std::abs(l.d[2]);
        (n == 1 ? face : n == 2 ? edge : corner) += l.bytes;
    }
    EXPECT_GT(face / 6, 2 * edge / 12);
    EXPECT_GT(edge / 12, 2 * corner / 8);
}

TEST(BlockGraph, WrapsPeriodicAxesAndSumsEqualBlocks)
{
    if (world().rank() != 0) return;
    auto blocks = box_of_blocks(4, 1, 1);
    blocks.push_back({{2, 0, 0}, 0.5, 10.0});
    BlockGrid grid;
    grid.period = {4, 0, 0};
    const auto g = block_graph(blocks, grid);
    ASSERT_EQ(g.size(), 4);
    EXPECT_EQ(g.work[2], 1.5);
    EXPECT_EQ(g.particles[2], 1010.0);
    EXPECT_EQ(g.links(0).size(), 2u);
    EXPECT_EQ(g.links(0)[0].block, 3);
}

TEST(BlockGraph, RefusesNonsense)
{
    if (world().rank() != 0) return;
    const std::vector<BlockWork> negative{{{0, 0, 0}, -1.0, 1.0}}, far{{{block_limit, 0, 0}, 1.0, 1.0}};
    EXPECT_THROW(block_graph(negative), Broken);
    EXPECT_THROW(block_graph(far), Broken);
}

TEST(Hilbert, CurveVisitsEveryPointAndStepsByOne)
{
    if (world().rank() != 0) return;
    const int bits = 3, n = 1 << bits;
    std::vector<Block> at(std::size_t(n * n * n));
    std::set<std::uint64_t> seen;
    for (unsigned i = 0; i < unsigned(n); ++i)
        for (unsigned j = 0; j < unsigned(n); ++j)
            for (unsigned k = 0; k < unsigned(n); ++k) {
                const auto h = hilbert_index({i, j, k}, bits);
                ASSERT_LT(h, at.size());
                seen.insert(h);
                at[h] = {int(i), int(j), int(k)};
            }
    EXPECT_EQ(seen.size(), at.size());
    for (std::size_t h = 1; h < at.size(); ++h) {
        int step = 0;
        for (int a = 0; a < 3; ++a) step += std::abs(at[h][a] - at[h - 1][a]);
        EXPECT_EQ(step, 1);
    }
}

void expect_complete(const BlockGraph& g, const std::vector<int>& part, int parts)
{
    ASSERT_EQ(int(part.size()), g.size());
    std::vector<int> count(std::size_t(parts), 0);
    for (const int p : part) {
        ASSERT_GE(p, 0);
        ASSERT_LT(p, parts);
        ++count[p];
    }
    int used = 0;
    for (const int c : count) used += c > 0;
    EXPECT_EQ(used, std::min(parts, g.size()));
}

TEST(Partition, IsEvenAndBeatsTheCurve)
{
    if (world().rank() != 0) return;
    struct Case {
        std::vector<BlockWork> blocks;
        int parts;
    };
    const Case cases[] = {{box_of_blocks(12, 12, 12), 16}, {box_of_blocks(12, 12, 12), 7}, {box_of_blocks(40, 40, 1), 24},
                          {floor_of_blocks(40, 1), 2},     {floor_of_blocks(40, 2), 64},   {floor_of_blocks(24, 3), 13}};
    for (const auto& c : cases) {
        const auto g = block_graph(c.blocks);
        const auto part = partition(g, c.parts);
        expect_complete(g, part, c.parts);
        const auto r = describe(g, part, c.parts);
        EXPECT_LE(r.imbalance, 1.05) << g.size() << " blocks in " << c.parts;
        const auto curve = partition(g, c.parts, Method::Hilbert);
        expect_complete(g, curve, c.parts);
        const auto h = describe(g, curve, c.parts);
        EXPECT_LE(r.cut_bytes, 1.02 * h.cut_bytes) << g.size() << " blocks in " << c.parts;
        EXPECT_EQ(part, partition(g, c.parts)) << "the same input must give the same cut";
    }
}

TEST(Partition, CountsPieces)
{
    if (world().rank() != 0) return;
    const auto g = block_graph(box_of_blocks(6, 1, 1));
    const auto r = describe(g, std::vector<int>{0, 0, 1, 0, 1, 1}, 3);
    EXPECT_EQ(r.pieces, (std::vector<int>{2, 2, 0}));
}

TEST(Partition, CutsABarAcross)
{
    if (world().rank() != 0) return;
    const auto g = block_graph(box_of_blocks(32, 4, 4));
    const auto r = describe(g, partition(g, 4), 4);
    EXPECT_LE(r.imbalance, 1.03);
    // Three cuts through 16 blocks' faces, a quarter of each block's particles, both ways.
    EXPECT_LE(r.cut_bytes, 1.15 * 3 * 2 * 16 * 250 * 128);
}

TEST(Partition, HandlesEveryOddCase)
{
    if (world().rank() != 0) return;
    EXPECT_TRUE(partition(block_graph({}), 5).empty());
    for (const Method m : {Method::Metis, Method::Hilbert}) {
        auto two = box_of_blocks(5, 5, 5);
        const auto far = box_of_blocks(5, 5, 5, {1000, -1000, 3});
        two.insert(two.end(), far.begin(), far.end());
        auto idle = box_of_blocks(6, 6, 1);
        for (auto& b : idle) b.work = 0;
        auto one_heavy = box_of_blocks(6, 6, 2);
        one_heavy[17].work = 1e6;
        for (const auto& blocks : {two, idle, one_heavy, box_of_blocks(1, 1, 1), box_of_blocks(3, 1, 1)})
            for (const int parts : {1, 2, 3, 5, 8, 70, 200}) {
                const auto g = block_graph(blocks);
                expect_complete(g, partition(g, parts, m), parts);
            }
    }
}

TEST(Partition, KeepsLabels)
{
    if (world().rank() != 0) return;
    const auto g = block_graph(floor_of_blocks(40, 4));
    const int parts = 16;
    const auto before = partition(g, parts);
    // Renamed at random: the same cut again must take the names over.
    std::vector<int> name(parts);
    std::iota(name.begin(), name.end(), 0);
    std::shuffle(name.begin(), name.end(), std::mt19937(5));
    std::vector<int> previous;
    for (const int p : before) previous.push_back(name[p]);
    EXPECT_EQ(partition(g, parts, Method::Metis, &previous), previous);
    // A block that is new does not disturb.
    previous[7] = -1;
    const auto after = partition(g, parts, Method::Metis, &previous);
    int same = 0;
    for (int b = 0; b < g.size(); ++b) same += after[b] == previous[b];
    EXPECT_EQ(same, g.size() - 1);
}

TEST(CutReport, CountsGhostsOfAPlainCut)
{
    if (world().rank() != 0) return;
    const auto g = block_graph(box_of_blocks(2, 1, 1));
    const std::vector<int> part{0, 1};
    const auto r = describe(g, part, 2);
    EXPECT_EQ(r.ghosts[0], 250.0);
    EXPECT_EQ(r.ghosts[1], 250.0);
    EXPECT_EQ(r.cut_bytes, 2 * 250.0 * 128);
    EXPECT_EQ(r.peers[0], 1);
    // Alone with a period of one block: both faces are seen again.
    BlockGrid grid;
    grid.period = {1, 0, 0};
    const auto p = block_graph(box_of_blocks(1, 1, 1), grid);
    EXPECT_EQ(describe(p, std::vector<int>{0}, 1).ghosts[0], 500.0);
    EXPECT_EQ(describe(p, std::vector<int>{0}, 1).cut_bytes, 0.0);
}

TEST(Domain, AgreesOnEveryOwner)
{
    const int rank = world().rank(), size = world().size();
    const auto blocks = floor_of_blocks(24, 6);
    std::vector<BlockWork> mine;
    for (std::size_t k = 0; k < blocks.size(); ++k)
        if (int(k) % size == rank) mine.push_back(blocks[k]);
    Domain domain(world(), {0.0, 0.0, 0.0}, {0.5, 0.5, 0.25}, {false, true, false}, {0, 0, 0}, {0, 16, 0});
    EXPECT_THROW(domain.owner_of(Block{0, 0, 0}), Broken);
    const CutReport r = domain.cut(mine);
    EXPECT_EQ(r.blocks, int(blocks.size()));
    EXPECT_LE(r.imbalance, 1.05);
    for (const auto& b : blocks)
        EXPECT_EQ(domain.owner_of(b.block),
                  domain.owner_of(Vector{b.block[0] * 0.5 + 0.1, b.block[1] * 0.5 + 0.1, b.block[2] * 0.25 + 0.1}));
    std::mt19937 random(7);
    std::vector<int> owners;
    for (int k = 0; k < 2000; ++k) {
        const int far = k % 4 ? 20 : 500;
        const Block b{int(random() % unsigned(2 * far)) - far, int(random() % unsigned(2 * far)) - far,
                      int(random() % unsigned(2 * far)) - far};
        owners.push_back(domain.owner_of(b));
        ASSERT_GE(owners.back(), 0);
        ASSERT_LT(owners.back(), size);
        // Against the definition.
        std::tuple<int, int, int> best{1 << 30, 0, 0};
        for (int c = 0; c < int(domain.blocks().size()); ++c) {
            int most = 0, sum = 0;
            for (int a = 0; a < 3; ++a) {
                int d = std::abs(domain.blocks()[c][a] - b[a]);
                if (a == 1) d %= 32, d = std::min(d, 32 - d);
                most = std::max(most, d), sum += d * d;
            }
            best = std::min(best, {most, sum, c});
        }
        EXPECT_EQ(owners.back(), domain.owners()[std::get<2>(best)]);
    }
    const auto all = world().allgather(std::span<const int>(owners));
    for (int q = 0; q < size; ++q) EXPECT_TRUE(std::equal(owners.begin(), owners.end(), all.begin() + std::ptrdiff_t(q * owners.size())));

    // Cut again from where everything is now: nothing moves.
    const std::vector<int> before(domain.owners().begin(), domain.owners().end());
    mine.clear();
    for (const auto& b : blocks)
        if (domain.owner_of(b.block) == rank) mine.push_back(b);
    domain.cut(mine);
    EXPECT_EQ(before, std::vector<int>(domain.owners().begin(), domain.owners().end()));
}

TEST(Domain, RefusesWhatItCannotCut)
{
    EXPECT_THROW(Domain(world(), {}, {0.5, 0.5, 0.5}, {true, false, false}, {}, {1.2, 0, 0}), BadInput);
    const Domain d(world(), {}, {0.5, 0.5, 0.5}, {false, false, false}, {}, {});
    EXPECT_THROW(d.block_of({0, NAN, 0}), NumbersFailed);
    EXPECT_THROW(d.block_of({1e30, 0, 0}), NumbersFailed);
    EXPECT_EQ(d.block_of({-0.1, 0.6, 0.5}), (Block{-1, 1, 1}));
    // A rank with nonsense: all ranks fail together.
    Domain e(world(), {}, {0.5, 0.5, 0.5}, {false, false, false}, {}, {});
    std::vector<BlockWork> mine;
    if (world().rank() == world().size() - 1) mine.push_back({{0, 0, 0}, NAN, 1.0});
    EXPECT_THROW(e.cut(mine), Broken);
    // No soil anywhere.
    e.cut({});
    EXPECT_EQ(e.owner_of(Block{3, 4, 5}), 0);
}

} // namespace
} // namespace kuzure
