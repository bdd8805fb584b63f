#pragma once
// The program's own table of commands and options, read from CLI11's: what help, completions and messages are made of.
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace kuzure {

/// One option, or one argument without dashes.
struct Item {
    std::vector<std::string> names; // with dashes; the long ones first
    std::string value;              // what it takes; empty for a flag
    std::string doc, heading;
    bool optional_value;
    const std::string& name() const { return names.front(); }
};
struct Command {
    std::string name, doc;
    std::vector<Item> arguments, options;
};

/// A command with the options that its help shows; the program itself is one too.
Command table_of(const CLI::App&);
/// All commands that the program's help shows.
std::vector<Command> commands_of(const CLI::App& program);

/// Whether an option's value comes after "=" or not at all: a flag with a value of its own, "--name{value}".
inline bool takes_optional_value(const CLI::Option* o) { return !o->get_fnames().empty(); }
/// What an option takes, without the checks that CLI11 writes behind it; empty for a flag.
std::string value_of(const CLI::Option*);

} // namespace kuzure
