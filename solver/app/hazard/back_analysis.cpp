#include "solver/app/hazard/back_analysis.hpp"
#include "io/csv.hpp"
#include "io/ground/raster.hpp"
#include "io/map_picture.hpp"
#include "io/owner.hpp"
#include "solver/app/hazard/kept.hpp"
#include "solver/app/hazard/plan.hpp"
#include "solver/app/study/runs.hpp"
#include "solver/core/wall_clock.hpp"
#include "solver/scene/ground.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

constexpr const char* mark = "fit_plan.json";
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
/// Times the layers of the best run, for particles at other positions: enough to move all of them, too few for another answer.
constexpr std::array repeat_layers{1.08, 1.17};
/// Below it soil is recorded too, so that outlines can be drawn through the cells in between.
constexpr double recorded = 0.1;

class BackAnalysis {
public:
    BackAnalysis(const Comm& comm, const BackArguments& a)
        : began_(wall_clock()), args_(a), within_(a.within.empty() ? 0 : parse_within(a.within)), layers_(parse_layers(a.layers))
    {
        if (comm.size() > 1)
            throw BadInput("kuzure fit starts its runs itself: start it without mpirun; --jobs says how many run at a time");
        if (a.layers.find(',') != a.layers.npos)
            throw BadInput(fmt::format("--layers: expected one number, of all runs, found \"{}\"", a.layers));
        const auto checked = a.scene.read(comm);
        auto uncertain = io::parse_uncertain(io::read_scene_text(a.scene.file), a.scene.file, a.scene.sets).value_or(scene::Uncertain{});
        uncertain.dem_error.reset();
        axes_ = axes_for(a.inputs, a.values, uncertain);
        base_ = base_of(checked, uncertain, a.scene.file);
        base_.wet = base_.scene.maps->wet, base_.recorded = recorded; // the event is what it is, however coarse the runs
        const double own = base_.scene.space.spacing;
        fixed_spacing_ = !base_.scene.start.from.empty();
        if (fixed_spacing_ && layers_.given)
            throw BadInput(fmt::format("--layers: {} starts from the state of another run (start.from), whose spacing is given. Remedy: "
                                       "leave it out",
                                       a.scene.file));
        spacing_ = layers_.given ? possible_spacing(base_, base_.spacing_of(layers_.ensemble)) : own;
        observed_ = read_observed(a.observed, base_, checked.filling, base_.wet);
        out_ = study::directory_for(a.output, base_.scene, a.scene.file, "fit");
        cores_ = std::max(1, cores_here());
        jobs_ = std::min(a.jobs > 0 ? a.jobs : cores_, study::most_children);
    }

    Exit go()
    {
        study::require_own_directory(out_, mark, "a fit");
        begin_plan();
        // What cannot run shall not begin: both ends are read as a run reads them.
        base_.coarsest = spacing_;
        for (const bool high : {false, true}) {
            std::vector<int> at;
            for (const auto& axis : axes_) at.push_back(high ? axis.parts : 0);
            auto m = member_at(at);
            const auto inputs = inputs_of(base_.uncertain);
            for (std::size_t k = 0; k < inputs.size(); ++k)
                if (inputs[k].name == "thickness") m.values[k] = 1; // files of its own it gets later
            const auto r = run_scene(base_, spacing_, m, high ? "highest" : "lowest", {});
            io::parse_scene(r.text, fmt::format("{} with the {} value of the range", args_.scene.file, high ? "high" : "low"), r.sets);
        }
        for (const auto& doubt : observed_.doubts) complain(doubt);
        study::make_directories(out_, {"scenes", "inputs", "logs", "runs"});
        owner_.emplace(io::hold(out_), complain);
        keep_plan();
        io::write_atomically(out_ / "scene.toml", io::read_scene_text(args_.scene.file));
        stop_.emplace();
        constexpr double patience = 1000; // s: without a deadline; a run that is stopped gets some of it for its checkpoint
        queue_.emplace(
            base_, out_, within_ > 0 ? within_ : patience, [this] { return left(); }, [this] { return stop_->came(); },
            [this] { compare_new_runs(); });
        if (within_ > 0 && !layers_.given && !fixed_spacing_) choose_layers();
        begin_runs();

        search();
        if (!over()) repeat_best();
        if (!over()) search();
        return end();
    }

private:
    double now() const { return wall_clock() - began_; }
    double left() const { return within_ > 0 ? within_ - std::clamp(0.02 * within_, 0.3, 2.0) - now() : HUGE_VAL; }
    bool over() const { return left() <= 0 || stop_->came(); }

