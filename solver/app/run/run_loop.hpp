#pragma once
// A run from its scene to its end: opening, twins, the loop over steps, and the four ways in which it ends.
#include "solver/app/run/arguments.hpp"

namespace kuzure {

/// Collective: runs the scene and leaves its results. Throws BadInput before anything is written, NumbersFailed and IoFailed with the last
/// good checkpoint named.
Exit run_scene(const Comm&, const RunArguments&);

} // namespace kuzure
