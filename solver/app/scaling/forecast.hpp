#pragma once
// How long a run will take here: a block of the scene's own soil stepped for a moment, times what the scene holds.
#include "solver/app/scaling/estimate.hpp"

namespace kuzure {

struct Forecast {
    double seconds = 0;          // wall time of the whole run, start and outputs included
    double low = 0, high = 0;    // s, between which it lies if the machine stays as it is
    double pair_nanoseconds = 0; // of a directed pair, on all ranks and threads together, update included
};

/// Collective; takes a second or less. `done` is the share that lies behind a restart. Uses the threads that are set.
Forecast forecast(const Comm&, const Scene&, const scene::Filling&, const Estimate&, double done = 0);

/// The unit in which a time is said, and how many seconds that is.
struct TimeUnit {
    double seconds;
    const char* name;
};
TimeUnit unit_for(double seconds);

/// "12.3 minutes (10.9 to 14.0)"
std::string forecast_text(const Forecast&);

} // namespace kuzure
