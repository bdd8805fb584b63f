#include "solver/app/hazard/runner.hpp"
#include "io/owner.hpp"
#include "solver/app/hazard/kept.hpp"
#include "solver/app/hazard/page.hpp"
#include "solver/app/hazard/plan.hpp"
#include "solver/app/hazard/queue.hpp"
#include "solver/app/run/maps.hpp"
#include "solver/app/study/runs.hpp"
#include "solver/core/wall_clock.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

class Hazard {
public:
    Hazard(const Comm& comm, const Arguments& a)
        : began_(wall_clock()), args_(a), within_(a.within.empty() ? 0 : parse_within(a.within)), layers_(parse_layers(a.layers))
    {
        if (comm.size() > 1)
            throw BadInput("kuzure hazard starts its runs itself: start it without mpirun; --jobs says how many run at a time");
        if (a.prepare) {
            if (!a.within.empty() || !a.members_from.empty())
                throw BadInput("--prepare: expected no --within and no --members-from beside it, for it runs nothing; leave them out");
            if (!layers_.given)
                throw BadInput("--prepare: expected --layers, as nothing is measured from which they would follow; write, for example, "
                               "--layers 4,6,10");
            within_ = HUGE_VAL;
        } else if (a.within.empty() == a.members_from.empty())
            throw BadInput(a.within.empty() ? "expected --within TIME, after which the answer is needed; write, for example, --within 30m"
                                            : "expected --within or --members-from, found both: the latter runs nothing");
        const auto checked = a.scene.read(comm);
        const auto text = io::read_scene_text(a.scene.file);
        const auto uncertain = io::parse_uncertain(text, a.scene.file, a.scene.sets);
        base_ = base_of(checked, uncertain, a.scene.file);
        varied_ = uncertain.has_value();
        if (!varied_ && a.members > 0)
            throw BadInput(
                fmt::format("{}: --members: expected [uncertain] in the scene, from which members are drawn, found none. Remedy: "
                            "[uncertain] bed_friction = {{ low = 16.0, likely = 20.0, high = 28.0 }} (docs/hazard.md)",
                            a.scene.file));
        if (!varied_ && a.prepare)
            throw BadInput(fmt::format("{}: --prepare: expected [uncertain] in the scene, found none: it would be one run, kuzure run",
                                       args_.scene.file));
        points_ = points_of_maps(comm, base_.scene, checked.filling, [&](const std::string& w) { complain(w); });
        out_ = study::directory_for(a.output, base_.scene, a.scene.file, "hazard");
        cores_ = std::max(1, cores_here());
        jobs_ = std::min(a.jobs > 0 ? a.jobs : cores_, study::most_children);
    }

    Exit go()
    {
        if (!args_.members_from.empty()) return answer_again(base_, args_, points_, out_);
        study::require_own_directory(out_, "plan.json", "a hazard");
        fixed_spacing_ = !base_.scene.start.from.empty();
        begin_plan();
        // What cannot run shall not begin: the corners of what is uncertain are read as a run reads them.
        for (const bool high : {false, true}) {
            const auto m = corner_member(base_.uncertain, high);
            const auto r = run_scene(base_, preliminary_spacing_, m, high ? "highest" : "lowest", {});
            io::parse_scene(r.text, fmt::format("{} with the {} values of [uncertain]", args_.scene.file, high ? "high" : "low"), r.sets);
        }
        open();
        if (args_.prepare) return prepare();
        stop_.emplace();
        queue_.emplace(
            base_, out_, within_, [this] { return left(); }, [this] { return stop_->came(); }, [this] { publish_now_and_then(); });
        reserve_ = std::clamp(0.02 * within_, 0.3, 2.0);

        say(fmt::format("{}: an answer within {}, {} in {}", base_.scene.title, seconds_text(within_),
                        jobs_ > 1 ? fmt::format("{} runs at a time", jobs_) : "one run at a time", out_.string()));
        auto& first = queue_->add(Part::Preliminary, likely_member(base_.uncertain), preliminary_spacing_, "preliminary");
        queue_->work({&first}, 1, cores_, 0);
        if (first.status == Status::Refused)
            throw BadInput(fmt::format("the scene was refused at {:.3g} layers: {}", first.layers, first.message));
        cost_ = measured_cost(first.seconds, first.layers);
        publish(false);

        const Plan plan = plan_ensemble();
        if (varied_) ensemble(plan);
        if (over()) not_finer({"no time was left", "時間切れ"});
        while (!over() && finer()) {}
        while (!over() && more_members()) {}
        return end();
    }

private:
    double now() const { return wall_clock() - began_; }
    double left() const { return within_ - reserve_ - now(); }
    bool over() const { return left() <= 0 || stop_->came(); }

