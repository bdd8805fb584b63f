#include "decomposition/rebalance.hpp"
#include <algorithm>
#include <cmath>

namespace kuzure {
namespace {

/// Clock readings as whole nanoseconds: their sum is the same on every rank whatever the order.
std::int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

struct Spread {
    double most, mean;
};
Spread spread(const Team& team, std::int64_t mine) { return {double(team.max(mine)), double(team.sum(mine)) / team.size()}; }

} // namespace

double imbalance(const Team& team, double mine)
{
    // Scaled to whole numbers for the same reason: any unit will do.
    const double largest = team.max(mine);
    if (!(largest > 0)) return 1;
    const Spread s = spread(team, std::llround(mine / largest * 1e12));
    return s.most / s.mean;
}

Rebalance::Rebalance(double promised, double cut_seconds) : floor_(std::max(0.0, promised - 1)), cost_(cut_seconds) {}

bool Rebalance::due(const Team& team, double busy_seconds)
{
    const Spread s = spread(team, nanoseconds(busy_seconds));
    imbalance_ = s.mean > 0 ? s.most / s.mean : 1;
    ++calls_;
    if (calls_ == 1) return false;
    smooth_ = calls_ == 2 ? imbalance_ : 0.75 * smooth_ + 0.25 * imbalance_;
    if (measured_ && calls_ <= settling) {
        floor_ = smooth_ - 1;
        return false;
    }
    floor_ = std::min(floor_, smooth_ - 1);
    idle_ = std::max(0.0, idle_ + (imbalance_ - 1 - floor_ - noticeable) * s.mean * 1e-9);
    return idle_ > cost_;
}

void Rebalance::cut(const Team& team, double seconds)
{
    cost_ = double(team.max(nanoseconds(seconds))) * 1e-9;
    idle_ = 0;
    calls_ = 0;
    measured_ = true;
}

} // namespace kuzure
