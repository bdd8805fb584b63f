// kuzure safety: the factor of safety by strength reduction.
#include "solver/app/cli/help.hpp"
#include "solver/app/safety/runner.hpp"
#include <CLI/CLI.hpp>

namespace kuzure {

void add_safety(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("safety", "the factor of safety of a slope by strength reduction (resumes)");
    auto a = std::make_shared<safety::Arguments>();
    a->scene.add_to(*command);
    command->add_option("--from", a->from, "least factor that is tried; the soil settles with its strength over it (default: 0.5)")
        ->type_name("F");
    command->add_option("--to", a->to, "largest factor that is tried (default: 4)")->type_name("F");
    command->add_option("--bracket", a->bracket, "how far the factors that hold and that fail may lie apart (default: 0.02)")
        ->type_name("F");
    command->add_option("--at", a->at, "of the state at this time (s) of the scene's own run, such as a stage of it (default: its start)")
        ->type_name("T");
    command->add_option("-o,--output", a->output, "directory of the answer; one that was begun goes on (default: results/<scene>-safety)")
        ->type_name("DIR");
    command->add_option("--jobs", a->jobs, "trials at a time (default: one a core)")->check(CLI::Range(1, 1024));
    under_heading(*command, "Scene", {"--set", "--force-step", "--at"});
    under_heading(*command, "Which factors", {"--from", "--to", "--bracket"});
    under_heading(*command, "Results", {"--output"});
    under_heading(*command, "Machine", {"--jobs"});
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return safety::run_safety(comm, *a); }; });
}

} // namespace kuzure
