#include "solver/app/study/study.hpp"
#include "io/json.hpp"
#include "io/scene_file.hpp"
#include "solver/app/report/record.hpp"
#include "solver/app/scaling/estimate.hpp"
#include "solver/scene/numbers.hpp"
#include <algorithm>
#include <charconv>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::study {
namespace {

using io::Measure;
const double unknown = std::nan("");

/// Rows of two numbers of a CSV; a header and lines that begin with # are passed over.
std::vector<std::array<double, 2>> read_pairs(const io::Path& file)
{
    std::vector<std::array<double, 2>> rows;
    std::string text;
    try {
        text = io::read_text(file, 1 << 24);
    } catch (const IoFailed& e) {
        throw BadInput(fmt::format("{}: expected a CSV of x and z in m, found none: {}", file.string(), e.what()));
    }
    int line = 0;
    for (std::size_t from = 0; from < text.size();) {
        const std::size_t end = std::min(text.find('\n', from), text.size());
        const std::string_view row(text.data() + from, end - from);
        from = end + 1, ++line;
        if (row.find_first_not_of(" \t\r") == row.npos || row[0] == '#') continue;
        std::array<double, 2> x{};
        const auto a = std::from_chars(row.data(), row.data() + row.size(), x[0]);
        bool good = a.ec == std::errc{} && a.ptr < row.data() + row.size() && *a.ptr == ',';
        if (good) {
            const auto* second = a.ptr + 1;
            while (second < row.data() + row.size() && *second == ' ') ++second;
            good = std::from_chars(second, row.data() + row.size(), x[1]).ec == std::errc{};
        }
        if (!good && rows.empty() && line == 1) continue; // names of the columns
        if (!good || !std::isfinite(x[0]) || !std::isfinite(x[1]))
            throw BadInput(fmt::format("{}:{}: expected two numbers x,z in m, found \"{}\"; correct this line", file.string(), line, row));
        if (!rows.empty() && !(x[0] > rows.back()[0]))
            throw BadInput(
                fmt::format("{}:{}: expected x to rise, found {:g} after {:g}; sort the rows", file.string(), line, x[0], rows.back()[0]));
        rows.push_back(x);
    }
    if (rows.size() < 2) throw BadInput(fmt::format("{}: expected at least two rows of x,z in m, found {}", file.string(), rows.size()));
    return rows;
}

/// RMS distance of two lines x(z), at right angles to the straight line through the second.
double line_distance(const std::vector<std::array<double, 2>>& line, const std::vector<std::array<double, 2>>& to)
{
    if (line.size() < 2 || to.size() < 2) return unknown;
    double mx = 0, mz = 0, xx = 0, xz = 0;
    for (const auto& [x, z] : to) mx += x / double(to.size()), mz += z / double(to.size());
    for (const auto& [x, z] : to) xx += (x - mx) * (x - mx), xz += (x - mx) * (z - mz);
    const double upright = xx > 0 ? std::sin(std::atan(std::fabs(xz / xx))) : 1;
    auto sorted = line;
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a[1] < b[1]; });
    double sum = 0;
    for (const auto& [x, z] : to) {
        auto k = std::size_t(std::lower_bound(sorted.begin(), sorted.end(), z, [](const auto& a, double v) { return a[1] < v; }) -
                             sorted.begin());
        k = std::clamp<std::size_t>(k, 1, sorted.size() - 1);
        const auto &a = sorted[k - 1], &b = sorted[k];
        const double share = std::clamp(b[1] > a[1] ? (z - a[1]) / (b[1] - a[1]) : 0.0, 0.0, 1.0);
        const double gap = (a[0] + share * (b[0] - a[0]) - x) * upright;
        sum += gap * gap;
    }
    return std::sqrt(sum / double(to.size()));
}

double soil_height(const Scene& s)
{
    const auto& b = scene::Filling(s).soil_bounds();
    return b.high.z - b.low.z + s.space.spacing;
}
/// Measures whose value is an error itself.
bool is_error(Measure m) { return m == Measure::Profile || m == Measure::FailureLine || m == Measure::Stress || m == Measure::Residual; }

} // namespace

