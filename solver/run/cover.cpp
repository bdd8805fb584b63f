#include "solver/run/cover.hpp"
#include <algorithm>

namespace kuzure {

Cover::Cover(const Particles& p, double side, double margin) : side_(side)
{
    const auto x = p[field::sorted_position];
    const auto add = [&](Square from, Square to, Heights of) {
        for (long i = from.first; i <= to.first; ++i)
            for (long j = from.second; j <= to.second; ++j) {
                auto& h = squares_.try_emplace({i, j}, of).first->second;
                h.low = std::min(h.low, of.low), h.high = std::max(h.high, of.high);
            }
    };
    // Neighbours in the store are neighbours in space: squares change seldom.
    Square from, to;
    Heights of{};
    for (Index i = 0; i < p.size(); ++i) {
        const Vector a = x[i];
        const Vector around{margin, margin, margin};
        const Square first = square_of(a - around), last = square_of(a + around);
        const Heights here{a.z - margin, a.z + margin};
        if (i > 0 && first == from && last == to) {
            of = {std::min(of.low, here.low), std::max(of.high, here.high)};
            continue;
        }
        if (i > 0) add(from, to, of);
        from = first, to = last, of = here;
    }
    if (p.size() > 0) add(from, to, of);
}

bool Cover::holds(Vector x) const
{
    const auto found = squares_.find(square_of(x));
    return found != squares_.end() && x.z >= found->second.low && x.z <= found->second.high;
}

bool Cover::holds(const Cover& other) const
{
    return std::ranges::all_of(other.squares_, [&](const auto& one) {
        const auto found = squares_.find(one.first);
        return found != squares_.end() && found->second.low <= one.second.low && found->second.high >= one.second.high;
    });
}

} // namespace kuzure
