#include "solver/app/cli/completion.hpp"
#include "solver/app/cli/options.hpp"
#include "solver/core/ensure.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure {

namespace {

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
