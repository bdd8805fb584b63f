#pragma once
// Other programs, started by their words alone: no shell reads what users wrote.
#include "io/file.hpp"
#include <optional>
#include <string>
#include <vector>

namespace kuzure {

/// Runs a program of the PATH with these words (the first names it) in a directory, its output into a file there or, where `log` is empty,
/// nowhere, and waits. Its exit code, -1 if a signal ended it; nothing where there is no such program. Throws IoFailed
/// where it cannot be started.
std::optional<int> run_program(std::vector<std::string> words, const io::Path& directory, const std::string& log = {});

} // namespace kuzure
