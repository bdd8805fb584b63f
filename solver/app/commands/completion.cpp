// kuzure completion: scripts for shells, and the manual page. Not in the help: cmake --install calls it.
#include "solver/app/cli/completion.hpp"
#include "solver/app/cli/command.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace kuzure {

void add_completion(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("completion", "completion script of a shell, or the manual page")->group("");
    auto what = std::make_shared<std::string>();
    command->add_option("WHAT", *what, "bash, zsh, fish or man")->required();
    command->callback([=, &app, &chosen] {
        chosen = [=, &app](const Comm& comm) {
            const std::string text = completion(app, *what);
            if (comm.rank() == 0) fmt::print("{}", text);
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
