#pragma once
// How good later cuts between neighbours are on many ranks, without a run: soil moved in small steps from its start to a
// later state, the cut evened out at each by as many imagined ranks.
#include "decomposition/even_out.hpp"
#include "solver/run/scaling.hpp"

namespace kuzure {

/// One cut between neighbours, and what a cut of the whole domain would have been (only at the last step).
struct ReplayedCut {
    EvenReport even;
    double cut_bytes = 0; // as CutReport's
    int scattered = 0;    // ranks whose blocks do not hang together
    double peers_mean = 0, peers_most = 0;
    std::int64_t moved_particles = 0; // by the migration after it
    std::size_t known_most = 0;       // blocks that a rank knows
    double whole_balance = 0, whole_bytes = 0, whole_seconds = 0;
    int whole_scattered = 0;
};
/// `x`: the later state, m; `way`: how each particle came there from its start.
std::vector<ReplayedCut> replay_repartition(const Scene&, const scene::Filling&, const BlockSpace&, int ranks, const std::vector<Vector>& x,
                                            const std::vector<Vector>& way, int steps, double reach, double ghost_bytes);

} // namespace kuzure
