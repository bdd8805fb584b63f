#pragma once
// The results of a run as they are shown: which scene they are of, which pictures belong to them.
#include "io/picture_series.hpp"
#include "solver/app/cli/command.hpp"
#include <utility>

namespace kuzure {

/// Collective. A result directory, held, and the scene in it. Throws BadInput where it is none.
std::pair<io::Place, Scene> open_results(const Comm&, const io::Path& results);
/// The pictures that the scene asks for, or those by default where it asks for none, from the results in a directory.
io::PictureTask picture_task(const Scene&, const io::Place& results);

} // namespace kuzure
