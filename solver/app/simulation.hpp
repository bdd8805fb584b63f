#pragma once
// One run in memory: the particles of this rank, their neighbours, and the time step. Everything a user sees of it
// (files, messages) is made by solver/app/commands.
#include "decomposition/domain.hpp"
#include "decomposition/rebalance.hpp"
#include "perf/phases.hpp"
#include "perf/report.hpp"
#include "solver/app/blocks.hpp"
#include "solver/app/energy.hpp"
#include "solver/kernels/step.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"
#include <functional>
#include <variant>

namespace kuzure {

/// How a run is carried out; none of it changes a bit of the result but `arithmetic` in mixed precision.
struct RunOptions {
    Arithmetic arithmetic = Arithmetic::Lanes;
    int recut_every = 0; // cut the domain anew at every so many list rebuilds, needed or not; 0: when it pays
    int blocks_per_rank = default_blocks_per_rank;
    bool guard = true; // look for trouble at list rebuilds; perf/bench/guard.cpp measures what it costs
    /// Called on every rank once its soil is filled: sets initial fields that a scene cannot say. Velocity, density and
    /// stress have half-step twins, which must be set alike.
    std::function<void(Particles&)> initial = {};
    std::optional<scene::Filling> filling = {}; // of this very scene, where somebody made it already
};

/// What a rank wants to happen after a step; travels with the step's only reduction.
struct Wishes {
    bool stop = false, checkpoint = false;
};

/// Bytes of a ghost, sent once a step.
std::size_t row_bytes(const PairModel&);

/// Where a run stands, beside the particles: what a checkpoint keeps to go on bit for bit.
struct Clock {
    double time = 0; // s
    std::int64_t step = 0;
    double dt = 0;              // s, length of the step before
    Extremes extremes{};        // of the step before, over all particles
    std::int64_t pairs = 0;     // summed over steps and ranks (kept by rank 0)
    DissipatedUnits dissipated; // over ranks (kept by rank 0)
    double energy_at_start = 0; // J
    double energy_unit = 0;     // J
    // Steps are the scene's times step_scale since base_step, which began at base_time: 1, 0, 0 unless a retry halved them.
    double step_scale = 1, base_time = 0; // 1, s
    std::int64_t base_step = 0;
    std::int64_t inspected = 0; // step of the guard's last look
};

class Simulation {
public:
    /// Fills the scene (with effects resolved). Collective. Throws BadInput.
    Simulation(const Comm&, const Scene&, RunOptions = {});
    /// Goes on from particles read anywhere and the clock of their checkpoint. Collective.
    Simulation(const Comm&, const Scene&, Particles, const Clock&, RunOptions = {});
    ~Simulation();

    /// One step of the leap-frog; one pass over pairs. Collective. Gives what any rank wished for, on every rank.
    /// Throws NumbersFailed on every rank together.
    Wishes step(Wishes mine = {});
    /// Length of the next step, s; 0 when the end time is reached.
    double next_dt() const;
    bool finished() const { return next_dt() == 0; }

    double time() const { return clock_.time; }
    std::int64_t steps() const { return clock_.step; }
    double dt() const { return clock_.dt; }
    double max_speed() const { return std::sqrt(clock_.extremes.speed2); }
    const Particles& particles() const { return particles_; }
    const scene::Filling& filling() const { return filling_; }
    const Scene& scene() const { return scene_; }
    std::span<const Material> soils() const { return soils_; }
    const PairModel& model() const { return *model_; }
    const Comm& comm() const { return comm_; }
    Timers& timers() { return timers_; }

    /// Collective. Back to the last state that the guard found good, to go on with half the step; only with time.retry.
    /// False, and nothing changed, if there is none or this trouble was met before.
    bool roll_back();
    /// Id of the particle that the last NumbersFailed named; -1 before there was one.
    std::int64_t blamed() const { return blamed_; }

    /// Collective: energies of now.
    Ledger ledger() const;
    /// (sum of energies - that at the start)/(potential drop).
    double residual(const Ledger&) const;
    /// Collective: the clock with everything that other ranks know summed up on every rank.
    Clock clock() const;
    /// Collective: pairs over all ranks since the start.
    std::int64_t pairs() const;
    WorkDone work_done() const;

