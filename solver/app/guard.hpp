#pragma once
// The guard: watches a run for what cannot be right, at list rebuilds, and says which limit broke, where and why.
#include "solver/core/particles.hpp"
#include "solver/core/team.hpp"
#include "solver/neighbours/lists.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/scene.hpp"
#include <string>

namespace kuzure {

/// Limits beyond which the numbers cannot be trusted.
namespace limit {
inline constexpr double energy_growth = 0.10; // of the largest energy in the ledger
inline constexpr double neighbours = 3.0;     // times those of the lattice
inline constexpr double penetration = 1.0;    // spacings that a particle may sink into a wall
inline constexpr double density = 10.0;       // times or parts of that at the start
inline constexpr double near = 0.6;           // spacings below which two particles count as clumped
} // namespace limit

/// What an inspection of the neighbourhoods finds; the worst particle of each kind by its id, -1 if none. The same on
/// every rank after combine().
struct Neighbourhoods {
    double clumped = 0;         // share of particles whose nearest soil neighbour is nearer than limit::near spacings
    double most_neighbours = 0; // of one particle, over that of the lattice
    double deepest = 0;         // spacings below a wall's surface
    std::int64_t crowded_id = -1, sunk_id = -1;
};

/// Collective. Looks at every particle's neighbours where the lists were built.
Neighbourhoods inspect_neighbours(const Team&, const Scene&, std::int64_t soil_count, const Particles&, const ClusterLists&,
                                  const double* ghost_x, const double* ghost_y, const double* ghost_z);

} // namespace kuzure
