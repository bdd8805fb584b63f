#pragma once
// The particles of a scene's start, and the energy scale of its run.
#include "decomposition/domain.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/scene.hpp"
#include <functional>

namespace kuzure {

/// Fills this rank's blocks with the scene's soil, with its velocities and initial stresses. Collective. The fields are required.
void fill_start(const Comm&, Domain&, const Scene&, const scene::Filling&, std::span<const Material>, Particles&);

/// The numbers of all soils of a scene.
std::vector<Material> materials_of(const Scene&);

/// Velocity with which a body starts, m/s; none along y in 2-D.
Vector start_velocity(const Scene&, const scene::Body&);

/// Adds this rank's even share of some bodies to soil that is there already, as they start, without stress.
void add_bodies(const Comm&, const Scene&, const scene::Filling&, std::span<const Material>, Particles&,
                const std::function<bool(const scene::Body&)>& wanted);

/// Energy scale of a whole run, J: weight times height, or kinetic energy, or a little strain.
double energy_scale(const Scene&, const scene::Filling&, std::span<const Material>);
/// The unit that energies of this scale (J) are sums of, a power of two: 64-bit sums hold 2^17 times the scale, however far soil may fall.
inline constexpr double energy_units_per_scale = 0x1p46;
double energy_unit(double scale);

} // namespace kuzure
