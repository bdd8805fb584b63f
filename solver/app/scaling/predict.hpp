#pragma once
// Seconds that a run will take on a machine of jobs/machines. Here and not in perf/: it needs the cut of
// solver/run, the scene's estimate and the profiles of io, which perf may not see.
#include "io/machine_profile.hpp"
#include "solver/app/scaling/estimate.hpp"
#include "solver/run/scaling.hpp"
#include <span>
#include <vector>

namespace kuzure {

/// The machine profile of this name (of jobs/machines in the sources, then of share/kuzure/machines beside the program) or
/// path, with this host's cores and memory where the profile leaves them to it. Throws BadInput.
io::MachineProfile machine_named(const std::string& name_or_path);

/// What one rank computes and sends in a step; sent, ghosts: particles.
struct RankLoad {
    double pairs = 0, particles = 0; // pairs in units of soil pairs
    double rim = 0;                  // particles whose sums wait for ghosts
    double sent = 0, ghosts = 0;     // sent, and arriving
    double messages = 0;             // sent; as many arrive
    double far_messages = 0;         // of them to other nodes
    double node_ghosts = 0;          // between this rank's node and others, the larger of both ways, of all its ranks
};

/// Seconds of one step by the model of docs/performance.md; the slowest rank counts.
struct StepSeconds {
    double pairs = 0;       // pair pass of the mean rank
    double particles = 0;   // lists, sorting, records of the mean rank
    double imbalance = 0;   // what the slowest rank computes beyond that
    double halo = 0;        // packing, messages, and waiting that the interior does not hide
    double reduction = 0;   // the step's one
    double rebuild = 0;     // what ranks tell each other when lists are made, per step
    double recut = 0;       // cutting anew and the idle time that it mends, per step
    double network = 0;     // for information: on the wire, hidden or not
    double recut_steps = 0; // for information: steps between two cuts
    double total() const { return pairs + particles + imbalance + halo + reduction + rebuild + recut; }
};

/// Machine, ranks and nodes of a run. Cores of a node are shared evenly by its ranks.
struct Deployment {
    const io::MachineProfile& machine;
    int ranks = 1, ranks_per_node = 1;
    double ghost_bytes = 128, blocks = 0;
    bool mixed = false;
    double latency_times = 1, bandwidth_times = 1; // for questions of sensitivity
    scene::Scheme scheme = scene::Scheme::LeapFrog;
};
/// How often ghosts are exchanged in a step.
int exchanges(scene::Scheme);
StepSeconds predict_step(std::span<const RankLoad>, const Deployment&);
/// The loads of a counted cut, its ranks on nodes in order.
std::vector<RankLoad> loads(const CutShare&, int ranks_per_node);

/// Wall seconds of the whole run on so many nodes, outputs left out: the model with cubes of soil instead of a counted cut.
double predict_seconds(const Estimate&, const io::MachineProfile&, int nodes, int ranks_per_node);

} // namespace kuzure
