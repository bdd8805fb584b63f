#pragma once
// Completions for shells and the manual page, from the program's own table of options.
#include <string>

namespace CLI {
class App;
}

namespace kuzure {

/// The completion script of "bash", "zsh" or "fish", or for "man" the manual page (roff), of the whole program. Throws BadInput
/// for anything else.
std::string completion(const CLI::App& program, const std::string& what);

} // namespace kuzure
