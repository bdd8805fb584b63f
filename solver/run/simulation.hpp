#pragma once
// One run in memory: the particles of this rank and the time step. Everything a user sees of it (files, messages) is made by solver/app.
#include "perf/phases.hpp"
#include "perf/report.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/run/balance.hpp"
#include "solver/run/clock.hpp"
#include "solver/run/layout.hpp"
#include "solver/run/settle.hpp"
#include "solver/run/wall_forces.hpp"
#include "solver/run/watch.hpp"

namespace kuzure {

/// How a run is carried out; none of it changes a bit of the result but `arithmetic` in mixed precision.
struct RunOptions {
    Arithmetic arithmetic = Arithmetic::Simd;
    int recut_every = 0; // cut the domain anew at every so many list rebuilds, needed or not; 0: when it pays
    int blocks_per_rank = default_blocks_per_rank;
    bool guard = true; // look for trouble at list rebuilds; perf/bench/guard.cpp measures what it costs
    /// Called on every rank once its soil is filled: sets initial fields that a scene cannot say.
    std::function<void(Particles&)> initial = {};
    std::optional<scene::Filling> filling = {}; // particles of this scene, if the caller already has them
    bool settles = false;                       // this is a settling run itself
    /// Called on every rank before each step of the settling run; true on any asks it to stop.
    std::function<bool(const Settling&)> settling = {};
    /// The soil that the run starts from instead of the scene's filling, each id once, on any rank: position, velocity, density, stress,
    /// what it remembers. Displacements count from there.
    std::optional<Particles> start = {};
};

/// What a rank asks for after a step; travels with the step's only reduction.
struct Requests {
    bool stop = false, checkpoint = false;
};

/// An event that has begun.
struct Happened {
    int event;   // number in Scene::events
    double time; // s
    std::int64_t step;
    double taken; // J, that it took out of the ledger at once, together with others of that time
};

class Simulation {
public:
    /// Fills the scene (with effects resolved). Collective. Throws BadInput.
    Simulation(const Comm&, const Scene&, RunOptions = {});
    /// Goes on from particles read anywhere and the clock of their checkpoint. Collective.
    Simulation(const Comm&, const Scene&, Particles, const Clock&, RunOptions = {});
    ~Simulation();

    /// One step. Collective. Returns the requests of all ranks combined. Throws NumbersFailed on every rank together.
    Requests step(Requests mine = {});
    /// Length of the next step, s; 0 when the end time is reached.
    double next_dt() const { return model_->moves_first() ? clock_.next : step_length(scene_, clock_); }
    bool finished() const { return next_dt() == 0; }

    double time() const { return clock_.time; }
    std::int64_t steps() const { return clock_.step; }
    double dt() const { return clock_.dt; }
    double max_speed() const { return std::sqrt(clock_.extremes.speed2); }
    double max_acceleration() const { return std::sqrt(clock_.extremes.acceleration2); }
    /// How the soil settled before t = 0, if it had to.
    const std::optional<Settling>& settled() const { return settled_; }
    const Particles& particles() const { return particles_; }
    const scene::Filling& filling() const { return filling_; }
    /// As it is now: events change it.
    const Scene& scene() const { return scene_; }
    /// Those that have begun since this start of the program, in their order.
    std::span<const Happened> happened() const { return happened_; }
    /// Collective: force, moment and impulse on the walls that have names.
    std::vector<WallLoad> wall_loads() { return wall_forces_.loads(comm_, particles_, clock_); }
    std::span<const Material> soils() const { return soils_; }
    const PairModel& model() const { return *model_; }
    const Comm& comm() const { return comm_; }
    Timers& timers() { return timers_; }

    /// Collective. Back to the last state that the guard found good, to go on with half the step; only with time.retry.
    /// False, and nothing changed, if there is none or this failure was met before.
    bool roll_back();
    /// The step (its number) to which roll_back() would go; -1 where it cannot.
    std::int64_t good_step() const { return last_good_ ? last_good_->clock.step : -1; }
    /// Id of the particle that the last NumbersFailed named; -1 before there was one.
    std::int64_t failed_id() const { return watch_.failed_id(); }

    /// Collective: energies of now.
    Ledger ledger() const { return ledger(clock_.dt); }
    /// (sum of energies - that at the start)/(potential drop).
    double residual(const Ledger&) const;
    /// Collective: the clock with everything that other ranks know summed up on every rank.
    Clock clock() const;
    /// Collective: pairs over all ranks since the start.
    std::int64_t pairs() const;
    WorkDone work_done() const { return work_; }

