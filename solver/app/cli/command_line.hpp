#pragma once
// How the command line shows itself: pages of help that fit a screen, completions for shells, a manual page. All come from
// CLI11's own tables of options.
#include <initializer_list>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace kuzure {

class Comm;

/// What a command line was found to be.
struct CommandLine {
    std::string command;            // "run"; empty where none was understood
    std::string wrong;              // why it cannot be carried out, or empty
    std::string text;               // what is to be shown: help, version
    bool shown = false;             // text is all that was asked for
    bool on_ranks = false;          // works on all ranks of mpirun, where there is one
    bool helpless = false;          // nothing was asked: the help, and exit code 2
    std::vector<std::string> words; // the command with its options, each in one form; only those that every rank must share
};
/// Parses, and finds words for what is wrong: the nearest command or option. Callbacks of the commands run if nothing is.
CommandLine parse(CLI::App&, int argc, char** argv);

/// Collective. Throws BadInput on all ranks, with the lowest rank that is meant, where one of them was given a wrong command line or
/// another one than rank 0.
void agree_on(const Comm&, const CommandLine&);

/// Help of at most 100 columns for the program and every command that is added after this.
void fit_help_to_screen(CLI::App&);

/// Puts options of a command under a heading of its help. Throws CLI::OptionNotFound where there is no such option.
void under_heading(CLI::App& command, const char* heading, std::initializer_list<const char*> options);

/// The completion script of "bash", "zsh" or "fish", or for "man" the manual page (roff), of the whole program. Throws BadInput
/// for anything else.
std::string completion(const CLI::App& program, const std::string& what);

} // namespace kuzure
