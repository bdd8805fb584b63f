#include "solver/app/scaling/drift.hpp"
#include <algorithm>
#include <numeric>
#include <omp.h>

namespace kuzure {

std::vector<ReplayedCut> replay_repartition(const Scene& s, const scene::Filling& f, const BlockSpace& space, int ranks,
                                            const std::vector<Vector>& end, const std::vector<Vector>& way, int steps, double reach,
                                            double row_bytes)
{
    const BlockGrid grid = space.grid(reach, row_bytes);
    const auto low = space.period_low(), length = space.period_length();
    const auto in_period = [&](int a, double v) {
        return space.period()[a] ? std::min(std::max(v - std::floor((v - low[a]) / length[a]) * length[a], low[a]), low[a] + length[a]) : v;
    };
    std::vector<Vector> x(end.size());
    const auto move = [&](double done) {
        for (std::size_t i = 0; i < x.size(); ++i) {
            const Vector v = end[i] - (1 - done) * way[i];
            x[i] = {in_period(0, v.x), in_period(1, v.y), in_period(2, v.z)};
        }
    };

    move(0);
    std::vector<BlockOwners> known(static_cast<std::size_t>(ranks));
    std::vector<int> holder(x.size());
    {
        const BlockCut cut = cut_blocks(weigh(StateSoil(s, f, space, x)).listed, {}, grid, ranks);
        const BlockOwners all(cut.graph.block, cut.owner);
        for (std::size_t i = 0; i < x.size(); ++i) holder[i] = all.owner_of(space.block_of(x[i]), space.period());
#pragma omp parallel for schedule(dynamic)
        for (int r = 0; r < ranks; ++r) known[r] = all, known[r].keep_neighbourhood(r, space.period());
    }
    std::vector<ReplayedCut> cuts;
    for (int step = 1; step <= steps; ++step) {
        move(double(step) / steps);
        const auto weighed = weigh(StateSoil(s, f, space, x)).listed;
        BlockIndex index;
        for (std::size_t k = 0; k < weighed.size(); ++k) index.set(weighed[k].block, int(k));
        std::vector<int> at(x.size());
        for (std::size_t i = 0; i < x.size(); ++i) at[i] = index[space.block_of(x[i])];
        const auto migrate = [&] {
            std::int64_t moved = 0;
            for (std::size_t i = 0; i < x.size(); ++i) {
                const int to = known[holder[i]].owner_of(weighed[at[i]].block, space.period());
                moved += to != holder[i];
                holder[i] = to;
            }
            return moved;
        };
        // Lists are made often, cuts seldom: particles are with the owners of their blocks when the next cut comes.
        migrate();
        std::vector<std::pair<int, int>> held; // (rank, block) of each particle
        for (std::size_t i = 0; i < x.size(); ++i) held.emplace_back(holder[i], at[i]);
        std::ranges::sort(held);
        std::vector<std::vector<BlockWork>> listed(static_cast<std::size_t>(ranks));
        for (std::size_t i = 0, to; i < held.size(); i = to) {
            for (to = i; to < held.size() && held[to] == held[i];) ++to;
            const BlockWork& b = weighed[held[i].second];
            listed[held[i].first].push_back({b.block, b.work * double(to - i) / b.particles, double(to - i)});
        }
        ReplayedCut c;
        c.even = even_out(VirtualRanks(ranks), listed, grid, known);
        c.moved_particles = migrate();
        for (const auto& k : known) c.known_most = std::max(c.known_most, k.blocks().size());

        const BlockGraph g = block_graph(weighed, grid);
        std::vector<int> owner(weighed.size(), 0);
        for (int r = 0; r < ranks; ++r)
            for (std::size_t k = 0; k < known[r].blocks().size(); ++k)
                if (known[r].owners()[k] == r)
                    if (const int b = index[known[r].blocks()[k]]; b >= 0) owner[b] = r;
        const CutReport report = describe(g, owner, ranks);
        c.cut_bytes = report.cut_bytes;
        for (const int pieces : report.pieces) c.scattered += pieces > 1;
        for (const int peers : report.peers) c.peers_mean += double(peers) / ranks, c.peers_most = std::max(c.peers_most, double(peers));
        if (step == steps) {
            const double begin = omp_get_wtime();
            const BlockCut whole = cut_blocks(weighed, {}, grid, ranks);
            c.whole_seconds = omp_get_wtime() - begin;
            c.whole_balance = whole.report.imbalance, c.whole_bytes = whole.report.cut_bytes;
            for (const int pieces : whole.report.pieces) c.whole_scattered += pieces > 1;
        }
        cuts.push_back(c);
    }
    return cuts;
}

} // namespace kuzure
