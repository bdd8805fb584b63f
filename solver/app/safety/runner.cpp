#include "solver/app/safety/runner.hpp"
#include "io/owner.hpp"
#include "io/picture_series.hpp"
#include "solver/app/report/pictures.hpp"
#include "solver/app/safety/kept.hpp"
#include "solver/app/safety/search.hpp"
#include "solver/app/study/child.hpp"
#include "solver/app/study/runs.hpp"
#include "solver/core/wall_clock.hpp"
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <list>
#include <nlohmann/json.hpp>
#include <thread>

namespace kuzure::safety {
namespace {

using study::say, study::seconds_text;

/// Thrown where this program was asked to stop.
struct Stop {};

class Safety {
public:
    Safety(const Comm& comm, const Arguments& a) : comm_(comm), args_(a), search_(a.from, a.to, a.bracket)
    {
        if (comm.size() > 1)
            throw BadInput("kuzure safety starts its runs itself: start it without mpirun; --jobs says how many run at a time");
        auto checked = a.scene.read(comm);
        const Scene& s = checked.scene;
        if (!a.at && !s.events.empty())
            throw BadInput(fmt::format("{}: event: the scene changes while it runs: expected --at TIME, the state whose factor is asked "
                                       "for. Remedy: --at {:g} for the end of the run",
                                       a.scene.file, s.time.end));
        if (a.at && !(*a.at > 0 && std::isfinite(*a.at)))
            throw BadInput(fmt::format("--at: expected a time above 0 s, found {:g}. Remedy: --at {:g}, or none for the scene's start",
                                       *a.at, s.time.end));
        if (s.terrain && !s.terrain->friction_map.empty())
            throw BadInput(
                fmt::format("{}: terrain.friction_map: expected one friction for the whole ground, which is reduced as the soil's "
                            "strength is. Remedy: friction instead",
                            a.scene.file));
        std::error_code error;
        if (!s.start.from.empty() && !std::filesystem::exists(s.start.from, error))
            throw BadInput(fmt::format("{}: start.from: {}: expected the result directory of a run, or a checkpoint; found nothing there. "
                                       "Remedy: run that scene first",
                                       a.scene.file, s.start.from));
        out_ = std::filesystem::absolute(study::directory_for(a.output, s, a.scene.file, "safety"));
        if (a.at) {
            state_ = s;
            state_->time.end = *a.at;
            state_->output.movie = false, state_->output.picture.reset(), state_->maps.reset();
        }
        setting_ = setting_of(a.at ? scene_at(s, *a.at, run_of("state")) : s, checked.filling, a.scene.file);
        identity_ = fmt::format("{} {:.17g} {:.17g}", io::scene_hash(s), a.from, a.at.value_or(-1));
        cores_ = std::max(1, cores_here());
        jobs_ = std::min(a.jobs > 0 ? a.jobs : cores_, study::most_children);
    }

    Exit go()
    {
        study::require_own_directory(out_, "plan.json", "a factor of safety");
        require_same_question();
        // What cannot run shall not begin: the strongest and the weakest scene are read as a run reads them.
        for (const double factor : {args_.from, args_.to})
            io::parse_scene(io::write_scene(trial_scene(setting_, factor, {})),
                            fmt::format("{} with its strength over {:g}", args_.scene.file, factor), {}, args_.scene.step_limit());
        open();
        stop_.emplace();
        try {
            return answer();
        } catch (const Stop&) {
            say("stopped on request; the same command goes on from here");
            return Exit::Stopped;
        }
    }

private:
    struct Running {
        study::Child child;
        int step;
        double began; // s of wall_clock()
    };

    // ---- the directory

    io::Path run_of(const std::string& name) const { return out_ / "runs" / name; }
    io::Path log_of(const std::string& name) const { return out_ / "logs" / (name + ".txt"); }
    io::Path scene_of(const std::string& name) const { return out_ / "scenes" / (name + ".toml"); }
    io::Path record_of(const std::string& name) const { return out_ / "trials" / (name + ".json"); }