    // ---- what is sought

    Member member_at(const std::vector<int>& at) const
    {
        Member m = likely_member(base_.uncertain);
        const auto inputs = inputs_of(base_.uncertain);
        for (std::size_t k = 0; k < inputs.size(); ++k)
            for (std::size_t a = 0; a < axes_.size(); ++a)
                if (axes_[a].name == inputs[k].name) m.values[k] = axes_[a].value(at[a]);
        return m;
    }

    // ---- the directory

    /// What makes runs those of one search.
    std::string identity() const
    {
        std::string text =
            fmt::format("{} {} {} {}", io::scene_hash(base_.scene), base_.scene.time.end, base_.scene.maps->cell, base_.scene.maps->wet);
        for (const auto& i : inputs_of(base_.uncertain))
            text += fmt::format(" {} {} {} {}", i.name, i.range.low, i.range.likely, i.range.high);
        for (const auto& a : axes_) text += fmt::format(" {} {}", a.name, a.scan);
        text += fmt::format(" {} {} {} {}", observed_.deposit, observed_.area, observed_.perimeter, observed_.reach);
        return text;
    }
    void begin_plan()
    {
        std::error_code error;
        if (!std::filesystem::exists(out_ / mark, error)) {
            plan_ = {identity(), {}};
            return;
        }
        try {
            plan_ = fit_from_text(io::read_text(out_ / mark));
        } catch (const IoFailed&) {
            throw;
        } catch (const std::runtime_error& e) {
            throw IoFailed(fmt::format("{}: damaged ({}). Remedy: choose another directory with -o DIR", (out_ / mark).string(), e.what()));
        }
        if (plan_.of != identity())
            throw BadInput(fmt::format("{}: expected the directory of this search, found one with another scene, event or range. Remedy: "
                                       "choose another with -o DIR",
                                       out_.string()));
        if (!plan_.spacing) return;
        const double was = *plan_.spacing;
        if (layers_.given && was != spacing_)
            throw BadInput(fmt::format("--layers: the runs in {} have {:.3g} layers. Remedy: leave --layers out, or choose another -o DIR",
                                       out_.string(), base_.layers_of(was)));
        spacing_ = was;
    }
    void keep_plan() { io::write_atomically(out_ / mark, to_text(plan_)); }

    // ---- what is run

    /// About how many runs a search takes.
    int usual_runs() const
    {
        int scan = 1;
        for (const auto& a : axes_) scan *= a.scan;
        return scan + (axes_.size() == 1 ? 14 : 45);
    }

    double coarse_spacing() const
    {
        const double own = base_.layers_of(base_.scene.space.spacing);
        return possible_spacing(base_, base_.spacing_of(std::min(preliminary_layers, std::max(1.0, own))));
    }

