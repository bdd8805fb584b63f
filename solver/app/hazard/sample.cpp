#include "solver/app/hazard/sample.hpp"
#include "solver/core/mix.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace kuzure::hazard {

Draws::Draws(std::uint64_t seed, std::string_view name)
{
    state_ = 14695981039346656037ull;
    const auto add = [&](std::uint64_t byte) { state_ = (state_ ^ byte) * 1099511628211ull; };
    for (int k = 0; k < 8; ++k) add(seed >> (8 * k) & 255);
    for (const char c : name) add((unsigned char)(c));
}
std::uint64_t Draws::bits() { return mix(state_ += 0x9e3779b97f4a7c15ull); }
double Draws::share() { return double(bits() >> 11) * 0x1p-53; }
std::uint64_t Draws::below(std::uint64_t n) { return std::uint64_t((__uint128_t(bits()) * n) >> 64); }

double value_at(const scene::Triangle& t, double share)
{
    const double width = t.high - t.low, rising = t.likely - t.low;
    if (!(width > 0)) return t.likely;
    return share * width < rising ? t.low + std::sqrt(share * width * rising)
                                  : t.high - std::sqrt((1 - share) * width * (t.high - t.likely));
}

std::vector<Input> inputs_of(const scene::Uncertain& u)
{
    std::vector<Input> all;
    if (u.friction) all.push_back({"friction", "deg", *u.friction});
    if (u.bed_friction) all.push_back({"bed_friction", "deg", *u.bed_friction});
    if (u.thickness) all.push_back({"thickness", "1", *u.thickness});
    for (const auto& k : u.keys) all.push_back({k.key, "", k.value});
    return all;
}

std::vector<Member> draw_members(const scene::Uncertain& u, int group, int count)
{
    const auto inputs = inputs_of(u);
    std::vector<Member> all;
    for (int first = 0; first < count; first += group) {
        std::vector<std::vector<double>> columns;
        for (const auto& input : inputs) {
            Draws draws(std::uint64_t(u.seed), fmt::format("{} of {}: {}", first / group, group, input.name));
            std::vector<int> part(std::size_t(group), 0);
            std::iota(part.begin(), part.end(), 0);
            for (std::size_t k = part.size(); k > 1; --k) std::swap(part[k - 1], part[draws.below(k)]);
            auto& column = columns.emplace_back();
            for (const int p : part) column.push_back(value_at(input.range, (p + draws.share()) / group));
        }
        for (int k = 0; k < group && first + k < count; ++k) {
            Member m{first + k + 1, {}, Draws(std::uint64_t(u.seed), fmt::format("ground {}", first + k + 1)).bits()};
            for (const auto& column : columns) m.values.push_back(column[std::size_t(k)]);
            all.push_back(std::move(m));
        }
    }
    return all;
}

Member likely_member(const scene::Uncertain& u)
{
    Member m;
    for (const auto& input : inputs_of(u)) m.values.push_back(input.range.likely);
    return m;
}

Member corner_member(const scene::Uncertain& u, std::optional<bool> high)
{
    Member m;
    for (const auto& input : inputs_of(u))
        m.values.push_back(input.name == "thickness" ? 1 : !high ? input.range.likely : *high ? input.range.high : input.range.low);
    return m;
}

namespace {

std::vector<double> ranks(std::span<const double> x)
{
    std::vector<std::size_t> order(x.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return x[a] < x[b]; });
    std::vector<double> rank(x.size());
    for (std::size_t first = 0; first < order.size();) {
        std::size_t end = first;
        while (end < order.size() && x[order[end]] == x[order[first]]) ++end;
        for (std::size_t k = first; k < end; ++k) rank[order[k]] = 0.5 * double(first + end - 1);
        first = end;
    }
    return rank;
}

} // namespace

double rank_correlation(std::span<const double> x, std::span<const double> y)
{
    const auto a = ranks(x), b = ranks(y);
    const double mean = 0.5 * (double(a.size()) - 1);
    double ab = 0, aa = 0, bb = 0;
    for (std::size_t k = 0; k < a.size(); ++k)
        ab += (a[k] - mean) * (b[k] - mean), aa += (a[k] - mean) * (a[k] - mean), bb += (b[k] - mean) * (b[k] - mean);
    return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : std::nan("");
}

std::array<double, 2> rank_correlation_interval(std::span<const double> x, std::span<const double> y)
{
    const std::size_t n = x.size();
    if (n < 4) return {std::nan(""), std::nan("")};
    Draws draws(20, "resampling");
    std::vector<double> found, a(n), b(n);
    for (int round = 0; round < 1000; ++round) {
        for (std::size_t k = 0; k < n; ++k) {
            const auto pick = draws.below(n);
            a[k] = x[pick], b[k] = y[pick];
        }
        if (const double r = rank_correlation(a, b); !std::isnan(r)) found.push_back(r);
    }
    if (found.empty()) return {std::nan(""), std::nan("")};
    std::sort(found.begin(), found.end());
    const std::span<const double> sorted(found);
    return {quantile(sorted, 0.05), quantile(sorted, 0.95)};
}

std::string members_table(const scene::Uncertain& u, const std::vector<Member>& members)
{
    const auto inputs = inputs_of(u);
    std::string out = "member";
    std::vector<std::size_t> width;
    for (const auto& input : inputs) {
        const auto head = input.unit.empty() || input.unit == "1" ? input.name : fmt::format("{} [{}]", input.name, input.unit);
        width.push_back(std::max<std::size_t>(head.size(), 10));
        out += fmt::format("  {:>{}}", head, width.back());
    }
    if (u.dem_error) out += "  ground";
    out += '\n';
    for (const auto& m : members) {
        out += fmt::format("{:>6}", m.number == 0 ? std::string("likely") : std::to_string(m.number));
        for (std::size_t k = 0; k < inputs.size(); ++k) out += fmt::format("  {:>{}.5g}", m.values[k], width[k]);
        if (u.dem_error) out += m.number == 0 ? "  as read" : fmt::format("  error {:04x}", m.error >> 48);
        out += '\n';
    }
    return out;
}

} // namespace kuzure::hazard
