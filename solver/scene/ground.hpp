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

} // namespace kuzure::scene
