#include "solver/app/cli/command_line.hpp"
#include "decomposition/comm.hpp"
#include "io/file.hpp"
#include "io/keys.hpp"
#include "io/quote.hpp"
#include "solver/core/ensure.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sstream>

namespace kuzure {

namespace {

constexpr std::size_t columns = 100, left = 30;

/// The same words in lines of at most `width`.
std::string wrapped(const std::string& text, std::size_t width)
{
    std::istringstream words(text);
    std::string out, word;
    std::size_t used = 0;
    while (words >> word) {
        if (used > 0 && used + 1 + word.size() > width) out += '\n', used = 0;
        else if (used > 0) out += ' ', ++used;
        out += word, used += word.size();
    }
    return out;
}

/// What an option takes, without the checks that CLI11 writes behind it; empty for a flag.
/// Whether an option's value comes after "=" or not at all: a flag with a value of its own, "--name{value}".
bool takes_optional_value(const CLI::Option* o) { return !o->get_fnames().empty(); }

std::string value_of(const CLI::Option* o)
{
    if (takes_optional_value(o)) return "FILE";
    const std::string name = o->get_type_size() != 0 ? o->get_type_name() : "";
    return name.substr(0, name.find(':'));
}

/// CLI11's page with descriptions wrapped (CLI11 indents the right column at every line break), short names of values, and
/// one empty line where it leaves several.
class Page final : public CLI::Formatter {
public:
    Page() { column_width(left); }
    std::string make_option_desc(const CLI::Option* o) const override { return wrapped(Formatter::make_option_desc(o), columns - left); }
    std::string make_option_name(const CLI::Option* o, bool positional) const override
    {
        const std::string name = Formatter::make_option_name(o, positional);
        return takes_optional_value(o) ? fmt::format("{}[={}]", name.substr(0, name.find('{')), value_of(o)) : name;
    }
    std::string make_option_opts(const CLI::Option* o) const override
    {
        if (o->get_positional() || takes_optional_value(o)) return "";
        std::string out = value_of(o).empty() ? "" : " " + value_of(o);
        if (!o->get_default_str().empty()) out += "=" + o->get_default_str();
        return out + (o->get_required() ? " (needed)" : "");
    }
    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override
    {
        std::string page = Formatter::make_help(app, name, mode);
        for (auto at = page.find("\n\n\n"); at != page.npos; at = page.find("\n\n\n", at)) page.erase(at, 1);
        return page;
    }
    std::string make_subcommand(const CLI::App* command) const override
    {
        std::ostringstream out;
        CLI::detail::format_help(out, command->get_name(), wrapped(command->get_description(), columns - left), left);
        return out.str();
    }
};

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

Command table_of(const CLI::App& app)
{
    Command c{app.get_name(), app.get_description(), {}, {}};
    for (const CLI::Option* o : app.get_options([](const CLI::Option* o) { return !o->get_group().empty(); })) {
        Item item{{}, value_of(o), o->get_description(), o->get_group(), takes_optional_value(o)};
        for (const auto& n : o->get_lnames()) item.names.push_back("--" + n);
        for (const auto& n : o->get_snames()) item.names.push_back("-" + n);
        if (o->get_positional()) item.names = {o->get_name(true)}, item.value = item.names[0];
        (o->get_positional() ? c.arguments : c.options).push_back(item);
    }
    return c;
}

std::vector<Command> commands_of(const CLI::App& program)
{
    std::vector<Command> all;
    for (const CLI::App* c : program.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); }))
        all.push_back(table_of(*c));
    return all;
}

/// Names of the options that take a value, of all commands or flags, one text.
std::string names(const Command& c, const char* between, bool (*chosen)(const Item&))
{
    std::vector<std::string> found;
    for (const Item& o : c.options)
        if (chosen(o)) found.insert(found.end(), o.names.begin(), o.names.end());
    return fmt::format("{}", fmt::join(found, between));
}
bool any(const Item&) { return true; }
bool directory(const Item& o) { return o.value.starts_with("DIR"); }
bool free_value(const Item& o) { return !o.value.empty() && !directory(o) && o.value != "FILE" && o.value != "NAME"; }

