#pragma once
// How the command line shows itself: pages of help that fit a screen, completions for shells, a manual page. All come from
// CLI11's own tables of options.
#include <initializer_list>
#include <string>

namespace CLI {
class App;
}

namespace kuzure {

/// Help of at most 100 columns for the program and every command that is added after this.
void fit_help_to_screen(CLI::App&);

/// Puts options of a command under a heading of its help. Throws CLI::OptionNotFound where there is no such option.
void under_heading(CLI::App& command, const char* heading, std::initializer_list<const char*> options);

/// The completion script of "bash", "zsh" or "fish", or for "man" the manual page (roff), of the whole program. Throws BadInput
/// for anything else.
std::string completion(const CLI::App& program, const std::string& what);

} // namespace kuzure
