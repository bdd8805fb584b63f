#pragma once
// Who computes what: the first cut of the domain, and later ones when idle time says that they pay. Nothing here changes a bit.
#include "decomposition/domain.hpp"
#include "decomposition/rebalance.hpp"
#include "perf/phases.hpp"
#include "solver/run/blocks.hpp"
#include "solver/run/layout.hpp"

namespace kuzure {

class Balance {
public:
    /// `recut_every`: cut anew at every so many list rebuilds, needed or not; 0: when it pays. Ghosts reach `reach` m.
    Balance(const Comm&, Domain&, double reach, double ghost_bytes, int recut_every);

    /// The first cut, by counts of the scene's start: each rank counts a share of the blocks; no rank keeps a particle yet. Collective.
    void cut_start(const Scene&, const scene::Filling&, Timers&);
    /// The first cut of a state whose particles lie on any rank; `rebuild` makes the lists by which pairs are counted. Collective.
    void cut_state(const Scene&, Particles&, const Layout&, bool has_run, const std::function<void()>& rebuild);
    /// Before a sort: cuts anew if it pays, then sends every particle to its owner. Collective.
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

    const Comm& comm_;
    Domain& domain_;
    HaloCost halo_;
    int recut_every_;
    Rebalance rebalance_;
    FullPartition full_;
    double cut_imbalance_ = 1, halo_share_ = 0;   // of the last cut
    double busy_before_ = 0, busy_since_cut_ = 0; // s
    double imbalance_ = 1;
    std::int64_t migrated_ = 0, cuts_ = 0, full_partitions_ = 0;
};

} // namespace kuzure
