#pragma once
// The pictures of a run as one film, by ffmpeg where it is installed.
#include "io/file.hpp"
#include <string>

namespace kuzure::report {

/// Writes movie.mp4 (H.264) or, where this ffmpeg cannot, movie.webm or movie.gif from the directory's pictures, about ten
/// seconds long; gives its name, or throws IoFailed with what is missing and the remedy.
io::Path write_movie(const io::Path& directory);

} // namespace kuzure::report
