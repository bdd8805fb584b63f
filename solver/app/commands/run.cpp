// kuzure run: its options.
#include "io/keys.hpp"
#include "solver/app/cli/help.hpp"
#include "solver/app/run/run_loop.hpp"
#include <CLI/CLI.hpp>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure {

void add_run(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("run", "simulate a scene");
    auto a = std::make_shared<RunArguments>();
    a->scene.add_to(*command);
    command->add_option("-o,--output", a->output, "result directory (default: [output] directory, or results/<scene>)")
        ->type_name("DIR")
        ->check([](const std::string& name) { return name.empty() ? "expected a directory, found \"\"" : ""; }, "");
    auto restart = std::make_shared<std::string>();
    auto* restarts =
        command->add_flag("--restart{newest}", *restart, "go on from the newest good checkpoint of the directory, or from FILE");
    command->add_option("--threads", a->threads, "threads of each rank (default: the node's cores shared by its ranks)")
        ->check(CLI::Range(1, 4096));
    command->add_option("--max-minutes", a->max_minutes, "stop with a checkpoint and exit code 5 after so many minutes")
        ->check(
            [](const std::string& text) {
                double minutes = 0;
                return CLI::detail::lexical_cast(text, minutes) && minutes > 0 && std::isfinite(minutes)
                           ? ""
                           : fmt::format("expected minutes above 0, such as 90 or 0.5, found \"{}\"", text);
            },
            "");
    command->add_flag("-n,--dry-run", a->check_only, "say what kuzure check says, and run nothing");
    command->add_option("--progress", a->progress, "auto (a bar on a terminal of its own, lines elsewhere), bar, plain or none")
        ->type_name("HOW")
        ->transform(CLI::Validator(
            [](std::string& how) {
                const auto& names = progress_names();
                const auto found = std::find(names.begin(), names.end(), how);
                if (found == names.end())
                    return fmt::format("expected {}, found \"{}\"{}", fmt::join(names, ", "), how, io::did_you_mean(how, names));
                how = std::to_string(found - names.begin());
                return std::string();
            },
            ""));
    command->add_flag("-q,--quiet", a->quiet, "print nothing but errors, warnings, and where a stopped run left its checkpoint");
    command->add_flag("--force", a->force, "move an existing result directory aside");
    command->add_flag("--force-size", a->force_size, "start although memory or disk will not be enough by kuzure's estimate");
    command->add_flag("--twins", a->twins, "first the same at 2 and 4 times the spacing: error bars on run-out, height and peak speed");
    command->add_flag("--plain", a->plain, "scalar arithmetic instead of lanes: the slow reference")->group("");
    command->add_option("--recut-every", a->recut_every, "cut the domain anew at every so many list rebuilds")->group("");
    under_heading(*command, "Scene", {"--set", "--force-step", "--dry-run"});
    under_heading(*command, "Results", {"--output", "--force", "--quiet", "--progress"});
    under_heading(*command, "How accurate", {"--twins"});
    under_heading(*command, "Start and stop", {"--restart", "--max-minutes"});
    under_heading(*command, "Machine", {"--threads", "--force-size"});
    command->callback([=, &chosen] {
        if (restarts->count() > 0) a->restart = *restart == "newest" ? "" : *restart;
        chosen = [=](const Comm& comm) { return a->check_only ? print_estimate(comm, a->scene) : run_scene(comm, *a); };
    });
}

} // namespace kuzure
