#pragma once
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// The wall that is real ground, and its heights; nothing where a scene has none.
inline const Wall* ground_wall(const Scene& s)
{
    for (const auto& wall : s.walls)
        if (std::holds_alternative<Ground>(wall.shape)) return &wall;
    return nullptr;
}
inline const HeightField* ground_of(const Scene& s)
{
    const Wall* wall = ground_wall(s);
    return wall ? std::get<Ground>(wall->shape).field.get() : nullptr;
}

/// Coulomb's friction of a wall at the point x (m) of its face, rad.
double friction_angle_at(const Wall&, Vector x);

/// True where soil at x (m) has left real ground for good, in a scene whose ground lets it: no ground below it nor, within two supports,
/// beside it, and no other wall below it.
bool has_left(const Scene&, Vector x);

} // namespace kuzure::scene
