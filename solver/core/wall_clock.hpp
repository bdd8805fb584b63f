#pragma once
// The one clock by which waits and works are timed.
#include <chrono>

namespace kuzure {

/// Seconds of a clock that never goes back.
inline double wall_clock() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

} // namespace kuzure
