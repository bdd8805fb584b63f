#include "solver/app/study/runner.hpp"
#include "io/json.hpp"
#include "io/owner.hpp"
#include "io/scene_file.hpp"
#include "solver/app/study/child.hpp"
#include "solver/app/study/runs.hpp"
#include "solver/app/study/study.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <optional>

namespace kuzure::study {

namespace {

using Json = nlohmann::ordered_json;

/// What point.json says of a run that was done before, where it is the same run.
bool take_what_is_there(const io::Path& folder, Point& p)
{
    try {
        const auto j = io::parse_json<Json>(io::read_text(folder / "point.json"));
        if (j.at("scene_hash") != p.hash || j.at("end") != p.scene->time.end || j.at("exit_code") != 0) return false;
        p.core_seconds = j.at("core_seconds");
    } catch (const std::exception&) {
        return false; // not done, or not whole
    }
    p.exit_code = 0, p.resumed = true;
    return true;
}

class StudyRun {
public:
    StudyRun(const Comm& comm, const StudyArguments& a) : comm_(comm), args_(a), out_(a.output) {}

    Exit go()
    {
        if (comm_.size() > 1)
            throw BadInput("kuzure study starts its runs itself: start it without mpirun; --threads or `threads` in the sweep gives each "
                           "run its threads");
        const std::string text = io::read_scene_text(args_.sweep);
        study_ = plan(io::parse_sweep(text, args_.sweep));
        open_directory(text);
        threads_ = args_.threads > 0 ? args_.threads : study_.sweep.threads;
        if (!run_all(to_run())) {
            say("stopped on request; the same command goes on from here");
            return Exit::Stopped;
        }
        measure_all();
        compare(study_);
        const auto problems = std::count_if(study_.points.begin(), study_.points.end(), [](const auto& p) { return !p.finished(); });
        io::write_atomically(out_ / "study.json", to_json(study_).dump(1) + "\n");
        io::write_atomically(out_ / "study.csv", to_csv(study_));
        say("\n" + to_text(study_));
        say(draw(study_, out_ / "figures"));
        say(fmt::format("{}; {} of {} points without result; results in {}", problems ? "done" : "all points done", problems,
                        study_.points.size(), out_.string()));
        return Exit::Ok;
    }

private:
    void open_directory(const std::string& text)
    {
        if (std::filesystem::exists(out_) && !std::filesystem::is_directory(out_))
            throw BadInput(fmt::format("{}: expected a directory, found a file; choose another with -o DIR", out_.string()));
        std::error_code error;
        // A sweep.toml alone may be the user's own.
        const bool ours = std::filesystem::exists(out_ / "sweep.toml", error) && std::filesystem::is_directory(out_ / "points", error);
        if (std::filesystem::is_directory(out_) && !std::filesystem::is_empty(out_, error) && !ours)
            throw BadInput(fmt::format(
                "{}: expected a new directory or that of a study, found one with other things in it; choose another with -o DIR",
                out_.string()));
        std::filesystem::create_directories(out_ / "points", error);
        owner_.emplace(io::hold(out_), complain);
        io::write_atomically(out_ / "sweep.toml", text);
    }

    /// The points that are not there yet. The cheap ones first: they show early what is wrong, and teach what the others will take.
    std::vector<Point*> to_run()
    {
        std::vector<Point*> todo;
        for (auto& p : study_.points) {
            if (!p.scene) continue;
            if (!take_what_is_there(folder(p), p)) todo.push_back(&p);
        }
        std::stable_sort(todo.begin(), todo.end(), [](const auto* a, const auto* b) { return a->predicted_work < b->predicted_work; });
        const auto done = std::count_if(study_.points.begin(), study_.points.end(), [](const auto& p) { return p.resumed; });
        say(fmt::format("{}: {} points, {} already there, {} to run, {} thread{} each", study_.sweep.title, study_.points.size(), done,
                        todo.size(), threads_, threads_ > 1 ? "s" : ""));
        return todo;
    }

