#pragma once
// [start] from: the last state of another run as the start of a scene.
#include "decomposition/comm.hpp"
#include "solver/core/particles.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

struct StartState {
    Particles particles; // rows on any rank: position, velocity, density, stress, what soil remembers, id, soil; origin is the position
    std::string from;    // the checkpoint
    double time = 0;     // s, of the other run
};

/// Collective. Reads what scene.start.from names. Throws BadInput where it is not there, or is of other bodies, spacing or dimensions;
/// IoFailed where it is damaged.
StartState start_state(const Comm&, const Scene&, const scene::Filling&);

} // namespace kuzure
