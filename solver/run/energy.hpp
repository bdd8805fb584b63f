#pragma once
// Energies of the whole run, summed so that the result does not depend on how particles are spread over threads and
// ranks: every addend is rounded to one unit, fixed for the run; sums of such numbers are exact.
#include "solver/core/particles.hpp"
#include "solver/core/team.hpp"
#include "solver/effects/pore_water.hpp"
#include "solver/pairs/tally.hpp"
#include "solver/scene/material.hpp"
#include <span>
#include <string>

namespace kuzure {

/// The energies that are functions of the state, J (J/m in 2-D). Potential, of weight and of still pore water, counts from
/// the particles' origins.
struct StateEnergy {
    double kinetic = 0, potential = 0, elastic = 0;
};

/// What left the mechanical ledger since the start, in whole units. Exact; addition in any order.
struct DissipatedUnits {
    std::int64_t plastic = 0, viscous = 0, wall = 0, damping = 0;
    static constexpr std::tuple members{&DissipatedUnits::plastic, &DissipatedUnits::viscous, &DissipatedUnits::wall,
                                        &DissipatedUnits::damping};
    void add(const EnergySums& e, double unit)
    {
        for_each_member(*this, e, [unit](std::int64_t& units, double joules) { units += std::int64_t(joules / unit); });
    }
};

/// Collective: over all ranks.
DissipatedUnits over_ranks(const Team&, DissipatedUnits);

/// One row of the ledger, the same bits on every rank.
struct Ledger {
    StateEnergy state;
    EnergySums dissipated;
    double sum() const;
};

/// Collective. Energies of the present state; `unit` (J) must be a power of two far below them.
StateEnergy state_energy(const Team&, const Particles&, std::span<const Material>, double volume, Vector gravity, const PoreWater&,
                         double unit);

/// Collective. 64-bit hash over all particles by id, of every column that the next step needs; -0 counts as +0.
std::string state_hash(const Team&, const Particles&);

} // namespace kuzure
