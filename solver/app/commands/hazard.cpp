// kuzure hazard: an answer in time, with its uncertainty.
#include "solver/app/cli/help.hpp"
#include "solver/app/hazard/runner.hpp"
#include <CLI/CLI.hpp>

namespace kuzure {

void add_hazard(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("hazard", "the best answer by a deadline: probability maps of an ensemble, and a page (resumes)");
    auto a = std::make_shared<hazard::Arguments>();
    a->scene.add_to(*command);
    command->add_option("--within", a->within, "when the answer is needed: 30m, 90s, 2h")->type_name("TIME");
    command->add_option("-o,--output", a->output, "directory of the answer; one that was begun goes on (default: results/<scene>-hazard)")
        ->type_name("DIR");
    command->add_option("--members", a->members, "runs of the ensemble (default: [uncertain] members, or what the time allows)")
        ->check(CLI::Range(1, 10000));
    command
        ->add_option(
            "--layers", a->layers,
            "layers of particles over the mean thickness, of the preliminary run, the ensemble and a finer run; one number: of all, and "
            "no finer run (default: 4, and what the time allows)")
        ->type_name("N[,N[,N]]");
    command->add_option("--jobs", a->jobs, "runs at a time (default: one a core)")->check(CLI::Range(1, 1024));
    command->add_flag("--prepare", a->prepare,
                      "run nothing: write the scenes of all runs, and how each is run into DIR/runs.txt; with --layers (kuzure job "
                      "--members N makes a cluster's script of it)");
    command->add_option("--members-from", a->members_from, "run nothing: the answer of the runs that this hazard.json lists, once more")
        ->type_name("FILE");
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return hazard::run_hazard(comm, *a); }; });
}

} // namespace kuzure
