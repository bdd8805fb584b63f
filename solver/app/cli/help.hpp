#pragma once
// Pages of help that fit a screen.
#include <initializer_list>

namespace CLI {
class App;
}

namespace kuzure {

/// Help of at most 100 columns for the program and every command that is added after this.
void fit_help_to_screen(CLI::App&);

/// Puts options of a command under a heading of its help. Throws CLI::OptionNotFound where there is no such option.
void under_heading(CLI::App& command, const char* heading, std::initializer_list<const char*> options);

} // namespace kuzure
