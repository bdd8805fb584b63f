#include "solver/app/scaling/job_script.hpp"
#include "io/batch_template.hpp"
#include "io/quote.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <fmt/format.h>

namespace kuzure {

namespace {

std::string clock_text(int seconds) { return fmt::format("{:02d}:{:02d}:{:02d}", seconds / 3600, seconds / 60 % 60, seconds % 60); }
std::string duration_text(double seconds)
{
    return seconds < 10     ? fmt::format("{:.2g} s", seconds)
           : seconds < 120  ? fmt::format("{:.0f} s", seconds)
           : seconds < 7200 ? fmt::format("{:.0f} minutes", seconds / 60)
           : seconds < 2e5  ? fmt::format("{:.1f} hours", seconds / 3600)
                            : fmt::format("{:.1f} days", seconds / 86400);
}

std::string filled(std::string line, const JobPlan& p)
{
    const std::pair<const char*, int> numbers[] = {
        {"{ranks}", p.ranks}, {"{per_node}", p.per_node}, {"{nodes}", p.nodes}, {"{threads}", p.threads}};
    for (const auto& [name, number] : numbers)
        for (auto at = line.find(name); at != line.npos; at = line.find(name))
            line.replace(at, std::string_view(name).size(), std::to_string(number));
    return line;
}

/// The comments at the top: what runs, on what, how long.
std::vector<std::string> about(const JobPlan& p)
{
    const auto& m = p.machine;
    const Estimate& e = p.estimate;
    std::vector<std::string> lines{
        version_text(), fmt::format("{}: {} soil and {} wall particles, {} steps", p.scene.filename().string(), e.soil, e.walls, e.steps),
        fmt::format("{}{}: {} node{} x {} rank{} x {} thread{}, {} of memory on each node", m.title,
                    p.mode ? ", " + p.mode->name + " mode" : "", p.nodes, p.nodes == 1 ? "" : "s", p.per_node, p.per_node == 1 ? "" : "s",
                    p.threads, p.threads == 1 ? "" : "s", bytes_text(p.memory)),
        fmt::format("predicted: {} ({:.3g} s a step) by the constants of {}", duration_text(p.predicted),
                    p.predicted / double(std::max<std::int64_t>(1, e.steps)), m.file.string())};
    if (p.clocked())
        lines.push_back(fmt::format("{} a job, the last {} kept for the checkpoint: {}", duration_text(p.limit), duration_text(p.margin),
                                    p.jobs == 1 ? "one job should do" : fmt::format("about {} jobs", p.jobs)));
    if (p.members > 0)
        lines.push_back(
            fmt::format("a task for each of {} members and the runs of the likely values, with {} layers (that is the finest above); "
                        "bash SCRIPT on a login node",
                        p.members, p.layers));
    for (auto& line : lines) line = io::comment_text(line);
    return lines;
}

} // namespace

std::string job_script(const JobPlan& p, const JobArguments& a)
{
    const auto& m = p.machine;
    io::BatchValues values;
    using enum io::BatchValue::Kind;
    const auto text = [&](const char* name, std::string value) { values[name] = {Text, {std::move(value)}}; };
    const auto number = [&](const char* name, int value) { text(name, std::to_string(value)); };
    const auto word = [&](const char* name, std::string value) { values[name] = {Word, {std::move(value)}}; };
    const auto flag = [&](const char* name, bool value) { text(name, value ? "yes" : ""); };

    const int cores = std::max(1, p.threads / m.node.threads_per_core);
    number("nodes", p.nodes), number("ranks", p.ranks), number("per_node", p.per_node), number("threads", p.threads);
    number("cores_per_rank", cores), number("cores_per_node", cores * p.per_node);
    number("limit", p.limit), number("margin", p.margin), number("chain_jobs", p.jobs + 1);
    text("clock", clock_text(p.limit)), text("limit_text", p.clocked() ? duration_text(p.limit) : "it was given");
    flag("clocked", p.clocked()), flag("chain", m.resubmit == io::Resubmit::Chain);
    text("name", p.name), text("name15", p.name.substr(0, 15)); // PBS before version 14 takes no more
    // A queue "default" is the batch system's own choice.
    text("queue", p.queue && p.queue->name != "default" ? io::batch_value(p.queue->name, "--queue") : "");
    text("account", !a.account.empty() ? io::batch_value(a.account, "--account") : m.needs_account ? "PROJECT" : "");
    word("program", io::shell_word(p.program.string())), word("scene", io::shell_word(p.scene.string()));
    word("results", io::shell_word(p.results.string()));

    std::string options;
    for (const auto& set : a.scene.sets) options += "--set " + io::shell_word(set) + " ";
    if (a.scene.force_step) options += "--force-step ";
    word("options", options + fmt::format("--threads {}", p.threads));
    if (p.members > 0) word("hazard", options + fmt::format("--members {} --layers {}", p.members, p.layers));
    std::string launch = filled(m.launcher, p);
    if (p.mode && !p.mode->wrapper.empty()) launch += " " + p.mode->wrapper;
    text("launch", launch), flag("launcher", !m.launcher.empty());

    std::vector<std::string> setup, directives;
    for (const auto& line : m.setup) setup.push_back(filled(line, p));
    if (p.mode)
        for (const auto& line : p.mode->setup) setup.push_back(filled(line, p));
    for (const auto& line : m.directives) directives.push_back(filled(line, p));
    values["setup"] = {Lines, setup}, values["directive"] = {Options, directives}, values["about"] = {Lines, about(p)};
    const std::string name = m.batch + (p.members > 0 ? ".hazard.sh" : ".job.sh");
    const auto file = io::template_file(name, m.folders);
    if (file.empty())
        throw BadInput(fmt::format("--members: {} has no template {} for the runs of a hazard as tasks of an array. Remedy: {}", m.name,
                                   name,
                                   m.batch == "none" ? "kuzure hazard, which runs them on this machine"
                                                     : "write one beside the profile; slurm.hazard.sh shows how"));
    return io::fill_template(file, values, m.folders);
}

} // namespace kuzure
