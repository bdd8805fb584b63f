#include "solver/app/study/dial.hpp"
#include "io/scene_file.hpp"
#include "io/scene_keys.hpp"
#include "solver/app/scaling/forecast.hpp"
#include "solver/core/ensure.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/scene/fill.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <set>

namespace kuzure::study {
namespace {

/// The dial turns on the shape of the heap: the one error that every collapse has.
const char* const dial_measure = "profile";

constexpr std::string_view measured_text =
#include "solver/app/study/measured.inl"
    ;

double slope(const MeasuredPoint& a, const MeasuredPoint& b)
{
    return std::clamp(std::log(a.error / b.error) / std::log(b.layers / a.layers), 0.5, 2.0);
}

/// The scene with a preset's keys and a spacing, resolved; nothing where it breaks a rule.
std::optional<scene::CheckedScene> with(const Scene& scene, const io::Preset& preset, double spacing)
{
    Scene s = scene;
    // The preset's keys by the reader itself, so that they mean what they mean in a file.
    std::vector<std::string> sets{"accuracy.preset=" + preset.name, fmt::format("space.spacing={}", spacing)};
    for (const auto& [key, value] : preset.settings) sets.push_back(key + "=" + value);
    if (scene.time.step) s.time.step.reset();
    try {
        return io::parse_checked_scene(io::write_scene(s), "proposal", sets, scene::StepLimit::Enforce);
    } catch (const BadInput&) {
        return {};
    }
}

} // namespace

Likeness likeness(const Scene& s)
{
    const scene::Filling filling(s);
    const auto& b = filling.soil_bounds();
    Likeness l;
    const double height = b.high.z - b.low.z + s.space.spacing, width = b.high.x - b.low.x + s.space.spacing;
    const double g = s.effects.gravity ? length(*s.effects.gravity) : 0;
    l.dimensions = s.dimensions, l.slenderness = height / (0.5 * width), l.layers = height / s.space.spacing;
    for (const auto& soil : s.soils) {
        l.friction_angle = std::max(l.friction_angle, soil.friction_angle * 180 / std::numbers::pi);
        if (g > 0) l.cohesion = std::max(l.cohesion, soil.cohesion / (soil.density * g * height));
    }
    return l;
}

std::vector<MeasuredCurve> read_measured(std::string_view json)
{
    std::vector<MeasuredCurve> all;
    try {
        for (const auto& c : nlohmann::json::parse(json)) {
            MeasuredCurve curve{c.at("scene"), c.at("measure"), c.at("preset"), {}, {}};
            const auto& a = c.at("about");
            curve.about = {a.at("dimensions"), a.at("slenderness"), 0, a.at("friction_angle"), a.at("cohesion")};
            for (const auto& p : c.at("points")) curve.points.push_back({p.at(0), p.at(1)});
            std::sort(curve.points.begin(), curve.points.end(), [](const auto& x, const auto& y) { return x.layers < y.layers; });
            if (curve.points.size() >= 2) all.push_back(std::move(curve));
        }
    } catch (const nlohmann::json::exception& e) {
        throw Broken(fmt::format("the table of measured errors cannot be read: {}", e.what()));
    }
    return all;
}

const std::vector<MeasuredCurve>& measured()
{
    static const auto table = read_measured(measured_text);
    return table;
}

double error_at(const MeasuredCurve& c, double layers)
{
    const auto& p = c.points;
    const std::size_t n = p.size();
    if (layers <= p.front().layers) return p.front().error * std::pow(p.front().layers / layers, slope(p[0], p[1]));
    if (layers >= p.back().layers) return p.back().error * std::pow(p.back().layers / layers, slope(p[n - 2], p[n - 1]));
    std::size_t k = 1;
    while (p[k].layers < layers) ++k;
    const double share = std::log(layers / p[k - 1].layers) / std::log(p[k].layers / p[k - 1].layers);
    return p[k - 1].error * std::pow(p[k].error / p[k - 1].error, share);
}

double layers_for(const MeasuredCurve& c, double error)
{
    // Errors need not fall everywhere: the coarsest that has it and keeps it at the measured points beyond.
    double low = 1, high = 1e6;
    for (const auto& p : c.points)
        if (p.error > error) low = std::max(low, p.layers);
    while (high / low > 1 + 1e-9) {
        const double middle = std::sqrt(low * high);
        (error_at(c, middle) > error ? low : high) = middle;
    }
    return high;
}

double distance(const Likeness& a, const Likeness& b, std::string* why)
{
    std::vector<std::pair<double, std::string>> parts;
    const auto add = [&](double d, std::string text) { parts.emplace_back(d, std::move(text)); };
    if (a.dimensions != b.dimensions) add(1, fmt::format("{}-D, not {}-D", a.dimensions, b.dimensions));
    // A factor of two in slenderness, 10 degrees, a tenth of the weight in cohesion: one each.
    add(std::fabs(std::log2(a.slenderness / b.slenderness)), fmt::format("slenderness {:.2g}, not {:.2g}", a.slenderness, b.slenderness));
    add(std::fabs(a.friction_angle - b.friction_angle) / 10,
        fmt::format("friction {:.3g} deg, not {:.3g}", a.friction_angle, b.friction_angle));
    add(std::fabs(a.cohesion - b.cohesion) / 0.1, fmt::format("cohesion {:.2g} of the weight, not {:.2g}", a.cohesion, b.cohesion));
    std::sort(parts.begin(), parts.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
    double sum = 0;
    if (why) why->clear();
    for (const auto& [d, text] : parts) {
        sum += d * d;
        if (why && d > 0.1) *why += (why->empty() ? "" : "; ") + text;
    }
    return std::sqrt(sum);
}

Proposal propose(const Scene& scene, double error, const std::vector<MeasuredCurve>& table,
                 const std::function<double(const scene::CheckedScene&)>& work)
{
    const Likeness here = likeness(scene);
    const double height = here.layers * scene.space.spacing;
    std::optional<Proposal> best;
    for (const auto& preset : io::presets()) {
        std::vector<const MeasuredCurve*> curves;
        for (const auto& c : table)
            if (c.preset == preset.name && c.measure == dial_measure) curves.push_back(&c);
        if (curves.empty()) continue;
        const MeasuredCurve* nearest = *std::min_element(curves.begin(), curves.end(), [&](const auto* a, const auto* b) {
            return distance(here, a->about) < distance(here, b->about);
        });
        const double wanted = height / layers_for(*nearest, error);
        // The largest spacing not above the wanted one that fills the bodies whole: fractions of the scene's own first.
        std::set<double, std::greater<>> spacings;
        for (int a = 1; a <= 16; ++a)
            for (int b = 1; b <= 64; ++b)
                if (std::gcd(a, b) == 1 && scene.space.spacing * a / b <= wanted * (1 + 1e-9)) spacings.insert(scene.space.spacing * a / b);
        std::optional<scene::CheckedScene> proposed;
        for (const double spacing : spacings)
            if (spacing > 0.5 * wanted && (proposed = with(scene, preset, spacing))) break;
        if (!proposed) continue;
        Proposal p;
        p.preset = preset.name;
        const double layers = height / proposed->scene.space.spacing;
        p.expected = error_at(*nearest, layers), p.low = p.high = p.expected;
        for (const auto* c : curves) p.low = std::min(p.low, error_at(*c, layers)), p.high = std::max(p.high, error_at(*c, layers));
        p.nearest = nearest->scene;
        p.distance = distance(here, nearest->about, &p.difference);
        p.least_layers = nearest->points.front().layers, p.most_layers = nearest->points.back().layers;
        p.work = work(*proposed);
        if (layers > p.most_layers * 1.01)
            p.note =
                fmt::format("{:.0f} layers are more than the {:.0f} that were measured: the error is extrapolated", layers, p.most_layers);
        else if (layers < p.least_layers * 0.99)
            p.note = fmt::format("{:.0f} layers are fewer than the {:.0f} that were measured: the error is extrapolated", layers,
                                 p.least_layers);
        if (scene.time.step) p.note += std::string(p.note.empty() ? "" : "; ") + "leave time.step out: the step then goes with the spacing";
        if (best && p.work >= best->work) continue;
        p.checked = std::move(proposed);
        best = std::move(p);
    }
    if (!best)
        throw BadInput(
            fmt::format("no settings for an error of {:g} % were found that fill this scene's bodies with whole particles. Expected: boxes "
                        "of whole spacings at a "
                        "fraction of space.spacing = {:g} m. Remedy: sizes that are multiples of one finer spacing, or another --accuracy",
                        100 * error, scene.space.spacing));
    return *best;
}

std::string to_text(const Proposal& p, double wanted, double seconds)
{
    std::string out = fmt::format("accuracy {:g} % of the heap's profile: proposed\n\n", 100 * wanted);
    out += fmt::format("  [space]\n  spacing = {:g}\n\n  [accuracy]\n  preset = \"{}\"\n\n", p.checked->scene.space.spacing, p.preset);
    out += fmt::format("  expected error {:.2g} %; over all measured scenes {:.2g} to {:.2g} %\n", 100 * p.expected, 100 * p.low,
                       100 * p.high);
    const auto [of, unit] = unit_for(seconds);
    out += fmt::format("  time           about {:.3g} {} on this machine\n", seconds / of, unit);
    out += fmt::format("  rests on       \"{}\"{}\n", p.nearest,
                       p.distance < 0.1
                           ? std::string(", a scene like this one")
                           : fmt::format(", distance {:.1f} ({}){}", p.distance, p.difference,
                                         p.distance > 1
                                             ? ": another kind of scene, so take the error as a guess and let kuzure run --twins judge it"
                                             : ""));
    if (!p.note.empty()) out += "  note           " + p.note + "\n";
    for (const auto& w : p.checked->warnings) out += "  warning        " + in_words(w) + "\n";
    return out;
}

nlohmann::ordered_json to_json(const Proposal& p, double wanted, double seconds)
{
    auto warnings = nlohmann::ordered_json::array();
    for (const auto& w : p.checked->warnings) warnings.push_back(in_words(w));
    return {{"wanted", wanted},
            {"preset", p.preset},
            {"spacing", p.checked->scene.space.spacing},
            {"expected_error", p.expected},
            {"error_interval", {p.low, p.high}},
            {"predicted_seconds", seconds},
            {"nearest", p.nearest},
            {"distance", p.distance},
            {"difference", p.difference},
            {"note", p.note},
            {"warnings", std::move(warnings)}};
}

double parse_accuracy(const std::string& text)
{
    double x = 0;
    const char* end = text.data() + text.size();
    auto [at, problem] = std::from_chars(text.data(), end, x);
    while (problem == std::errc{} && at < end && *at == ' ') ++at;
    const bool percent = problem == std::errc{} && at < end && *at == '%';
    if (percent) x /= 100, ++at;
    if (problem != std::errc{} || at != end || !(x >= 0.001 && x <= 0.5))
        throw BadInput(
            fmt::format("--accuracy: expected an error from 0.1 % to 50 %, found \"{}\"; write, for example, --accuracy 5%", text));
    return x;
}

Exit print_proposal(const Comm& comm, const Scene& s, const std::string& accuracy, bool json)
{
    const double wanted = parse_accuracy(accuracy);
    use_threads(comm, 0);
    const auto estimate_of = [](const scene::CheckedScene& r) {
        return estimate(r.scene, r.filling, *choose_model(r.scene, Arithmetic::Simd));
    };
    const auto proposal = propose(s, wanted, measured(), [&](const scene::CheckedScene& r) { return work(estimate_of(r)); });
    const auto& r = *proposal.checked;
    const double seconds = forecast(comm, r.scene, r.filling, estimate_of(r)).seconds;
    if (comm.rank() == 0) fmt::print("{}", json ? to_json(proposal, wanted, seconds).dump(2) + "\n" : to_text(proposal, wanted, seconds));
    return Exit::Ok;
}

} // namespace kuzure::study
