#pragma once
// Where a wall that moves stands.
#include "solver/core/tensor.hpp"

namespace kuzure::scene {

/// A shape as it is drawn, turned about the origin (rows of the turn) and then shifted (m).
struct Pose {
    Mat3<double> turn{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Vector shift{};
    bool operator==(const Pose&) const = default;
};
/// A vector of the drawn shape as it points now, and back.
inline Vector turned(const Pose& p, Vector a) { return {dot(p.turn.x, a), dot(p.turn.y, a), dot(p.turn.z, a)}; }
inline Vector turned_back(const Pose& p, Vector a) { return a.x * p.turn.x + a.y * p.turn.y + a.z * p.turn.z; }
/// Where a point of the drawn shape is now, and back, m.
inline Vector placed(const Pose& p, Vector x) { return turned(p, x) + p.shift; }
inline Vector as_drawn(const Pose& p, Vector x) { return turned_back(p, x - p.shift); }
/// First the one, then the other.
inline Pose then(const Pose& first, const Pose& next)
{
    const Mat3<double>& a = first.turn;
    const auto row = [&](Vector r) { return r.x * a.x + r.y * a.y + r.z * a.z; };
    return {{row(next.turn.x), row(next.turn.y), row(next.turn.z)}, placed(next, first.shift)};
}
inline Pose inverse(const Pose& p)
{
    const Mat3<double>& r = p.turn;
    return {{{r.x.x, r.y.x, r.z.x}, {r.x.y, r.y.y, r.z.y}, {r.x.z, r.y.z, r.z.z}}, -1.0 * turned_back(p, p.shift)};
}

} // namespace kuzure::scene
