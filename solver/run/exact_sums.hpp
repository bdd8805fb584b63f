#pragma once
// Sums over particles and ranks of numbers of any size, the same bits in whatever order they are added.
#include "solver/core/team.hpp"
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kuzure {

/// A whole number of units that no run can outgrow, high 2^40 + low; the same value however it was added up.
struct WideUnits {
    std::int64_t high = 0, low = 0; // 0 <= low < 2^40 after add()
    /// |units| < 2^62.
    void add(std::int64_t units) { *this = sum(high, low + units); }
    void add(const WideUnits& o) { *this = sum(high + o.high, low + o.low); }
    double value() const { return std::ldexp(double(high), 40) + double(low); }
    static WideUnits sum(std::int64_t high, std::int64_t low)
    {
        const std::int64_t carry = low >> 40; // rounds down
        return {high + carry, low - carry * (std::int64_t(1) << 40)};
    }
};
/// Collective: over all ranks.
inline void add_over_ranks(const Team& team, std::vector<std::array<WideUnits, 3>>& all)
{
    std::vector<std::int64_t> parts;
    for (const auto& vector : all)
        for (const auto& u : vector) parts.insert(parts.end(), {u.high, u.low});
    team.sum(std::span<std::int64_t>(parts));
    auto part = parts.begin();
    for (auto& vector : all)
        for (auto& u : vector) u = WideUnits::sum(part[0], part[1]), part += 2;
}

/// Collective: n sums. visit(add) is called twice and each time calls add(k, x) for every addend x of sum k on this rank, of which there
/// are fewer than 2^32 over all ranks. Of each x its first 60 bits below the largest addend count. What is not finite is left out.
template <class Visit> std::vector<double> exact_sums(const Team& team, std::size_t n, Visit visit)
{
    constexpr int bits = 30;
    std::vector<double> most(n, 0.0), sums(n, 0.0);
    visit([&](std::size_t k, double x) {
        if (std::isfinite(x)) most[k] = std::max(most[k], std::fabs(x));
    });
    team.max(std::span<double>(most));
    std::vector<std::int64_t> units(2 * n, 0); // of 2^-30 of the largest addend, and of 2^-60
    const auto exponent = [&](std::size_t k) { return most[k] > 0 ? bits - 1 - std::ilogb(most[k]) : 0; };
    std::vector<int> shift(n);
    for (std::size_t k = 0; k < n; ++k) shift[k] = exponent(k);
    visit([&](std::size_t k, double x) {
        if (!std::isfinite(x)) return;
        const double scaled = std::ldexp(x, shift[k]), high = std::nearbyint(scaled);
        units[k] += std::int64_t(high), units[n + k] += std::int64_t(std::nearbyint(std::ldexp(scaled - high, bits)));
    });
    team.sum(std::span<std::int64_t>(units));
    for (std::size_t k = 0; k < n; ++k) sums[k] = std::ldexp(double(units[k]) + std::ldexp(double(units[n + k]), -bits), -shift[k]);
    return sums;
}

} // namespace kuzure