    /// With a deadline: as many layers as fit by what one coarse run takes, at most the scene's own.
    void choose_layers()
    {
        if (plan_.spacing) return;
        const double own = base_.scene.space.spacing;
        const double coarse = coarse_spacing();
        base_.coarsest = coarse;
        std::vector<int> middle;
        for (const auto& a : axes_) middle.push_back(a.parts / 2);
        auto& r = queue_->add(Part::Preliminary, member_at(middle), coarse, "preliminary");
        queue_->work({&r}, 1, cores_, 0);
        spacing_ = coarse;
        if (!r.finished()) return;
        Cost cost = measured_cost(r.seconds, r.layers);
        cost.start /= std::min(jobs_, cores_);
        double layers = r.layers;
        while (layers < base_.layers_of(own) && usual_runs() * cost.seconds(layers + 0.1) < 0.8 * left()) layers += 0.1;
        if (layers >= 0.97 * base_.layers_of(own)) spacing_ = own;
        else if (layers > 1.15 * r.layers) spacing_ = possible_spacing(base_, base_.spacing_of(layers));
    }

    void begin_runs()
    {
        base_.coarsest = spacing_;
        const auto maps = maps_of_runs(base_);
        cell_ = maps.cell, wet_ = maps.wet;
        of_cells_ = misfit_of_cells(observed_, cell_);
        plan_.spacing = spacing_;
        keep_plan();
        std::vector<std::string> ranges;
        for (const auto& a : axes_) ranges.push_back(fmt::format("{} from {:g} to {:g}{}", a.name, a.low, a.high, unit_of(a)));
        say(fmt::format("{}: {}, {} values{} first, {:.3g} layers, {} in {}", base_.scene.title, fmt::join(ranges, " and "), axes_[0].scan,
                        axes_.size() > 1 ? " of each" : "", base_.layers_of(spacing_),
                        jobs_ > 1 ? fmt::format("{} runs at a time", jobs_) : "one run at a time", out_.string()));
        say(fmt::format("observed: {}: {:.4g} m2, to {:.4g} m from the middle of the mass; {} counts from {:g} m", observed_.file,
                        observed_.area, observed_.reach, observed_.deposit ? "deposit" : "what was reached", wet_));
    }
    static std::string unit_of(const Axis& a) { return a.unit.empty() || a.unit == "1" ? "" : " " + a.unit; }

    std::vector<Trial> trials() const
    {
        std::vector<Trial> all;
        for (const auto& t : tried_)
            if (t.run->status == Status::Finished) all.push_back({t.at, t.compared.misfit});
            else if (t.run->status == Status::Failed || t.run->status == Status::Refused) all.push_back({t.at, nan});
        return all;
    }

    /// By how much misfits differ that cannot be told apart.
    double alike() const { return std::max({of_cells_, scatter_of(trials()), std::isnan(of_repeats_) ? 0 : of_repeats_}); }

    void search()
    {
        while (!over()) {
            const auto next = next_trials(axes_, trials(), alike());
            if (next.empty()) break;
            std::vector<Run*> todo;
            for (const auto& at : next) {
                auto known = std::ranges::find(tried_, at, &Tried::at);
                if (known == tried_.end()) {
                    auto& r = queue_->add(Part::Member, member_at(at), spacing_, fmt::format("runs/{:03}", tried_.size() + 1));
                    r.member.number = int(tried_.size()) + 1;
                    tried_.push_back({&r, at, {}});
                    known = tried_.end() - 1;
                }
                todo.push_back(known->run);
            }
            if (!work(todo)) break;
            publish(state(false));
        }
    }
    /// Whether all of them have ended.
    bool work(const std::vector<Run*>& todo)
    {
        const int together = std::min<int>(jobs_, int(todo.size()));
        queue_->work(todo, jobs_, std::max(1, cores_ / together), within_ > 0 ? mean_seconds() : 0);
        compare_new_runs();
        return std::ranges::all_of(todo, [](const Run* r) { return r->status != Status::NotRun && r->status != Status::Stopped; });
    }
    double mean_seconds() const
    {
        double sum = 0;
        int n = 0;
        for (const auto& t : tried_)
            if (t.run->finished()) sum += t.run->seconds, ++n;
        return n > 0 ? sum / n : 0;
    }

