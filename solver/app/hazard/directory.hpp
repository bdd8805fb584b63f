#pragma once
// The directory of an answer that is made of many runs.
#include "io/file.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::hazard {

/// What was asked for, or the scene's output directory and "-what", or results/FILE-what.
io::Path directory_for(const std::string& asked, const Scene&, const std::string& scene_file, const std::string& what);
/// The directory with what its runs need: scenes, inputs, logs and `runs`.
void make_directories(const io::Path& directory, const std::string& runs);

} // namespace kuzure::hazard
