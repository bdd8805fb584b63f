#include "solver/run/scaling.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <numeric>
#include <omp.h>

namespace kuzure {

WeighedBlocks weigh(const BlockSoil& soil, std::size_t first, std::size_t stride)
{
    const auto blocks = soil.blocks();
    const std::int64_t n = blocks.size() > first ? std::int64_t((blocks.size() - first + stride - 1) / stride) : 0;
    std::vector<StepWork> work(static_cast<std::size_t>(n));
#pragma omp parallel for schedule(dynamic, 16)
    for (std::int64_t k = 0; k < n; ++k) work[k] = soil.work(blocks[first + std::size_t(k) * stride]);
    WeighedBlocks w;
    for (std::int64_t k = 0; k < n; ++k) {
        if (work[k].particles == 0) continue;
        w.listed.push_back({blocks[first + std::size_t(k) * stride], work[k].total(), double(work[k].particles)});
        w.work.push_back(work[k]);
    }
    return w;
}

StepWork CutShare::sum() const
{
    StepWork all;
    for (const auto& r : rank) all.add(r.work);
    return all;
}

namespace {
template <class Of> double largest_over_mean(const std::vector<RankShare>& ranks, Of of)
{
    double most = 0, sum = 0;
    for (const auto& r : ranks) most = std::max(most, of(r)), sum += of(r);
    return sum > 0 ? most * double(ranks.size()) / sum : 1;
}
} // namespace

double CutShare::pair_balance() const
{
    return largest_over_mean(rank, [](const RankShare& r) { return r.work.pairs(); });
}
double CutShare::balance() const
{
    return largest_over_mean(rank, [](const RankShare& r) { return r.work.total(); });
}
double CutShare::ghost_share() const
{
    std::int64_t ghosts = 0;
    for (const auto& r : rank) ghosts += r.ghosts;
    return double(ghosts) / double(std::max<std::int64_t>(1, sum().particles));
}

CutShare share_out(const BlockSoil& soil, int ranks, double reach, double ghost_bytes, Method method)
{
    CutShare s;
    const double start = omp_get_wtime();
    const WeighedBlocks weighed = weigh(soil);
    s.weigh_seconds = omp_get_wtime() - start;

    const double cutting = omp_get_wtime();
    const BlockCut cut = cut_blocks(weighed.listed, {}, soil.space().grid(reach, ghost_bytes), ranks, method);
    s.cut_seconds = omp_get_wtime() - cutting;

    const BlockGraph& g = cut.graph;
    s.blocks = g.size();
    s.rank.resize(std::size_t(ranks));
    for (const int pieces : cut.report.pieces) s.scattered += pieces > 1;
    BlockIndex index;
    index.reserve(g.block.size());
    for (int b = 0; b < g.size(); ++b) index.set(g.block[b], b);
    const auto owner_of = [&](const Block& b) {
        const int k = index[b];
        return k < 0 ? -1 : cut.owner[k];
    };
    std::vector<BlockSoil::HaloDemand> demand(g.block.size());
#pragma omp parallel for schedule(dynamic, 16)
    for (int b = 0; b < g.size(); ++b) demand[b] = soil.halo_demand(g.block[b], cut.owner[b], owner_of, reach);

    std::vector<HaloMessage> parts;
    for (int b = 0; b < g.size(); ++b) {
        const int mine = cut.owner[b];
        s.rank[mine].work.add(weighed.work[b]);
        s.rank[mine].seen += demand[b].seen;
        for (const auto& w : demand[b].by) {
            s.rank[w.owner].ghosts += w.particles;
            if (w.owner != mine) parts.push_back({mine, w.owner, w.particles});
        }
    }
    std::ranges::sort(parts, {}, [](const HaloMessage& r) { return std::pair(r.from, r.to); });
    for (std::size_t k = 0, to; k < parts.size(); k = to) {
        std::int64_t sum = 0;
        for (to = k; to < parts.size() && parts[to].from == parts[k].from && parts[to].to == parts[k].to; ++to) sum += parts[to].ghosts;
        s.message.push_back({parts[k].from, parts[k].to, sum});
        s.rank[parts[k].from].sent += sum;
        ++s.rank[parts[k].from].messages;
    }
    return s;
}

} // namespace kuzure
