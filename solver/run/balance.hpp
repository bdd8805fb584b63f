#pragma once
// Who computes what: the first cut of the domain, and later ones when idle time says that they pay. Nothing here changes a bit.
#include "decomposition/domain.hpp"
#include "decomposition/rebalance.hpp"
#include "perf/phases.hpp"
#include "solver/run/blocks.hpp"
#include "solver/run/layout.hpp"
#include <functional>

namespace kuzure {

/// What the pairs of each cluster cost, in soil pairs: counted for one cluster in `every`, for the others by the length of their lists, of
/// which a cluster's batches take the time. meets(particle, record), meets_wall(particle, wall, point): nearer than the support.
std::vector<double> pair_work(const ClusterLists&, const std::function<bool(Index, Index)>& meets,
                              const std::function<bool(Index, int, Index)>& meets_wall, Index every);
inline constexpr Index sampled_clusters = 16;

class Balance {
public:
    /// `recut_every`: cut anew at every so many list rebuilds, needed or not; 0: when it pays. Ghosts reach `reach` m.
    Balance(const Comm&, Domain&, double reach, double ghost_bytes, int recut_every);

    /// The first cut, by counts of the scene's start: each rank counts a share of the blocks; no rank keeps a particle yet. Collective.
    void cut_start(const Scene&, const scene::Filling&, Timers&);
    /// The first cut of a state whose particles lie on any rank; `rebuild` makes the lists by which pairs are counted. Collective.
    void cut_state(const Scene&, Particles&, const Layout&, bool has_run, const std::function<void()>& rebuild);
    /// Before a sort; at every fourth, and where a cut is wanted: cuts anew if it pays, then sends every particle to its owner. Collective.
    void migrate(const Scene&, Particles&, const Layout&, std::int64_t rebuilds, Timers&);

    double imbalance() const { return imbalance_; } // max/mean of the ranks' busy seconds, as last measured
    std::int64_t migrated() const { return migrated_; }
    std::int64_t cuts() const { return cuts_; }
    std::int64_t full_partitions() const { return full_partitions_; }

private:
    void cut(const Scene&, const Particles&, const Layout&, Timers&);
    /// Seconds of this rank per unit of work since the last cut, against all ranks; 1 where they differ little. Collective.
    double cost_factor(double work) const;

    struct FullPartition {
        double imbalance = 1, seconds = 0; // max/mean that the last cut of the whole domain promised, and what it took, s
        double idle_cost = 0;              // idle seconds that cuts between neighbours have left behind since, beyond `imbalance`
        double halo_ratio = 0;             // EvenReport::halo of the first of them
    };
    static constexpr double noise = 0.02; // of max/mean: below this, imbalance is noise
    static constexpr double ragged = 1.5; // times the halo of fresh parts

    /// Soil that crosses into another rank's blocks moves there so late: by then it is a spacing or two beyond, which the halo takes as it
    /// comes, and three of four exchanges with their barriers fall away.
    static constexpr int rebuilds_a_migration = 4;

    const Comm& comm_;
    Domain& domain_;
    HaloCost halo_;
    int recut_every_;
    Rebalance rebalance_;
    FullPartition full_;
    double cut_imbalance_ = 1, halo_share_ = 0;   // of the last cut
    double busy_before_ = 0, busy_since_cut_ = 0; // s
    double imbalance_ = 1;
    int stayed_ = 0; // sorts since the last migration
    std::int64_t migrated_ = 0, cuts_ = 0, full_partitions_ = 0;
};

} // namespace kuzure