std::string bash(const Command& program, const std::vector<Command>& commands)
{
    std::string list, cases;
    for (const Command& c : commands) {
        list += (list.empty() ? "" : " ") + c.name;
        const std::string folders = names(c, "|", directory), values = names(c, "|", free_value);
        cases += fmt::format("    {})\n        options='{}'\n", c.name, names(c, " ", any));
        cases += "        case $previous in\n";
        if (!folders.empty()) cases += fmt::format("        {}) want=directory ;;\n", folders);
        if (!values.empty()) cases += fmt::format("        {}) want=nothing ;;\n", values);
        cases += fmt::format("        *) want={} ;;\n        esac\n        ;;\n", c.arguments.empty()         ? "nothing"
                                                                                  : directory(c.arguments[0]) ? "directory"
                                                                                                              : "file");
    }
    return fmt::format(R"(# bash completion of kuzure, from its own table of options: kuzure completion bash
_kuzure() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} command='' word options want
    for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        [[ $word == -* ]] || {{ command=$word; break; }}
    done
    case $command in
    '')
        COMPREPLY=($(compgen -W '{} {}' -- "$current"))
        return
        ;;
{}    *) return ;;
    esac
    if [[ $current == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$current"))
    elif [ "$want" = directory ]; then
        compopt -o filenames
        mapfile -t COMPREPLY < <(compgen -d -- "$current")
    elif [ "$want" = file ]; then
        compopt -o filenames
        mapfile -t COMPREPLY < <(compgen -f -- "$current")
    fi
}}
complete -F _kuzure kuzure
)",
                       list, names(program, " ", any), cases);
}

/// Inside single quotes of the completion languages, whose way to write the quote itself is `quote`.
std::string quoted(std::string s, const char* quote)
{
    for (auto at = s.find('\''); at != s.npos; at = s.find('\'', at + std::string_view(quote).size())) s.replace(at, 1, quote);
    return s;
}

std::string zsh(const Command& program, const std::vector<Command>& commands)
{
    const auto text = [](std::string s) {
        std::string out;
        for (const char c : quoted(std::move(s), "'\\''"))
            out += c == '[' || c == ']' || c == ':' ? fmt::format("\\{}", c) : std::string(1, c);
        return out;
    };
    const auto takes = [](const Item& o) { return directory(o) ? "_files -/" : free_value(o) ? "" : "_files"; };
    const auto specs = [&](const Command& c) {
        std::string out;
        for (const Item& o : c.options)
            for (const auto& n : o.names) {
                out += fmt::format(" \\\n            '*{}{}[{}]", n, o.optional_value ? "=-" : "", text(o.doc));
                if (!o.value.empty()) out += fmt::format("{}{}:{}", o.optional_value ? "::" : ":", text(o.value), takes(o));
                out += '\'';
            }
        for (const Item& a : c.arguments) out += fmt::format(" \\\n            ':{}:{}'", text(a.name()), takes(a));
        return out;
    };
    std::string list, cases;
    for (const Command& c : commands) {
        list += fmt::format("        '{}:{}'\n", c.name, text(c.doc));
        cases += fmt::format("    {})\n        _arguments{}\n        ;;\n", c.name, specs(c));
    }
    return fmt::format(R"(#compdef kuzure
# zsh completion of kuzure, from its own table of options: kuzure completion zsh
_kuzure() {{
    local -a commands
    commands=(
{}    )
    if (( CURRENT == 2 )); then
        _describe command commands
        _arguments{}
        return
    fi
    local command=$words[2]
    shift words
    (( CURRENT-- ))
    case $command in
{}    esac
}}
_kuzure "$@"
)",
                       list, specs(program), cases);
}