    std::int64_t rebuilds() const { return rebuilds_; }
    const Balance& balance() const { return balance_; }
    const Watch::Seen& seen() const { return watch_.seen(); }
    Index ghosts() const { return layout_.ghosts(); }
    /// Bytes that this rank sends in a step.
    std::int64_t halo_bytes() const;
    int halo_messages() const;
    /// Bytes of this rank's large arrays.
    MemoryUse memory() const;

private:
    Simulation(const Comm&, const Scene&, RunOptions, const Clock&);
    /// Of a state that a step of this length led to, s.
    Ledger ledger(double dt) const;
    void prepare();
    /// This rank's share of the soil at t = 0, where it is to be. Collective.
    void start_soil();
    /// `sort_anew`: at the positions of now, which are those of a time (s); else at those of the last sort.
    void rebuild(bool sort_anew, double time, double way = 0);
    StepInput step_input(double dt, double next);
    /// The forces of a state that no step led to, where steps need them first. Collective.
    void evaluate_anew();
    /// The events that are due at the present time. Collective.
    void begin_events();
    /// The scene, and what is made of it, as events have it at a time, s.
    void enter_stage(double time);
    /// Takes the soil of bodies away that went, and puts that of those there that came. Collective.
    void change_bodies(const Scene& before);
    /// Soil that loads push, which were not there before, is found, and its faces are measured. Collective.
    void begin_loads(const Scene& before);
    /// Throws NumbersFailed where a wall or body came to stand in soil. Collective.
    void require_room(const Scene& before);
    /// Soil that has left real ground is taken out of the run: else it falls without end, ever faster. Collective.
    void take_out_what_left();
    /// What changes little by little takes its values of the end of a step; gives the scene before, where something does. Collective.
    std::optional<Scene> follow_courses(double dt);
    void end_course(const Scene& before);
    StateEnergy state(const Scene&, double dt) const;
    void take(double joules);
    PassResult run_stages(const StepInput&);
    /// Where a wall stands at a time, s.
    scene::Pose pose(int wall, double time) const;
    /// Walls that move stand where they do at a time, s: for all but the model.
    void move_walls(double time);
    /// For the model too, half-way through the step under way or at its end.
    void place_walls(const StepInput&, bool midway);
    /// The largest way and speed of a wall in the step to come join those of particles: lists and the next step hold for both.
    void meet_walls();
    Requests reduce(const PassResult&, Requests mine);
    /// How fast the whole scene flies past at a time (s): without walls the mean velocity of its bodies, falling with gravity.
    Vector frame(double time) const;
    /// 1/s, while the scene asks for it.
    double damping() const;
    SleepStage sleep_stage() const;
    /// A stage over all clusters, those without ghosts while the halo travels.
    PassResult run_stage(int stage, const StepInput&);
    void count_work(Phase, const Stage&, std::int64_t pairs, std::size_t clusters);
    Requests end_step(const StepInput&, PassResult, Requests mine);
    /// Length of the step after one of this length, where it is decided ahead, s.
    double following_dt(double dt) const;
    void remember_if_good(bool rebuilt);
    void remember();

    const Comm& comm_;
    Scene start_scene_; // as it is before its events
    Scene scene_;       // as it is now
    RunOptions options_;
    scene::Filling filling_;
    std::vector<Material> soils_;
    std::unique_ptr<PairModel> model_;
    Domain domain_;
    Layout layout_;
    Balance balance_;
    std::vector<int> moving_; // numbers of the walls that events move
    Watch watch_;
    WallForces wall_forces_;
    std::vector<Happened> happened_;
    int events_before_ = 0; // that had begun before this start of the program
    Particles particles_;
    std::optional<Settling> settled_;
    PoreWater water_;
    std::vector<LoadNow> loads_;
    bool evolving_ = false, remembering_ = false;
    std::int64_t sleep_interval_ = 1; // steps between detections, where soil may sleep
    Clock clock_;
    WorkDone work_; // of this rank
    std::int64_t rebuilds_ = 0;
    struct SavedState {
        Particles particles;
        Clock clock;
        WorkDone work;
        BlockOwners known;
    };
    std::optional<SavedState> last_good_; // for time.retry
    double last_failure_time_ = -1;       // s, of the last retried failure
    Timers timers_;
};

} // namespace kuzure
