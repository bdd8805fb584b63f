#include "solver/run/balance.hpp"
#include "solver/run/scaling.hpp"
#include <omp.h>

namespace kuzure {

namespace {
/// Blocks of this rank's particles and their costs; pairs are those of the last sort.
std::vector<BlockWork> block_work(const Scene& scene, const Domain& domain, const Particles& p, const Layout& layout)
{
    const auto x = p[field::position], sorted = p[field::sorted_position];
    const ClusterLists& lists = layout.lists();
    const Index n = p.size();
    const double support = scene.support(), support2 = support * support;
    std::vector<StepWork> of(std::size_t(n), {1, -1, 0}); // every particle meets itself once in its list
#pragma omp parallel for schedule(dynamic, 64)
    for (Index c = 0; c < lists.size(); ++c)
        for (Index i = lists.first(c); i < lists.first(c) + lists.count(c); ++i) {
            const Vector here = sorted[i];
            const auto close = [&](Vector there) { return dot(there - here, there - here) < support2; };
            for (const Index j : lists.soil(c)) of[i].soil_pairs += close(layout.sorted(p, j));
            for (auto runs = lists.walls(c); !runs.empty(); runs = runs.subspan(2 + runs[1])) {
                const WallPoints& w = layout.walls()[runs[0]];
                for (const Index k : runs.subspan(2, runs[1])) of[i].wall_pairs += close({w.x[k], w.y[k], w.z[k]});
            }
        }
    std::map<Block, StepWork> blocks;
    for (Index i = 0; i < n; ++i) blocks[domain.block_of(x[i])].add(of[i]);
    std::vector<BlockWork> work;
    for (const auto& [b, w] : blocks) work.push_back({b, w.total(), double(w.particles)});
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
    const double busy = timers.seconds(Phase::Interior) + timers.seconds(Phase::Rim);
    const bool due = layout.built() && rebalance_.due(comm_, busy - busy_before_);
    busy_since_cut_ += busy - busy_before_;
    busy_before_ = busy;
    imbalance_ = rebalance_.imbalance();
    const bool now = due || (recut_every_ > 0 && layout.built() && rebuilds % recut_every_ == 0);
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