bool ErrorBar::covers() const { return why_not.empty() && std::fabs(value - truth) <= half_width; }

std::vector<std::string> Study::curves() const
{
    std::vector<std::string> names;
    for (const auto& p : points)
        if (!p.asked.choice && std::find(names.begin(), names.end(), p.asked.curve) == names.end()) names.push_back(p.asked.curve);
    return names;
}
std::vector<const Point*> Study::along(const std::string& curve) const
{
    std::vector<const Point*> all;
    for (const auto& p : points)
        if (!p.asked.choice && p.asked.curve == curve && p.finished()) all.push_back(&p);
    std::stable_sort(all.begin(), all.end(), [](const Point* a, const Point* b) { return a->spacing > b->spacing; });
    return all;
}
bool Study::tells(const Point& p, Measure m) const
{
    const double error = p.error[std::size_t(m)];
    return std::isfinite(error) && error > 0 && p.spacing > reference_spacing[std::size_t(m)] * (1 + 1e-9);
}

std::vector<Price> Study::prices(const std::string& curve, Measure m, bool work) const
{
    std::vector<Price> all;
    for (const Point* p : along(curve))
        if (tells(*p, m)) all.push_back({work ? p->work : p->core_seconds, p->error[std::size_t(m)]});
    return all;
}
const Point* Study::base() const
{
    for (const auto& p : points)
        if (p.asked.choice && p.finished()) return p.asked.curve == "base" ? &p : nullptr;
    return nullptr;
}

Study plan(const io::Sweep& sweep)
{
    Study study;
    study.sweep = sweep;
    const std::string text = io::read_scene_text(sweep.scene);
    if (sweep.reference.kind == io::SweepReference::Kind::Experiment) {
        for (const auto& [x, z] : read_pairs(sweep.reference.profile))
            study.experiment.at.push_back(x), study.experiment.height.push_back(z);
        study.experiment.top = *std::max_element(study.experiment.height.begin(), study.experiment.height.end());
        if (!sweep.reference.failure.empty()) study.experiment_failure = read_pairs(sweep.reference.failure);
    }
    std::string first_message;
    bool any = false;
    double coarsest = 0;
    for (const auto& asked : sweep.points) {
        Point p;
        p.asked = asked;
        try {
            Scene s = io::parse_scene(text, sweep.scene.string(), asked.sets);
            p.spacing = s.space.spacing;
            const scene::Filling filling(s);
            p.predicted_work = work(estimate(s, filling, *choose_model(s, Arithmetic::Simd)));
            for (const auto& n : scene::dimensionless_numbers(s, filling)) {
                if (n.name == "base_strain") p.base_strain = n.value;
                if (n.name == "mach") p.mach = n.value;
            }
            // What a study looks at, and nothing that costs time beside it.
            s.output = {};
            s.output.fields = {"stress", "displacement"};
            s.output.history = s.time.end / 200;
            s.output.checkpoint_minutes = 1e6;
            p.hash = io::scene_hash(s);
            p.folder = fmt::format("{:g}-{}", p.spacing, p.hash.substr(0, 12));
            p.scene = std::move(s);
            coarsest = std::max(coarsest, p.spacing);
            any = true;
        } catch (const BadInput& e) {
            p.exit_code = 2, p.message = e.what();
            if (first_message.empty()) first_message = e.what();
        }
        study.points.push_back(std::move(p));
    }
    if (!any) throw BadInput(fmt::format("every point of the sweep is refused. The first: {}", first_message));
    study.window = 2 * coarsest;
    study.grain = sweep.grain.value_or(coarsest);
    return study;
}

