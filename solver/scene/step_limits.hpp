#pragma once
// How long a step may be, and what follows from its length.
#include "solver/scene/scene.hpp"
#include <cstdint>

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

} // namespace kuzure::scene
