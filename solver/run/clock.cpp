#include "solver/run/clock.hpp"
#include <limits>

namespace kuzure {

namespace {
constexpr double largest_way = 0.12; // of h, of a particle in a step with cfl = 1
} // namespace

double step_length(const Scene& scene, const Clock& clock)
{
    const double end = scene.time.end;
    if (scene.time.step) {
        const double dt = clock.step_scale * *scene.time.step;
        return clock.step - clock.base_step < std::llround((end - clock.base_time) / dt) ? dt : 0;
    }
    if (clock.time >= end) return 0;
    const double stop = std::min(end, scene::next_event_after(scene, clock.time));
    const double h = scene.smoothing_length(), a = std::sqrt(clock.extremes.acceleration2);
    const double limit = std::min(h / clock.extremes.signal, a > 0 ? std::sqrt(h / a) : std::numeric_limits<double>::infinity());
    double dt = clock.step_scale * scene.accuracy.cfl * limit;
    // The geometry of mid-step holds for ways well below h: a fast impact shortens the staggered step.
    if (scene.accuracy.scheme == scene::Scheme::Staggered && clock.extremes.half_step_speed2 > 0)
        dt = std::min(dt, clock.step_scale * scene.accuracy.cfl * largest_way * h / std::sqrt(clock.extremes.half_step_speed2));
    // The last step is shortened to end on time, as is one before an event; a remainder of round-off is not a step.
    return clock.time + dt * (1 + 1e-9) >= stop ? stop - clock.time : dt;
}

double time_after(const Scene& scene, const Clock& clock, double dt)
{
    if (scene.time.step) return clock.base_time + double(clock.step + 1 - clock.base_step) * dt;
    const double stop = std::min(scene.time.end, scene::next_event_after(scene, clock.time));
    return clock.time + dt * (1 + 1e-9) >= stop ? stop : clock.time + dt;
}

int events_begun(const Scene& scene, const Clock& clock)
{
    const double dt = scene.time.step ? clock.step_scale * *scene.time.step : 0;
    int begun = 0;
    for (const int k : scene::order_of_events(scene)) {
        const double at = scene::begin_of(scene.events[std::size_t(k)]);
        const bool reached = dt > 0 ? clock.step - clock.base_step >= std::llround((at - clock.base_time) / dt) : clock.time >= at;
        if (!reached) break;
        ++begun;
    }
    return begun;
}

} // namespace kuzure