    // ---- the directory

    /// What makes runs those of one answer: scene, distributions, the coarsest run.
    std::string identity() const
    {
        const auto& u = base_.uncertain;
        std::string text = fmt::format("{} {} {}", io::scene_hash(base_.scene), base_.scene.time.end, u.seed);
        for (const auto& i : inputs_of(u)) text += fmt::format(" {} {} {} {}", i.name, i.range.low, i.range.likely, i.range.high);
        if (u.dem_error) text += fmt::format(" {} {}", u.dem_error->height, u.dem_error->length);
        text += fmt::format(" {} {}", base_.scene.maps->cell, base_.scene.maps->wet);
        return text;
    }

    /// What an earlier call in this directory decided, or the beginning of it.
    void begin_plan()
    {
        std::error_code error;
        if (std::filesystem::exists(out_ / "plan.json", error)) {
            try {
                plan_ = plan_from_text(io::read_text(out_ / "plan.json"));
            } catch (const IoFailed&) {
                throw;
            } catch (const std::runtime_error& e) {
                throw IoFailed(
                    fmt::format("{}: damaged ({}). Remedy: choose another directory with -o DIR", (out_ / "plan.json").string(), e.what()));
            }
            preliminary_spacing_ = plan_.preliminary_spacing, group_ = plan_.group;
            if (plan_.of != identity())
                throw BadInput(fmt::format("{}: expected the directory of this scene, found one whose runs have other physics or other "
                                           "[uncertain]. Remedy: choose another with -o DIR",
                                           out_.string()));
            const double was = plan_.ensemble_layers.value_or(0);
            if (layers_.given && was > 0 && std::fabs(was - layers_.ensemble) > 1e-9)
                throw BadInput(
                    fmt::format("--layers: the members in {} have {:g} layers. Remedy: leave --layers out, or choose another -o DIR",
                                out_.string(), was));
        } else {
            const double own = base_.layers_of(base_.scene.space.spacing);
            const double wanted = layers_.preliminary > 0 ? layers_.preliminary : std::min(preliminary_layers, std::max(own, 1.0));
            preliminary_spacing_ = fixed_spacing_ ? base_.scene.space.spacing : possible_spacing(base_, base_.spacing_of(wanted));
            plan_ = {identity(), preliminary_spacing_, 0, {}, {}};
        }
        base_.coarsest = preliminary_spacing_;
    }
    void keep_plan() { io::write_atomically(out_ / "plan.json", to_text(plan_)); }

    void open()
    {
        study::make_directories(out_, {"scenes", "inputs", "logs", "members"});
        owner_.emplace(io::hold(out_), complain);
        keep_plan();
        io::write_atomically(out_ / "scene.toml", io::read_scene_text(args_.scene.file));
    }

    // ---- what is run

    Plan plan_ensemble()
    {
        // Members side by side share what one run has alone: what happens before the first step, too.
        Cost shared = cost_;
        shared.start /= std::min(jobs_, cores_);
        double layers = plan_.ensemble_layers.value_or(layers_.ensemble);
        if (fixed_spacing_) layers = base_.layers_of(base_.scene.space.spacing);
        const int asked = args_.members > 0 ? args_.members : base_.uncertain.members;
        Plan p = make_plan(shared, left(), asked, layers);
        if (group_ == 0) group_ = asked > 0 ? asked : p.members;
        if (asked == 0) p.members = group_;
        plan_.group = group_, plan_.ensemble_layers = p.layers;
        keep_plan();
        return p;
    }

    /// Scenes of all runs, and a line for each that says how it is run. The answer is made by the same command with --within, which finds
    /// them finished.
    Exit prepare()
    {
        queue_.emplace(
            base_, out_, within_, [] { return HUGE_VAL; }, [] { return false; }, [] {});
        queue_->add(Part::Preliminary, likely_member(base_.uncertain), preliminary_spacing_, "preliminary");
        const Plan p = plan_ensemble();
        add_ensemble(p);
        if (layers_.finer > 0 && !fixed_spacing_) {
            plan_.finer_layers = {layers_.finer};
            add_finer(possible_spacing(base_, base_.spacing_of(layers_.finer)));
        }
        keep_plan();
        std::string lines;
        for (auto& r : queue_->runs) lines += queue_->prepare_only(r) + "\n";
        io::write_atomically(out_ / "runs.txt", lines);
        say(fmt::format("{} runs: kuzure run with a line of {} each, {} members among them; then this command with --within for --prepare",
                        queue_->runs.size(), (out_ / "runs.txt").string(), p.members));
        return Exit::Ok;
    }

