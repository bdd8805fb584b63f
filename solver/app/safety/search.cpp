#include "solver/app/safety/search.hpp"
#include <algorithm>
#include <cmath>
#include <deque>
#include <fmt/format.h>
#include <utility>

namespace kuzure::safety {
namespace {

constexpr double most_steps = 10000;

} // namespace

Search::Search(double from, double to, double width) : from_(from), to_(to), width_(width)
{
    if (!(from > 0) || !std::isfinite(to) || !(to > from))
        throw BadInput(fmt::format("--from, --to: expected factors above 0, the second larger than the first, found {:g} and {:g}. Remedy: "
                                   "--from 0.5 --to 4",
                                   from, to));
    if (!(width > 0) || width > to - from || (to - from) / width > most_steps)
        throw BadInput(fmt::format("--bracket: expected a width above 0 of at most --to less --from, {:g}, and not less than {:g}, found "
                                   "{:g}. Remedy: --bracket 0.02",
                                   to - from, (to - from) / most_steps, width));
    steps_ = std::max(1, int(std::ceil((to - from) / width - 1e-6)));
    fails_ = steps_ + 1;
}

double Search::factor(int step) const
{
    // Without the last digits in which 0.1 + 0.2 differs from 0.3.
    return step >= steps_ ? to_ : std::stod(fmt::format("{:.10g}", from_ + step * width_));
}

void Search::tell(int step, Outcome o)
{
    if (idle(step)) return;
    if (o == Outcome::Holds) holds_ = step;
    else fails_ = step;
}

std::optional<int> Search::next(const std::set<int>& running) const
{
    if (done()) return std::nullopt;
    // The middle, then the middles of both halves and so on. Beyond the last step nothing is to be tried.
    std::deque<std::pair<int, int>> parts{{holds_, std::min(fails_, steps_ + 1)}};
    while (!parts.empty()) {
        const auto [low, high] = parts.front();
        parts.pop_front();
        if (high - low < 2) continue;
        const int middle = low + (high - low) / 2;
        if (!running.contains(middle)) return middle;
        parts.emplace_back(low, middle), parts.emplace_back(middle, high);
    }
    return std::nullopt;
}

} // namespace kuzure::safety
