// kuzure job: a batch script for a machine of jobs/machines, to standard output.
#include "io/quote.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/cli/help.hpp"
#include "solver/app/scaling/predict.hpp"
#include "solver/kernels/pair_model.hpp"
#include <CLI/CLI.hpp>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure {

namespace {

using io::Batch;

struct Arguments {
    SceneArguments scene;
    std::string machine, mode, queue, account, output;
    int nodes = 1, ranks_per_node = 0;
    double minutes = 0;
};

/// What the script asks for and why.
struct Plan {
    io::MachineProfile machine;
    const io::ModeProfile* mode = nullptr;
    const io::QueueProfile* queue = nullptr;
    int nodes, per_node, ranks, threads;
    Estimate estimate;
    double predicted; // s of the whole run
    double memory;    // bytes a node
    int limit = 0;    // s of one job; 0: none
    int margin = 0;   // s kept at its end
    int jobs = 1;     // how many the run will probably take
    io::Path program, scene, results;
    std::string name;
    bool clocked() const { return limit > 0; }
};

/// A batch system's name for the job: letters, digits, - and _, beginning with a letter.
std::string job_name(const io::Path& scene)
{
    std::string name = scene.stem().string();
    for (char& c : name)
        if (!std::isalnum((unsigned char)(c)) && c != '-' && c != '_') c = '_';
    if (name.empty() || !std::isalpha((unsigned char)(name[0]))) name = "kuzure_" + name;
    return name.substr(0, 60);
}

std::string clock_text(int seconds) { return fmt::format("{:02d}:{:02d}:{:02d}", seconds / 3600, seconds / 60 % 60, seconds % 60); }
std::string duration_text(double seconds)
{
    return seconds < 10     ? fmt::format("{:.2g} s", seconds)
           : seconds < 120  ? fmt::format("{:.0f} s", seconds)
           : seconds < 7200 ? fmt::format("{:.0f} minutes", seconds / 60)
           : seconds < 2e5  ? fmt::format("{:.1f} hours", seconds / 3600)
                            : fmt::format("{:.1f} days", seconds / 86400);
}

std::string filled(std::string line, const Plan& p)
{
    const std::pair<const char*, int> numbers[] = {
        {"{ranks}", p.ranks}, {"{per_node}", p.per_node}, {"{nodes}", p.nodes}, {"{threads}", p.threads}};
    for (const auto& [name, number] : numbers)
        for (auto at = line.find(name); at != line.npos; at = line.find(name))
            line.replace(at, std::string_view(name).size(), std::to_string(number));
    return line;
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

void choose_mode_and_queue(Plan& p, const Arguments& a)
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

Plan make_plan(const Comm& comm, const Arguments& a)
{
    Plan p;
    const auto [scene, doubts, filling] = a.scene.read(comm);
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
    else if (m.batch != Batch::None) p.limit = int(300 * std::ceil(std::min({whole + 600, most > 0 ? most : 1e9, 8e8}) / 300));
    if (most > 0) p.limit = std::min(p.limit, int(most));
    if (p.clocked()) {
        const double step = p.predicted / double(std::max<std::int64_t>(1, e.steps));
        p.margin = int(std::ceil(std::min(60 + e.checkpoint / writing + 2 * step, p.limit / 3.0)));
        p.jobs = int(std::min(1e6, std::ceil(whole / (p.limit - p.margin))));
    }
    p.program = own_path();
    p.scene = std::filesystem::absolute(a.scene.file).lexically_normal();
    p.results = std::filesystem::absolute(a.scene.results(scene, a.output)).lexically_normal();
    p.name = job_name(p.scene);
    return p;
}

/// The comments at the top and the lines that the batch system reads.
std::string header(const Plan& p, const Arguments& a)
{
    const auto& m = p.machine;
    const Estimate& e = p.estimate;
    const char* mark = m.batch == Batch::Pjsub ? "#PJM" : "#SBATCH";
    std::string out = "#!/bin/bash\n";
    const auto option = [&](const std::string& text) { out += fmt::format("{} {}\n", mark, text); };
    const auto comment = [&](const std::string& text) { out += "# " + io::comment_text(text) + "\n"; };
    const std::string account = a.account.empty() ? "PROJECT" : io::batch_value(a.account, "--account");
    if (m.batch == Batch::Pjsub) {
        if (p.queue) option("-L rscgrp=" + io::batch_value(p.queue->name, "--queue"));
        option(fmt::format("-L node={}", p.nodes));
        option("-L elapse=" + clock_text(p.limit));
        option(fmt::format("--mpi proc={}", p.ranks));
        if (m.needs_account || !a.account.empty()) option("-g " + account);
        option("-N " + p.name);
        option("-j");
    } else if (m.batch == Batch::Slurm) {
        option("--job-name=" + p.name);
        if (p.queue && p.queue->name != "default") option("--partition=" + io::batch_value(p.queue->name, "--queue"));
        option(fmt::format("--nodes={}", p.nodes));
        option(fmt::format("--ntasks-per-node={}", p.per_node));
        option(fmt::format("--cpus-per-task={}", std::max(1, p.threads / m.node.threads_per_core)));
        option("--time=" + clock_text(p.limit));
        if (m.needs_account || !a.account.empty()) option("--account=" + account);
        option("--requeue");
        option("--open-mode=append");
    }
    for (const auto& line : m.directives) {
        if (line.starts_with("#")) out += line + "\n";
        else option(filled(line, p));
    }
    comment(version_text());
    comment(fmt::format("{}: {} soil and {} wall particles, {} steps", p.scene.filename().string(), e.soil, e.walls, e.steps));
    comment(fmt::format("{}{}: {} node{} x {} rank{} x {} thread{}, {} of memory on each node", m.title,
                        p.mode ? ", " + p.mode->name + " mode" : "", p.nodes, p.nodes == 1 ? "" : "s", p.per_node,
                        p.per_node == 1 ? "" : "s", p.threads, p.threads == 1 ? "" : "s", bytes_text(p.memory)));
    comment(fmt::format("predicted: {} ({:.3g} s a step) by the constants of {}", duration_text(p.predicted),
                        p.predicted / double(std::max<std::int64_t>(1, e.steps)), m.file.string()));
    if (p.clocked())
        comment(fmt::format("{} a job, the last {} kept for the checkpoint: {}", duration_text(p.limit), duration_text(p.margin),
                            p.jobs == 1 ? "one job should do" : fmt::format("about {} jobs", p.jobs)));
    return out;
}

/// What happens after exit code 5 with steps made: shell lines.
std::string go_on(const Plan& p)
{
    const auto& m = p.machine;
    const std::string by_hand = R"sh(echo "job: not done yet; submit the script again and it goes on from the checkpoint" >&2
    exit 5
)sh";
    if (m.batch == Batch::Slurm)
        return R"sh(echo "job: back into the queue, to go on from the checkpoint"
    scontrol requeue "$SLURM_JOB_ID" && sleep 300 # Slurm ends this script meanwhile
    )sh" + by_hand;
    if (m.batch == Batch::Pjsub && m.resubmit == io::Resubmit::Itself)
        return R"sh(echo "job: submitting the next job, to go on from the checkpoint"
    pjsub "$self" && exit 5
    )sh" + by_hand;
    if (m.batch == Batch::Pjsub)
        return R"sh(echo "job: the next job of the chain goes on from the checkpoint; was this the last one, submit the script again"
    exit 5
)sh";
    return R"sh(echo "job: not done yet; start the script again and it goes on from the checkpoint"
    exit 5
)sh";
}

