#include "solver/run/simulation.hpp"
#include "solver/core/simd.hpp"
#include "solver/effects/shifting.hpp"
#include "solver/run/loads.hpp"
#include "solver/run/start.hpp"
#include "solver/scene/loads.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/step_limits.hpp"
#include <limits>
#include <omp.h>

namespace kuzure {

Simulation::Simulation(const Comm& comm, const Scene& scene, RunOptions options, const Clock& clock)
    : comm_(comm), start_scene_(scene), scene_(scene), options_(std::move(options)),
      filling_(options_.filling ? std::move(*options_.filling) : scene::Filling(scene)), soils_(materials_of(scene)),
      model_(choose_model(scene, options_.arithmetic)), domain_(comm, block_space(scene, filling_, comm.size(), options_.blocks_per_rank)),
      layout_(scene_, filling_, low_corner(filling_, scene)),
      balance_(comm, domain_, layout_.reach(), double(ghost_bytes(*model_)), options_.recut_every), moving_(scene::moving_walls(scene)),
      watch_(comm, scene_, filling_, soils_), wall_forces_(scene_, soils_, layout_), clock_(clock)
{
}

Simulation::Simulation(const Comm& comm, const Scene& scene, RunOptions options) : Simulation(comm, scene, std::move(options), Clock{})
{
    timers_.timed(Phase::Setup, [&] {
        start_soil();
        if (options_.initial) options_.initial(particles_);
        model_->start(particles_);
        double fastest = 0, half_step = 0;
        for (Index i = 0; i < particles_.size(); ++i) {
            const Vector v = std::as_const(particles_)[field::velocity][i];
            fastest = std::max(fastest, dot(v, v));
            const Vector u = v - frame(0);
            half_step = std::max(half_step, dot(u, u));
        }
        clock_.extremes.speed2 = comm_.max(fastest), clock_.extremes.half_step_speed2 = comm_.max(half_step);
        clock_.energy_unit = energy_unit(energy_scale(scene_, filling_, soils_));
        if (options_.initial && clock_.extremes.speed2 > 0) { // particles may have been made faster than the scene says
            double mass = 0;
            for (const auto& m : soils_) mass = std::max(mass, m.density * scene_.particle_volume() * double(filling_.soil_count()));
            clock_.energy_unit = std::max(clock_.energy_unit, energy_unit(mass * clock_.extremes.speed2));
        }
        const Vector g = scene_.effects.gravity.value_or(Vector{});
        clock_.extremes.acceleration2 = dot(g, g);
        for (const auto& m : soils_) clock_.extremes.signal = std::max(clock_.extremes.signal, m.c_p);
        if (model_->moves_first()) {
            Scene nothing = scene_;
            for (auto& l : nothing.loads) l.present = false;
            begin_loads(nothing);
            evaluate_anew();
        }
        clock_.energy_at_start = ledger(clock_.next).sum(); // with the half kick to come before it, as at every other time
    });
}

Simulation::Simulation(const Comm& comm, const Scene& scene, Particles particles, const Clock& clock, RunOptions options)
    : Simulation(comm, scene, std::move(options), clock)
{
    timers_.timed(Phase::Setup, [&] {
        particles_ = std::move(particles);
        if (clock_.events > 0) enter_stage(clock_.time);
        events_before_ = clock_.events;
        prepare();
        work_.steps = clock.step;
        if (comm_.rank() != 0) clock_.pairs = 0, clock_.dissipated = clock_.later = {}, clock_.impulse.clear();
        if (model_->moves_first() && clock_.next == 0) { // it was at its end, which is further now
            clock_.next = step_length(scene_, clock_);
            if (clock_.next > 0 && !scene_.time.step) clock_.extremes.displacement2 = std::numeric_limits<double>::infinity();
        }
        balance_.cut_state(scene_, particles_, layout_, clock_.step > 0 || wall_forces_.any(), [&] { rebuild(false, clock_.time); });
    });
}

Simulation::~Simulation() = default;

void Simulation::start_soil()
{
    if (!options_.start && !options_.settles)
        if (const auto why = no_closed_form(scene_, filling_); !why.empty()) {
            settled_.emplace().why = why;
            options_.start = settle(comm_, scene_, filling_, options_, *settled_);
        }
    if (!options_.start) {
        prepare();
        balance_.cut_start(scene_, filling_, timers_);
        return fill_start(comm_, domain_, scene_, filling_, soils_, particles_);
    }
    particles_ = std::move(*options_.start);
    options_.start.reset();
    prepare();
    if (settled_)
        add_bodies(comm_, scene_, filling_, soils_, particles_, [](const scene::Body& b) { return b.present && !scene::rests(b); });
    balance_.cut_state(scene_, particles_, layout_, false, [] {});
}

void Simulation::prepare()
{
    water_ = PoreWater::from(scene_.effects);
    for (const auto& m : soils_) evolving_ = evolving_ || m.evolves(), remembering_ = remembering_ || m.remembers > 0;
    particles_.require(field::position, field::velocity, field::density, field::stress, field::plastic_strain, field::sorted_position,
                       field::origin, field::id, field::soil);
    model_->require_fields(particles_,
                           std::ranges::any_of(scene_.walls, [](const scene::Wall& w) { return w.surface == scene::Surface::Coulomb; }));
    if (remembering_) particles_.require(field::opened_volume);
    if (!scene_.loads.empty()) particles_.require(field::load, field::load_push);
    if (any_plate(start_scene_)) particles_.require(field::unstored);
    loads_ = loads_now(scene_);
    if (wall_forces_.any()) particles_.require(field::wall_force);
    if (scene_.accuracy.sleep_below > 0) {
        particles_.require(field::activity);
        sleep_interval_ = scene::sleep_interval(scene_);
    }
    // Denormals are flushed in every thread, whatever ran before.
#pragma omp parallel
    flush_denormals();
}

// ---- the step -----------------------------------------------------------------------------------------------------

Requests Simulation::step(Requests mine)
{
    begin_events();
    take_out_what_left();
    const double dt = next_dt();
    ensure(dt > 0, "a finished run was asked for another step");
    if (!last_good_) remember(); // the start of the run, or of its restart
    const auto course = follow_courses(dt);
    bool bearable = wall_forces_.add_impulse(particles_, 0.5 * dt, clock_);
    StepInput in = step_input(dt, following_dt(dt));
    timers_.timed(Phase::Move, [&] { model_->move(in); });
    const bool rebuilt = layout_.outgrown(clock_.extremes.displacement2);
    const double way = model_->moves_first() ? dt * std::sqrt(clock_.extremes.half_step_speed2) : 0;
    if (model_->moves_first()) clock_.frame_way = clock_.frame_way + dt * frame(clock_.time + 0.5 * dt);
    if (rebuilt) rebuild(true, time_after(scene_, clock_, dt), way);
    // The displacement that this step tells is that of the next one, or its own.
    const double after = model_->moves_first() ? in.next : dt, from = model_->moves_first() ? clock_.time + dt : clock_.time;
    in.frame = frame(from + 0.5 * after), in.frame_way = clock_.frame_way + after * in.frame;
    if (!model_->moves_first()) clock_.frame_way = in.frame_way;
    layout_.prepare_lists(in, way, std::sqrt(clock_.extremes.half_step_speed2));
    PassResult result = run_stages(in);
    bearable = wall_forces_.add_impulse(particles_, 0.5 * dt, clock_) && bearable;
    if (!bearable) result.maxima.not_finite = 1; // the guard says more
    mine = end_step(in, result, mine);
    if (course) end_course(*course);
    watch_.judge_step(particles_, clock_);
    remember_if_good(rebuilt);
    return mine;
}

double Simulation::following_dt(double dt) const
{
    if (!model_->moves_first()) return 0;
    Clock then = clock_;
    then.time = time_after(scene_, clock_, dt);
    then.step += 1;
    return step_length(scene_, then);
}

PassResult Simulation::run_stages(const StepInput& in)
{
    PassResult result;
    const int stages = int(model_->stages().size());
    for (int stage = 0; stage < stages; ++stage) {
        if (!moving_.empty()) place_walls(in, stage + 1 < stages); // strains are those of mid-step
        result.add(run_stage(stage, in));
    }
    if (any_plate(scene_)) hold_plates(comm_, scene_, soils_, in, result);
    return result;
}

void Simulation::evaluate_anew()
{
    clock_.next = step_length(scene_, clock_);
    rebuild(true, clock_.time);
    StepInput in = step_input(0, clock_.next);
    in.sleep = SleepStage::Off;
    layout_.prepare_lists(in, 0, std::sqrt(clock_.extremes.speed2));
    const PassResult result = run_stages(in);
    clock_.later = {};
    clock_.later.add(result.later, clock_.energy_unit);
    reduce(result, {});
}

void Simulation::rebuild(bool sort_anew, double time, double way)
{
    if (sort_anew) clock_.sorted_time = time;
    move_walls(clock_.sorted_time);
    if (sort_anew)
        timers_.timed(Phase::Migrate, [&] {
            layout_.wrap_into_period(particles_);
            balance_.migrate(scene_, particles_, layout_, rebuilds_, timers_);
            layout_.sort_at_present_positions(particles_);
        });
    layout_.rebuild(comm_, domain_, particles_, soils_, *model_, timers_, way);
    wall_forces_.renew_faces();
    move_walls(time);
    if (sort_anew) clock_.extremes.displacement2 = 0, clock_.frame_way = {};
    ++rebuilds_;
}

PassResult Simulation::run_stage(int stage, const StepInput& in)
{
    const Stage& s = model_->stages()[stage];
    Halo& halo = layout_.halo();
    const ClusterLists& lists = layout_.lists();
    timers_.timed(Phase::HaloBegin, [&] {
        halo.begin(s.ghost_bytes, [&](Index owned, Vector shift, std::byte* to) { model_->pack(stage, owned, shift, to); });
    });
    PassResult result = timers_.timed(Phase::Interior, [&] {
        // MPI moves long messages only when it is called: in a few portions of the work, none smaller than threads like.
        auto left = lists.interior();
        const std::size_t portions = halo.messages_per_refresh() > 0 ? 8 : 1;
        const std::size_t portion = std::max<std::size_t>((left.size() + portions - 1) / portions, 512);
        PassResult all;
        while (left.size() > portion) {
            all.add(model_->run(stage, in, left.first(portion)));
            left = left.subspan(portion);
            halo.progress();
        }
        all.add(model_->run(stage, in, left));
        return all;
    });
    count_work(Phase::Interior, s, result.pairs, lists.interior().size());
    timers_.timed(Phase::HaloWait, [&] { halo.arrive([&](Index slot, const std::byte* record) { model_->unpack(stage, slot, record); }); });
    const PassResult rim = timers_.timed(Phase::Rim, [&] { return model_->run(stage, in, lists.rim()); });
    count_work(Phase::Rim, s, rim.pairs, lists.rim().size());
    model_->end_stage(stage);
    result.add(rim);
    return result;
}

Requests Simulation::end_step(const StepInput& in, PassResult result, Requests mine)
{
    work_.pairs += result.pairs, work_.asleep += result.asleep;
    work_.halo_bytes += halo_bytes(), work_.messages += halo_messages();
    if (work_.first_step.soil == 0) work_.first_step = {particles_.size(), result.pairs, ghosts(), halo_bytes(), halo_messages()};
    work_.particle_steps += particles_.size();
    const double following = following_dt(in.dt);
    try {
        clock_.dissipated.add(result.energy, clock_.energy_unit);
        clock_.dissipated.add(std::exchange(clock_.later, {}));
        clock_.later.add(result.later, clock_.energy_unit);
    } catch (const NumbersFailed&) {
        result.maxima.not_finite = 1; // so that all ranks fail together
    }
    clock_.time = time_after(scene_, clock_, in.dt);
    clock_.step += 1, work_.steps += 1;
    clock_.dt = in.dt, clock_.next = following, clock_.frame = frame(clock_.time);
    mine = reduce(result, mine);
    if (!model_->moves_first()) layout_.moved(in.dt * std::sqrt(clock_.extremes.half_step_speed2));
    return mine;
}

Requests Simulation::reduce(const PassResult& result, Requests mine)
{
    timers_.timed(Phase::Reduce, [&] {
        constexpr std::size_t n = std::tuple_size_v<decltype(Extremes::members)>;
        std::array<double, n + 2> all;
        std::size_t k = 0;
        Extremes& e = clock_.extremes = result.maxima;
        for_each_member(e, e, [&](double& x, double&) { all[k++] = x; });
        all[n] = mine.stop, all[n + 1] = mine.checkpoint;
        comm_.max(std::span<double>(all));
        k = 0;
        for_each_member(e, e, [&](double& x, double&) { x = all[k++]; });
        mine = {all[n] != 0, all[n + 1] != 0};
    });
    meet_walls();
    // Sleeping particles are not in the maxima: the step is never longer than the soil at rest allows.
    if (scene_.accuracy.sleep_below > 0)
        for (const auto& m : soils_) clock_.extremes.signal = std::max(clock_.extremes.signal, m.c_p);
    return mine;
}

Vector Simulation::frame(double time) const
{
    if (!scene_.walls.empty() || !scene_.events.empty() || !scene_.loads.empty()) return {};
    Vector momentum{};
    double mass = 0;
    for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
        const double m = soils_[scene_.bodies[k].soil].density * double(filling_.body_count(int(k)));
        momentum = momentum + m * scene_.bodies[k].velocity, mass += m;
    }
    Vector v = (1 / mass) * momentum + time * scene_.effects.gravity.value_or(Vector{});
    if (scene_.dimensions == 2) v.y = 0;
    return v;
}

