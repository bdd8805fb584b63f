#include "solver/app/hazard/search.hpp"
#include <algorithm>
#include <cmath>

namespace kuzure::hazard {
namespace {

constexpr int parts_of_one = 64, parts_of_two = 32;

bool equal(double a, double b) { return std::fabs(a - b) <= 1e-12; }

/// Of equal ones the middle; no trial has a misfit: nothing.
std::optional<std::size_t> best_of(const std::vector<Trial>& sorted)
{
    double least = HUGE_VAL;
    for (const auto& t : sorted)
        if (t.misfit < least) least = t.misfit;
    std::vector<std::size_t> equals;
    for (std::size_t k = 0; k < sorted.size(); ++k)
        if (std::isfinite(sorted[k].misfit) && equal(sorted[k].misfit, least)) equals.push_back(k);
    if (equals.empty()) return {};
    return equals[equals.size() / 2];
}

bool tried(const std::vector<Trial>& sorted, const std::vector<int>& at)
{
    return std::binary_search(sorted.begin(), sorted.end(), Trial{at, 0});
}

/// The even scan, the first axis slowest.
std::vector<std::vector<int>> scan_of(const std::vector<Axis>& axes)
{
    std::vector<std::vector<int>> all{{}};
    for (const auto& a : axes) {
        std::vector<std::vector<int>> more;
        for (const auto& begun : all)
            for (int k = 0; k < a.scan; ++k) {
                more.push_back(begun);
                more.back().push_back(k * (a.parts / (a.scan - 1)));
            }
        all = std::move(more);
    }
    return all;
}

} // namespace

void choose_parts(std::vector<Axis>& axes)
{
    for (auto& a : axes) {
        a.parts = a.scan - 1;
        while (a.parts < (axes.size() == 1 ? parts_of_one : parts_of_two)) a.parts *= 2;
    }
}

std::vector<std::vector<int>> next_trials(const std::vector<Axis>& axes, std::vector<Trial> trials, double alike)
{
    std::sort(trials.begin(), trials.end());
    std::vector<std::vector<int>> next;
    for (auto& at : scan_of(axes))
        if (!tried(trials, at)) next.push_back(std::move(at));
    const auto best = best_of(trials);
    if (!next.empty() || !best) return next;
    if (axes.size() == 1) {
        const double least = trials[*best].misfit;
        const auto as_good = [&](const Trial& t) { return t.misfit <= least + alike; };
        for (std::size_t k = 0; k + 1 < trials.size(); ++k) {
            const Trial &a = trials[k], &b = trials[k + 1];
            const int gap = b.at[0] - a.at[0];
            const bool beside_best = k == *best || k + 1 == *best || equal(a.misfit, least) || equal(b.misfit, least);
            const int finest = beside_best ? 1 : as_good(a) != as_good(b) ? 2 : as_good(a) ? 4 : gap;
            if (gap > finest) next.push_back({a.at[0] + gap / 2});
        }
        return next;
    }
    const auto& centre = trials[*best].at;
    std::vector<int> step;
    for (const auto& a : axes) step.push_back(a.parts / (a.scan - 1) / 2);
    while (std::ranges::all_of(step, [](int s) { return s >= 1; })) {
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j) {
                const std::vector<int> at{centre[0] + i * step[0], centre[1] + j * step[1]};
                const bool inside = at[0] >= 0 && at[0] <= axes[0].parts && at[1] >= 0 && at[1] <= axes[1].parts;
                if (inside && !tried(trials, at)) next.push_back(at);
            }
        if (!next.empty()) return next;
        for (int& s : step) s /= 2;
    }
    return next;
}

double scatter_of(std::vector<Trial> trials)
{
    std::erase_if(trials, [](const Trial& t) { return std::isnan(t.misfit) || t.at.size() != 1; });
    std::sort(trials.begin(), trials.end());
    const auto best = best_of(trials);
    std::vector<double> distances; // in standard deviations of one value
    for (std::size_t k = 1; k + 1 < trials.size(); ++k) {
        if (k + 1 >= *best && k <= *best + 1) continue; // a valley may be sharp
        const auto &a = trials[k - 1], &b = trials[k], &c = trials[k + 1];
        const double w = double(c.at[0] - b.at[0]) / (c.at[0] - a.at[0]);
        distances.push_back(std::fabs(b.misfit - w * a.misfit - (1 - w) * c.misfit) / std::sqrt(1 + w * w + (1 - w) * (1 - w)));
    }
    if (distances.size() < 5) return 0;
    const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return 2 * 1.4826 * *middle; // of a normal distribution
}

std::optional<Verdict> judge(const std::vector<Axis>& axes, std::vector<Trial> trials, double alike)
{
    std::sort(trials.begin(), trials.end());
    const auto best = best_of(trials);
    if (!best) return {};
    Verdict v{.best = trials[*best].at, .misfit = trials[*best].misfit};
    for (std::size_t k = 0; k < axes.size(); ++k) v.at_end = v.at_end || v.best[k] == 0 || v.best[k] == axes[k].parts;
    if (v.at_end) return v;
    const double limit = v.misfit + alike;
    const auto as_good = [&](const Trial& t) { return t.misfit <= limit; };
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
        int low = axes[axis].parts, high = 0;
        for (const auto& t : trials)
            if (as_good(t)) low = std::min(low, t.at[axis]), high = std::max(high, t.at[axis]);
        double from = low, to = high;
        if (axes.size() == 1) {
            // Where the misfit, linear between the values, leaves what is as good.
            const auto crossing = [&](const Trial& in, const Trial& out) {
                if (std::isnan(out.misfit)) return double(in.at[0]);
                return in.at[0] + (out.at[0] - in.at[0]) * (limit - in.misfit) / (out.misfit - in.misfit);
            };
            for (std::size_t k = 0; k < trials.size(); ++k) {
                if (trials[k].at[0] == low && k > 0) from = crossing(trials[k], trials[k - 1]);
                if (trials[k].at[0] == high && k + 1 < trials.size()) to = crossing(trials[k], trials[k + 1]);
                v.split = v.split || (trials[k].at[0] > low && trials[k].at[0] < high && !as_good(trials[k]));
            }
        }
        v.intervals.push_back({axes[axis].value(from), axes[axis].value(to), low == 0, high == axes[axis].parts});
    }
    return v;
}

} // namespace kuzure::hazard
