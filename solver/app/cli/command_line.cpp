#include "solver/app/cli/command_line.hpp"
#include "decomposition/comm.hpp"
#include "io/file.hpp"
#include "io/keys.hpp"
#include "solver/app/cli/options.hpp"
#include "solver/core/ensure.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sstream>

namespace kuzure {

namespace {

/// The options of a command as they are written, those that the help leaves out too.
std::vector<std::string> option_names(const CLI::App& command)
{
    std::vector<std::string> all;
    for (const CLI::Option* o : command.get_options()) {
        for (const auto& n : o->get_lnames()) all.push_back("--" + n);
        for (const auto& n : o->get_snames()) all.push_back("-" + n);
    }
    return all;
}

std::string unknown_option(const CLI::App& app, const CLI::App& command, const std::string& word)
{
    const std::string name = word.substr(0, word.find('=')), of = command.get_name();
    std::string text = fmt::format("{}: expected an option of kuzure {}, found none of this name", name, of);
    if (const auto meant = io::nearest(name, option_names(command)); !meant.empty()) return text + fmt::format("; did you mean {}?", meant);
    for (const CLI::App* other : app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); })) {
        const auto has = option_names(*other);
        if (std::find(has.begin(), has.end(), name) != has.end()) return text + fmt::format("; kuzure {} has it", other->get_name());
    }
    return text;
}

std::string unknown_command(const CLI::App& app, const std::string& word)
{
    if (word.starts_with("-")) {
        std::string text = fmt::format("{}: expected a command, found an option", word);
        for (const CLI::App* other : app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); })) {
            const auto has = option_names(*other);
            if (std::find(has.begin(), has.end(), word.substr(0, word.find('='))) != has.end())
                return text + fmt::format("; it goes behind one: kuzure {} ... {}", other->get_name(), word);
        }
        return text;
    }
    std::vector<std::string> all;
    for (const Command& c : commands_of(app)) all.push_back(c.name);
    if (word.ends_with(".toml")) return fmt::format("{0}: expected a command, found a file; kuzure run {0}, or kuzure check {0}", word);
    return fmt::format("{}: expected a command, found none of this name{} Commands: {}", word, io::did_you_mean(word, all),
                       fmt::join(all, ", "));
}

/// What a command was given, one word an option, the same whatever their order. Threads may differ between ranks.
std::vector<std::string> words_of(const CLI::App& command)
{
    std::vector<std::string> all{command.get_name()};
    for (const CLI::Option* o : command.get_options()) {
        if (o->count() == 0 || o->check_lname("threads")) continue;
        for (const auto& value : o->results()) all.push_back(o->get_positional() ? value : fmt::format("{} {}", o->get_name(), value));
    }
    return all;
}

/// These share their work among the ranks of mpirun; the others are done by one of them.
bool works_on_ranks(const CLI::App& command) { return command.get_name() == "run" || command.get_name() == "picture"; }

} // namespace

CommandLine parse(CLI::App& app, int argc, char** argv)
{
    CommandLine given;
    std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
    if (words.empty()) {
        given.helpless = true, given.wrong = "expected a command, found none", given.text = app.help();
        return given;
    }
    if (words[0] == "help") { // kuzure help run
        words.erase(words.begin());
        words.push_back("--help");
    }
    const auto command = [&]() -> const CLI::App* {
        const auto chosen = app.get_subcommands();
        return chosen.empty() ? nullptr : chosen[0];
    };
    try {
        std::vector<std::string> backwards(words.rbegin(), words.rend()); // as CLI11 takes them
        app.parse(backwards);
    } catch (const CLI::ParseError& e) {
        std::ostringstream out, ignored;
        if (e.get_exit_code() == 0) {
            app.exit(e, out, ignored);
            given.shown = true, given.text = out.str(), given.words = words;
            return given;
        }
        given.wrong = e.what();
        given.on_ranks = !command() || works_on_ranks(*command()); // another rank's may be right: it must be told
        if (const CLI::App* c = command()) {
            given.command = c->get_name();
            // An unknown option is said before what it may stand for and is missing.
            for (const auto& word : c->remaining())
                if (word.starts_with("-") && word.size() > 1) {
                    given.wrong = unknown_option(app, *c, word);
                    break;
                }
            given.wrong += fmt::format("\nsee kuzure {} --help", c->get_name());
        } else {
            given.wrong = unknown_command(app, words[0]) + "\nsee kuzure --help";
        }
        return given;
    }
    const CLI::App* c = command();
    given.command = c->get_name(), given.words = words_of(*c);
    const CLI::Option* dry = c->get_option_no_throw("--dry-run");
    given.on_ranks = works_on_ranks(*c) && !(dry && dry->count() > 0);
    return given;
}

void agree_on(const Comm& comm, const CommandLine& mine)
{
    // One text each: "!" and what is wrong, or the words with their ends.
    std::string text = mine.wrong.empty() ? "" : "!" + mine.wrong;
    if (mine.wrong.empty())
        for (const auto& word : mine.words) text += word + '\0';
    const auto all = comm.gather(std::as_bytes(std::span(text.data(), text.size())));
    io::on_root(comm, [&] {
        const auto text_of = [&](std::size_t r) { return std::string(reinterpret_cast<const char*>(all[r].data()), all[r].size()); };
        const auto words_in = [](const std::string& s) {
            std::vector<std::string> out;
            for (std::size_t at = 0; at < s.size(); at = s.find('\0', at) + 1) out.push_back(s.substr(at, s.find('\0', at) - at));
            return out;
        };
        const std::string first = text_of(0);
        if (first.starts_with("!")) throw BadInput(first.substr(1));
        for (std::size_t r = 1; r < all.size(); ++r) {
            const std::string its = text_of(r);
            if (its.starts_with("!")) throw BadInput(fmt::format("rank {}: {}", r, its.substr(1)));
            if (its == first) continue;
            const auto a = words_in(first), b = words_in(its);
            const auto only = [](const auto& x, const auto& y) {
                std::vector<std::string> out;
                for (const auto& word : x)
                    if (std::count(x.begin(), x.end(), word) != std::count(y.begin(), y.end(), word)) out.push_back(word);
                return out.empty() ? std::string("the same in another order") : fmt::format("{}", fmt::join(out, " "));
            };
            throw BadInput(fmt::format("rank {} was given another command line than rank 0: {} there, {} here. Expected the same on all "
                                       "ranks, --threads apart. Remedy: one program and one set of arguments for mpirun",
                                       r, only(b, a), only(a, b)));
        }
    });
}

} // namespace kuzure