std::string fish(const Command& program, const std::vector<Command>& commands)
{
    const auto text = [](const std::string& s) { return quoted(s, "\\'"); };
    std::string out = "# fish completion of kuzure, from its own table of options: kuzure completion fish\ncomplete -c kuzure -f\n";
    const auto options = [&](const Command& c, const std::string& when) {
        for (const Item& o : c.options) {
            out += fmt::format("complete -c kuzure -n '{}'", when);
            for (const auto& n : o.names) out += n.starts_with("--") ? " -l " + n.substr(2) : " -s " + n.substr(1);
            if (directory(o)) out += " -x -a '(__fish_complete_directories)'";
            else if (free_value(o)) out += " -x";
            else if (!o.value.empty()) out += o.optional_value ? " -F" : " -r -F";
            out += fmt::format(" -d '{}'\n", text(o.doc));
        }
    };
    options(program, "__fish_use_subcommand");
    for (const Command& c : commands) {
        const std::string when = "__fish_seen_subcommand_from " + c.name;
        out += fmt::format("complete -c kuzure -n '__fish_use_subcommand' -a {} -d '{}'\n", c.name, text(c.doc));
        if (!c.arguments.empty())
            out += fmt::format("complete -c kuzure -n '{}' {}\n", when,
                               directory(c.arguments[0]) ? "-x -a '(__fish_complete_directories)'" : "-F");
        options(c, when);
    }
    return out;
}

std::string manual(const Command& program, const std::vector<Command>& commands)
{
    const auto text = [](const std::string& s) {
        std::string out;
        for (const char c : s) out += c == '\\' ? "\\e" : c == '-' ? "\\-" : c == '\'' ? "\\(aq" : std::string(1, c);
        return out.starts_with('.') ? "\\&" + out : out;
    };
    std::string out = fmt::format(".TH KUZURE 1\n.SH NAME\nkuzure \\- {}\n.SH SYNOPSIS\n",
                                  text(program.doc.substr(program.doc.rfind(": ") == program.doc.npos ? 0 : program.doc.rfind(": ") + 2)));
    for (const Command& c : commands) {
        out += fmt::format(".B kuzure {}\n", c.name);
        for (const Item& a : c.arguments) out += fmt::format(".I {}\n", text(a.name()));
        out += "[options]\n.br\n";
    }
    out += ".B mpirun \\-n\n.I RANKS\n.B kuzure run\n.I SCENE.toml\n";
    for (const Command& c : commands) {
        out += fmt::format(".SH \"kuzure {}\"\n{}.\n", c.name, text(c.doc));
        for (const auto* items : {&c.arguments, &c.options})
            for (const Item& o : *items) {
                out += ".TP\n.B " + text(fmt::format("{}", fmt::join(o.names, ", ")));
                if (items == &c.options && !o.value.empty())
                    out += (o.optional_value ? "\\fR[=\\fI" + text(o.value) + "\\fR]" : " \\fI" + text(o.value));
                out += "\n" + text(o.doc) + "\n";
            }
    }
    out += R"(.SH "EXIT STATUS"
.TP
.B 0
done
.TP
.B 2
the command line or the scene is wrong; nothing was written
.TP
.B 3
the numbers failed: the message names what, where, when and the remedy
.TP
.B 4
input or output failed; the last good checkpoint is named
.TP
.B 5
stopped on request, with a checkpoint
.SH ENVIRONMENT
.TP
.B OMP_NUM_THREADS
threads of each rank, where \-\-threads is not given
.TP
.B KUZURE_MPI
1: a launcher started this process as one of several ranks, whether or not it is recognised; 0: none did
.TP
.B KUZURE_ISA
of an installed package: x86\-64, x86\-64\-v3 or x86\-64\-v4 in place of the best this processor has
.SH "SEE ALSO"
.BR mpirun (1),
the tutorial and the scene reference in the package's documents
)";
    return out;
}

} // namespace

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

void fit_help_to_screen(CLI::App& app) { app.formatter(std::make_shared<Page>()); }

void under_heading(CLI::App& command, const char* heading, std::initializer_list<const char*> options)
{
    for (const char* name : options) command.get_option(name)->group(heading);
}

std::string completion(const CLI::App& app, const std::string& what)
{
    const Command program = table_of(app);
    const auto commands = commands_of(app);
    if (what == "bash") return bash(program, commands);
    if (what == "zsh") return zsh(program, commands);
    if (what == "fish") return fish(program, commands);
    if (what == "man") return manual(program, commands);
    throw BadInput(fmt::format("completion {}: expected bash, zsh, fish or man", what));
}

} // namespace kuzure