StepInput Simulation::step_input(double dt, double next)
{
    // Shifted is the move of steps 8, 16, ... and decided by the step before; once more where forces are made anew in between.
    const bool shifts = scene_.accuracy.shifting > 0, shifted = shifts && clock_.step > 0 && clock_.step % Shifting::every == 0;
    StepInput in{.particles = &particles_,
                 .lists = &layout_.lists(),
                 .soils = soils_,
                 .dt = dt,
                 .kick = 0.5 * (clock_.dt + dt),
                 .next = next > 0 ? next : dt, // a run's last forces work as if it went on
                 .forces = {scene_.effects.gravity.value_or(Vector{}), damping()},
                 .evolving = evolving_,
                 .shifts = dt > 0 ? shifts && (clock_.step + 1) % Shifting::every == 0 : shifted,
                 .shifted = dt > 0 && shifted,
                 .remembering = remembering_,
                 .energy_unit = clock_.energy_unit,
                 .low = scene_.space.low,
                 .high = scene_.space.high,
                 .loads = loads_,
                 .sleep = sleep_stage(),
                 .calm_speed = scene_.accuracy.sleep_below,
                 .detection_interval = double(sleep_interval_ - 1) * dt};
    for (int axis = 0; axis < 3; ++axis) // a periodic axis has no way out
        if (scene_.space.periodic[axis] && in.low) {
            const double all = std::numeric_limits<double>::infinity();
            (axis == 0 ? in.low->x : axis == 1 ? in.low->y : in.low->z) = -all;
            (axis == 0 ? in.high->x : axis == 1 ? in.high->y : in.high->z) = all;
        }
    return in;
}