void measure(const Study& study, Point& p, const io::Path& run)
{
    const auto summary = io::parse_json(io::read_text(run / "summary.json"));
    p.particles = summary.at("soil_particles"), p.steps = summary.at("steps");
    p.pairs = summary.at("pairs").get<double>(), p.wall_seconds = summary.at("wall_seconds");
    p.work = p.pairs * step_price(p.scene->accuracy.scheme);
    const auto history = report::read_table(io::read_text(run / "history.csv"));
    const auto& residual = history.at("residual");
    if (residual.empty()) throw std::out_of_range("history.csv has no rows");
    const auto soil = io::read_snapshot(io::last_snapshot(run));
    p.profile = measure_profile(*p.scene, soil, study.window);
    const auto wants = [&](Measure m) {
        return std::find(study.sweep.measures.begin(), study.sweep.measures.end(), m) != study.sweep.measures.end();
    };
    p.value.fill(unknown), p.error.fill(unknown);
    const auto value = [&](Measure m) -> double& { return p.value[std::size_t(m)]; };
    value(Measure::Runout) = p.profile.runout(study.grain);
    value(Measure::Height) = p.profile.top;
    value(Measure::PeakSpeed) = greatest_speed(run, summary.value("peak_speed", 0.0));
    value(Measure::Residual) = std::fabs(residual.back());
    if (wants(Measure::FailureLine)) p.failure = failure_line(soil, p.spacing, 0.02 * study.grain + 1e-3);
    if (wants(Measure::Stress) || wants(Measure::Settlement)) {
        const AtRest rest = measure_at_rest(*p.scene, soil);
        value(Measure::Stress) = rest.stress, value(Measure::Settlement) = rest.settlement;
        p.settlement = rest.settlement_expected;
        p.error[std::size_t(Measure::Settlement)] = std::fabs(rest.settlement / rest.settlement_expected - 1);
    }
}

