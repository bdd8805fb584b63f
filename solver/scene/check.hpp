#pragma once
// The rules a scene must obey beyond the type and range of each key, and the choice of effects it leaves to
// us.
#include "solver/scene/fill.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// Above this dt c_p/h nearly every run fails (docs/stability.md, the map of stable steps); it is refused unless the user
/// insists.
inline constexpr double unstable_courant = 0.6;
/// Up to this dt c_p/h columns and collapses with viscosity kept their energy with every kernel; above it a warning.
inline constexpr double recommended_courant = 0.3;

/// min over soils of h/c_p (s): a Courant number of one.
double crossing_time(const Scene&);
/// Fixed steps (s) up to here are stable with margin, and up to there stable at all.
double recommended_step(const Scene&);
double stable_step(const Scene&);
/// Every so many steps soil that may sleep (accuracy.sleep_below) is looked at: no sooner can a P-wave that was nowhere near a sleeper,
/// not within its support, have reached it.
std::int64_t sleep_interval(const Scene&);

/// What a step above the stable limit is: an error, or a warning for --force-step.
enum class StepLimit { Enforce, Force };

/// Decides what the file leaves to "auto" and rewrites scene.notes: one line for every effect, on or off, and
/// why.
void resolve(Scene&);
/// Every rule a resolved scene breaks: errors and warnings, filling included.
Issues check(const Scene&, StepLimit = StepLimit::Enforce);

/// A resolved scene without errors, what is doubtful about it, and the particles it starts with: made once, by its check.
struct Ready {
    Scene scene;
    Issues warnings;
    Filling filling;
};
/// Nothing where check() finds errors; all that it finds is in `issues`.
std::optional<Ready> ready(Scene, StepLimit, Issues& issues);

/// Bytes of the columns of all soil particles of a run: the fields of the store, without records and lists.
double column_bytes(const Filling&);

} // namespace kuzure::scene