double Simulation::damping() const
{
    const auto& d = scene_.effects.damping;
    if (!d || clock_.time >= d->until) return 0;
    // mu_d = ratio * 2 omega_1, omega_1 = pi c_p/(2 H): critical for the lowest mode of a column of height H
    double c = 0;
    for (const auto& m : soils_) c = std::max(c, m.c_p);
    return d->ratio * std::numbers::pi * c / filling_.soil_height();
}

SleepStage Simulation::sleep_stage() const
{
    // Damping settles a state: there soil is slow before it is at rest.
    if (scene_.accuracy.sleep_below == 0 || damping() > 0) return SleepStage::Off;
    const auto shoves = [&](const scene::Event& e) {
        return scene::load_changes(e, clock_.time) || (e.move && clock_.time >= scene::begin_of(e) && clock_.time < scene::end_of(e));
    };
    if (std::ranges::any_of(start_scene_.events, shoves)) return SleepStage::Off; // a wall or a load comes upon sleepers
    const auto phase = clock_.step % sleep_interval_;
    return phase == 0 ? SleepStage::Detect : phase == 1 ? SleepStage::Freeze : SleepStage::Frozen;
}

void Simulation::count_work(Phase phase, const Stage& stage, std::int64_t pairs, std::size_t clusters)
{
    // Pairs are tallied by one stage; every stage walks them.
    double flops = 0;
    for (const Stage& s : model_->stages()) flops += s.flops_per_pair;
    const double particles = double(clusters) / std::max<double>(1, double(layout_.lists().size())) * particles_.size();
    timers_.did(phase, double(pairs) * flops + particles * stage.flops_per_particle, particles * stage.bytes_per_particle);
}

