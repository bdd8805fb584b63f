#pragma once
// What three resolutions say of the error of the finest, and which of several settings are worth their time. Numbers only.
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kuzure::study {

/// A quantity at one resolution.
struct Sample {
    double spacing, value;
};

/// The order p of value = limit + C spacing^p through three resolutions, or why there is none.
struct Convergence {
    std::optional<double> order; // 1, as observed
    double limit = 0;            // of spacing to 0, by the observed order but at most 2
    double half_width = 0;       // of the error bar around the finest value
    std::string why_not;         // in words, where there is no order
};
/// Orders outside these say that the three are not yet, or no longer, in the range where the error falls with the spacing.
inline constexpr double least_order = 0.5, greatest_order = 2;
/// The safety factor on the estimated error of the finest of three resolutions. The grid convergence index takes 1.25 where a
/// method shows its formal order, else 3 (Roache 1994): particle methods at a fixed h/spacing have none.
inline constexpr double safety = 3;
/// Richardson extrapolation of the three finest samples, in any order.
Convergence converge(std::vector<Sample> samples);

/// Error and cost of one run.
struct Price {
    double cost, error;
};
/// Indices of those that nothing beats in both, cheapest first.
std::vector<std::size_t> pareto_front(std::span<const Price>);

/// Cost at which a curve reaches an error: linear in the logarithms between the first two neighbours in cost that have it between
/// them. Empty where the curve never reaches it; the cheapest run's cost where all of it lies below.
std::optional<double> cost_at(std::vector<Price> curve, double error);

} // namespace kuzure::study
