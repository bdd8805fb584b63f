#pragma once
// Closed rings of corners in a plane: outlines in plan, polygons in x-z.
#include "solver/scene/parts.hpp"

namespace kuzure::scene {

/// True if a point lies inside a ring, by the even-odd rule; half open, so that a corner counts once.
inline bool encloses(const Ring& ring, double x, double y)
{
    bool inside = false;
    for (std::size_t k = 0, n = ring.size(); k < n; ++k) {
        const auto &a = ring[k], &b = ring[k + 1 < n ? k + 1 : 0];
        if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])) inside = !inside;
    }
    return inside;
}
/// True if an odd number of rings encloses a point: inside of outer rings, outside of their holes.
inline bool encloses(const std::vector<Ring>& rings, double x, double y)
{
    bool inside = false;
    for (const Ring& ring : rings) inside = inside != encloses(ring, x, y);
    return inside;
}

/// Signed area of a ring, m^2, positive counterclockwise; computed near the ring, for map coordinates are large.
inline double signed_area(const Ring& ring)
{
    double twice = 0;
    const auto& o = ring[0];
    for (std::size_t k = 1; k + 1 < ring.size(); ++k)
        twice += (ring[k][0] - o[0]) * (ring[k + 1][1] - o[1]) - (ring[k][1] - o[1]) * (ring[k + 1][0] - o[0]);
    return 0.5 * twice;
}

} // namespace kuzure::scene
