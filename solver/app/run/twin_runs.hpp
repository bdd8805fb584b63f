#pragma once
// The coarser twins of a run: what they leave becomes error bars at its end.
#include "io/result_directory.hpp"
#include "solver/app/run/arguments.hpp"
#include "solver/app/run/messages.hpp"
#include "solver/app/study/twins.hpp"
#include <functional>
#include <optional>

namespace kuzure {

/// Collective: runs the twins that are not there already, by `run`, into the run's directory. A twin that fails costs its bar only; one
/// that was stopped goes on where the run is restarted: then nothing is returned. `start`: wall_clock() when the run began.
std::optional<std::vector<study::TwinRun>> run_twins(const Comm&, const RunArguments&, const Scene&, const io::ResultDirectory&, Messages&,
                                                     double start,
                                                     const std::function<Exit(const RunArguments&, scene::CheckedScene)>& run);

} // namespace kuzure
