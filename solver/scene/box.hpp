#pragma once
// Components of vectors by number, and boxes as sets.
#include "solver/scene/parts.hpp"
#include <algorithm>

namespace kuzure::scene {

/// Component along axis 0 (x), 1 (y) or 2 (z).
inline double at(const Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// The smallest box around two.
inline Box united(const Box& a, const Box& b)
{
    return {{std::min(a.low.x, b.low.x), std::min(a.low.y, b.low.y), std::min(a.low.z, b.low.z)},
            {std::max(a.high.x, b.high.x), std::max(a.high.y, b.high.y), std::max(a.high.z, b.high.z)}};
}

} // namespace kuzure::scene