std::string body(const Plan& p, const Arguments& a)
{
    const auto& m = p.machine;
    std::string out = "set -u\nexport TERM=dumb # plain lines in the log, no bar\n";
    out += fmt::format("program=${{KUZURE:-{}}}\n", io::shell_word(p.program.string()));
    out += fmt::format("scene={}\n", io::shell_word(p.scene.string()));
    out += fmt::format("results={}\n", io::shell_word(p.results.string()));
    if (m.batch == Batch::Pjsub && m.resubmit == io::Resubmit::Chain)
        out += fmt::format(R"sh(
# Compute nodes cannot submit. Started by hand on a login node (bash SCRIPT [JOBS]), this submits a chain of step jobs, of which
# each goes on from the checkpoint of the one before; the rest is taken away once one ends with anything but 5, "not done yet".
if [ -z "${{PJM_JOBID:-}}" ]; then
    jobs=${{1:-{}}}
    said=$(pjsub --step "$0") || exit
    echo "$said"
    id=$(sed -n 's/.* Job \([0-9]*\)_[0-9]* submitted.*/\1/p' <<<"$said")
    for ((k = 1; k < jobs; k++)); do pjsub --step --sparam "jid=$id,sd=ec!=5:all" "$0" || exit; done
    exit
fi
)sh",
                           p.jobs + 1);
    if (m.batch == Batch::Pjsub && m.resubmit == io::Resubmit::Itself)
        out += R"sh(
