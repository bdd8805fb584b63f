#pragma once
// The command line as it was given: parsed, with words for what is wrong, and the same on all ranks.
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

} // namespace kuzure
