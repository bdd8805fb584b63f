#include "solver/app/hazard/answer.hpp"
#include "solver/app/study/convergence.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::hazard {
namespace {

constexpr double least_ratio = 1.15; // of two spacings whose answers are compared

} // namespace

namespace {

/// The error of resolution, from finished runs of the likely values, the coarsest first.
void judge_resolutions(std::vector<const Run*> runs, Discretisation& d)
{
    if (!runs.empty()) d.front = runs.back()->maps->front;
    // Neighbours that are nearly alike say nothing of an order: the finest of them counts; and the three finest tell most.
    for (std::size_t k = runs.size(); k > 1; --k)
        if (runs[k - 2]->spacing < least_ratio * runs[k - 1]->spacing) runs.erase(runs.begin() + std::ptrdiff_t(k) - 2);
    if (runs.size() > 3) runs.erase(runs.begin(), runs.end() - 3);
    if (runs.size() >= 2) d.finest_two.assign(runs.end() - 2, runs.end());
    std::vector<study::Sample> samples;
    for (const auto* r : runs) samples.push_back({r->spacing, r->maps->reach});
    const auto [least, most] = std::ranges::minmax_element(samples, {}, &study::Sample::value);
    if (samples.size() < 2) {
        d.how = "the likely values were run at one resolution only";
    } else if (samples.size() == 2) {
        d.kind = Discretisation::Difference, d.half_width = most->value - least->value;
        d.how = "the difference of two resolutions; no order of convergence is known from two";
    } else if (const auto c = study::converge(samples); c.order) {
        d.kind = Discretisation::Richardson, d.half_width = c.half_width, d.order = std::min(*c.order, study::greatest_order);
        d.how = fmt::format("Richardson extrapolation of three resolutions, order {:.2g}{}, {:g} times the estimated error", d.order,
                            *c.order > d.order ? fmt::format(" (observed {:.2g}, which is chance)", *c.order) : "", study::safety);
    } else {
        d.kind = Discretisation::Spread, d.half_width = most->value - least->value;
        d.how = fmt::format("the spread of three resolutions: no extrapolation, {}", c.why_not);
    }
    if (d.half_width < d.front) {
        d.half_width = d.front;
        d.how = "what a layer of particles more or less moves the front by, which is more than the resolutions differ; " + d.how;
    }
}

void correlate(const Base& base, const std::vector<const Run*>& members, const std::vector<double>& reaches, Answer& out)
{
    const auto inputs = inputs_of(base.uncertain);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
        std::vector<double> values;
        for (const auto* r : members) values.push_back(r->member.values[k]);
        out.sensitivity.push_back({inputs[k].name, rank_correlation(values, reaches), rank_correlation_interval(values, reaches)});
    }
}

} // namespace

Answer answer_of(const Base& base, const std::vector<Run>& runs)
{
    Answer out;
    std::vector<const Run*> members, likely;
    for (const auto& r : runs) {
        if (!r.finished()) continue;
        (r.part == Part::Member ? members : likely).push_back(&r);
    }
    std::ranges::sort(members, {}, [](const Run* r) { return r->member.number; });
    std::ranges::stable_sort(likely, std::ranges::greater{}, [](const Run* r) { return r->spacing; });
    out.preliminary = int(members.size()) < enough_members;
    if (out.preliminary) out.counted = likely;
    out.counted.insert(out.counted.end(), members.begin(), members.end());

    auto resolutions = likely;
    const auto same = [](const Run* a, const Run* b) { return a->spacing == b->spacing; }; // the same run under two names
    resolutions.erase(std::unique(resolutions.begin(), resolutions.end(), same), resolutions.end());
    for (const auto* r : resolutions) out.discretisation.samples.push_back({r->layers, r->maps->reach});
    judge_resolutions(std::move(resolutions), out.discretisation);

    std::vector<double> reaches;
    for (const auto* r : out.counted) reaches.push_back(r->maps->reach);
    auto sorted = reaches;
    std::sort(sorted.begin(), sorted.end());
    const std::span<const double> s(sorted);
    out.likely = likely.empty() ? quantile(s, 0.5) : likely.back()->maps->reach;
    const double more = out.discretisation.half_width;
    out.low = std::max(0.0, std::min(quantile(s, 0.05), out.likely) - more), out.high = std::max(quantile(s, 0.95), out.likely) + more;

    double sum = 0;
    out.volume = {HUGE_VAL, 0, 0};
    for (const auto* r : out.counted)
        out.volume[0] = std::min(out.volume[0], r->maps->volume), out.volume[2] = std::max(out.volume[2], r->maps->volume),
        sum += r->maps->volume;
    out.volume[1] = sum / double(out.counted.size());

    if (!out.preliminary) correlate(base, members, reaches, out);
    return out;
}

} // namespace kuzure::hazard
