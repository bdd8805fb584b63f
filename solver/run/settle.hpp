#pragma once
// The settling run: where the stress of columns is no equilibrium (scene::no_closed_form), soil "at rest" comes to rest under damping
// before t = 0. The only settling of the project.
#include "solver/core/particles.hpp"
#include "solver/scene/at_rest.hpp"
#include <functional>
#include <stdexcept>

namespace kuzure {

class Comm;
struct RunOptions;

/// How a settling run went, or goes.
struct Settling {
    std::string why; // no closed form
    std::int64_t steps = 0;
    double time = 0;         // s
    double speed = 0;        // m/s, largest
    double acceleration = 0; // m/s^2, largest
    double displacement = 0; // m, largest
    bool held = false;       // the soil does not stand by itself: it settled as elastic soil, as if something held it
    bool at_rest = false;    // speed and acceleration are below settled_speed and settled_acceleration
};

/// Soil is settled when it moves nowhere faster than this, m/s, and is nowhere accelerated by more than this, m/s^2.
double settled_speed(const Scene&);
double settled_acceleration(const Scene&);

/// Thrown on every rank when RunOptions::settling asked a settling run to stop.
class SettlingStopped : public std::runtime_error {
public:
    SettlingStopped() : std::runtime_error("stopped before t = 0, while the soil settled") {}
};

/// The soil of all bodies "at rest", settled: any rank holds any of it, ids and soils of the whole scene; no plastic strain, origin where
/// it settled, velocities of the bodies. Collective. Throws NumbersFailed, SettlingStopped.
Particles settle(const Comm&, const Scene&, const scene::Filling&, const RunOptions&, Settling&);

} // namespace kuzure