    void require_same_question() const
    {
        std::error_code error;
        if (!std::filesystem::exists(out_ / "plan.json", error)) return;
        try {
            if (identity_from_text(io::read_text(out_ / "plan.json")) == identity_) return;
        } catch (const IoFailed&) {
            throw;
        } catch (const std::runtime_error& e) {
            throw BadInput(
                fmt::format("{}: expected the plan of a factor of safety, found other text ({}). Remedy: choose another directory "
                            "with -o DIR",
                            (out_ / "plan.json").string(), e.what()));
        }
        throw BadInput(fmt::format("{}: expected the directory of this scene, found one of another scene, --from or --at. Remedy: choose "
                                   "another with -o DIR",
                                   out_.string()));
    }

    void open()
    {
        study::make_directories(out_, {"scenes", "runs", "logs", "trials"});
        owner_.emplace(io::hold(out_), complain);
        io::write_atomically(out_ / "plan.json", plan_text(identity_));
        io::write_atomically(out_ / "scene.toml", io::read_scene_text(args_.scene.file));
    }

    // ---- runs

    /// The scene on the disk; what is left of a run of another one goes.
    void prepare(const std::string& name, const Scene& scene) const
    {
        const std::string text = io::write_scene(scene);
        std::error_code error;
        study::wait_for_the_end_of_a_run(run_of(name));
        if (!std::filesystem::exists(scene_of(name), error) || io::read_text(scene_of(name)) != text) {
            io::remove_file(record_of(name));
            std::filesystem::remove_all(run_of(name), error);
            io::write_atomically(scene_of(name), text);
        }
    }
    /// Without a checkpoint a run begins anew, and kuzure would move aside what it had begun.
    void begin_anew_without_checkpoint(const std::string& name) const
    {
        std::error_code error;
        if (!study::has_checkpoint(run_of(name))) std::filesystem::remove_all(run_of(name), error);
    }
    std::vector<std::string> command(const std::string& name, double end, int threads) const
    {
        std::vector<std::string> words{"run",
                                       scene_of(name).string(),
                                       "-o",
                                       run_of(name).string(),
                                       "--restart",
                                       "--threads",
                                       std::to_string(threads),
                                       "--quiet",
                                       "--set",
                                       fmt::format("time.end={:.17g}", end)};
        if (args_.scene.force_step) words.emplace_back("--force-step");
        return words;
    }
    /// Throws where a run did not come to its end.
    void require_ended(const std::string& name, const study::ChildResult& ended) const
    {
        if (ended.exit_code == 0) return;
        const std::string words = fmt::format("{}: {}", run_of(name).string(), study::last_words(log_of(name)));
        switch (ended.exit_code) {
        case 2:
            throw BadInput(words);
        case 3:
            throw NumbersFailed(words);
        case 4:
            throw IoFailed(words);
        default:
            if (stop_->came() || ended.exit_code == 5) throw Stop{};
            throw IoFailed(fmt::format("{}: the run ended with exit code {}", run_of(name).string(), ended.exit_code));
        }
    }

    /// The scene's own run up to --at.
    void find_state()
    {
        prepare("state", *state_);
        begin_anew_without_checkpoint("state");
        say(fmt::format("the scene's own run to t = {:g} s", *args_.at));
        int waits = study::most_waits;
        std::optional<study::ChildResult> ended;
        do ended = study::Child(command("state", *args_.at, cores_), log_of("state"), true).ended(true);
        while (study::waited_for_an_earlier_run(ended->exit_code, log_of("state"), run_of("state"), waits));
        require_ended("state", *ended);
    }

    // ---- trials

    Trial& trial(int step)
    {
        auto [at, fresh] = trials_.try_emplace(step);
        Trial& t = at->second;
        if (!fresh) return t;
        t.factor = search_.factor(step);
        t.name = step == 0 ? std::string("settled") : fmt::format("F{:.10g}", t.factor);
        prepare(t.name, trial_scene(setting_, t.factor, step == 0 ? io::Path() : run_of("settled")));
        recall(t);
        return t;
    }
    /// What an earlier call saw of a trial.
    void recall(Trial& t) const
    {
        try {
            auto kept = trial_from_text(io::read_text(record_of(t.name)));
            t.seen = std::move(kept.seen), t.seconds = kept.seconds;
        } catch (const std::runtime_error&) { // none, or not whole
        }
        t.outcome = judge(setting_, t.seen);
        // Inspections of a run of which no state is left are no help for what is still to be run.
        if (t.outcome != Outcome::Open && t.name != "settled") return;
        if (!study::has_checkpoint(run_of(t.name))) t.seen.clear(), t.outcome = Outcome::Open;
        begin_anew_without_checkpoint(t.name);
    }
    void keep(const Trial& t) const { io::write_atomically(record_of(t.name), to_text(KeptTrial{t.factor, t.seen, t.seconds})); }

