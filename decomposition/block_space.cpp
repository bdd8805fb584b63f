#include "decomposition/block_space.hpp"
#include "solver/core/ensure.hpp"
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace kuzure {

std::string lost_at(Vector x)
{
    return fmt::format("a soil particle is at ({}, {}, {}) m, outside of anything that can be cut into blocks: the run "
                       "has blown up; try a smaller time step",
                       x.x, x.y, x.z);
}

BlockSpace::BlockSpace(Vector origin, Vector size, std::array<bool, 3> periodic, Vector low, Vector length)
    : origin_{origin.x, origin.y, origin.z}, size_{size.x, size.y, size.z}, period_low_{low.x, low.y, low.z}, period_length_{length.x,
                                                                                                                             length.y,
                                                                                                                             length.z}
{
    for (int a = 0; a < 3; ++a) {
        ensure(size_[a] > 0 && std::isfinite(size_[a]), "the size of a block is not positive");
        if (!periodic[a]) continue;
        const double all = period_length_[a], n = std::round(all / size_[a]);
        if (!(n >= 1 && n < block_limit && std::abs(n * size_[a] - all) <= 1e-9 * all))
            throw BadInput(fmt::format("the period along {} ({} m) is not a whole number of blocks of {} m: choose a "
                                       "block size that divides it",
                                       "xyz"[a], all, size_[a]));
        period_[a] = std::int32_t(n);
    }
}

bool BlockSpace::raw_block(Vector x, Block& b) const
{
    const double at[3] = {x.x, x.y, x.z};
    for (int a = 0; a < 3; ++a) {
        const double k = std::floor((at[a] - origin_[a]) / size_[a]);
        if (!(std::isgreaterequal(k, -block_limit) && std::isless(k, block_limit))) return false; // quietly, of not-a-number too
        b[a] = std::int32_t(k);
    }
    return true;
}

Block BlockSpace::block_of(Vector x) const
{
    Block b;
    if (!raw_block(x, b)) throw NumbersFailed(lost_at(x));
    return wrapped(b);
}

BlockGrid BlockSpace::grid(double reach, double ghost_bytes) const
{
    BlockGrid g;
    g.period = period_;
    g.ghost_bytes = ghost_bytes;
    if (reach > 0)
        for (int a = 0; a < 3; ++a) g.reach[a] = reach / size_[a];
    return g;
}

Bounds Bounds::none()
{
    const double inf = std::numeric_limits<double>::infinity();
    return {{inf, inf, inf}, {-inf, -inf, -inf}};
}

} // namespace kuzure
