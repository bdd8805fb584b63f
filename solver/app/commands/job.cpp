// kuzure job: a batch script for a machine of jobs/machines, to standard output.
#include "solver/app/cli/help.hpp"
#include "solver/app/scaling/job_script.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace kuzure {

void add_job(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("job", "a batch script for a machine, to standard output");
    auto a = std::make_shared<JobArguments>();
    a->scene.add_to(*command);
    command->add_option("--machine", a->machine, "a profile of jobs/machines, or the path of one")->required()->type_name("NAME");
    command->add_option("-n,--nodes", a->nodes, "nodes of a job")->required()->check(CLI::Range(1, 10000000));
    command->add_option("--mode", a->mode, "how the nodes' memory is set up, such as flat or cache")->type_name("NAME");
    command->add_option("--queue", a->queue, "queue (default: the profile's first that fits)")->type_name("NAME");
    command->add_option("--account", a->account, "project that pays")->type_name("NAME");
    command->add_option("--minutes", a->minutes, "clock limit of a job (default: from the predicted time)")->check(CLI::Range(1.0, 1e6));
    command->add_option("--ranks-per-node", a->ranks_per_node, "ranks on each node (default: the profile's)")->check(CLI::Range(1, 4096));
    command
        ->add_option("--members", a->members,
                     "a hazard: its runs as the tasks of a job array, each on so many nodes, and a job that makes the answer of them")
        ->check(CLI::Range(1, 10000));
    command
        ->add_option("--layers", a->layers,
                     "of a hazard: layers of its preliminary run, members and finer run (default: 4, the scene's own)")
        ->type_name("N[,N[,N]]");
    command->add_option("-o,--output", a->output, "result directory (default: as kuzure run, kuzure hazard)")->type_name("DIR");
    under_heading(*command, "What the job asks for",
                  {"--machine", "--nodes", "--ranks-per-node", "--queue", "--mode", "--account", "--minutes"});
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            const JobPlan p = plan_job(comm, *a);
            if (comm.rank() != 0) return Exit::Ok;
            if (p.machine.needs_account && a->account.empty())
                complain(fmt::format("jobs on {} need a project: write yours instead of PROJECT, or give --account", p.machine.name));
            fmt::print("{}", job_script(p, *a));
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
