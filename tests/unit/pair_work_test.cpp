// What blocks weigh at a later cut: pairs of a few clusters counted, the others by the length of their lists.
#include "perf/bench/cloud.hpp"
#include "solver/core/arena.hpp"
#include "solver/run/balance.hpp"
#include <gtest/gtest.h>
#include <map>

namespace kuzure {
namespace {

TEST(PairWork, FewCountedClustersWeighBlocksAsAllDo)
{
    Scene s = bench::dry_sand();
    const double edge = 24 * s.space.spacing, deep = 4 * s.space.spacing;
    scene::Wall floor;
    floor.shape = scene::Box{{-deep, -deep, -deep}, {edge + deep, edge + deep, 0}};
    s.walls = {floor};
    bench::Cloud c(24, 0.2, s);
    c.sort();
    for (const int width : {1, 4, 8}) {
        c.build(width, 0.2);
        const auto x = std::as_const(c.particles)[field::position];
        const double support2 = s.support() * s.support();
        std::int64_t asked = 0;
        const auto near = [&](Vector a, Vector b) { return dot(a - b, a - b) < support2; };
        const auto work = [&](Index every) {
            return pair_work(
                c.lists,
                [&](Index i, Index j) {
#pragma omp atomic
                    ++asked;
                    return near(x[i], x[j]);
                },
                [&](Index i, int w, Index k) {
                    const WallPoints& p = c.walls[std::size_t(w)];
                    return near(x[i], {p.x[k], p.y[k], p.z[k]});
                },
                every);
        };
        const auto all = work(1);
        const std::int64_t for_all = std::exchange(asked, 0);
        const auto some = work(sampled_clusters);
        EXPECT_LT(asked, for_all / 12) << "of " << for_all;

        // By brute force, in blocks of six spacings, as small as a run of many ranks has them.
        std::map<std::array<int, 3>, std::array<double, 3>> blocks;
        double sum = 0;
        for (Index k = 0; k < c.lists.size(); ++k)
            for (Index i = c.lists.first(k); i < c.lists.first(k) + c.lists.count(k); ++i) {
                const Vector at = (1 / (6 * s.space.spacing)) * x[i];
                auto& b = blocks[{int(std::floor(at.x)), int(std::floor(at.y)), int(std::floor(at.z))}];
                double counted = StepWork::particle;
                c.lists.soil(k).for_each([&](std::size_t j) { counted += j != std::size_t(i) && near(x[i], x[Index(j)]); });
                c.lists.walls(k).for_each([&](int w, const PointSet& points) {
                    const WallPoints& p = c.walls[std::size_t(w)];
                    points.for_each([&](std::size_t n) { counted += StepWork::wall * near(x[i], {p.x[n], p.y[n], p.z[n]}); });
                });
                b[0] += counted;
                b[1] += all[std::size_t(k)] / c.lists.count(k) + StepWork::particle;
                b[2] += some[std::size_t(k)] / c.lists.count(k) + StepWork::particle;
                sum += counted;
            }
        double worst = 0, mine = 0, sampled = 0;
        for (const auto& [at, b] : blocks) worst = std::max(worst, std::abs(b[2] - b[0])), mine += b[1], sampled += b[2];
        EXPECT_NEAR(mine / sum, 1, 1e-9) << "all of them counted, width " << width;
        EXPECT_NEAR(sampled / sum, 1, 0.02) << "width " << width;
        EXPECT_LT(worst * double(blocks.size()) / sum, 0.12) << "of a block's mean work, width " << width;
    }
}

TEST(Arena, ListsStayWhereTheyAreAndTakeLittleMore)
{
    Arena<Index> arena;
    arena.clear(100000);
    std::vector<Index*> lists;
    for (int round = 0; round < 3; ++round) {
        lists.clear();
        for (Index k = 0; k < 1000; ++k) {
            Index* to = arena.room(500);
            for (Index n = 0; n < 500; ++n) to[n] = -1; // room for all of it
            for (Index n = 0; n < 100; ++n) to[n] = k;
            arena.take(100);
            lists.push_back(to);
        }
        for (Index k = 0; k < 1000; ++k)
            for (Index n = 0; n < 100; ++n) ASSERT_EQ(lists[std::size_t(k)][n], k);
        EXPECT_EQ(arena.taken(), 100000u);
        EXPECT_LE(arena.bytes(), 100000 * sizeof(Index) * 5 / 4);
        arena.clear(100000);
    }
    // One that is longer than a piece has its own.
    Index* longest = arena.room(1000000);
    longest[999999] = 1;
    arena.take(1000000);
    EXPECT_EQ(arena.taken(), 1000000u);
}

} // namespace
} // namespace kuzure
