#include "solver/app/hazard/queue.hpp"
#include "io/quote.hpp"
#include "solver/app/hazard/kept.hpp"
#include "solver/core/wall_clock.hpp"
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <list>
#include <thread>

namespace kuzure::hazard {
namespace {

/// The name of a run as one of a file.
std::string flat(const Run& r)
{
    std::string name = r.directory.string();
    std::replace(name.begin(), name.end(), '/', '-');
    return name;
}

} // namespace

Run& Queue::add(Part part, Member m, double spacing, const std::string& name)
{
    auto& r = runs.emplace_back();
    r.part = part, r.member = std::move(m), r.spacing = spacing, r.layers = base_.layers_of(spacing), r.directory = name;
    return r;
}
/// A run's scene on the disk; whether that is the one that was there before.
bool Queue::prepare(Run& r, RunScene& scene) const
{
    const std::string name = flat(r), title = r.part == Part::Member ? fmt::format("member {}", r.member.number) : word(r.part);
    scene = run_scene(base_, r.spacing, r.member, title, out_ / "inputs" / name);
    r.notes = scene.notes;
    std::string text = scene.text;
    for (const auto& s : scene.sets) text = fmt::format("# with {}\n", s) + text;
    const io::Path file = out_ / "scenes" / (name + ".toml");
    std::error_code error;
    const bool same = std::filesystem::exists(file, error) && io::read_text(file) == text;
    if (!same) {
        std::filesystem::remove_all(out_ / r.directory, error);
        io::write_atomically(file, text);
    }
    return same;
}

std::vector<std::string> Queue::words_of(const Run& r, const RunScene& scene) const
{
    std::vector<std::string> words{(out_ / "scenes" / (flat(r) + ".toml")).string(), "-o", (out_ / r.directory).string()};
    for (const auto& s : scene.sets) words.insert(words.end(), {"--set", s});
    return words;
}
std::string Queue::prepare_only(Run& r) const
{
    RunScene scene;
    prepare(r, scene);
    std::string text;
    for (const auto& w : words_of(r, scene)) text += (text.empty() ? "" : " ") + io::shell_word(w);
    return text;
}

/// What is left of an earlier call: takes what is finished, waits for a run that is still ending.
void Queue::take_what_is_there(Run& r) const
{
    const io::Path where = out_ / r.directory;
    std::error_code error;
    if (!std::filesystem::is_directory(where, error)) return;
    study::wait_for_the_end_of_a_run(where);
    try {
        const auto end = end_from_text(io::read_text(where / "summary.json"));
        if (end && end->status == Status::Finished) r.seconds = end->seconds, finish(r);
        else if (end) r.status = end->status, r.message = end->message;
    } catch (const std::exception&) { // not ended, or not whole: it is run again
        r.status = Status::NotRun;
    }
    // Without a checkpoint it begins anew, and kuzure would move aside what it had begun.
    if (r.status == Status::NotRun && !study::has_checkpoint(where)) std::filesystem::remove_all(where, error);
}

void Queue::finish(Run& r) const
{
    r.maps = std::make_shared<const RunMaps>(read_maps(out_ / r.directory, base_, maps_of_runs(base_).wet, r.spacing));
    r.status = Status::Finished;
    // Only the results count: a checkpoint of each of many runs would fill the disk.
    std::error_code error;
    for (const char* name : {"checkpoint.h5", "checkpoint.prev.h5"}) std::filesystem::remove(out_ / r.directory / name, error);
}

void Queue::work(std::vector<Run*> todo, int jobs, int threads, double expected)
{
    std::list<Running> running;
    std::size_t next = 0;
    double sum = 0;
    int measured = 0;
    bool stopping = false;
    double stop_began = 0;
    while (next < todo.size() || !running.empty()) {
        while (!over() && next < todo.size() && int(running.size()) < jobs) {
            if (measured > 0) expected = sum / measured;
            if (expected > left_()) break;
            Run& r = *todo[next++];
            if (r.status != Status::NotRun && r.status != Status::Stopped) continue;
            if (auto started = start(r, threads)) running.push_back(std::move(*started));
        }
        if (running.empty()) break;
        for (auto at = running.begin(); at != running.end();) {
            const auto ended = at->child.ended();
            if (!ended) {
                ++at;
                continue;
            }
            at->run->seconds += wall_clock() - at->began;
            conclude(*at->run, *ended);
            if (at->run->status == Status::NotRun) todo.push_back(at->run);
            if (at->run->finished()) sum += at->run->seconds, ++measured;
            at = running.erase(at);
            after_each_();
        }
        if (over() && !stopping) {
            stopping = true, stop_began = wall_clock();
            for (auto& r : running) r.child.send(SIGTERM);
        }
        if (stopping && wall_clock() - stop_began > std::max(2.0, 0.03 * within_))
            for (auto& r : running) r.child.send(SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

std::optional<Queue::Running> Queue::start(Run& r, int threads) const
{
    RunScene scene;
    try {
        const bool same = prepare(r, scene);
        if (same) take_what_is_there(r);
    } catch (const BadInput& e) {
        r.status = Status::Refused, r.message = e.what();
        return std::nullopt;
    }
    if (r.status == Status::Finished || r.status == Status::Failed) {
        say(fmt::format("  {}: there already, {}", r.directory.string(), word(r.status)));
        return std::nullopt;
    }
    std::vector<std::string> words{"run"};
    for (auto& w : words_of(r, scene)) words.push_back(std::move(w));
    words.insert(words.end(), {"--restart", "--threads", std::to_string(threads), "--quiet"});
    return Running{study::Child(words, out_ / "logs" / (flat(r) + ".txt"), true), &r, wall_clock()};
}

void Queue::conclude(Run& r, const study::ChildResult& ended) const
{
    const io::Path log = out_ / "logs" / (flat(r) + ".txt");
    switch (ended.exit_code) {
    case 0:
        try {
            finish(r);
        } catch (const BadInput& e) {
            r.status = Status::Failed, r.message = e.what();
        } catch (const IoFailed& e) {
            r.status = Status::Failed, r.message = e.what();
        }
        break;
    case 2:
        if (study::waited_for_an_earlier_run(ended.exit_code, log, out_ / r.directory, r.waits)) {
            r.status = Status::NotRun;
            return;
        }
        r.status = Status::Refused, r.message = study::last_words(log);
        break;
    case 5:
    case 128 + SIGTERM:
    case 128 + SIGINT:
    case 128 + SIGKILL:
        r.status = Status::Stopped;
        break;
    default:
        r.status = Status::Failed, r.message = ended.exit_code == 3 || ended.exit_code == 4
                                                   ? study::last_words(log)
                                                   : fmt::format("ended with exit code {}", ended.exit_code);
    }
    if (r.finished())
        say(fmt::format("  {}: {:.3g} layers, reach {:.4g} m, {}", r.directory.string(), r.layers, r.maps->reach, seconds_text(r.seconds)));
    else say(fmt::format("  {}: {}{}", r.directory.string(), word(r.status), r.message.empty() ? "" : ": " + r.message));
}

} // namespace kuzure::hazard