namespace {
using Kind = io::SweepReference::Kind;

/// The curve whose finest run, or limit, is the reference: the one the sweep names, else that of the finest run with most pairs.
std::string reference_curve(const Study& study)
{
    std::string chosen = study.sweep.reference.curve;
    if (study.sweep.reference.kind != Kind::Finest) return chosen;
    const auto curves = study.curves();
    if (!chosen.empty() && std::find(curves.begin(), curves.end(), chosen) == curves.end())
        throw BadInput(fmt::format("reference.finest: expected the name of a curve, found \"{}\"; the curves are {}", chosen,
                                   fmt::join(curves, "; ")));
    if (!chosen.empty()) return chosen;
    double finest = HUGE_VAL, most = 0;
    for (const auto& p : study.points)
        if (!p.asked.choice && p.finished() && (p.spacing < finest || (p.spacing == finest && p.pairs > most)))
            finest = p.spacing, most = p.pairs, chosen = p.asked.curve;
    return chosen;
}

/// What the errors of a measure count from, and its words.
void find_reference(Study& study, Measure m, const std::string& curve, const Point* finest)
{
    const auto k = std::size_t(m);
    auto& note = study.reference_note[k];
    const Kind kind = study.sweep.reference.kind;
    if (m == Measure::Residual) note = "0: energy is kept";
    else if (kind == Kind::ClosedForm) note = "closed form";
    else if (kind == Kind::Experiment) {
        note = "experiment";
        if (m == Measure::Height) study.reference[k] = study.experiment.top;
        if (m == Measure::Runout && finest == nullptr)
            for (const auto& p : study.points)
                if (p.finished()) {
                    Profile measured = study.experiment;
                    measured.spread = p.profile.spread, measured.start_low = p.profile.start_low,
                    measured.start_high = p.profile.start_high;
                    study.reference[k] = measured.runout(study.grain);
                    break;
                }
        if (m == Measure::PeakSpeed) note = "none: the experiment does not give it";
    } else if (finest) {
        note = fmt::format("the finest run of \"{}\", {:g} m", curve, finest->spacing);
        study.reference[k] = is_error(m) ? unknown : finest->value[k];
        study.reference_spacing[k] = finest->spacing;
        for (const auto& c : study.convergence)
            if (c.curve == curve && c.measure == m) {
                if (c.result.order) {
                    study.reference[k] = c.result.limit, study.reference_spacing[k] = 0;
                    note = fmt::format("limit of \"{}\" by Richardson extrapolation, observed order {:.2f}", curve, *c.result.order);
                } else {
                    note += fmt::format("; no extrapolation: {}", c.result.why_not);
                }
            }
    }
}

/// The error of a measure of one run; what it had where the reference says nothing of it.
double error_of(const Study& study, const Point& p, Measure m, const Point* finest)
{
    const auto k = std::size_t(m);
    const Kind kind = study.sweep.reference.kind;
    const bool another = finest && p.hash != finest->hash;
    switch (m) {
    case Measure::Residual:
    case Measure::Stress:
        return p.value[k];
    case Measure::Settlement:
        break; // the closed form is that of its own scene
    case Measure::Profile:
        if (kind == Kind::Experiment) {
            double e2 = 0, r2 = 0;
            for (std::size_t i = 0; i < study.experiment.at.size(); ++i) {
                const double e = p.profile(study.experiment.at[i]) - study.experiment.height[i];
                e2 += e * e, r2 += study.experiment.height[i] * study.experiment.height[i];
            }
            return std::sqrt(e2 / r2);
        }
        if (another) return profile_distance(p.profile, finest->profile);
        break;
    case Measure::FailureLine:
        if (kind == Kind::Experiment) return line_distance(p.failure, study.experiment_failure) / soil_height(*p.scene);
        if (another) return line_distance(p.failure, finest->failure) / soil_height(*p.scene);
        break;
    default:
        if (std::isfinite(study.reference[k]) && !(finest && p.hash == finest->hash && study.reference[k] == p.value[k]))
            return std::fabs(p.value[k] / study.reference[k] - 1);
    }
    return p.error[k];
}

/// Error bars as a run with twins has them, wherever a curve holds h, 2 h and 4 h.
void add_bars(Study& study, Measure m, const std::string& curve, const Point* finest)
{
    const auto k = std::size_t(m);
    const auto along = study.along(curve);
    for (const Point* p : along) {
        const auto at = [&](double factor) {
            const auto found = std::find_if(along.begin(), along.end(),
                                            [&](const Point* q) { return std::fabs(q->spacing / p->spacing - factor) < 1e-6; });
            return found == along.end() ? nullptr : *found;
        };
        const Point *two = at(2), *four = at(4);
        // Against an experiment the bar cannot be judged: it is one of the numbers, not of the model.
        if (!two || !four || study.sweep.reference.kind == Kind::Experiment) continue;
        const double truth = m == Measure::Settlement ? p->settlement : study.reference[k];
        if (p == finest || !std::isfinite(truth)) continue; // of itself the finest says nothing
        const auto c = converge({{p->spacing, p->value[k]}, {two->spacing, two->value[k]}, {four->spacing, four->value[k]}});
        study.bars.push_back({curve, m, p->spacing, p->value[k], c.half_width, truth, c.why_not});
    }
}
} // namespace

void compare(Study& study)
{
    study.reference.fill(unknown), study.reference_spacing.fill(0);
    study.convergence.clear(), study.bars.clear();
    for (auto& note : study.reference_note) note.clear();

    const std::string chosen = reference_curve(study);
    const auto curves = study.curves();
    const auto runs = study.along(chosen);
    const Point* finest = runs.empty() ? nullptr : runs.back();
    for (const Measure m : study.sweep.measures) {
        const auto k = std::size_t(m);
        for (const auto& curve : curves) {
            if (is_error(m)) continue;
            std::vector<Sample> samples;
            for (const Point* p : study.along(curve)) samples.push_back({p->spacing, p->value[k]});
            study.convergence.push_back({curve, m, converge(samples)});
        }
        find_reference(study, m, chosen, finest);
        for (auto& p : study.points)
            if (p.finished()) p.error[k] = error_of(study, p, m, finest);
        for (const auto& curve : curves)
            if (!is_error(m)) add_bars(study, m, curve, finest);
    }
}

} // namespace kuzure::study