    void compare_new_runs()
    {
        for (auto* list : {&tried_, &repeats_})
            for (auto& t : *list) {
                if (!t.run->finished() || !std::isnan(t.compared.misfit)) continue;
                t.compared = compare(observed_, out_ / t.run->directory, base_, cell_, wet_);
                std::vector<std::string> values;
                for (std::size_t k = 0; k < axes_.size(); ++k)
                    values.push_back(fmt::format("{} {:.4g}{}", axes_[k].name, axes_[k].value(t.at[k]), unit_of(axes_[k])));
                say(fmt::format("    {}{}: overlap {:.1f} %, reach {:+.3g} m{}", fmt::join(values, ", "),
                                list == &repeats_ ? ", once more" : "", 100 * t.compared.overlap, t.compared.reach_error,
                                observed_.deposit ? fmt::format(", thickness off by {:.3g} m rms", t.compared.rms) : ""));
            }
    }

    /// The best values once more with particles at other positions: what comes out otherwise is not the input's doing.
    void repeat_best()
    {
        const auto v = judge(axes_, trials(), alike());
        if (!v || v->at_end) return;
        if (fixed_spacing_) return;
        std::vector<Run*> todo;
        for (const double more : repeat_layers) {
            const double wanted = spacing_ / more, spacing = possible_spacing(base_, wanted);
            if (std::fabs(spacing / wanted - 1) > 0.01) continue; // boxes hold whole layers: another volume is no repeat
            auto& r = queue_->add(Part::Finer, member_at(v->best), spacing, fmt::format("runs/twin-{:.3g}", base_.layers_of(spacing)));
            repeats_.push_back({&r, v->best, {}});
            todo.push_back(&r);
        }
        repeats_wanted_ = !todo.empty();
        if (todo.empty()) return;
        work(todo);
        double low = v->misfit, high = v->misfit;
        bool any = false;
        for (const auto& t : repeats_)
            if (t.run->finished()) low = std::min(low, t.compared.misfit), high = std::max(high, t.compared.misfit), any = true;
        if (!any) return;
        of_repeats_ = high - low;
    }

    // ---- what is published

    BackState state(bool final)
    {
        BackState s{
            .base = base_, .scene_file = args_.scene.file, .observed = observed_, .axes = axes_, .tried = tried_, .repeats = repeats_};
        s.verdict = judge(axes_, trials(), alike());
        s.alike = alike(), s.of_cells = of_cells_, s.of_repeats = of_repeats_, s.of_curve = scatter_of(trials()), s.cell = cell_,
        s.wet = wet_;
        s.spacing = spacing_, s.layers = base_.layers_of(spacing_), s.ended = now(), s.final = final;
        if (s.verdict) s.moving = moving_of(s.best());
        if (final) s.not_done = not_done();
        return s;
    }
    /// Kinetic energy at the end over its greatest.
    double moving_of(const Tried& t) const
    {
        const auto csv = io::read_csv(out_ / t.run->directory / "history.csv", "history.csv of a run");
        const auto column = csv.column("kinetic");
        double most = 0, last = 0;
        for (const auto& row : csv.rows)
            if (const auto e = column ? io::csv_number(row.cells[*column]) : std::nullopt) last = *e, most = std::max(most, last);
        return most > 0 ? last / most : 0;
    }

    std::vector<Words> not_done() const
    {
        std::vector<Words> all;
        int waiting = 0, failed = 0;
        std::string why;
        for (const auto& t : tried_) {
            waiting += t.run->status == Status::NotRun || t.run->status == Status::Stopped;
            if (t.run->status == Status::Failed || t.run->status == Status::Refused) ++failed, why = t.run->message;
        }
        if (failed > 0)
            all.push_back({fmt::format("{} of the runs failed and {} not in the curve ({})", failed, failed == 1 ? "is" : "are", why),
                           fmt::format("失敗した計算 {} 件は曲線に含まれていません({})", failed, why)});
        if (waiting > 0 || !next_trials(axes_, trials(), alike()).empty())
            all.push_back(
                {"the search: no time was left to go closer; the same command goes on", "探索の続き: 時間切れ(同じコマンドで続行)"});
        if (repeats_wanted_ && std::isnan(of_repeats_))
            all.push_back({"the best values with particles at other places: the interval stands on the cells and the curve's scatter alone",
                           "粒子配置を変えた再計算: 区間は格子と曲線のばらつきだけによります"});
        return all;
    }

