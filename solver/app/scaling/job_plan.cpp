#include "solver/app/scaling/job_plan.hpp"
#include "solver/app/hazard/cluster.hpp"
#include "solver/core/ensure.hpp"
#include "solver/kernels/pair_model.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <optional>

namespace kuzure {

namespace {

/// A batch system's name for the job: letters, digits, - and _, beginning with a letter.
std::string job_name(const io::Path& scene)
{
    std::string name = scene.stem().string();
    for (char& c : name)
        if (!std::isalnum((unsigned char)(c)) && c != '-' && c != '_') c = '_';
    if (name.empty() || !std::isalpha((unsigned char)(name[0]))) name = "kuzure_" + name;
    return name.substr(0, 60);
}

/// The option and value with which no name was found, and the names there are.
template <class Items> BadInput no_such(const char* option, const std::string& name, const Items& items, const io::MachineProfile& m)
{
    std::vector<std::string> names;
    for (const auto& item : items) names.push_back(item.name);
    if (names.empty()) return BadInput(fmt::format("--{} {}: {} has no such thing; leave it out", option, name, m.file.string()));
    return BadInput(fmt::format("--{0} {1}: expected a {0} of {2}, found none of this name{3} Known: {4}", option, name, m.file.string(),
                                io::did_you_mean(name, names), fmt::join(names, ", ")));
}

void choose_mode_and_queue(JobPlan& p, const JobArguments& a)
{
    const auto& m = p.machine;
    const auto named = [](const auto& items, const std::string& name) {
        const auto found = std::find_if(items.begin(), items.end(), [&](const auto& x) { return x.name == name; });
        return found == items.end() ? nullptr : &*found;
    };
    if (!a.queue.empty()) {
        p.queue = named(m.queues, a.queue);
        if (!p.queue) throw no_such("queue", a.queue, m.queues, m);
    }
    if (!a.mode.empty()) {
        p.mode = named(m.modes, a.mode);
        if (!p.mode) throw no_such("mode", a.mode, m.modes, m);
        if (p.queue && !p.queue->mode.empty() && p.queue->mode != a.mode)
            throw BadInput(fmt::format("--queue {}: this queue of {} is for mode {}, found --mode {}; leave one of them out", a.queue,
                                       m.name, p.queue->mode, a.mode));
    } else if (p.queue && !p.queue->mode.empty()) {
        p.mode = named(m.modes, p.queue->mode);
    } else if (!m.modes.empty()) {
        p.mode = &m.modes.front();
    }
    const auto serves = [&](const io::QueueProfile& q) { return q.mode.empty() || (p.mode && q.mode == p.mode->name); };
    const auto fits = [&](const io::QueueProfile& q) {
        return serves(q) && q.least_nodes <= p.nodes && p.nodes <= q.most_nodes && a.minutes <= q.minutes;
    };
    if (!p.queue && !m.queues.empty()) {
        const auto found = std::find_if(m.queues.begin(), m.queues.end(), fits);
        if (found != m.queues.end()) p.queue = &*found;
    }
    if (m.queues.empty() || (p.queue && fits(*p.queue))) return;
    std::vector<std::string> limits;
    for (const auto& q : m.queues)
        if (serves(q) && (!p.queue || p.queue == &q))
            limits.push_back(fmt::format("{} (nodes {} to {}, {:g} minutes)", q.name, q.least_nodes, q.most_nodes, q.minutes));
    throw BadInput(fmt::format("--nodes {}{}: expected what a queue of {} allows, found none that does: {}. Remedy: other --nodes or "
                               "--minutes",
                               p.nodes, a.minutes > 0 ? fmt::format(" --minutes {:g}", a.minutes) : "", m.name, fmt::join(limits, ", ")));
}

} // namespace

JobPlan plan_job(const Comm& comm, const JobArguments& a)
{
    JobPlan p;
    std::optional<hazard::ClusterRuns> runs;
    if (a.hazard()) runs = hazard::cluster_runs(comm, a.scene, a.members, a.layers, a.output);
    const auto checked = runs ? std::move(runs->largest) : a.scene.read(comm);
    const auto& [scene, scene_warnings, filling] = checked;
    p.machine = machine_named(a.machine);
    const auto& m = p.machine;
    p.nodes = a.nodes, p.per_node = a.ranks_per_node > 0 ? a.ranks_per_node : m.node.ranks;
    p.ranks = p.nodes * p.per_node, p.threads = m.threads(p.per_node);
    if (p.nodes > m.node.count)
        throw BadInput(fmt::format("--nodes {}: {} has {} nodes ({}); ask for fewer", p.nodes, m.name, m.node.count, m.file.string()));
    if (p.per_node > m.node.cores * m.node.threads_per_core)
        throw BadInput(fmt::format("--ranks-per-node {}: a node of {} has {} cores ({}); ask for fewer", p.per_node, m.name, m.node.cores,
                                   m.file.string()));
    choose_mode_and_queue(p, a);

    p.estimate = estimate(scene, filling, *choose_model(scene, Arithmetic::Simd));
    const Estimate& e = p.estimate;
    p.memory = e.memory / p.nodes + bytes_per_process * p.per_node;
    const double has = p.mode && p.mode->memory ? *p.mode->memory : m.node.memory;
    if (p.memory > has)
        throw BadInput(
            fmt::format("--nodes {}: {} soil and {} wall particles need {} on each node, a node of {} has {}. Remedy: at least {:.0f} "
                        "nodes, or a larger space.spacing",
                        p.nodes, e.soil, e.walls, bytes_text(p.memory), m.name, bytes_text(has),
                        std::ceil(e.memory / std::max(1.0, has - bytes_per_process * p.per_node))));

    p.predicted = predict_seconds(e, m, p.nodes, p.per_node);
    // Outputs go through one file system: half a gigabyte a second is what a modest one takes.
    const double writing = 0.5e9, start = 10;
    const double whole = 1.5 * p.predicted + e.disk() / writing + start;
    const double most = p.queue ? 60 * p.queue->minutes : 0;
    if (a.minutes > 0) p.limit = int(std::lround(60 * a.minutes));
    else if (m.batch != "none") p.limit = int(300 * std::ceil(std::min({whole + 600, most > 0 ? most : 1e9, 8e8}) / 300));
    if (most > 0) p.limit = std::min(p.limit, int(most));
    if (p.clocked()) {
        const double step = p.predicted / double(std::max<std::int64_t>(1, e.steps));
        p.margin = int(std::ceil(std::min(60 + e.checkpoint / writing + 2 * step, p.limit / 3.0)));
        p.jobs = int(std::min(1e6, std::ceil(whole / (p.limit - p.margin))));
    }
    p.program = own_path();
    p.scene = std::filesystem::absolute(a.scene.file).lexically_normal();
    p.results = std::filesystem::absolute(runs ? runs->directory : a.scene.results(scene, a.output)).lexically_normal();
    if (runs) p.members = runs->members, p.layers = runs->layers;
    p.name = job_name(p.scene);
    return p;
}

} // namespace kuzure