    /// False if this program was asked to stop.
    bool run_all(const std::vector<Point*>& todo)
    {
        for (const auto* p : todo) work_left_ += p->predicted_work;
        const auto begin = std::chrono::steady_clock::now();
        const StopRequest stop; // for as long as points are run
        for (std::size_t k = 0; k < todo.size(); ++k) {
            if (stop.came()) return false;
            Point& p = *todo[k];
            if (args_.max_minutes > 0 && std::chrono::steady_clock::now() - begin > std::chrono::duration<double>(60 * args_.max_minutes)) {
                p.message = "not run yet: --max-minutes are over; the same command goes on";
                continue;
            }
            const std::string head = fmt::format("[{}/{}] {}, {:g} m", k + 1, todo.size(), p.asked.curve, p.spacing);
            // Another point of the same scene may have been run meanwhile.
            if (take_what_is_there(folder(p), p)) say(head + ": the same scene as a point before");
            else if (!run(p, threads_)) return false;
            else tell(head, p, k + 1 == todo.size());
            work_left_ -= p.predicted_work;
        }
        return true;
    }
    void tell(const std::string& head, const Point& p, bool last)
    {
        work_done_ += p.predicted_work, seconds_done_ += p.core_seconds;
        const double left = work_done_ > 0 ? seconds_done_ / work_done_ * (work_left_ - p.predicted_work) / threads_ : 0;
        const std::string how =
            p.exit_code == 0 ? fmt::format("{:.1f} core-seconds", p.core_seconds) : fmt::format("exit {}: {}", p.exit_code, p.message);
        const std::string still = last         ? ""
                                  : left < 100 ? fmt::format("; about {:.0f} s left", left)
                                               : fmt::format("; about {:.1f} minutes left", left / 60);
        say(head + ": " + how + still);
    }

    void measure_all()
    {
        for (auto& p : study_.points) {
            if (!p.finished()) continue;
            const auto damaged = [&](const std::exception& e) {
                return IoFailed(
                    fmt::format("{}: damaged results ({}). Remedy: remove this directory; the same command runs the point again",
                                folder(p).string(), e.what()));
            };
            try {
                measure(study_, p, folder(p) / "run");
            } catch (const nlohmann::json::exception& e) {
                throw damaged(e);
            } catch (const std::out_of_range& e) {
                throw damaged(e);
            }
        }
    }

    io::Path folder(const Point& p) const { return out_ / "points" / p.folder; }

    /// False if this program was asked to stop.
    bool run(Point& p, int threads)
    {
        const io::Path here = folder(p);
        std::error_code error;
        ChildResult child;
        int waits = most_waits;
        do {
            wait_for_the_end_of_a_run(here / "run");
            std::filesystem::remove_all(here, error);
            std::filesystem::create_directories(here, error);
            io::write_atomically(here / "scene.toml", io::write_scene(*p.scene));
            child = run_child(
                {"run", (here / "scene.toml").string(), "-o", (here / "run").string(), "--threads", std::to_string(threads), "--quiet"},
                here / "log.txt");
        } while (!child.stopped && waited_for_an_earlier_run(child.exit_code, here / "log.txt", here / "run", waits));
        if (child.stopped) return false;
        p.exit_code = child.exit_code, p.core_seconds = child.core_seconds;
        // Only the results count: a checkpoint of each of many points would fill the disk.
        for (const char* name : {"checkpoint.h5", "checkpoint.prev.h5"}) std::filesystem::remove(here / "run" / name, error);
        if (p.exit_code != 0) p.message = last_words(here / "log.txt");
        io::write_atomically(here / "point.json", Json{{"scene_hash", p.hash},
                                                       {"end", p.scene->time.end},
                                                       {"exit_code", p.exit_code},
                                                       {"core_seconds", p.core_seconds},
                                                       {"threads", threads},
                                                       {"version", version_text()}}
                                                          .dump(1) +
                                                      "\n");
        return true;
    }

    const Comm& comm_;
    StudyArguments args_;
    io::Path out_;
    std::optional<io::Ownership> owner_;
    Study study_;
    int threads_ = 1;
    double work_left_ = 0, work_done_ = 0, seconds_done_ = 0; // of the points to run: pairs, core-seconds
};

} // namespace

Exit run_study(const Comm& comm, const StudyArguments& a) { return StudyRun(comm, a).go(); }

} // namespace kuzure::study
