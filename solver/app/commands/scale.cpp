// kuzure scale: the real cut of the real scene for any number of ranks, counted on one machine, and what a step of it
// should take on a machine of jobs/machines. Runs nothing.
#include "solver/app/cli/command.hpp"
#include "solver/app/scaling/cases.hpp"
#include "solver/core/ensure.hpp"
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {

namespace {

struct Arguments {
    SceneArguments scene;
    std::vector<int> ranks;
    std::string machine = "here", from;
    int ranks_per_node = 0, threads = 0, recuts = 0;
    bool json = false, per_rank = false, hilbert = false;
};

Exit scale(const Comm& comm, const Arguments& a)
{
    if (comm.size() > 1) throw BadInput("kuzure scale counts for any number of ranks on one: expected a start without mpirun");
    use_threads(comm, 0);
    const auto [s, scene_warnings, filling] = a.scene.read(comm);
    io::MachineProfile machine = machine_named(a.machine);
    const auto model = choose_model(s, Arithmetic::Simd);
    const double bytes = double(ghost_bytes(*model)), reach = list_reach(s);
    const Estimate e = estimate(s, filling, *model);
    const auto state = a.from.empty() ? State() : state_of(comm, s, a.from);

    auto ranks = a.ranks;
    std::ranges::sort(ranks);
    if (a.recuts > 0) {
        if (a.from.empty()) throw BadInput("--recuts moves the soil from its start to a later state: expected --from DIR");
        auto all = nlohmann::ordered_json::array();
        for (const int n : ranks)
            all.push_back({{"ranks", n},
                           {"cuts", to_json(replay_repartition(s, filling, block_space(s, filling, n), n, state.x, state.way, a.recuts,
                                                               reach, bytes))}});
        fmt::print("{}\n", all.dump(2));
        return Exit::Ok;
    }
    std::vector<Case> cases;
    for (const int n : ranks) {
        // A machine of one node holds all ranks.
        const int per_node = a.ranks_per_node > 0 ? a.ranks_per_node : machine.node.count > 1 ? machine.node.ranks : n;
        if (a.threads > 0) machine.node.cores = a.threads * per_node;
        const int nodes = (n + per_node - 1) / per_node;
        if (nodes > machine.node.count)
            throw BadInput(fmt::format("--ranks {}: {} has {} nodes, and {} ranks a node need {}. Remedy: fewer ranks, or --ranks-per-node",
                                       n, machine.name, machine.node.count, per_node, nodes));
        cases.push_back(count_case(
            s, filling, e,
            {.machine = machine, .ranks = n, .ranks_per_node = per_node, .ghost_bytes = bytes, .mixed = e.mixed, .scheme = e.scheme},
            state.x, a.hilbert ? Method::Hilbert : Method::Metis));
    }
    for (Case& c : cases) c.efficiency = cases.front().step.total() * cases.front().cores / (c.step.total() * c.cores);
    if (a.json) {
        auto all = nlohmann::ordered_json::array();
        for (const Case& c : cases) all.push_back(to_json(c, bytes, a.per_rank));
        fmt::print("{}\n", all.dump(2));
    } else {
        fmt::print("{}", to_text(cases, s, {.machine = machine, .ghost_bytes = bytes, .mixed = e.mixed, .scheme = e.scheme}, e.soil,
                                 a.from.empty() ? "at the start" : "from " + a.from));
    }
    return Exit::Ok;
}

} // namespace

void add_scale(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("scale", "the real cut of the scene for any number of ranks, on one machine; runs nothing");
    auto a = std::make_shared<Arguments>();
    a->scene.add_to(*command);
    command->add_option("--ranks", a->ranks, "numbers of ranks")
        ->required()
        ->delimiter(',')
        ->check(CLI::Range(1, 1 << 20))
        ->type_name("N[,N...]");
    command->add_option("--machine", a->machine, "a profile of jobs/machines or its path, for the predicted times")
        ->type_name("NAME")
        ->capture_default_str();
    command->add_option("--ranks-per-node", a->ranks_per_node, "default: the profile's; all where the machine has one node")
        ->check(CLI::Range(1, 4096));
    command->add_option("--threads", a->threads, "cores of each rank (default: the node's cores shared by its ranks)")
        ->check(CLI::Range(1, 4096));
    command->add_option("--from", a->from, "a later state: a checkpoint, or a result directory's newest")->type_name("DIR|FILE");
    command
        ->add_option("--recuts", a->recuts, "move the soil from its start to --from in so many steps, each with a cut between neighbours")
        ->check(CLI::Range(1, 100000));
    command->add_flag("--json", a->json, "as JSON");
    command->add_flag("--per-rank", a->per_rank, "every rank's numbers in the JSON");
    command->add_flag("--hilbert", a->hilbert, "cut along the Hilbert curve, as where METIS fails");
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return scale(comm, *a); }; });
}

} // namespace kuzure
