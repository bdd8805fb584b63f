#pragma once
// Which effects a scene has, and why: what the file leaves to "auto" is decided here.
#include "solver/scene/scene.hpp"
#include <string>

namespace kuzure::scene {

/// Decides what the file leaves to "auto" and rewrites scene.notes: one line for every effect, on or off, and why.
void resolve(Scene&);

/// Why a soil can bear a tensile principal stress, or empty if none can exist inside its cone; why no soil of a scene can.
std::string tension_in(const Soil&);
std::string why_no_tension(const Scene&);
/// Why the static part that stress diffusion takes out is not that of this scene, or empty.
std::string no_static_part(const Scene&);

} // namespace kuzure::scene
