#include "solver/app/scaling/cases.hpp"
#include "io/checkpoint.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/run/checkpoints.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

namespace kuzure {

namespace {

nlohmann::ordered_json to_json(const StepSeconds& s)
{
    return {{"pairs", s.pairs},         {"particles", s.particles}, {"imbalance", s.imbalance}, {"halo", s.halo},
            {"reduction", s.reduction}, {"rebuild", s.rebuild},     {"recut", s.recut}};
}

template <class Of> std::int64_t most(const CutShare& c, Of of)
{
    std::int64_t m = 0;
    for (const auto& r : c.rank) m = std::max(m, std::int64_t(of(r)));
    return m;
}

} // namespace

State state_of(const Comm& comm, const Scene& s, const io::Path& from)
{
    const auto found = checkpoint_at(comm, from);
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

Case count_case(const Scene& s, const scene::Filling& filling, const Estimate& e, Deployment at, const std::vector<Vector>& x,
                Method method)
{
    const int n = at.ranks;
    const BlockSpace space = block_space(s, filling, n);
    Case c{n,
           (n + at.ranks_per_node - 1) / at.ranks_per_node,
           double(at.machine.node.cores) / at.ranks_per_node * n,
           x.empty() ? share_out(StartSoil(s, filling, space), n, list_reach(s), at.ghost_bytes, method)
                     : share_out(StateSoil(s, filling, space, x), n, list_reach(s), at.ghost_bytes, method),
           {},
           {},
           {}};
    const auto load = loads(c.cut, at.ranks_per_node);
    at.blocks = double(c.cut.blocks);
    c.step = predict_step(load, at);
    at.latency_times = 2, c.slow_messages = predict_step(load, at);
    at.latency_times = 1, at.bandwidth_times = 0.5, c.thin_wires = predict_step(load, at);
    for (const auto& r : c.cut.rank)
        c.memory = std::max(c.memory, e.memory / double(e.soil) * double(r.work.particles) + (2 * at.ghost_bytes + 32) * double(r.ghosts));
    c.memory += bytes_per_process;
    for (auto& r : c.cut.rank) r.messages *= exchanges(at.scheme); // told of a step
    return c;
}

nlohmann::ordered_json to_json(const std::vector<ReplayedCut>& cuts)
{
    auto all = nlohmann::ordered_json::array();
    for (const auto& c : cuts)
        all.push_back({{"before", c.even.before},
                       {"after", c.even.after},
                       {"halo", c.even.halo},
                       {"blocks", c.even.blocks},
                       {"moved_blocks", c.even.moved},
                       {"moved_particles", c.moved_particles},
                       {"sweeps", c.even.iterations},
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

nlohmann::ordered_json to_json(const Case& c, double ghost_bytes, bool per_rank)
{
    std::int64_t sent = 0, messages = 0;
    for (const auto& r : c.cut.rank) sent += r.sent, messages += r.messages;
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
        {"halo_bytes_per_step", std::int64_t(double(sent) * ghost_bytes)},
        {"messages_per_step", messages},
        {"largest_rank",
         {{"soil", most(c.cut, [](const RankShare& r) { return r.work.particles; })},
          {"ghosts", most(c.cut, [](const RankShare& r) { return r.ghosts; })},
          {"halo_bytes_per_step", std::int64_t(ghost_bytes) * most(c.cut, [](const RankShare& r) { return r.sent; })},
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
                                     {"halo_bytes", r.sent * std::int64_t(ghost_bytes)},
                                     {"messages", r.messages}});
    return j;
}

std::string to_text(const std::vector<Case>& cases, const Scene& s, const Deployment& at, std::int64_t soil, const std::string& state)
{
    std::string text;
    const auto add = [&]<class... T>(fmt::format_string<T...> format, T&&... values) {
        fmt::format_to(std::back_inserter(text), format, std::forward<T>(values)...);
    };
    add("{}\n{} soil particles, {}; {}, {}\n\n", s.title, soil, state, at.machine.title, at.mixed ? "mixed precision" : "double precision");
    add("{:>7}{:>7}{:>8}{:>10}{:>11}{:>9}{:>9}{:>10}{:>11}{:>9}{:>10}{:>10}{:>8}\n", "ranks", "nodes", "cores", "blocks", "soil", "pairs",
        "ghosts", "messages", "halo", "memory", "step", "effici-", "cut");
    add("{:>7}{:>7}{:>8}{:>10}{:>11}{:>9}{:>9}{:>10}{:>11}{:>9}{:>10}{:>10}{:>8}\n", "", "", "", "", "most", "max/mean", "per soil", "most",
        "kB, most", "MB, most", "ms", "ency", "s");
    for (const Case& c : cases) {
        add("{:>7}{:>7}{:>8.0f}{:>10}{:>11}{:>9.3f}{:>9.3f}{:>10}{:>11.1f}{:>9.0f}{:>10.3f}{:>10.3f}{:>8.2f}\n", c.ranks, c.nodes, c.cores,
            c.cut.blocks, most(c.cut, [](const RankShare& r) { return r.work.particles; }), c.cut.pair_balance(), c.cut.ghost_share(),
            most(c.cut, [](const RankShare& r) { return r.messages; }),
            1e-3 * at.ghost_bytes * double(most(c.cut, [](const RankShare& r) { return r.sent; })), 1e-6 * c.memory, 1e3 * c.step.total(),
            c.efficiency, c.cut.cut_seconds);
    }
    add("\npredicted step, ms\n{:>7}{:>10}{:>10}{:>11}{:>9}{:>11}{:>9}{:>9}{:>16}{:>16}\n", "ranks", "pairs", "particles", "imbalance",
        "halo", "reduction", "rebuild", "re-cut", "latency x 2", "bandwidth / 2");
    for (const Case& c : cases)
        add("{:>7}{:>10.3f}{:>10.3f}{:>11.3f}{:>9.3f}{:>11.3f}{:>9.3f}{:>9.3f}{:>16.3f}{:>16.3f}\n", c.ranks, 1e3 * c.step.pairs,
            1e3 * c.step.particles, 1e3 * c.step.imbalance, 1e3 * c.step.halo, 1e3 * c.step.reduction, 1e3 * c.step.rebuild,
            1e3 * c.step.recut, 1e3 * c.slow_messages.total(), 1e3 * c.thin_wires.total());
    for (const Case& c : cases)
        if (c.cut.scattered > 0) add("\n{} ranks: {} of them have soil in several pieces\n", c.ranks, c.cut.scattered);
    add("\nThe counts are those of a run's first step; times are by the model of docs/performance.md.\n");
    return text;
}

} // namespace kuzure
