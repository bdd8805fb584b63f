#pragma once
// Height and fronts of the soil: how high it stands and how far it reaches.
#include "decomposition/comm.hpp"
#include "solver/core/particles.hpp"
#include "solver/scene/fill.hpp"

namespace kuzure {

/// Height and reach of the columns, one spacing wide, whose soil stands at least `grain` high (its volume over its
/// area); outer edges of those columns, m. All zero where no column does. off_ground: the share of the soil particles that have left the
/// ground, below the lowest wall or beyond the outermost ones; 0 without walls.
struct Fronts {
    double height = 0;
    double min_x = 0, max_x = 0, min_y = 0, max_y = 0;
    double off_ground = 0;
};
/// Collective; heights count from the lowest soil at the start.
Fronts measure_fronts(const Comm&, const Particles&, const Scene&, const scene::Filling&);

/// Collective: soil particles that have left real ground and were taken out of the run.
std::int64_t taken_out(const Comm&, const Particles&, const Scene&, const scene::Filling&);

/// Collective. Mean rho_0/rho of the soil that rests, which moves slower than scene::resting_speed(); 0 where none does.
double resting_volume_ratio(const Comm&, const Particles&, const Scene&, const scene::Filling&);

} // namespace kuzure