    double ensemble_spacing(double layers) const
    {
        return fixed_spacing_ ? base_.scene.space.spacing : possible_spacing(base_, base_.spacing_of(layers));
    }

    std::vector<Run*> add_ensemble(const Plan& p)
    {
        const double spacing = ensemble_spacing(p.layers);
        std::vector<Run*> all;
        if (spacing != preliminary_spacing_) all.push_back(&queue_->add(Part::Likely, likely_member(base_.uncertain), spacing, "likely"));
        for (auto& m : draw_members(base_.uncertain, group_, p.members))
            all.push_back(&queue_->add(Part::Member, m, spacing, fmt::format("members/{:03}", m.number)));
        return all;
    }
    Run& add_finer(double spacing)
    {
        return queue_->add(Part::Finer, likely_member(base_.uncertain), spacing, fmt::format("finer-{:.3g}", base_.layers_of(spacing)));
    }

    void ensemble(const Plan& p)
    {
        const double spacing = ensemble_spacing(p.layers);
        const int threads = std::max(1, cores_ / jobs_);
        const auto todo = add_ensemble(p);
        const double each = cost_.start + (cost_.seconds(base_.layers_of(spacing)) - cost_.start) * std::min(jobs_, cores_);
        say(fmt::format("ensemble: {} members with {:.3g} layers, about {} each", p.members, base_.layers_of(spacing), seconds_text(each)));
        queue_->work(todo, jobs_, threads, 0); // until one is measured, to try costs nothing
        if (!over()) publish(false);
        // What one of them took tells what a finer one will.
        double sum = 0;
        int n = 0;
        for (const auto* r : todo)
            if (r->finished()) sum += r->seconds, ++n;
        if (n > 0) {
            cost_ = measured_cost(sum / n, base_.layers_of(spacing));
            cost_.steps = std::max(1e-3, cost_.steps / std::min(jobs_, cores_));
        }
    }

    double finest() const
    {
        double spacing = HUGE_VAL;
        for (const auto& r : queue_->runs)
            if (r.part != Part::Member && r.finished()) spacing = std::min(spacing, r.spacing);
        return base_.layers_of(spacing);
    }

    /// A finer run of the likely values, if one fits; whether another may.
    bool finer()
    {
        if (fixed_spacing_)
            return not_finer(
                {"the scene starts from the state of another run, whose spacing is given", "初期状態の粒子間隔が決まっているため"});
        if (layers_.given && layers_.finer == 0) return not_finer({"--layers asks for none", "--layers の指定により"});
        const auto before = std::size_t(std::ranges::count_if(queue_->runs, [](const Run& r) { return r.part == Part::Finer; }));
        if (layers_.given && before > 0) return false;
        auto& kept = plan_.finer_layers; // an earlier call's, perhaps with a checkpoint
        double layers = kept.size() > before ? kept[before] : 0;
        if (layers == 0) {
            layers = layers_.given ? layers_.finer : finer_layers(cost_, left(), finest());
            if (layers == 0)
                return not_finer({fmt::format("the time left, {}, is too short for one", seconds_text(std::max(0.0, left()))),
                                  "残り時間が足りないため"});
        }
        const double spacing = possible_spacing(base_, base_.spacing_of(layers));
        if (!(base_.layers_of(spacing) > 1.05 * finest()))
            return not_finer({"the bodies hold no finer whole spacings that fit", "物体の寸法に合う細かい間隔がないため"});
        if (kept.size() <= before) kept.push_back(layers);
        keep_plan();
        auto& r = add_finer(spacing);
        const double expected = cost_.seconds(r.layers);
        say(fmt::format("finer: the likely values with {:.3g} layers, about {}", r.layers, seconds_text(expected)));
        queue_->work({&r}, 1, cores_, layers_.given ? 0 : std::min(expected, 0.98 * left()));
        if (!r.finished()) return false;
        cost_ = measured_cost(r.seconds, r.layers);
        if (!over()) publish(false);
        return true;
    }
    bool not_finer(Words why)
    {
        if (finer_not_done_.en.empty()) finer_not_done_ = std::move(why);
        return false;
    }

