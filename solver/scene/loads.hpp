#pragma once
// Loads: what they may say, and which soil they push.
#include "solver/scene/fill.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// True where the soil of a body at a point (m) is what a load pushes.
bool pushes(const Scene&, const Load&, int body, Vector x);
/// True where some load pushes soil as the run starts.
bool loaded_at_start(const Scene&);
/// The largest pressure or traction (Pa) of any load at any time.
double largest_load(const Scene&);
/// True where an event changes the factor of a load at a time (s).
bool load_changes(const Event&, double time);
/// "load footing: pressure 2e+04 Pa on the free faces of body block in a box, as they are then".
std::string in_words(const Scene&, int load);
/// What is wrong with loads, and with the soil that they find as the run starts.
void check_loads(const Scene&, Issues&);
void check_loaded_soil(const Scene&, const Filling&, Issues&);

} // namespace kuzure::scene
