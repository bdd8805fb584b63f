#pragma once
// Which values the members of an ensemble take: a Latin hypercube over triangles. Numbers only, the same on every machine.
#include "solver/scene/uncertain.hpp"
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kuzure::hazard {

/// Numbers that depend on a seed, a name and how many came before alone (splitmix64, mapped by hand): no library's, so that every machine
/// draws the same.
class Draws {
public:
    Draws(std::uint64_t seed, std::string_view name);
    std::uint64_t bits();
    /// In [0, 1), a multiple of 2^-53.
    double share();
    /// 0 ... n - 1, all alike.
    std::uint64_t below(std::uint64_t n);

private:
    std::uint64_t state_;
};

/// The value below which a share (0 to 1) of a triangle lies.
double value_at(const scene::Triangle&, double share);

/// A number that is varied.
struct Input {
    std::string name; // "friction", "bed_friction", "thickness", or the path of a key
    std::string unit;
    scene::Triangle range;
};
/// In the order of the table of keys.
std::vector<Input> inputs_of(const scene::Uncertain&);

/// What one run of the ensemble takes.
struct Member {
    int number = 0;             // from 1
    std::vector<double> values; // by input
    std::uint64_t error = 0;    // seed of the errors of its ground
};
/// The first `count` members. They are drawn in groups of `group`: within one, each of as many parts of equal probability of every input is
/// taken once. More members leave the first ones as they are.
std::vector<Member> draw_members(const scene::Uncertain&, int group, int count);
/// All inputs at their likely values, the ground as it was measured.
Member likely_member(const scene::Uncertain&);
/// All inputs at their low, likely or high values, but the thickness as the scene has it: a scene that needs no files of its own.
Member corner_member(const scene::Uncertain&, std::optional<bool> high);

/// Spearman's rank correlation, equal values with their mean rank; NaN where one of the two does not vary.
double rank_correlation(std::span<const double> x, std::span<const double> y);
/// What 90 % of 1000 resamplings of the pairs give for it (a fixed seed); NaN for fewer than 4 pairs.
std::array<double, 2> rank_correlation_interval(std::span<const double> x, std::span<const double> y);

/// The value that a share of sorted ones do not exceed: one of them, the nearest rank, so that no rounding comes in. Of at least one.
template <class T> T quantile(std::span<const T> sorted, double share)
{
    const auto n = double(sorted.size());
    std::size_t k = 1;
    while (double(k) < share * n - 1e-9 * n && k < sorted.size()) ++k;
    return sorted[k - 1];
}

/// A table of the members for the terminal.
std::string members_table(const scene::Uncertain&, const std::vector<Member>&);

} // namespace kuzure::hazard
