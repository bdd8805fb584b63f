#pragma once
// Where a run stands in time, and how long its next step is. Decided from numbers that all ranks share.
#include "solver/pairs/tally.hpp"
#include "solver/run/energy.hpp"
#include "solver/run/exact_sums.hpp"
#include "solver/scene/events.hpp"
#include <vector>

namespace kuzure {

/// Everything but the particles that a restart needs to go on bit for bit.
struct Clock {
    double time = 0; // s
    std::int64_t step = 0;
    double dt = 0;              // s, length of the step before
    Extremes extremes{};        // of the step before, over all particles
    std::int64_t pairs = 0;     // summed over steps and ranks (kept by rank 0)
    DissipatedUnits dissipated; // over ranks (kept by rank 0)
    DissipatedUnits later;      // of the half step to come (likewise)
    double next = 0;            // s, length of the step to come, where it is decided one step ahead
    double energy_at_start = 0; // J
    double energy_unit = 0;     // J
    // Steps are the scene's times step_scale since base_step, which began at base_time: 1, 0, 0 unless a retry halved them.
    double step_scale = 1, base_time = 0; // 1, s
    std::int64_t base_step = 0;
    Vector frame{};             // m/s, how fast the whole scene flies past
    Vector frame_way{};         // m, flown with the frame since the last sort
    double largest_energy = 0;  // J, that the guard has met: kinetic + elastic + potential drop, and the kinetic energy at the start
    EnergySums largest_taken{}; // J, the most that each has taken
    std::int64_t inspected = 0; // step of the guard's last inspection
    double sorted_time = 0;     // s, at which particles were last sorted: where walls that move stood when lists were made
    int events = 0;             // that have begun, in their order (scene::order_of_events)
    std::int64_t taken = 0;     // energy units that events have taken out of the ledger; the same on every rank
    // Impulse on each named wall, in units of an impulse (WallForces); over ranks, kept by rank 0.
    std::vector<std::array<WideUnits, 3>> impulse;
};

/// Length of a step that starts at clock.time, s, 0 when the end time is reached:
///     dt = cfl min( h/(c_p + signal speed), sqrt(h/|a|), staggered: 0.12 h/|v| ),  or the scene's fixed step; the last one ends on time.
double step_length(const Scene&, const Clock&);
/// Where a step of this length ends, s.
double time_after(const Scene&, const Clock&, double dt);
/// How many events have begun at clock.time. Steps are shortened to end where events begin and end; with a fixed step an event happens at
/// the boundary of two steps that is nearest to its time.
int events_begun(const Scene&, const Clock&);

} // namespace kuzure
