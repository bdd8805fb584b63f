#pragma once
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// The heights of real ground; nothing where a scene has none.
inline const HeightField* ground_of(const Scene& s)
{
    for (const auto& wall : s.walls)
        if (const auto* g = std::get_if<Ground>(&wall.shape)) return g->field.get();
    return nullptr;
}

/// Coulomb's friction of a wall at the point x (m) of its face, rad.
double friction_angle_at(const Wall&, Vector x);

/// True where soil at x (m) has left real ground for good, in a scene whose ground lets it: no ground below it nor, within two supports,
/// beside it, and no other wall below it.
bool has_left(const Scene&, Vector x);

} // namespace kuzure::scene
