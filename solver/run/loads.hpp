#pragma once
// Loads on soil: who is pushed, and by how much. What a load does in the pair loop is in kernels/force.hpp.
#include "solver/core/particles.hpp"
#include "solver/core/team.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"
#include <span>
#include <vector>

namespace kuzure {

/// Pressure (Pa) in the pair loop that pushes a flat face of soil on its lattice by one Pa: 1/(-sum_j V x_ij dW/dx).
double unit_pressure(const Scene&);
/// What acts of each load of a scene as it is now.
std::vector<LoadNow> loads_now(const Scene&);
/// Loads that are there in one scene and not in the other.
std::vector<int> loads_come(const Scene& before, const Scene& after);

/// Collective. Gives the soil that lies where loads begin their numbers. Throws NumbersFailed where a load finds no soil (not with
/// `settles`), or soil that another one pushes already; `time`: s, for the words.
void give_to_loads(const Team&, const Scene&, const scene::Filling&, std::span<const int> loads, double time, bool settles, Particles&);
/// Takes the soil of these loads from them.
void take_from_loads(std::span<const int> loads, Particles&);
/// Collective. field::load_push of these loads' particles, from the area (m^2) of their free faces, against its normal, to the force (N)
/// that the load says. Where it has a normal, the area that is seen along it is shared among the soil at that point
/// in the proportion of those.
void set_pushes(const Team&, const Scene&, std::span<const int> loads, Particles&);

/// True where some load has a plate, now or later.
bool any_plate(const Scene&);
/// Collective. The soil under each plate gets one velocity along its normal, that of its momentum.
void join_plates(const Team&, const Scene&, std::span<const Material>, Particles&);
/// Collective. After the forces of a step: the soil under each plate is accelerated along its normal as one, by the forces on all of it.
/// The plate gives and takes nothing, since its soil has one velocity along the normal; what is known already of the works of the half step
/// to come (`later`) was booked for soil without it, and the difference goes to the account of loads.
/// Largest speeds and ways join the maxima.
void hold_plates(const Team&, const Scene&, std::span<const Material>, const StepInput&, PassResult&);

/// What a load pushes: its particles, and their force together as it began, N, of all of it (factor 1).
struct LoadedSoil {
    std::string name;
    std::int64_t particles;
    Vector force;
    double factor; // of now; 0 where it is not there
};
/// Collective: of every load of the scene.
std::vector<LoadedSoil> loaded_soil(const Team&, const Scene&, const Particles&);

} // namespace kuzure
