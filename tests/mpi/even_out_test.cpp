// Later cuts: on imagined ranks for any number of them, then on the real ones with particles.
#include "decomposition/domain.hpp"
#include "tests/mpi/world.hpp"
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <set>

namespace kuzure {
namespace {

/// A heap that slides along x: block (i, j, k) and what it costs at a time between 0 and 1.
struct Heap {
    int nx, ny, nz;
    double work(int i, int j, int k, double time) const
    {
        const double at = (i + 0.5) / nx, middle = 0.3 + 0.4 * time;
        return (0.3 + std::exp(-8 * (at - middle) * (at - middle))) * (1 + 0.2 * std::sin(0.7 * i + 1.3 * j + 2.1 * k));
    }
    std::vector<BlockWork> blocks(double time) const
    {
        std::vector<BlockWork> b;
        for (int i = 0; i < nx; ++i)
            for (int j = 0; j < ny; ++j)
                for (int k = 0; k < nz; ++k) b.push_back({{i, j, k}, work(i, j, k, time), 100});
        return b;
    }
};

std::vector<std::vector<BlockWork>> by_owner(const std::vector<BlockWork>& blocks, const std::vector<int>& owner, int ranks)
{
    std::vector<std::vector<BlockWork>> lists(static_cast<std::size_t>(ranks));
    for (std::size_t b = 0; b < blocks.size(); ++b) lists[owner[b]].push_back(blocks[b]);
    return lists;
}

/// The owner of each block according to the rank that has it; fails where none or two do, or where neighbours think otherwise.
std::vector<int> owners_of(const BlockGraph& g, const std::vector<BlockOwners>& known)
{
    std::vector<int> owner(g.block.size(), -1);
    BlockIndex index;
    for (int b = 0; b < g.size(); ++b) index.set(g.block[b], b);
    for (int r = 0; r < int(known.size()); ++r)
        for (std::size_t k = 0; k < known[r].blocks().size(); ++k) {
            if (known[r].owners()[k] != r) continue;
            const int b = index[known[r].blocks()[k]];
            EXPECT_GE(b, 0);
            EXPECT_EQ(owner[b], -1) << "two ranks own a block";
            owner[b] = r;
        }
    for (const int o : owner) EXPECT_GE(o, 0) << "nobody owns a block";
    for (int b = 0; b < g.size(); ++b)
        for (const auto& l : g.links(b))
            EXPECT_EQ(known[owner[b]].owner_of(g.block[l.block], g.grid.period), owner[l.block])
                << "an owner next to its blocks is not known";
    return owner;
}

TEST(EvenOut, FollowsAMovingLoadOnImaginedRanks)
{
    if (world().rank() != 0) return;
    struct Case {
        Heap heap;
        int ranks;
        std::int32_t period; // of y
    };
    for (const auto& [heap, ranks, period] :
         {Case{{16, 8, 4}, 2, 0}, {{16, 8, 4}, 4, 8}, {{20, 8, 4}, 7, 0}, {{40, 20, 4}, 64, 20}, {{64, 32, 4}, 150, 0}}) {
        BlockGrid grid;
        grid.period = {0, period, 0};
        auto blocks = heap.blocks(0);
        auto g = block_graph(blocks, grid);
        auto owner = partition(g, ranks);
        std::vector<BlockOwners> known(std::size_t(ranks), BlockOwners(g.block, owner));
        const auto pieces_before = describe(g, owner, ranks).pieces;
        const auto first = owner;
        for (int step = 1; step <= 10; ++step) {
            // More ranks are narrower: the same way would be a part's width.
            blocks = heap.blocks((ranks > 100 ? 0.02 : 0.1) * step);
            g = block_graph(blocks, grid);
            const auto before = describe(g, owner, ranks);
            std::vector<std::set<int>> touched(static_cast<std::size_t>(ranks));
            for (int b = 0; b < g.size(); ++b)
                for (const auto& l : g.links(b)) touched[owner[b]].insert(owner[l.block]);
            const auto r = even_out(VirtualRanks(ranks), by_owner(blocks, owner, ranks), grid, known);
            const auto now = owners_of(g, known);
            const auto after = describe(g, now, ranks);
            const auto what = [&] { return std::to_string(ranks) + " ranks, step " + std::to_string(step); };
            EXPECT_NEAR(r.before, before.imbalance, 1e-9) << what();
            EXPECT_NEAR(r.after, after.imbalance, 1e-9) << what();
            EXPECT_LE(r.after, r.before) << what();
            EXPECT_LE(r.after, ranks < 10 ? 1.035 : 1.06) << what() << ", before " << r.before;
            double sum = 0;
            for (const double w : after.work) sum += w;
            EXPECT_NEAR(sum, r.mean * ranks, 1e-9 * sum) << "work is conserved";
            std::int64_t moved = 0;
            for (int b = 0; b < g.size(); ++b) {
                moved += now[b] != owner[b];
                EXPECT_TRUE(now[b] == owner[b] || touched[owner[b]].contains(now[b]))
                    << what() << ": a block went to a rank that was no neighbour";
            }
            EXPECT_EQ(moved, r.moved);
            EXPECT_LT(moved, g.size() / 3) << what() << ": most work stays";
            for (int p = 0; p < ranks; ++p) EXPECT_LE(after.pieces[p], std::max(1, pieces_before[p])) << what() << ", part " << p;
            EXPECT_LE(after.cut_bytes, 1.5 * before.cut_bytes) << what();
            owner = now;
        }
        EXPECT_GT(describe(g, first, ranks).imbalance, 1.1) << "the load has moved: the first cut would not do any more";
    }
}

TEST(EvenOut, LeavesAnEvenCutAlone)
{
    if (world().rank() != 0) return;
    const Heap heap{16, 8, 4};
    const auto blocks = heap.blocks(0.5);
    const auto g = block_graph(blocks);
    const auto owner = partition(g, 7);
    ASSERT_LE(describe(g, owner, 7).imbalance, good_balance);
    std::vector<BlockOwners> known(7, BlockOwners(g.block, owner));
    const auto r = even_out(VirtualRanks(7), by_owner(blocks, owner, 7), {}, known);
    EXPECT_EQ(r.moved, 0);
    EXPECT_EQ(r.iterations, 0);
    EXPECT_EQ(owners_of(g, known), owner);
}

TEST(EvenOut, BodiesApartAndRanksWithoutBlocks)
{
    if (world().rank() != 0) return;
    // Two bodies, each of two ranks; the second is twice as heavy: nothing can flow between them, within them it must. A fifth
    // rank has nothing.
    std::vector<BlockWork> blocks;
    std::vector<int> owner;
    for (const int x : {0, 1000})
        for (int i = 0; i < 20; ++i)
            for (int j = 0; j < 4; ++j) blocks.push_back({{x + i, j, 0}, x ? 2.0 : 1.0, 10}), owner.push_back((x ? 2 : 0) + (i >= 14));
    const auto g = block_graph(blocks);
    std::vector<BlockOwners> known(5, BlockOwners(g.block, owner));
    // A cut takes one layer off a part; here three or four must go.
    EvenReport r;
    for (int cut = 0; cut < 5; ++cut) r = even_out(VirtualRanks(5), by_owner(blocks, owners_of(g, known), 5), {}, known);
    const auto w = describe(g, owners_of(g, known), 5).work;
    EXPECT_NEAR(w[0], 40, 1.01);
    EXPECT_NEAR(w[2], 80, 2.01);
    EXPECT_EQ(w[4], 0);
    EXPECT_NEAR(r.after, std::max(w[2], w[3]) / (240.0 / 5), 1e-9) << "the report tells what is left";
}

TEST(EvenOut, SettlesWhoOwnsABlockThatTwoRanksFound)
{
    if (world().rank() != 0) return;
    // Soil of both has come into block 2, which nobody knew.
    std::vector<BlockOwners> known{{{{0, 0, 0}, {1, 0, 0}}, {0, 0}}, {{{3, 0, 0}, {4, 0, 0}}, {1, 1}}};
    const std::vector<std::vector<BlockWork>> listed{{{{0, 0, 0}, 10, 10}, {{1, 0, 0}, 10, 10}, {{2, 0, 0}, 0.1, 1}},
                                                     {{{2, 0, 0}, 0.2, 1}, {{3, 0, 0}, 10, 10}, {{4, 0, 0}, 10, 10}}};
    const auto r = even_out(VirtualRanks(2), listed, {}, known);
    EXPECT_EQ(r.blocks, 5);
    EXPECT_NEAR(r.mean, 20.15, 1e-12);
    for (const auto& k : known) EXPECT_EQ(k.owner_of({2, 0, 0}, {0, 0, 0}), 1);
}

TEST(EvenOut, RefusesNonsense)
{
    if (world().rank() != 0) return;
    std::vector<BlockOwners> known(2);
    EXPECT_THROW(even_out(VirtualRanks(2), {{{{0, 0, 0}, NAN, 1}}, {}}, {}, known), Broken);
}

TEST(BlockOwners, ForgetsOnlyWhatIsFar)
{
    if (world().rank() != 0) return;
    std::vector<Block> blocks;
    std::vector<int> owner;
    for (int i = 0; i < 12; ++i) blocks.push_back({i, 0, 0}), owner.push_back(i / 3);
    BlockOwners o(blocks, owner);
    o.keep_neighbourhood(0, {12, 0, 0});
    std::vector<Block> left{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {10, 0, 0}, {11, 0, 0}};
    EXPECT_EQ(std::vector(o.blocks().begin(), o.blocks().end()), left);
    EXPECT_EQ(o.owner_of({10, 0, 0}, {12, 0, 0}), 3);
    EXPECT_EQ(o.owner_of({6, 0, 0}, {12, 0, 0}), 1) << "of the nearest that is known";
}

TEST(Domain, EvensOutAMovingLoadAndMigratesToNeighbours)
{
    // As a run does it: each rank lists the blocks of its particles, hands over, migrates; nothing is lost or doubled.
    const int rank = world().rank(), size = world().size();
    const Heap heap{16, 8, 4};
    Domain domain(world(), {0, 0, 0}, {1, 1, 1}, {false, true, false}, {0, 0, 0}, {0, 8, 0});
    const auto start = heap.blocks(0);
    std::vector<BlockWork> mine;
    for (std::size_t k = 0; k < start.size(); ++k)
        if (int(k) % size == rank) mine.push_back(start[k]);
    domain.cut(mine);
    Particles p;
    p.require(field::position, field::id);
    std::vector<Block> own;
    for (std::size_t b = 0; b < start.size(); ++b)
        if (domain.owner_of(start[b].block) == rank) own.push_back(start[b].block);
    p.resize(Index(own.size()));
    for (std::size_t k = 0; k < own.size(); ++k) {
        const auto& b = own[k];
        p[field::position].set(Index(k), Vector{b[0] + 0.5, b[1] + 0.5, b[2] + 0.5});
        p[field::id].set(Index(k), (b[0] * 8 + b[1]) * 4 + b[2]);
    }
    domain.keep_neighbourhood();
    double before = 1;
    for (int step = 1; step <= 10; ++step) {
        mine.clear();
        std::set<int> near;
        for (Index i = 0; i < p.size(); ++i) {
            const Block b = domain.block_of(p[field::position][i]);
            mine.push_back({b, heap.work(b[0], b[1], b[2], 0.1 * step), 1});
            for (int d = 0; d < 27; ++d) near.insert(domain.owner_of(Block{b[0] + d % 3 - 1, b[1] + d / 3 % 3 - 1, b[2] + d / 9 - 1}));
        }
        const auto r = domain.even_out(mine);
        before = std::max(before, r.before);
        EXPECT_LE(r.after, 1.035) << step << " before " << r.before;
        for (Index i = 0; i < p.size(); ++i)
            EXPECT_TRUE(near.contains(domain.owner_of(p[field::position][i]))) << "sent to a rank that was no neighbour";
        const Index n = p.size();
        const auto moved = domain.migrate(p);
        EXPECT_EQ(p.size(), n - moved.left + moved.arrived);
        double work = 0;
        std::int64_t ids = 0;
        for (Index i = 0; i < p.size(); ++i) {
            const Block b = domain.block_of(p[field::position][i]);
            EXPECT_EQ(domain.owner_of(b), rank) << "who gets a block knows that it is its own";
            work += heap.work(b[0], b[1], b[2], 0.1 * step);
            ids += p[field::id][i];
        }
        EXPECT_EQ(world().sum(std::int64_t(p.size())), std::int64_t(start.size()));
        EXPECT_EQ(world().sum(ids), std::int64_t(start.size() * (start.size() - 1) / 2));
        EXPECT_NEAR(world().max(work), r.after * r.mean, 1e-9 * r.mean);
        EXPECT_LT(domain.migrate(p).left, 1) << "one migration is enough";
    }
    if (size > 1) EXPECT_GT(before, 1.03) << "the load moves";
    EXPECT_LT(domain.blocks().size(), start.size() + 1);
}

} // namespace
} // namespace kuzure
