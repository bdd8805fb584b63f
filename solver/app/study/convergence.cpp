#include "solver/app/study/convergence.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::study {

Convergence converge(std::vector<Sample> s)
{
    std::sort(s.begin(), s.end(), [](const Sample& a, const Sample& b) { return a.spacing < b.spacing; });
    Convergence c;
    if (s.size() < 3) {
        c.why_not = fmt::format("needs three resolutions, found {}", s.size());
        return c;
    }
    const double h1 = s[0].spacing, h2 = s[1].spacing, h3 = s[2].spacing;
    const double near = s[1].value - s[0].value, far = s[2].value - s[1].value;
    c.limit = s[0].value;
    if (near == 0 && far == 0) { // nothing changes: exact as far as can be seen
        c.order = greatest_order;
        return c;
    }
    if (near == 0 || far == 0 || (near > 0) != (far > 0)) {
        c.why_not = fmt::format("not monotone: {:.6g}, {:.6g}, {:.6g} from coarse to fine", s[2].value, s[1].value, s[0].value);
        return c;
    }
    // far/near = (h3^p - h2^p)/(h2^p - h1^p), which grows with p.
    const double ratio = far / near;
    const auto of = [&](double p) { return (std::pow(h3 / h1, p) - std::pow(h2 / h1, p)) / (std::pow(h2 / h1, p) - 1); };
    if (ratio < of(least_order)) {
        c.why_not = fmt::format("differences hardly fall ({:.3g}, then {:.3g}): an order below {:g}", far, near, least_order);
        return c;
    }
    double low = least_order, high = 20;
    if (ratio >= of(high)) low = high;
    while (high - low > 1e-12 * high) {
        const double middle = 0.5 * (low + high);
        (of(middle) < ratio ? low : high) = middle;
    }
    c.order = low;
    // A greater order than the method has is chance: it must not make the error small.
    const double error = near / (std::pow(h2 / h1, std::min(low, greatest_order)) - 1);
    c.limit = s[0].value - error;
    c.half_width = safety * std::fabs(error);
    return c;
}

std::vector<std::size_t> pareto_front(std::span<const Price> all)
{
    std::vector<std::size_t> order(all.size()), front;
    for (std::size_t i = 0; i < all.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return all[a].cost != all[b].cost ? all[a].cost < all[b].cost : all[a].error < all[b].error;
    });
    for (const auto i : order)
        if (std::isfinite(all[i].error) && (front.empty() || all[i].error < all[front.back()].error)) front.push_back(i);
    return front;
}

std::optional<double> cost_at(std::vector<Price> curve, double error)
{
    std::erase_if(curve, [](const Price& p) { return !std::isfinite(p.error); });
    std::sort(curve.begin(), curve.end(), [](const Price& a, const Price& b) { return a.cost < b.cost; });
    if (curve.empty()) return {};
    if (std::all_of(curve.begin(), curve.end(), [&](const Price& p) { return p.error <= error; })) return curve.front().cost;
    for (std::size_t k = 1; k < curve.size(); ++k) {
        const Price &a = curve[k - 1], &b = curve[k];
        if (a.error <= error || b.error > error) continue;
        const double share = std::log(a.error / error) / std::log(a.error / std::max(b.error, 1e-12 * error));
        return a.cost * std::pow(b.cost / a.cost, share);
    }
    return {};
}

} // namespace kuzure::study