# The batch system gives a copy of this script to the job: keep one from which the next job can be submitted.
self=$results.job.sh
mkdir -p "$(dirname "$results")"
[ "$0" -ef "$self" ] || cp "$0" "$self" || exit 4
)sh";
    out += "\n";
    for (const auto& line : m.setup) out += filled(line, p) + "\n";
    if (p.mode)
        for (const auto& line : p.mode->setup) out += filled(line, p) + "\n";
    if (p.clocked())
        out += fmt::format(R"sh(
# Stop with a checkpoint before the batch system stops the job: {} s are granted, {} s kept.
left=$(({} - {} - SECONDS))
[ $left -gt 0 ] || {{ echo "job: setting up took all of the time" >&2; exit 1; }}
)sh",
                           p.limit, p.margin, p.limit, p.margin);
    out += R"sh(
# The steps so far, 0 before the first job: a job that gets no further must not be followed by another.
steps() { { sed -n 's/^ *"steps": *\([0-9]*\),*$/\1/p' "$results/summary.json" 2>/dev/null || true; echo 0; } | head -n 1; }
before=$(steps)
)sh";
    std::string launch = filled(m.launcher, p);
    if (!launch.empty()) out += "export KUZURE_MPI=1 # ranks, whatever the launcher tells them of itself\n";
    if (p.mode && !p.mode->wrapper.empty()) launch += " " + p.mode->wrapper;
    out += fmt::format("{} \"$program\" run \"$scene\" -o \"$results\"", launch);
    for (const auto& set : a.scene.sets) out += " --set " + io::shell_word(set);
    if (a.scene.force_step) out += " --force-step";
    out += fmt::format(" --threads {}", p.threads);
    if (p.clocked()) out += R"sh( --max-minutes "$(printf '%d.%02d' $((left / 60)) $((left % 60 * 100 / 60)))")sh";
    out += " --restart\ncode=$?\n";
    out += fmt::format(R"sh(
case $code in
0)
    echo "job: done; results in $results"
    ;;
5)
    if [ -e "$results/STOP" ]; then
        echo "job: stopped by the file $results/STOP; remove it and submit the script again to go on" >&2
        exit 5
    fi
    if [ "$(steps)" = "$before" ]; then
        echo "job: no step was made in this job: it needs more time than {}" >&2
        exit 1
    fi
    {}    ;;
2) echo "job: the scene or the command line is wrong (message above); nothing to go on with" >&2 ;;
3) echo "job: the numbers failed (message above); nothing to go on with" >&2 ;;
4) echo "job: files failed (message above). Make room, then submit the script again: it goes on from the last good checkpoint" >&2 ;;
*) echo "job: kuzure or its launcher ended with $code. Submit the script again: it goes on from the last good checkpoint" >&2 ;;
esac
exit $code
)sh",
                       p.clocked() ? duration_text(p.limit) : "it was given", go_on(p));
    return out;
}

} // namespace

void add_job(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("job", "a batch script for a machine, to standard output");
    auto a = std::make_shared<Arguments>();
    a->scene.add_to(*command);
    command->add_option("--machine", a->machine, "a profile of jobs/machines, or the path of one")->required()->type_name("NAME");
    command->add_option("-n,--nodes", a->nodes, "nodes of a job")->required()->check(CLI::Range(1, 10000000));
    command->add_option("--mode", a->mode, "how the nodes' memory is set up, such as flat or cache")->type_name("NAME");
    command->add_option("--queue", a->queue, "queue (default: the profile's first that fits)")->type_name("NAME");
    command->add_option("--account", a->account, "project that pays")->type_name("NAME");
    command->add_option("--minutes", a->minutes, "clock limit of a job (default: from the predicted time)")->check(CLI::Range(1.0, 1e6));
    command->add_option("--ranks-per-node", a->ranks_per_node, "ranks on each node (default: the profile's)")->check(CLI::Range(1, 4096));
    command->add_option("-o,--output", a->output, "result directory (default: as kuzure run)")->type_name("DIR");
    under_heading(*command, "What the job asks for",
                  {"--machine", "--nodes", "--ranks-per-node", "--queue", "--mode", "--account", "--minutes"});
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            const Plan p = make_plan(comm, *a);
            if (comm.rank() != 0) return Exit::Ok;
            if (p.machine.needs_account && a->account.empty())
                complain(fmt::format("jobs on {} need a project: write yours instead of PROJECT, or give --account", p.machine.name));
            fmt::print("{}{}", header(p, *a), body(p, *a));
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
