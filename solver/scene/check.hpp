#pragma once
// The rules a scene must obey beyond the type and range of each key: all of scene/rules, asked in order.
#include "solver/scene/fill.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// What a step above the stable limit is: an error, or a warning for --force-step.
enum class StepLimit { Enforce, Force };

/// Every rule a resolved scene breaks: errors and warnings, filling included.
Issues check(const Scene&, StepLimit = StepLimit::Enforce);

/// A resolved scene without errors, its warnings, and the particles it starts with: made once, by its check.
struct CheckedScene {
    Scene scene;
    Issues warnings;
    Filling filling;
};
/// Nothing where check() finds errors; all that it finds is in `issues`.
std::optional<CheckedScene> check_and_fill(Scene, StepLimit, Issues& issues);

/// By how much of it (1) the mass of a body's particles exceeds that of its shape's volume; above `most_excess` either way a warning.
double excess_of_mass(const Scene&, const Filling&, int body);
inline constexpr double most_excess = 0.02;

} // namespace kuzure::scene
