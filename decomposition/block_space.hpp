#pragma once
// Space in blocks: which block holds a point, across periodic axes too. No ranks here.
#include "decomposition/partition.hpp"
#include "solver/core/tensor.hpp"
#include <algorithm>
#include <cmath>
#include <string>

namespace kuzure {

class BlockSpace {
public:
    /// Blocks of this size from this origin (m); on a periodic axis the period must hold a whole number of
    /// blocks, else BadInput.
    BlockSpace(Vector origin, Vector block_size, std::array<bool, 3> periodic, Vector period_low, Vector period_length);

    /// floor((x - origin)/size) by axis, not wrapped. False, and b without meaning, for a position that is not finite
    /// or more than 2^20 blocks away.
    bool raw_block(Vector x, Block& b) const;
    /// The same on one axis, for a coordinate that is near.
    std::int32_t raw_axis(int axis, double x) const { return std::int32_t(std::floor((x - origin_[axis]) / size_[axis])); }
    /// Wrapped to 0 .. n-1 on periodic axes.
    Block wrapped(Block b) const { return kuzure::wrapped(b, period_); }
    /// Both. Throws NumbersFailed where raw_block() gives nothing.
    Block block_of(Vector x) const;
    /// Corner of a block, m; that of the next one is its end.
    double face(int axis, std::int32_t block) const { return origin_[axis] + size_[axis] * block; }

    const std::array<double, 3>& size() const { return size_; }
    /// Blocks per period by axis; 0 where open.
    const std::array<std::int32_t, 3>& period() const { return period_; }
    const std::array<double, 3>& period_low() const { return period_low_; }
    const std::array<double, 3>& period_length() const { return period_length_; }
    /// The grid that a cut looks at, for a halo of this reach (m; 0: a quarter of a block) and ghosts of so many bytes.
    BlockGrid grid(double reach, double ghost_bytes) const;

private:
    std::array<double, 3> origin_, size_, period_low_, period_length_;
    std::array<std::int32_t, 3> period_{};
};

/// What is said of a particle whose block does not exist.
std::string lost_at(Vector x);

/// A box of space, m; empty until something is added.
struct Bounds {
    double low[3], high[3];
    static Bounds none();
    bool empty() const { return low[0] > high[0]; }
    void add(const double* l, const double* h)
    {
        for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], l[a]), high[a] = std::max(high[a], h[a]);
    }
    void add(Vector v)
    {
        const double at[3] = {v.x, v.y, v.z};
        add(at, at);
    }
};

/// Squared distance of box a, moved by d, from box b.
inline double squared_distance(const Bounds& a, const double* d, const Bounds& b)
{
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double gap = std::max({0.0, b.low[k] - (a.high[k] + d[k]), (a.low[k] + d[k]) - b.high[k]});
        sum += gap * gap;
    }
    return sum;
}
/// Gap between box a, moved by d, and box b on the axis where it is widest, m; none where they meet on all.
inline double widest_gap(const Bounds& a, const double* d, const Bounds& b)
{
    double widest = 0;
    for (int k = 0; k < 3; ++k) widest = std::max({widest, b.low[k] - (a.high[k] + d[k]), (a.low[k] + d[k]) - b.high[k]});
    return widest;
}
/// How far `now` reaches beyond `before` on any axis, m; infinite where there was nothing before.
inline double overhang(const Bounds& now, const Bounds& before)
{
    if (now.empty()) return 0;
    double most = 0;
    for (int k = 0; k < 3; ++k) most = std::max({most, before.low[k] - now.low[k], now.high[k] - before.high[k]});
    return most;
}
/// A box and so much around it, m.
inline Bounds widened(Bounds b, double by)
{
    for (int k = 0; k < 3; ++k) b.low[k] -= by, b.high[k] += by;
    return b;
}
/// Of a point.
inline double squared_distance(Vector v, const double* d, const Bounds& b)
{
    const Bounds at{{v.x, v.y, v.z}, {v.x, v.y, v.z}};
    return squared_distance(at, d, b);
}

/// Reach at which a halo is planned: rounding must not lose a pair that the solver, adding a period on the other side,
/// finds just inside. `extent` is the largest coordinate or period of any rank, m.
inline double halo_reach(double reach, double extent) { return reach * (1 + 1e-9) + 1e-14 * extent; }

} // namespace kuzure
