#pragma once
// The one pass over pairs of a time step, declared: sums over neighbours, constitutive law and leap-frog update of a set
// of clusters, in one go. Compiled once per pair model (variants.hpp, variant.cpp) for double and mixed precision.
#include "solver/core/particles.hpp"
#include "solver/kernels/record.hpp"
#include "solver/neighbours/lists.hpp"
#include "solver/physics/terms.hpp"
#include "solver/scene/material.hpp"
#include <memory>
#include <optional>

namespace kuzure {

/// Tension tensors tau of one particle beside its record; only models with artificial stress read and write them.
template <class T> struct alignas(8 * sizeof(T)) Tension {
    T xx, yy, zz, xy, yz, xz, any, spare; // Pa; any != 0 where tau is not zero
};

/// Points of one wall as the pair loop reads them.
template <class T> struct WallRecords {
    const scene::Wall* wall;
    Array<Place<T>> x, y, z;
};

/// Energy that left the mechanical ledger during a pass, J (J/m in 2-D). Every addend is a multiple of one unit fixed
/// for the run, so the sums are exact and equal in any order. Viscous: artificial viscosity and the other terms against
/// noise, artificial stress and stress diffusion, together.
struct EnergySums {
    double plastic = 0, viscous = 0, wall = 0, damping = 0;
};

/// The extremes a step reports; combined by max over threads and ranks.
struct Extremes {
    double acceleration2 = 0; // (m/s^2)^2
    double signal = 0;        // c_p + h |D|, m/s
    double moved2 = 0;        // squared way since the last sort, m^2
    double speed2 = 0;        // (m/s)^2
    double drift2 = 0;        // (m/s)^2, of the half-step velocity that moved the particle
    double bad = 0;           // 1 where a number is not finite
    double outside = 0;       // 1 where a particle left the box
    double strained = 0;      // density over that at the start, or the other way round
};

/// What a step of given length does to velocities besides the pair forces.
struct StepForces {
    Vector gravity{};   // m/s^2
    double damping = 0; // 1/s: -damping v
};

/// What a pass does about soil at rest. Nobody sleeps; or a look at who is calm, neither moving nor about to (|v| + nap |a|
/// below a speed); or those fall asleep who are calm among calm neighbours, by the look of the pass before; or sleepers keep their state.
enum class Rest { Nobody, Look, FallAsleep, Keep };

/// Everything one pass reads and writes. Columns of `particles`: position, velocity, density, stress, plastic_strain
/// and their half-step twins.
template <class T> struct Pass {
    Particles* particles;
    const Record<T>* records; // owned, then ghosts
    Record<T>* next;          // owned particles' records at the end of the step
    const Tension<T>* tension = nullptr;
    Tension<T>* next_tension = nullptr;
    ClusterLists* lists;
    bool prune = true; // make the pruned lists anew from the lists; else those of an earlier pass hold everything in reach
    double margin = 0; // m, how far beyond the support the pruned lists reach
    std::span<const WallRecords<T>> walls;
    std::span<const Material> soils;
    double volume; // m^3 (m^2 in 2-D) of one particle at reference density
    double h;      // m
    double dt;     // length of this step, s
    double kick;   // half of the step before and half of this one, s
    StepForces forces;
    const PoreWater* water = nullptr; // still water, if any
    bool evolving = false;            // a soil's cone changes with strain or its rate
    double energy_unit;               // J
    std::optional<Vector> low, high;
    Rest rest = Rest::Nobody;       // else `particles` has field::activity
    double calm_speed = 0, nap = 0; // m/s, s: until a sleeper moves again at the earliest
};

struct PassResult {
    EnergySums energy;
    Extremes extremes;
    std::int64_t pairs = 0;
    std::int64_t asleep = 0; // particles whose state was kept

    /// What two passes, or two threads of one, report together.
    void add(const PassResult& o)
    {
        energy.plastic += o.energy.plastic, energy.viscous += o.energy.viscous;
        energy.wall += o.energy.wall, energy.damping += o.energy.damping;
        pairs += o.pairs, asleep += o.asleep;
        Extremes& x = extremes;
        const Extremes& y = o.extremes;
        x = {max(y.acceleration2, x.acceleration2),
             max(y.signal, x.signal),
             max(y.moved2, x.moved2),
             max(y.speed2, x.speed2),
             max(y.drift2, x.drift2),
             max(y.bad, x.bad),
             max(y.outside, x.outside),
             max(y.strained, x.strained)};
    }
};

enum class Arithmetic { Lanes, Plain };

/// A compiled pair model and precision, chosen once a run.
class PairModel {
public:
    virtual ~PairModel() = default;
    virtual std::string name() const = 0;
    /// Particles a cluster must hold.
    virtual int cluster_width() const = 0;
    virtual scene::Precision precision() const = 0;
    virtual bool tensile() const = 0;
    /// Floating-point operations of one directed pair (an fma counts two; square root, division, min and max one), and of
    /// the update of one particle; bytes of main memory that one particle's step moves: for the roofline.
    virtual double flops_per_pair() const = 0;
    virtual double flops_per_particle() const = 0;
    virtual double bytes_per_particle() const = 0;
    virtual PassResult run(const Pass<double>&, std::span<const Index> clusters) const = 0;
    virtual PassResult run(const Pass<float>&, std::span<const Index> clusters) const = 0;
};

/// The cheapest compiled model that contains every pair term of the scene (whose "auto" effects are resolved).
std::unique_ptr<PairModel> choose_model(const scene::Interactions&, Arithmetic);
std::unique_ptr<PairModel> choose_model(const Scene&, Arithmetic);

/// One record of a particle at its present state.
template <class T> Record<T> make_record(const Places<T>&, Vector x, Vector v, double volume, double density, const Stress&, double c);
/// Its tension tensor.
template <class T> Tension<T> make_tension(const Stress&, double epsilon);

} // namespace kuzure