    void publish(const BackState& s)
    {
        if (!s.verdict) return;
        draw(s);
        io::write_atomically(out_ / "curve.csv", curve_csv(s));
        io::write_atomically(out_ / "report.html", html(s, out_));
        io::write_atomically(out_ / "fit.json", to_json(s).dump(1) + "\n");
    }
    void draw(const BackState& s) const
    {
        if (!io::can_draw()) return;
        const auto& best = s.best();
        auto soil = io::read_raster(out_ / best.run->directory / "maps" / (observed_.deposit ? "h_end.tif" : "h_max.tif")).grid;
        for (double& h : soil.values)
            if (h < wet_ * (1 - 1e-6)) h = nan;
        std::vector<scene::Area> seen;
        for (const auto& ring : observed_.rings) seen.push_back({ring});
        io::MapPicture picture{
            {"", "m", observed_.deposit ? "deposit" : "greatest thickness"}, base_.scene.title, std::move(soil), {}, {}, true};
        picture.outlines.push_back({0, seen, "observed"}), picture.outlines.push_back({0, best.compared.drawn, "best run"});
        if (const scene::HeightField* ground = scene::ground_of(base_.scene))
            picture.ground = [&, ground](double x, double y) {
                return ground->at(x - base_.scene.map_frame.x, y - base_.scene.map_frame.y).z;
            };
        io::write_atomically(out_ / "best.png", io::map_png(picture));
    }

    Exit end()
    {
        const bool stopped = stop_->came();
        const BackState s = state(true);
        publish(s);
        stop_.reset();
        if (!s.verdict) {
            for (const auto& line : s.not_done) say("  not done: " + line.en);
            if (stopped) {
                say("stopped on request before anything was finished; the same command goes on");
                return Exit::Stopped;
            }
            throw NumbersFailed(fmt::format("no run of {} was finished{}: there is no answer. Remedy: {}", args_.scene.file,
                                            within_ > 0 ? " within " + seconds_text(within_) : "",
                                            within_ > 0 ? "a longer --within (the same command goes on from here), fewer --layers"
                                                        : "kuzure run of a scene in " + (out_ / "scenes").string()));
        }
        say("");
        for (const auto& line : meaning(s)) say(line.en);
        for (const auto& line : s.not_done) say("  not done: " + line.en);
        say(fmt::format("{}after {}: {}", stopped ? "stopped on request " : "", seconds_text(now()), (out_ / "report.html").string()));
        return stopped ? Exit::Stopped : Exit::Ok;
    }

    double began_;
    BackArguments args_;
    double within_;
    Layers layers_;
    Base base_;
    bool fixed_spacing_ = false;
    std::vector<Axis> axes_;
    Observed observed_;
    io::Path out_;
    int cores_ = 1, jobs_ = 1;
    double spacing_ = 0, cell_ = 0, wet_ = 0, of_cells_ = 0, of_repeats_ = nan;
    bool repeats_wanted_ = false;
    KeptFit plan_;
    std::vector<Tried> tried_, repeats_;
    std::optional<Queue> queue_;
    std::optional<io::Ownership> owner_;
    std::optional<study::StopRequest> stop_;
};

} // namespace

const Tried& BackState::best() const { return *std::ranges::find(tried, verdict->best, &Tried::at); }

Exit run_back_analysis(const Comm& comm, const BackArguments& a) { return BackAnalysis(comm, a).go(); }

} // namespace kuzure::hazard
