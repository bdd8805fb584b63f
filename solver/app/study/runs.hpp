#pragma once
// What all commands share that start runs of their own in a directory of their own: words, whose directory it is, what was left there.
#include "io/file.hpp"
#include "solver/scene/scene.hpp"
#include <initializer_list>
#include <string>

namespace kuzure::study {

/// A line for the user, on standard output.
void say(const std::string&);
/// "12.3 s", "45.6 min"
std::string seconds_text(double seconds);
/// The last line that a child said into its log, without the program's name.
std::string last_words(const io::Path& log);

/// What was asked for, or the scene's output directory and "-what", or results/FILE-what.
io::Path directory_for(const std::string& asked, const Scene&, const std::string& scene_file, const std::string& what);
/// The directory with these folders.
void make_directories(const io::Path& directory, std::initializer_list<const char*> folders);
/// Throws BadInput where `out` is a file, or a directory that holds other things than those of a `what` ("a hazard"), which has `mark` in
/// it; nothing there, or an empty directory, is fine.
void require_own_directory(const io::Path& out, const char* mark, const char* what);
/// A run whose starter was killed is asked to stop and still writes for a moment: waits until none lives in this result directory, at most
/// 20 s.
void wait_for_the_end_of_a_run(const io::Path& directory);
/// True, `times` times, of a child that was refused because such a run had not ended, or not even begun to write, when it was looked for:
/// waits for its end, and the child is to be started again.
bool waited_for_an_earlier_run(int exit_code, const io::Path& log, const io::Path& directory, int& times);
inline constexpr int most_waits = 3;
/// Whether a result directory holds a checkpoint.
bool has_checkpoint(const io::Path& directory);

} // namespace kuzure::study
