#include "solver/run/balance.hpp"
#include "solver/run/scaling.hpp"
#include <omp.h>

namespace kuzure {

std::vector<double> pair_work(const ClusterLists& lists, const std::function<bool(Index, Index)>& meets,
                              const std::function<bool(Index, int, Index)>& meets_wall, Index every)
{
    struct Met {
        double entries = 0, pairs = 0; // entries: once for each particle of the cluster
        double share() const { return entries > 0 ? pairs / entries : 0; }
    };
    Met soil, wall;
#pragma omp parallel
    {
        Met my_soil, my_wall;
#pragma omp for schedule(dynamic, 64) nowait
        for (Index c = 0; c < lists.size(); c += every) {
            const Index first = lists.first(c), last = first + lists.count(c);
            lists.soil(c).for_each([&](Index j) {
                my_soil.entries += last - first;
                for (Index i = first; i < last; ++i) my_soil.pairs += j != i && meets(i, j);
            });
            lists.walls(c).for_each([&](int w, const PointSet& points) {
                points.for_each([&](Index k) {
                    my_wall.entries += last - first;
                    for (Index i = first; i < last; ++i) my_wall.pairs += meets_wall(i, w, k);
                });
            });
        }
#pragma omp critical
        {
            soil.entries += my_soil.entries, soil.pairs += my_soil.pairs;
            wall.entries += my_wall.entries, wall.pairs += my_wall.pairs;
        }
    }
    const double of_soil = soil.share(), of_wall = StepWork::wall * wall.share();
    std::vector<double> work(std::size_t(lists.size()));
#pragma omp parallel for schedule(static)
    for (Index c = 0; c < lists.size(); ++c)
        work[std::size_t(c)] = lists.count(c) * (of_soil * double(lists.soil(c).size()) + of_wall * double(lists.walls(c).size()));
    return work;
}

namespace {
/// Blocks of this rank's particles and their costs, by the pairs of the last sort.
std::vector<BlockWork> block_work(const Scene& scene, const Domain& domain, const Particles& p, const Layout& layout)
{
    const auto x = p[field::position], sorted = p[field::sorted_position];
    const double support2 = scene.support() * scene.support();
    const auto close = [&](Index i, Vector there) {
        const Vector r = there - sorted[i];
        return dot(r, r) < support2;
    };
    const ClusterLists& lists = layout.lists();
    const auto of_pairs = pair_work(
        lists, [&](Index i, Index j) { return close(i, layout.sorted(p, j)); },
        [&](Index i, int wall, Index k) {
            const WallPoints& w = layout.walls()[std::size_t(wall)];
            return close(i, {w.x[k], w.y[k], w.z[k]});
        },
        sampled_clusters);
    // Each thread a share of its own, put together in their order: the same sums in every run on so many.
    using Blocks = std::map<Block, BlockWork>;
    std::vector<Blocks> by_thread(static_cast<std::size_t>(omp_get_max_threads()));
#pragma omp parallel num_threads(int(by_thread.size()))
    {
        Blocks& mine = by_thread[std::size_t(omp_get_thread_num())];
        BlockWork* last = nullptr; // most particles are in the block of the one before
#pragma omp for schedule(static)
        for (Index c = 0; c < lists.size(); ++c)
            for (Index i = lists.first(c); i < lists.first(c) + lists.count(c); ++i) {
                Block b;
                if (!domain.space().raw_block(x[i], b)) continue; // all ranks hear of it when particles migrate
                b = domain.space().wrapped(b);
                if (!last || last->block != b) last = &mine.try_emplace(b, BlockWork{b, 0, 0}).first->second;
                last->work += of_pairs[std::size_t(c)] / lists.count(c) + StepWork::particle;
                last->particles += 1;
            }
    }
    Blocks blocks;
    for (const Blocks& some : by_thread)
        for (const auto& [b, w] : some) {
            BlockWork& sum = blocks.try_emplace(b, BlockWork{b, 0, 0}).first->second;
            sum.work += w.work, sum.particles += w.particles;
        }
    std::vector<BlockWork> work;
    for (const auto& [b, w] : blocks) work.push_back(w);
    return work;
}
} // namespace

Balance::Balance(const Comm& comm, Domain& domain, double reach, double ghost_bytes, int recut_every)
    : comm_(comm), domain_(domain), halo_{reach, ghost_bytes}, recut_every_(recut_every)
{
}

void Balance::cut_start(const Scene& scene, const scene::Filling& filling, Timers& timers)
{
    const auto mine = weigh(StartSoil(scene, filling, domain_.space()), std::size_t(comm_.rank()), std::size_t(comm_.size())).listed;
    const auto report = timers.timed(Phase::Partition, [&] { return domain_.cut(mine, Method::Metis, halo_, Labels::Free); });
    rebalance_ = Rebalance(report.imbalance, report.seconds);
    full_ = {.imbalance = report.imbalance, .seconds = report.seconds};
}

void Balance::cut_state(const Scene& scene, Particles& p, const Layout& layout, bool has_run, const std::function<void()>& rebuild)
{
    std::map<Block, double> count;
    for (Index i = 0; i < p.size(); ++i) count[domain_.block_of(p[field::position][i])] += 1;
    std::vector<BlockWork> work;
    for (const auto& [b, n] : count) work.push_back({b, n, n});
    // Rows of a checkpoint lie on any rank: no rank can count pairs before a first cut has brought neighbours together.
    const double begin = omp_get_wtime();
    const bool again = has_run && comm_.size() > 1;
    auto report = domain_.cut(work, again ? Method::Hilbert : Method::Metis, halo_, Labels::Free);
    domain_.migrate(p);
    if (has_run) rebuild();
    if (again) {
        report = domain_.cut(block_work(scene, domain_, p, layout), Method::Metis, halo_, Labels::Free);
        domain_.migrate(p);
        rebuild();
    }
    domain_.keep_neighbourhood();
    const double seconds = comm_.max(omp_get_wtime() - begin);
    rebalance_ = Rebalance(report.imbalance, seconds);
    full_ = {.imbalance = report.imbalance, .seconds = seconds};
}

void Balance::migrate(const Scene& scene, Particles& p, const Layout& layout, std::int64_t rebuilds, Timers& timers)
{
    if (comm_.size() == 1) return;
    const bool forced = recut_every_ > 0 && layout.built() && rebuilds % recut_every_ == 0;
    if (!forced && layout.built() && ++stayed_ < rebuilds_a_migration) return; // who computes what has left its blocks changes no bit
    stayed_ = 0;
    const double busy = timers.seconds(Phase::Interior) + timers.seconds(Phase::Rim);
    const bool due = layout.built() && rebalance_.due(comm_, busy - busy_before_);
    busy_since_cut_ += busy - busy_before_;
    busy_before_ = busy;
    imbalance_ = rebalance_.imbalance();
    const bool now = due || forced;
    const double begin = omp_get_wtime();
    if (now) cut(scene, p, layout, timers);
    migrated_ += domain_.migrate(p).left;
    domain_.keep_neighbourhood();
    if (now) rebalance_.cut(comm_, omp_get_wtime() - begin);
}

void Balance::cut(const Scene& scene, const Particles& p, const Layout& layout, Timers& timers)
{
    auto mine = block_work(scene, domain_, p, layout);
    double total = 0;
    for (const auto& b : mine) total += b.work;
    const double factor = cost_factor(total);
    for (auto& b : mine) b.work *= factor;
    // Handing blocks to neighbours costs nearly nothing, a cut of the whole domain much. The latter is made when what the
    // former left behind has cost as much idle time as it will cost, or when its parts have become ragged.
    full_.idle_cost += std::max(0.0, cut_imbalance_ - full_.imbalance - noise) * comm_.sum(busy_since_cut_) / comm_.size();
    const bool again = full_.idle_cost > full_.seconds || (full_.halo_ratio > 0 && halo_share_ > ragged * full_.halo_ratio);
    timers.timed(Phase::Partition, [&] {
        if (again) {
            const auto report = domain_.cut(mine, Method::Metis, halo_);
            full_ = {.imbalance = report.imbalance, .seconds = report.seconds};
            cut_imbalance_ = report.imbalance, halo_share_ = 0;
            ++full_partitions_;
        } else {
            const auto report = domain_.even_out(mine, halo_);
            cut_imbalance_ = report.after, halo_share_ = report.halo;
            if (full_.halo_ratio == 0) full_.halo_ratio = report.halo;
        }
    });
    busy_since_cut_ = 0;
    ++cuts_;
}

double Balance::cost_factor(double work) const
{
    // Seconds per unit of work against those of all ranks: what pairs do not explain, such as a slow node. Less than a tenth is noise.
    double all[] = {busy_since_cut_, work};
    comm_.sum(std::span<double>(all));
    if (!(busy_since_cut_ > 0.1) || !(work > 0) || !(all[0] > 0)) return 1;
    const double ratio = busy_since_cut_ / work / (all[0] / all[1]);
    return std::abs(ratio - 1) < 0.1 ? 1 : std::clamp(ratio, 0.5, 2.0);
}

} // namespace kuzure