    Running begin_leg(int step)
    {
        Trial& t = trial(step);
        const double end = end_of_leg(setting_, int(t.seen.size()));
        const int threads = step == 0 ? cores_ : std::max(1, cores_ / jobs_);
        return {study::Child(command(t.name, end, threads), log_of(t.name), true), step, wall_clock()};
    }
    void end_leg(const Running& r, const study::ChildResult& ended)
    {
        Trial& t = trial(r.step);
        if (study::waited_for_an_earlier_run(ended.exit_code, log_of(t.name), run_of(t.name), t.waits)) return; // the leg is run again
        require_ended(t.name, ended);
        const int leg = int(t.seen.size());
        t.seen.push_back(inspect(setting_, run_of(t.name), leg > 0 ? end_of_leg(setting_, leg - 1) : 0, end_of_leg(setting_, leg)));
        t.seconds += wall_clock() - r.began;
        t.outcome = judge(setting_, t.seen);
        keep(t);
    }
    void say_of(const Trial& t, bool there) const
    {
        const auto& s = t.seen.back();
        say(fmt::format("  F = {:g}: {}, moved {:.3g} m, {:.2g} of gravity unbalanced{}", t.factor, word(t.outcome), s.displacement,
                        s.unbalanced, there ? ", there already" : fmt::format(", {}", seconds_text(t.seconds))));
    }

    /// Legs of one trial, until it is decided and as long as `more` says.
    template <class More> void run_alone(int step, More more)
    {
        while (more(trial(step))) {
            if (stop_->came()) throw Stop{};
            auto r = begin_leg(step);
            const auto ended = r.child.ended(true);
            end_leg(r, *ended);
        }
    }

    /// Trials side by side until the bracket is as narrow as asked for.
    void search()
    {
        std::list<Running> running;
        std::set<int> steps;
        const auto learn = [&](int step, bool there) {
            say_of(trial(step), there);
            search_.tell(step, trial(step).outcome);
        };
        while (!search_.done()) {
            while (!stop_->came() && int(running.size()) < jobs_) {
                const auto step = search_.next(steps);
                if (!step) break;
                if (trial(*step).outcome != Outcome::Open) {
                    learn(*step, true);
                    continue;
                }
                steps.insert(*step);
                running.push_back(begin_leg(*step));
            }
            for (auto at = running.begin(); at != running.end();) {
                const auto ended = at->child.ended();
                if (!ended) {
                    ++at;
                    continue;
                }
                const int step = at->step;
                const bool useful = !search_.idle(step);
                if (useful) end_leg(*at, *ended);
                at = running.erase(at);
                if (useful && trial(step).outcome == Outcome::Open && !stop_->came()) {
                    running.push_back(begin_leg(step));
                    continue;
                }
                steps.erase(step);
                if (useful && trial(step).outcome != Outcome::Open) learn(step, false);
                // Another's outcome has made it needless.
                for (const auto& r : running)
                    if (search_.idle(r.step)) r.child.send(SIGTERM);
            }
            if (stop_->came() && running.empty()) throw Stop{};
            std::this_thread::sleep_for(std::chrono::milliseconds(3));
        }
        for (auto& r : running) r.child.send(SIGTERM);
        for (auto& r : running) r.child.ended(true);
    }

    // ---- the answer

