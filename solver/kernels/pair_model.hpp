#pragma once
// A compiled pair model: the stages of a time step over its own records. The app sees this interface alone, so that kernels'
// templates and number types stay behind it.
#include "solver/core/particles.hpp"
#include "solver/neighbours/lists.hpp"
#include "solver/pairs/tally.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/parts.hpp"
#include <memory>
#include <optional>

namespace kuzure {

/// What a step of given length does to velocities besides the pair forces.
struct StepForces {
    Vector gravity{};   // m/s^2
    double damping = 0; // 1/s: -damping v
};

/// What a step does about soil at rest: nothing; find the calm, who neither move nor are about to (|v| + detection_interval |a|
/// below a speed); let those fall asleep who are calm among calm neighbours, by the step before; keep the state of sleepers.
enum class SleepStage { Off, Detect, Freeze, Frozen };

/// What acts of a load now: a pressure that follows its face (Pa), or a share of the force that its particles have been given.
struct LoadNow {
    double pressure = 0, share = 0;
    bool measured = false; // its particles are given the force of that pressure
};

/// What a step asks of a model, the same for all stages and clusters.
struct StepInput {
    Particles* particles; // with the model's fields
    ClusterLists* lists;
    std::span<const Material> soils;
    bool prune = true; // make the pruned lists anew from the lists; else those of an earlier pass hold everything in reach
    double margin = 0; // m, how far beyond the support the pruned lists reach
    double dt;         // length of this step, s
    double kick;       // half of the step before and half of this one, s
    double next;       // length of the step to come, s
    StepForces forces;
    bool evolving = false; // a soil's cone changes with strain or its rate
    /// Of a model that shifts particles: this step decides how those of the next are; its own move has shifted them.
    bool shifts = false, shifted = false;
    bool remembering = false; // a soil remembers opened volume: `particles` has field::opened_volume
    Vector frame{};           // m/s, how fast the whole scene flies past; largest speeds and displacements are against it
    Vector frame_way{};       // m, how far it will have flown since the last sort, after the step whose displacement is told
    double energy_unit;       // J
    std::optional<Vector> low = {}, high = {};
    std::span<const LoadNow> loads = {};           // none: `particles` has no field::load
    SleepStage sleep = SleepStage::Off;            // else `particles` has field::activity
    double calm_speed = 0, detection_interval = 0; // m/s, s: until a sleeper moves again at the earliest
};

/// Where a wall stands at the start of a step, at its end and at that of the next, seen from its pose when the model's walls were set.
struct WallPoses {
    scene::Pose before, after, later;
};
/// All walls of a scene in a step of length dt before one of length `next`, s; of no length: at its end.
struct WallStep {
    std::span<const WallPoses> walls;
    double dt, next;
    bool midway; // of the step, else at its end
    /// Mean velocity (m/s) of what was at x (m) when walls were set, in this step and in the next.
    Vector velocity(int wall, Vector x) const
    {
        const WallPoses& w = walls[std::size_t(wall)];
        return dt > 0 ? (1 / dt) * (scene::placed(w.after, x) - scene::placed(w.before, x)) : next_velocity(wall, x);
    }
    Vector next_velocity(int wall, Vector x) const
    {
        const WallPoses& w = walls[std::size_t(wall)];
        return (1 / next) * (scene::placed(w.later, x) - scene::placed(w.after, x));
    }
    /// Where that is now; half-way along the chord, as soil is at mid-step.
    Vector position(int wall, Vector x) const
    {
        const WallPoses& w = walls[std::size_t(wall)];
        const Vector after = scene::placed(w.after, x);
        return midway ? 0.5 * (scene::placed(w.before, x) + after) : after;
    }
    Vector turned(int wall, Vector normal) const
    {
        const WallPoses& w = walls[std::size_t(wall)];
        const Vector after = scene::turned(w.after, normal), n = midway ? scene::turned(w.before, normal) + after : after;
        return (1 / length(n)) * n;
    }
};

/// One stage of a step: a pass over all clusters, and the exchange of ghosts before it.
struct Stage {
    const char* name;
    std::size_t ghost_bytes; // of a ghost's record
    /// Floating-point operations of one directed pair (an fma counts two; square root, division, min and max one), and of
    /// the update of one particle; bytes of main memory that one particle's update moves: for the roofline.
    double flops_per_pair, flops_per_particle, bytes_per_particle;
};

enum class Arithmetic { Simd, Scalar };

/// Kernel, terms, integrator, precision and lanes, chosen once a run; owns the records of this rank's particles and ghosts.
class PairModel {
public:
    virtual ~PairModel() = default;
    virtual std::string name() const = 0;
    /// Particles a cluster must hold.
    virtual int cluster_width() const = 0;
    virtual scene::Precision precision() const = 0;
    /// The passes of one step, in order.
    virtual std::span<const Stage> stages() const = 0;
    /// Bytes of the records of one particle.
    virtual std::size_t record_bytes() const = 0;
    /// Columns that the scheme advances; others are the run's.
    virtual void require_fields(Particles&, bool coulomb_walls) const = 0;
    /// Those columns at the start of a run, from the state: velocity, density, stress.
    virtual void start(Particles&) const = 0;

    /// Records of owned particles, from their columns, and room for so many ghosts of these soils.
    virtual void make_records(const Particles&, std::span<const Material>, std::span<const std::int32_t> ghost_soil) = 0;
    /// The wall points near this rank's soil, which must outlive the model's use as the scene must. Those that this model has no use for
    /// are taken away: lists are made of what is left.
    virtual void set_walls(const Scene&, std::span<WallPoints>) = 0;
    /// Walls as they stand in the stage to come, where some move.
    virtual void place_walls(const WallStep&) {}

    /// True where a step first moves the particles by the acceleration they have (move()), which must be there at the start: stages run
    /// once with a step of no length. The length of the step to come is then decided one step ahead.
    virtual bool moves_first() const { return false; }
    virtual void move(const StepInput&) {}
    /// One stage over some clusters. Ghosts must have arrived where the clusters' lists hold any.
    virtual PassResult run(int stage, const StepInput&, std::span<const Index> clusters) = 0;
    /// After the last cluster of a stage.
    virtual void end_stage(int stage) = 0;
    /// Ghosts of a stage, a record each: that of an owned particle seen from another period (m), and back to its slot.
    /// Threads call them at once.
    virtual void pack(int stage, Index owned, Vector shift, std::byte* to) const = 0;
    virtual void unpack(int stage, Index slot, const std::byte* from) = 0;

    /// The strengths of effects are those of this scene from now on; which there are stays as it was.
    virtual void renew(const scene::Interactions&) = 0;

    /// Bytes of the records it holds, and of what it keeps of walls.
    virtual std::size_t record_memory() const = 0;
    virtual std::size_t wall_memory() const = 0;
};

/// Bytes of the ghost records of one particle in a whole step.
std::size_t ghost_bytes(const PairModel&);

/// The cheapest compiled model that contains every pair term of the scene (whose "auto" effects are resolved).
std::unique_ptr<PairModel> choose_model(const scene::Interactions&, Arithmetic);
std::unique_ptr<PairModel> choose_model(const Scene&, Arithmetic);

} // namespace kuzure
