#pragma once
// Sums over particles and ranks of numbers of any size, the same bits in whatever order they are added.
#include "solver/core/team.hpp"
#include <cmath>
#include <cstdint>
#include <vector>

namespace kuzure {

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
