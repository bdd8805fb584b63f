#include "solver/app/scaling/drift.hpp"
#include <algorithm>
#include <numeric>
#include <omp.h>

namespace kuzure {

namespace {

/// Particles on their way, who holds each of them, and what every rank knows of the owners of blocks.
class Replay {
public:
    Replay(const Scene& s, const scene::Filling& f, const BlockSpace& space, int ranks, const std::vector<Vector>& end,
           const std::vector<Vector>& way, double reach, double ghost_bytes)
        : scene_(s), filling_(f), space_(space), grid_(space.grid(reach, ghost_bytes)), ranks_(ranks), end_(end), way_(way), x_(end.size()),
          known_(static_cast<std::size_t>(ranks)), holder_(end.size())
    {
        move(0);
        const BlockCut cut = cut_blocks(weigh(StateSoil(s, f, space, x_)).listed, {}, grid_, ranks);
        const BlockOwners all(cut.graph.block, cut.owner);
        for (std::size_t i = 0; i < x_.size(); ++i) holder_[i] = all.owner_of(space.block_of(x_[i]), space.period());
#pragma omp parallel for schedule(dynamic)
        for (int r = 0; r < ranks; ++r) known_[r] = all, known_[r].keep_neighbourhood(r, space.period());
    }

    /// The next cut, when this share of the way is done; `last`: with a whole cut to compare.
    ReplayedCut cut(double done, bool last)
    {
        move(done);
        weighed_ = weigh(StateSoil(scene_, filling_, space_, x_)).listed;
        BlockIndex index;
        for (std::size_t k = 0; k < weighed_.size(); ++k) index.set(weighed_[k].block, int(k));
        at_.resize(x_.size());
        for (std::size_t i = 0; i < x_.size(); ++i) at_[i] = index[space_.block_of(x_[i])];
        // Lists are made often, cuts seldom: particles are with the owners of their blocks when the next cut comes.
        migrate();
        ReplayedCut c;
        c.even = even_out(VirtualRanks(ranks_), listed(), grid_, known_);
        c.moved_particles = migrate();
        for (const auto& k : known_) c.known_most = std::max(c.known_most, k.blocks().size());
        describe_owners(index, c);
        if (last) cut_whole(c);
        return c;
    }

private:
    void move(double done)
    {
        const auto low = space_.period_low(), length = space_.period_length();
        const auto in_period = [&](int a, double v) {
            return space_.period()[a] ? std::min(std::max(v - std::floor((v - low[a]) / length[a]) * length[a], low[a]), low[a] + length[a])
                                      : v;
        };
        for (std::size_t i = 0; i < x_.size(); ++i) {
            const Vector v = end_[i] - (1 - done) * way_[i];
            x_[i] = {in_period(0, v.x), in_period(1, v.y), in_period(2, v.z)};
        }
    }

    std::int64_t migrate()
    {
        std::int64_t moved = 0;
        for (std::size_t i = 0; i < x_.size(); ++i) {
            const int to = known_[holder_[i]].owner_of(weighed_[at_[i]].block, space_.period());
            moved += to != holder_[i];
            holder_[i] = to;
        }
        return moved;
    }

    /// What each rank's blocks cost.
    std::vector<std::vector<BlockWork>> listed() const
    {
        std::vector<std::pair<int, int>> held; // (rank, block) of each particle
        for (std::size_t i = 0; i < x_.size(); ++i) held.emplace_back(holder_[i], at_[i]);
        std::ranges::sort(held);
        std::vector<std::vector<BlockWork>> all(static_cast<std::size_t>(ranks_));
        for (std::size_t i = 0, to; i < held.size(); i = to) {
            for (to = i; to < held.size() && held[to] == held[i];) ++to;
            const BlockWork& b = weighed_[held[i].second];
            all[held[i].first].push_back({b.block, b.work * double(to - i) / b.particles, double(to - i)});
        }
        return all;
    }

    void describe_owners(const BlockIndex& index, ReplayedCut& c) const
    {
        std::vector<int> owner(weighed_.size(), 0);
        for (int r = 0; r < ranks_; ++r)
            for (std::size_t k = 0; k < known_[r].blocks().size(); ++k)
                if (known_[r].owners()[k] == r)
                    if (const int b = index[known_[r].blocks()[k]]; b >= 0) owner[b] = r;
        const CutReport report = describe(block_graph(weighed_, grid_), owner, ranks_);
        c.cut_bytes = report.cut_bytes;
        for (const int pieces : report.pieces) c.scattered += pieces > 1;
        for (const int peers : report.peers) c.peers_mean += double(peers) / ranks_, c.peers_most = std::max(c.peers_most, double(peers));
    }

    void cut_whole(ReplayedCut& c) const
    {
        const double begin = omp_get_wtime();
        const BlockCut whole = cut_blocks(weighed_, {}, grid_, ranks_);
        c.whole_seconds = omp_get_wtime() - begin;
        c.whole_balance = whole.report.imbalance, c.whole_bytes = whole.report.cut_bytes;
        for (const int pieces : whole.report.pieces) c.whole_scattered += pieces > 1;
    }

    const Scene& scene_;
    const scene::Filling& filling_;
    const BlockSpace& space_;
    BlockGrid grid_;
    int ranks_;
    const std::vector<Vector>&end_, &way_;
    std::vector<Vector> x_;
    std::vector<BlockOwners> known_; // by each rank
    std::vector<int> holder_;        // of each particle
    std::vector<BlockWork> weighed_;
    std::vector<int> at_; // block of each particle
};

} // namespace

std::vector<ReplayedCut> replay_repartition(const Scene& s, const scene::Filling& f, const BlockSpace& space, int ranks,
                                            const std::vector<Vector>& end, const std::vector<Vector>& way, int steps, double reach,
                                            double ghost_bytes)
{
    Replay replay(s, f, space, ranks, end, way, reach, ghost_bytes);
    std::vector<ReplayedCut> cuts;
    for (int step = 1; step <= steps; ++step) cuts.push_back(replay.cut(double(step) / steps, step == steps));
    return cuts;
}

} // namespace kuzure
