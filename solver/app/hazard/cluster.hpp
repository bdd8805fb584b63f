#pragma once
// A hazard whose runs are the tasks of a cluster's job array: what kuzure job asks for.
#include "solver/app/cli/command.hpp"

namespace kuzure::hazard {

struct ClusterRuns {
    scene::CheckedScene largest; // the finest of all runs: time and memory go by it
    std::string layers;          // --layers
    int members = 0;
    io::Path directory;
};
/// `members`: 0 for those of [uncertain], or the usual number; `layers`: empty for 4 and the scene's own. Collective. Throws BadInput.
ClusterRuns cluster_runs(const Comm&, const SceneArguments&, int members, const std::string& layers, const std::string& output);

} // namespace kuzure::hazard
