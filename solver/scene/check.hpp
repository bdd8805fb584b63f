#pragma once
// The rules a scene must obey beyond the type and range of each key, and the choice of effects it leaves to us.
#include "solver/scene/fill.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// dt c_p/h above which a scheme is unstable by theory (staggered; of kernel, h and viscosity) or nearly every run fails
/// (leap-frog); docs/verification.md has the map of stable steps.
double courant_limit(const Scene&);
/// What is refused unless the user insists, and up to where columns and collapses kept their energy; above it a warning.
double unstable_courant(const Scene&);
double recommended_courant(const Scene&);

/// min over soils of h/c_p (s): a Courant number of one.
double crossing_time(const Scene&);
/// Length of a step of soil that does not move, s: the fixed one, or accuracy.cfl of crossing_time().
double step_at_rest(const Scene&);
/// Fixed steps (s) up to here are stable with margin, and up to there stable at all.
double recommended_step(const Scene&);
double stable_step(const Scene&);
/// Every so many steps soil that may sleep (accuracy.sleep_below) is checked for calm: no sooner can a P-wave that was outside the support
/// of a sleeping particle have reached it.
std::int64_t sleep_interval(const Scene&);

/// What a step above the stable limit is: an error, or a warning for --force-step.
enum class StepLimit { Enforce, Force };

/// Decides what the file leaves to "auto" and rewrites scene.notes: one line for every effect, on or off, and why.
void resolve(Scene&);
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

/// Bytes of the columns of all soil particles of a run: the fields of the store, without records and lists.
double column_bytes(const Scene&, const Filling&);

} // namespace kuzure::scene
