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

/// Exact; throws NumbersFailed where an energy is beyond what its unit can count.
std::int64_t sum_of_units(std::int64_t units, double more);
std::int64_t sum_of_units(std::int64_t units, std::int64_t more);

/// What left the mechanical ledger since the start, in whole units. Exact; addition in any order.
struct DissipatedUnits {
    std::int64_t plastic = 0, viscous = 0, wall = 0, damping = 0, stabilising = 0, moved_wall = 0, loads = 0;
    static constexpr std::tuple members{&DissipatedUnits::plastic, &DissipatedUnits::viscous,     &DissipatedUnits::wall,
                                        &DissipatedUnits::damping, &DissipatedUnits::stabilising, &DissipatedUnits::moved_wall,
                                        &DissipatedUnits::loads};
    void add(const DissipatedUnits& o)
    {
        for_each_member(*this, o, [](std::int64_t& units, std::int64_t more) { units = sum_of_units(units, more); });
    }
    void add(const EnergySums& e, double unit)
    {
        for_each_member(*this, e, [unit](std::int64_t& units, double joules) { units = sum_of_units(units, joules / unit); });
    }
};

/// Collective: over all ranks.
DissipatedUnits over_ranks(const Team&, DissipatedUnits);

/// One row of the ledger, the same bits on every rank.
struct Ledger {
    StateEnergy state;
    EnergySums dissipated;
    double events = 0; // J, that events have taken
    double sum() const;
};

/// Collective. Energies of the present state; `unit` (J) must be a power of two far below them. Where the particles have an
/// acceleration, kinetic energy is m v^{n-1/2}.v^{n+1/2}/2 = m (v^2 - (dt/2 a)^2)/2, which elastic waves keep (dt: the step before, s).
StateEnergy state_energy(const Team&, const Particles&, std::span<const Material>, double volume, Vector gravity, const PoreWater&,
                         double unit, double dt);

/// Collective. 64-bit hash over all particles by id, of every column that the next step needs; -0 counts as +0.
std::string state_hash(const Team&, const Particles&);

} // namespace kuzure
