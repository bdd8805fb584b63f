#include "solver/app/hazard/plan.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <vector>

namespace kuzure::hazard {
namespace {

constexpr double for_the_ensemble = 0.6, for_a_finer_run = 0.75; // shares of the time that is left then

/// Layers of runs that take so long, s.
double layers_for(const Cost& c, double seconds)
{
    const double steps = seconds - c.start;
    return steps > 0 && c.steps > 0 ? std::min(most_layers, c.layers * std::pow(steps / c.steps, 1 / cost_power)) : 0;
}

/// To a tenth of a layer, downwards.
double rounded(double layers) { return std::floor(10 * layers + 1e-9) / 10; }

} // namespace

Cost measured_cost(double seconds, double layers)
{
    constexpr double most_start = 1.0; // s, of a run before its first step: reading, forecast
    const double start = std::min(most_start, 0.7 * seconds);
    return {start, std::max(1e-3, seconds - start), layers};
}

double Cost::seconds(double at) const { return start + steps * std::pow(at / layers, cost_power); }

Plan make_plan(const Cost& c, double left, int members, double layers)
{
    Plan p;
    const double time = for_the_ensemble * left;
    const auto layers_of = [&](int n) { return rounded(layers_for(c, time / (n + 1))); }; // and the likely values
    p.members = members > 0 ? members : usual_members;
    if (members == 0 && layers == 0 && layers_of(2 * usual_members) >= 6) p.members = 2 * usual_members;
    p.layers = layers > 0 ? layers : std::max(c.layers, layers_of(p.members));
    if (layers == 0 && p.layers < 1.15 * c.layers) p.layers = c.layers; // hardly finer is not worth a likely run of its own
    if (members == 0 && c.seconds(p.layers) * (p.members + 1) > 0.9 * left)
        p.members = std::clamp(int(0.9 * left / c.seconds(p.layers)) - 1, 3, usual_members);
    p.seconds = c.seconds(p.layers) * (p.members + 1);
    p.finer = finer_layers(c, left - p.seconds, p.layers);
    if (p.finer > 0) p.seconds += c.seconds(p.finer);
    return p;
}

double finer_layers(const Cost& c, double left, double than)
{
    const double layers = rounded(layers_for(c, for_a_finer_run * left));
    return layers >= 1.15 * than ? layers : 0;
}

double parse_within(const std::string& text)
{
    double seconds = 0;
    bool good = !text.empty(), unit_last = false;
    const char *at = text.data(), *end = at + text.size();
    while (good && at < end) {
        double x = 0;
        const auto [to, error] = std::from_chars(at, end, x, std::chars_format::fixed);
        good = error == std::errc{} && x >= 0 && std::isfinite(x) && !(unit_last && to == end);
        if (!good) break;
        at = to;
        const char unit = at < end ? *at++ : 'm';
        good = unit == 's' || unit == 'm' || unit == 'h';
        seconds += x * (unit == 's' ? 1 : unit == 'm' ? 60 : 3600), unit_last = true;
    }
    if (!good || !(seconds >= 1 && seconds <= 30 * 86400.0))
        throw BadInput(fmt::format("--within: expected a time from 1 s to 30 days, found \"{}\"; "
                                   "write, for example, --within 30m, 90s, 2h or 1h30m",
                                   text));
    return seconds;
}

Layers parse_layers(const std::string& text)
{
    Layers l;
    if (text.empty()) return l;
    std::vector<double> numbers;
    const char *at = text.data(), *end = at + text.size();
    for (bool good = true; good;) {
        double x = 0;
        const auto [to, error] = std::from_chars(at, end, x, std::chars_format::fixed);
        good = error == std::errc{} && x >= 1 && x <= 200 && (numbers.empty() || x >= numbers.back());
        if (good) numbers.push_back(x);
        if (good && to == end && numbers.size() <= 3) break;
        good = good && *to == ',';
        at = to + 1;
        if (!good)
            throw BadInput(
                fmt::format("--layers: expected up to three numbers from 1 to 200 that do not fall (preliminary, ensemble, finer), found "
                            "\"{}\"; write, for example, --layers 4,6,10",
                            text));
    }
    l = {numbers[0], numbers[0], 0, true};
    if (numbers.size() > 1) l.ensemble = numbers[1];
    if (numbers.size() > 2) l.finer = numbers[2];
    return l;
}

} // namespace kuzure::hazard