    /// More members, where nobody said how many; whether still more may fit.
    bool more_members()
    {
        if (!varied_ || args_.members > 0 || base_.uncertain.members > 0 || layers_.given) return false;
        double sum = 0, spacing = 0;
        int n = 0, last = 0;
        for (const auto& r : queue_->runs) {
            if (r.part != Part::Member) continue;
            last = std::max(last, r.member.number), spacing = r.spacing;
            if (r.finished()) sum += r.seconds, ++n;
        }
        if (n == 0 || sum / n > left()) return false;
        const auto all = draw_members(base_.uncertain, group_, last + group_);
        std::vector<Run*> todo;
        for (auto m = all.begin() + last; m != all.end(); ++m)
            todo.push_back(&queue_->add(Part::Member, *m, spacing, fmt::format("members/{:03}", m->number)));
        say(fmt::format("more members: {} to {}", last + 1, last + group_));
        extra_from_ = extra_from_ > 0 ? extra_from_ : last + 1;
        queue_->work(todo, jobs_, std::max(1, cores_ / jobs_), sum / n);
        return std::ranges::all_of(todo, [](const Run* r) { return r->status != Status::NotRun && r->status != Status::Stopped; });
    }

    // ---- what is published

    std::vector<Words> what_is_not_done() const { return not_done(runs(), extra_from_, varied_, finer_not_done_); }
    std::vector<Run> runs() const { return {queue_->runs.begin(), queue_->runs.end()}; }

    void publish_now_and_then()
    {
        const auto members = std::ranges::count_if(queue_->runs, [](const Run& r) { return r.part == Part::Member && r.finished(); });
        if (members >= enough_members && now() - published_at_ > std::max(10.0, 20 * publish_seconds_) && !over()) publish(false);
    }

    /// Nothing where no run is finished.
    std::optional<Answer> publish(bool final)
    {
        const double begin = now();
        published_ = runs();
        if (std::ranges::none_of(published_, &Run::finished)) return {};
        Answer answer = answer_of(base_, published_);
        write_maps(base_, answer, points_, out_);
        State state{base_,
                    args_.scene.file,
                    published_,
                    within_,
                    0,
                    group_,
                    final,
                    final ? what_is_not_done() : std::vector<Words>{},
                    not_modelled(base_)};
        state.ended = now();
        io::write_atomically(out_ / "report.html", html(state, answer, out_));
        io::write_atomically(out_ / "hazard.json", to_json(state, answer).dump(1) + "\n");
        publish_seconds_ = now() - begin, published_at_ = now();
        reserve_ = std::max(reserve_, 1.2 * publish_seconds_ + 0.3);
        return answer;
    }

    Exit end()
    {
        const auto answer = publish(true);
        const bool stopped = stop_->came();
        stop_.reset();
        if (!answer) {
            for (const auto& line : what_is_not_done()) say("  not done: " + line.en);
            if (stopped) {
                say("stopped on request before anything was finished; the same command goes on");
                return Exit::Stopped;
            }
            throw NumbersFailed(
                fmt::format("no run of {} was finished within {}: there is no answer. Remedy: a longer --within (the same command "
                            "goes on from here), fewer --layers",
                            args_.scene.file, seconds_text(within_)));
        }
        say(fmt::format("\nreach {:.4g} m ({:.4g} to {:.4g} m) from the middle of the mass, of {} runs; resolution: {}", answer->likely,
                        answer->low, answer->high, answer->counted.size(), answer->discretisation.how));
        for (const auto& s : answer->sensitivity)
            if (std::isfinite(s.correlation))
                say(fmt::format("  {:<16} rank correlation with the reach {:+.2f} ({})", s.input, s.correlation,
                                std::isfinite(s.interval[0]) ? fmt::format("{:+.2f} to {:+.2f}", s.interval[0], s.interval[1])
                                                             : "too few members for an interval"));
        for (const auto& line : what_is_not_done()) say("  not done: " + line.en);
        say(fmt::format("{}after {} of {}: {}", stopped ? "stopped on request " : "", seconds_text(now()), seconds_text(within_),
                        (out_ / "report.html").string()));
        return stopped ? Exit::Stopped : Exit::Ok;
    }

    double began_;
    Arguments args_;
    double within_;
    Layers layers_;
    Base base_;
    bool varied_ = false, fixed_spacing_ = false;
    std::vector<io::NamedPoint> points_;
    io::Path out_;
    int cores_ = 1, jobs_ = 1, group_ = 0, extra_from_ = 0;
    double preliminary_spacing_ = 0, reserve_ = 0, publish_seconds_ = 0, published_at_ = 0;
    Cost cost_;
    KeptPlan plan_;
    Words finer_not_done_;
    std::optional<Queue> queue_;
    std::vector<Run> published_; // what the last answer points at
    std::optional<io::Ownership> owner_;
    std::optional<study::StopRequest> stop_;
};

} // namespace

Exit run_hazard(const Comm& comm, const Arguments& a) { return Hazard(comm, a).go(); }

} // namespace kuzure::hazard
