// kuzure study: one scene over a table of settings.
#include "solver/app/study/runner.hpp"
#include <CLI/CLI.hpp>

namespace kuzure {

void add_study(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("study", "one scene over a table of settings: error, time, figures (resumes)");
    auto a = std::make_shared<study::StudyArguments>();
    command->add_option("SWEEP.toml", a->sweep, "the sweep (docs/accuracy.md)")->required();
    command->add_option("-o,--output", a->output, "directory of the study; one that was begun goes on")->type_name("DIR")->required();
    command->add_option("--threads", a->threads, "threads of each run (default: the sweep's)")->check(CLI::Range(1, 4096));
    command->add_option("--max-minutes", a->max_minutes, "begin no run after so many minutes, and end with what there is")
        ->check(CLI::PositiveNumber);
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return study::run_study(comm, *a); }; });
}

} // namespace kuzure
