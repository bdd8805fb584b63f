// kuzure scale: the real cut of the real scene for any number of ranks, counted on one machine, and what a step of it
// should take on a machine of jobs/machines. Runs nothing.
#include "io/checkpoint.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/scaling/drift.hpp"
#include "solver/app/scaling/predict.hpp"
#include "solver/run/simulation.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

namespace kuzure {

namespace {

struct Arguments {
    SceneArguments scene;
    std::vector<int> ranks;
    std::string machine = "here", from;
    int ranks_per_node = 0, threads = 0, recuts = 0;
    bool json = false, per_rank = false, hilbert = false;
};

/// What is said of one number of ranks.
struct Case {
    int ranks, nodes;
    double cores; // of all ranks together
    CutShare cut;
    StepSeconds step, slow_messages, thin_wires;
    double efficiency = 1, memory = 0; // bytes of the fullest rank
};

/// The soil of a checkpoint, wrapped into the periods, and its ways there from the start, m.
struct State {
    std::vector<Vector> x, way;
};
/// Throws BadInput for another scene's.
State state_of(const Comm& comm, const Scene& s, const io::Path& from)
{
    const bool directory = std::filesystem::is_directory(from);
    const auto found = directory ? io::newest_good(comm, from, complain) : io::verify_checkpoint(comm, from);
    if (!found)
        throw BadInput(fmt::format("--from {}: expected a checkpoint or a result directory that holds one, found none", from.string()));
    require_same_scene(comm, *found, s);
    Particles p;
    io::read_checkpoint(comm, *found, p);
    std::vector<Vector> x(std::size_t(p.size())), way(x.size());
    const Vector low = s.space.low.value_or(Vector{}), length = period(s);
    const auto wrapped = [&](int axis, double v, double lo, double all) {
        return s.space.periodic[axis] ? std::min(std::max(v - std::floor((v - lo) / all) * all, lo), lo + all) : v;
    };
    for (Index i = 0; i < p.size(); ++i) {
        const Vector v = std::as_const(p)[field::position][i];
        x[i] = {wrapped(0, v.x, low.x, length.x), wrapped(1, v.y, low.y, length.y), wrapped(2, v.z, low.z, length.z)};
        way[i] = v - std::as_const(p)[field::origin][i];
    }
    return {std::move(x), std::move(way)};
}

nlohmann::ordered_json to_json(const StepSeconds& s)
{
    return {{"pairs", s.pairs},         {"particles", s.particles}, {"imbalance", s.imbalance}, {"halo", s.halo},
            {"reduction", s.reduction}, {"rebuild", s.rebuild},     {"recut", s.recut}};
}

nlohmann::ordered_json to_json(const std::vector<DriftCut>& cuts)
{
    auto all = nlohmann::ordered_json::array();
    for (const auto& c : cuts)
        all.push_back({{"before", c.even.before},
                       {"after", c.even.after},
                       {"halo", c.even.halo},
                       {"blocks", c.even.blocks},
                       {"moved_blocks", c.even.moved},
                       {"moved_particles", c.moved_particles},
                       {"sweeps", c.even.sweeps},
                       {"rounds", c.even.rounds},
                       {"busy_seconds", c.even.busy},
                       {"cut_bytes", c.cut_bytes},
                       {"scattered", c.scattered},
                       {"peers_mean", c.peers_mean},
                       {"peers_most", c.peers_most},
                       {"known_most", c.known_most},
                       {"whole",
                        {{"balance", c.whole_balance},
                         {"cut_bytes", c.whole_bytes},
                         {"scattered", c.whole_scattered},
                         {"seconds", c.whole_seconds}}}});
    return all;
}

template <class Of> std::int64_t most(const CutShare& c, Of of)
{
    std::int64_t m = 0;
    for (const auto& r : c.rank) m = std::max(m, std::int64_t(of(r)));
    return m;
}

nlohmann::ordered_json to_json(const Case& c, double row_bytes, bool per_rank)
{
    std::int64_t rows = 0, messages = 0;
    for (const auto& r : c.cut.rank) rows += r.rows, messages += r.messages;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    nlohmann::ordered_json j{
        {"ranks", c.ranks},
        {"nodes", c.nodes},
        {"cores", std::int64_t(c.cores)},
        {"blocks", c.cut.blocks},
        {"pair_balance", c.cut.pair_balance()},
        {"work_balance", c.cut.balance()},
        {"scattered_ranks", c.cut.scattered},
        {"ghost_share", c.cut.ghost_share()},
        {"halo_bytes_per_step", std::int64_t(double(rows) * row_bytes)},
        {"messages_per_step", messages},
        {"largest_rank",
         {{"soil", most(c.cut, [](const RankShare& r) { return r.work.particles; })},
          {"ghosts", most(c.cut, [](const RankShare& r) { return r.ghosts; })},
          {"halo_bytes_per_step", std::int64_t(row_bytes) * most(c.cut, [](const RankShare& r) { return r.rows; })},
          {"messages_per_step", most(c.cut, [](const RankShare& r) { return r.messages; })},
          {"memory_bytes", std::int64_t(c.memory)}}},
        {"predicted_seconds_per_step", c.step.total()},
        {"predicted_efficiency", c.efficiency},
        {"predicted_step", to_json(c.step)},
        {"predicted_network_seconds", c.step.network},
        {"predicted_steps_between_cuts", c.step.recut_steps},
        {"predicted_seconds_per_step_if", {{"latency_doubled", c.slow_messages.total()}, {"bandwidth_halved", c.thin_wires.total()}}},
        {"count_seconds", c.cut.weigh_seconds},
        {"cut_seconds", c.cut.cut_seconds},
        {"peak_memory_bytes_here", 1024 * std::int64_t(usage.ru_maxrss)}};
    if (per_rank)
        for (const auto& r : c.cut.rank)
            j["per_rank"].push_back({{"soil", r.work.particles},
                                     {"soil_pairs", r.work.soil_pairs},
                                     {"wall_pairs", r.work.wall_pairs},
                                     {"ghosts", r.ghosts},
                                     {"halo_bytes", r.rows * std::int64_t(row_bytes)},
                                     {"messages", r.messages}});
    return j;
}

void print(const std::vector<Case>& cases, const Scene& s, const StepPlace& at, std::int64_t soil, const std::string& state)
{
    fmt::print("{}\n{} soil particles, {}; {}, {}\n\n", s.title, soil, state, at.machine.title,
               at.mixed ? "mixed precision" : "double precision");
    fmt::print("{:>7}{:>7}{:>8}{:>10}{:>11}{:>9}{:>9}{:>10}{:>11}{:>9}{:>10}{:>10}{:>8}\n", "ranks", "nodes", "cores", "blocks", "soil",
               "pairs", "ghosts", "messages", "halo", "memory", "step", "effici-", "cut");
    fmt::print("{:>7}{:>7}{:>8}{:>10}{:>11}{:>9}{:>9}{:>10}{:>11}{:>9}{:>10}{:>10}{:>8}\n", "", "", "", "", "most", "max/mean", "per soil",
               "most", "kB, most", "MB, most", "ms", "ency", "s");
    for (const Case& c : cases) {
        fmt::print("{:>7}{:>7}{:>8.0f}{:>10}{:>11}{:>9.3f}{:>9.3f}{:>10}{:>11.1f}{:>9.0f}{:>10.3f}{:>10.3f}{:>8.2f}\n", c.ranks, c.nodes,
                   c.cores, c.cut.blocks, most(c.cut, [](const RankShare& r) { return r.work.particles; }), c.cut.pair_balance(),
                   c.cut.ghost_share(), most(c.cut, [](const RankShare& r) { return r.messages; }),
                   1e-3 * at.row_bytes * double(most(c.cut, [](const RankShare& r) { return r.rows; })), 1e-6 * c.memory,
                   1e3 * c.step.total(), c.efficiency, c.cut.cut_seconds);
    }
    fmt::print("\npredicted step, ms\n{:>7}{:>10}{:>10}{:>11}{:>9}{:>11}{:>9}{:>9}{:>16}{:>16}\n", "ranks", "pairs", "particles",
               "imbalance", "halo", "reduction", "rebuild", "re-cut", "latency x 2", "bandwidth / 2");
    for (const Case& c : cases)
        fmt::print("{:>7}{:>10.3f}{:>10.3f}{:>11.3f}{:>9.3f}{:>11.3f}{:>9.3f}{:>9.3f}{:>16.3f}{:>16.3f}\n", c.ranks, 1e3 * c.step.pairs,
                   1e3 * c.step.particles, 1e3 * c.step.imbalance, 1e3 * c.step.halo, 1e3 * c.step.reduction, 1e3 * c.step.rebuild,
                   1e3 * c.step.recut, 1e3 * c.slow_messages.total(), 1e3 * c.thin_wires.total());
    for (const Case& c : cases)
        if (c.cut.scattered > 0) fmt::print("\n{} ranks: {} of them have soil in several pieces\n", c.ranks, c.cut.scattered);
    fmt::print("\nThe counts are those of a run's first step; times are by the model of docs/performance.md.\n");
}

Exit scale(const Comm& comm, const Arguments& a)
{
    if (comm.size() > 1) throw BadInput("kuzure scale counts for any number of ranks on one: expected a start without mpirun");
    use_threads(comm, 0);
    const auto [s, doubts, filling] = a.scene.read(comm);
    io::MachineProfile machine = machine_named(a.machine);
    const auto model = choose_model(s, Arithmetic::Simd);
    const double bytes = double(row_bytes(*model)), reach = list_reach(s);
    const Estimate e = estimate(s, filling, *model);
    const auto state = a.from.empty() ? State() : state_of(comm, s, a.from);

    auto ranks = a.ranks;
    std::ranges::sort(ranks);
    if (a.recuts > 0) {
        if (a.from.empty()) throw BadInput("--recuts moves the soil from its start to a later state: expected --from DIR");
        auto all = nlohmann::ordered_json::array();
        for (const int n : ranks)
            all.push_back(
                {{"ranks", n},
                 {"cuts", to_json(drift(s, filling, block_space(s, filling, n), n, state.x, state.way, a.recuts, reach, bytes))}});
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
        const BlockSpace space = block_space(s, filling, n);
        const auto method = a.hilbert ? Method::Hilbert : Method::Metis;
        Case c{n,
               nodes,
               double(machine.node.cores) / per_node * n,
               a.from.empty() ? share_out(StartSoil(s, filling, space), n, reach, bytes, method)
                              : share_out(StateSoil(s, filling, space, state.x), n, reach, bytes, method),
               {},
               {},
               {}};
        const auto load = loads(c.cut, per_node);
        StepPlace at{machine, n, per_node, bytes, double(c.cut.blocks), e.mixed};
        c.step = predict_step(load, at);
        at.latency_times = 2, c.slow_messages = predict_step(load, at);
        at.latency_times = 1, at.bandwidth_times = 0.5, c.thin_wires = predict_step(load, at);
        for (const auto& r : c.cut.rank)
            c.memory = std::max(c.memory, e.memory / double(e.soil) * double(r.work.particles) + (2 * bytes + 32) * double(r.ghosts));
        c.memory += bytes_per_process;
        cases.push_back(std::move(c));
    }
    for (Case& c : cases) c.efficiency = cases.front().step.total() * cases.front().cores / (c.step.total() * c.cores);
    if (a.json) {
        auto all = nlohmann::ordered_json::array();
        for (const Case& c : cases) all.push_back(to_json(c, bytes, a.per_rank));
        fmt::print("{}\n", all.dump(2));
    } else {
        print(cases, s, {machine, 1, 1, bytes, 0, e.mixed}, e.soil, a.from.empty() ? "at the start" : "from " + a.from);
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
