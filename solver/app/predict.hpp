#pragma once
// Seconds that a run will take on a machine of jobs/machines.
#include "io/machine_profile.hpp"
#include "solver/app/estimate.hpp"

namespace kuzure {

/// The machine profile of this name (of jobs/machines in the sources, then of share/kuzure/machines beside the program) or
/// path, with this host's cores and memory where the profile leaves them to it. Throws BadInput.
io::MachineProfile machine_named(const std::string& name_or_path);

/// Wall seconds of the whole run on so many nodes, outputs left out.
double predict_seconds(const Estimate&, const io::MachineProfile&, int nodes, int ranks_per_node);

} // namespace kuzure