// ---- what a run tells of itself ------------------------------------------------------------------------------------

Ledger Simulation::ledger(double dt) const
{
    Ledger l;
    l.state = state(scene_, dt);
    l.events = double(clock_.taken) * clock_.energy_unit;
    auto units = over_ranks(comm_, clock_.dissipated);
    for_each_member(l.dissipated, units, [&](double& joules, std::int64_t& u) { joules = double(u) * clock_.energy_unit; });
    return l;
}

StateEnergy Simulation::state(const Scene& scene, double dt) const
{
    return state_energy(comm_, particles_, materials_of(scene), scene.particle_volume(), scene.effects.gravity.value_or(Vector{}),
                        PoreWater::from(scene.effects), clock_.energy_unit * 16, dt); // doubles hold 2^11 times the scale exactly
}

double Simulation::residual(const Ledger& l) const
{
    if (clock_.step == 0) return 0; // the ledger begins here; what it began with has the half kick to come before it
    const double excess = l.sum() - clock_.energy_at_start;
    double drop = -l.state.potential;
    // After an event the potential may be that of other soil or gravity, or some of the soil has left.
    if (clock_.events > 0 || clock_.taken != 0)
        drop = std::max({drop, l.state.kinetic, l.state.elastic, std::fabs(l.events), std::fabs(l.dissipated.moved_wall),
                         std::fabs(clock_.energy_at_start)});
    if (!scene_.loads.empty()) drop = std::max({drop, l.state.kinetic, l.state.elastic, std::fabs(l.dissipated.loads)});
    const double scale =
        drop > 0 ? drop : std::max({std::fabs(l.state.potential), l.state.kinetic, l.state.elastic, std::fabs(clock_.energy_at_start)});
    return scale > 0 ? excess / scale : 0;
}

std::int64_t Simulation::pairs() const { return comm_.sum(work_.pairs + clock_.pairs); }

Clock Simulation::clock() const
{
    Clock c = clock_;
    c.pairs = pairs();
    c.dissipated = over_ranks(comm_, c.dissipated), c.later = over_ranks(comm_, c.later);
    if (wall_forces_.any()) {
        c.impulse.resize(WallForces::named(scene_).size());
        add_over_ranks(comm_, c.impulse);
    }
    return c;
}

std::int64_t Simulation::halo_bytes() const
{
    const auto& halo = layout_.made_halo();
    return halo ? halo->records_per_refresh() * std::int64_t(ghost_bytes(*model_)) : 0;
}
int Simulation::halo_messages() const
{
    const auto& halo = layout_.made_halo();
    return halo ? halo->messages_per_refresh() * int(model_->stages().size()) : 0;
}

MemoryUse Simulation::memory() const
{
    MemoryUse m;
    m.state = particles_.bytes(), m.sorting = particles_.spare_bytes();
    m.records = model_->record_memory();
    m.walls = model_->wall_memory() + wall_forces_.bytes();
    layout_.add_bytes(m);
    return m;
}

} // namespace kuzure