    Exit answer()
    {
        say(fmt::format("{}: factor of safety from {:g} to {:g}, bracket {:g}, {} in {}", setting_.base.title, args_.from, args_.to,
                        args_.bracket, jobs_ > 1 ? fmt::format("{} trials at a time", jobs_) : "one trial at a time", out_.string()));
        if (state_) find_state();
        const bool there = trial(0).outcome != Outcome::Open;
        run_alone(0, [](const Trial& t) { return t.outcome == Outcome::Open; });
        say_of(trial(0), there);
        Answer found;
        if (trial(0).outcome == Outcome::Fails) {
            found.fails = args_.from;
            return publish(found, 0);
        }
        search();
        found.holds = search_.factor(search_.holds());
        const int fails = search_.fails();
        if (fails > search_.steps()) return publish(found, -1);
        found.fails = search_.factor(fails);
        // It goes on for the picture: on the slip surface strain grows.
        if (study::has_checkpoint(run_of(trial(fails).name)))
            run_alone(fails, [&](const Trial& t) { return t.seen.size() < legs && t.seen.back().displacement < setting_.limit; });
        return publish(found, fails);
    }

    /// `shown`: the step whose plastic strain is drawn; -1: none.
    Exit publish(const Answer& found, int shown)
    {
        Told told{setting_, args_.scene.file, {}, found, args_.at, notes_of(setting_.base), {}};
        for (const auto& [step, t] : trials_)
            if (t.outcome != Outcome::Open) told.trials.push_back(t);
        if (shown >= 0) told.picture = draw(trial(shown));
        io::write_atomically(out_ / "safety.csv", to_csv(told));
        io::write_atomically(out_ / "safety.json", to_json(told).dump(1) + "\n");
        io::write_atomically(out_ / "report.html", html(told, out_));
        // Only what was seen counts, and the state from which another bracket's trials start.
        std::error_code error;
        for (const auto& [step, t] : trials_)
            if (t.outcome == Outcome::Open) std::filesystem::remove_all(run_of(t.name), error);
            else if (step > 0)
                for (const char* name : {"checkpoint.h5", "checkpoint.prev.h5"}) std::filesystem::remove(run_of(t.name) / name, error);
        say(fmt::format("\n{}", found.words()));
        for (const auto& n : told.notes) say("  " + n);
        say((out_ / "report.html").string());
        return Exit::Ok;
    }

    /// The slip surface; the file's name, or nothing where this program draws none.
    std::string draw(const Trial& t) const
    {
        const char* name = "slip_surface.png";
        try {
            const auto [results, scene] = open_results(comm_, run_of(t.name));
            auto task = picture_task(scene, results);
            task.color = "plastic_strain", task.range = {};
            task.view = setting_.base.output.picture ? setting_.base.output.picture->view : scene::View::Slice; // it lies inside
            task.at = HUGE_VAL;
            task.file = [&](int) { return io::Place(out_ / name); };
            for (const auto& w : io::draw_pictures(comm_, task).warnings) complain("warning: " + w);
            return name;
        } catch (const BadInput& e) {
            complain(std::string("warning: ") + e.what());
            return {};
        }
    }

    const Comm& comm_;
    Arguments args_;
    Search search_;
    Setting setting_;
    std::optional<Scene> state_; // its own run is asked for
    std::string identity_;
    io::Path out_;
    int cores_ = 1, jobs_ = 1;
    std::map<int, Trial> trials_; // by step; 0: the settled state
    std::optional<io::Ownership> owner_;
    std::optional<study::StopRequest> stop_;
};

} // namespace

std::optional<double> Answer::factor() const { return holds && fails ? std::optional(0.5 * (*holds + *fails)) : std::nullopt; }

std::string Answer::words() const
{
    if (factor()) return fmt::format("factor of safety {:.4g}: the soil holds at {:g} and fails at {:g}", *factor(), *holds, *fails);
    if (fails)
        return fmt::format("factor of safety below {0:g}: the soil fails with its strength over {0:g} already; a smaller --from, in "
                           "another directory, tells how far",
                           *fails);
    return fmt::format("factor of safety above {0:g}: the soil holds with its strength over {0:g}; a larger --to goes on from there",
                       holds.value_or(0));
}

Exit run_safety(const Comm& comm, const Arguments& a) { return Safety(comm, a).go(); }

} // namespace kuzure::safety