    struct Structure {
        std::int64_t rebuilds = 0, migrated = 0;
        std::int64_t cuts = 0, whole_cuts = 0; // since the start; the latter of the whole domain by METIS
        double imbalance = 1;                  // max/mean of the ranks' busy seconds, as last measured
        // what the guard saw, at its last look and at its worst
        double clumped = 0, most_clumped = 0, deepest = 0;
    };
    const Structure& structure() const { return structure_; }
    Index ghosts() const { return n_ghosts_; }
    std::int64_t halo_bytes() const { return halo_ ? halo_->bytes_per_refresh() : 0; }
    int halo_messages() const { return halo_ ? halo_->messages_per_refresh() : 0; }
    /// Bytes of this rank's large arrays.
    std::size_t memory_bytes() const;

private:
    template <class T> struct Buffers {
        Places<T> place;
        Array<Record<T>> now, next;
        Array<Tension<T>> tension, next_tension;
        std::vector<WallRecords<T>> walls;
        explicit Buffers(double h) : place(h) {}
    };

    void prepare();
    void widen_energy_unit();
    void fill();
    void cut_by_counts();
    /// Blocks of this rank's particles and their costs; pairs are those of the last sort.
    std::vector<BlockWork> block_work() const;
    /// Seconds of this rank per unit of work since the last cut, against all ranks; 1 where they differ little. Collective.
    double slowness(double work) const;
    void recut();
    void rebuild(bool sort_anew);
    /// What fails on one rank fails on all, with the words of the highest such rank.
    void together(const std::function<void()>& work);
    void wrap_periodic();
    void renew_walls();
    void make_records();
    bool outgrown() const;
    /// What the next pass does about soil at rest.
    Rest rest() const;
    /// True where the pruned lists no longer hold everything in reach: then with a margin for the steps to come.
    bool prune_lists_anew(double dt);
    void count_work(Phase, std::int64_t pairs, std::size_t clusters);
    /// Looks for limits that broke in the last step; throws NumbersFailed.
    void judge_step();
    /// The guard's look at energies and neighbourhoods, after a list rebuild. Throws NumbersFailed.
    void inspect();
    /// Throws NumbersFailed with what happened to this particle, where, and the remedy.
    [[noreturn]] void blame(std::int64_t id, const std::string& what, const std::string& remedy);
    /// Id of the fastest particle, the lowest of several.
    std::int64_t fastest() const;
    /// Which limit of stability the present step breaks, and what to do: {what, remedy}.
    std::pair<std::string, std::string> diagnosis() const;

    const Comm& comm_;
    Scene scene_;
    RunOptions options_;
    scene::Filling filling_;
    std::vector<Material> soils_;
    std::unique_ptr<PairModel> model_;
    Columns columns_;
    Domain domain_;
    Rebalance rebalance_;
    Particles particles_;
    ColumnSort sorted_, ghost_sorted_;
    Array<double> ghost_x_, ghost_y_, ghost_z_;
    Array<std::int64_t> ghost_id_;
    Index n_ghosts_ = 0;
    std::optional<Halo> halo_;
    ClusterLists lists_;
    std::vector<WallPoints> walls_;
    std::optional<scene::Box> wall_region_;
    std::variant<Buffers<double>, Buffers<float>> buffers_;
    StepForces forces_;
    PoreWater water_;
    bool evolving_ = false;
    std::int64_t steps_between_looks_ = 1; // where soil may sleep
    double reach_, skin_;                  // m
    // How far beyond the support the pruned lists reach, and a bound of the way of any particle since they were made, m.
    double pruned_margin_ = 0, pruned_way_ = 0;
    Clock clock_;
    bool built_ = false;
    double busy_before_ = 0, busy_since_cut_ = 0; // s
    struct WholeCut {
        double left = 1, seconds = 0; // max/mean that the last cut of the whole domain promised, and what it took, s
        double owed = 0;              // idle seconds that cuts between neighbours have left behind since, beyond `left`
        double halo = 0;              // EvenReport::halo of the first of them
    };
    static constexpr double noticeable_ = 0.02; // of max/mean: nobody should act upon less
    static constexpr double ragged_ = 1.5;      // times the halo of fresh parts
    WholeCut whole_cut_;
    double left_ = 1, halo_share_ = 0; // of the last cut
    std::int64_t my_pairs_ = 0, my_particle_steps_ = 0, my_asleep_ = 0, my_halo_bytes_ = 0, my_messages_ = 0;
    std::optional<RankStep> first_step_;
    Structure structure_;
    struct Good {
        Particles particles;
        Clock clock;
        std::int64_t pairs, particle_steps, asleep;
        BlockOwners known;
    };
    std::optional<Good> good_; // for time.retry
    std::int64_t blamed_ = -1;
    double trouble_ = -1; // s, when the last retried failure happened
    Timers timers_;
};

} // namespace kuzure
