#include "solver/app/simulation.hpp"
#include "solver/app/guard.hpp"
#include "solver/app/initial_stress.hpp"
#include "solver/app/scaling.hpp"
#include "solver/scene/check.hpp"
#include <fmt/format.h>
#include <limits>
#include <map>
#include <omp.h>

namespace kuzure {

namespace {

template <class T> Record<T> far_away()
{
    Record<T> r{};
    if constexpr (std::is_same_v<T, double>) r.x = r.y = r.z = 1e12;
    else r.x = r.y = r.z = 1 << 30;
    r.density = T(1000), r.sound_speed = T(1);
    return r;
}

} // namespace

Simulation::Simulation(const Comm& comm, const Scene& scene, RunOptions options)
    : comm_(comm), scene_(scene), options_(std::move(options)),
      filling_(options_.filling ? std::move(*options_.filling) : scene::Filling(scene)), model_(choose_model(scene, options_.arithmetic)),
      columns_(Columns::of(scene, low_corner(filling_, scene))),
      domain_(comm, block_space(scene, filling_, comm.size(), options_.blocks_per_rank)),
      buffers_(Buffers<double>(scene.smoothing_length()))
{
    timers_.timed(Phase::Setup, [&] {
        prepare();
        cut_by_counts();
        fill();
        if (options_.initial) options_.initial(particles_);
        double fastest = 0;
        for (Index i = 0; i < particles_.size(); ++i) {
            const Vector v = std::as_const(particles_)[field::velocity][i];
            fastest = std::max(fastest, dot(v, v));
        }
        clock_.extremes.speed2 = comm_.max(fastest);
        if (options_.initial) widen_energy_unit();
        const double unit = clock_.energy_unit * 65536;
        const auto e = state_energy(comm_, particles_, soils_, scene_.particle_volume(), forces_.gravity, water_, unit);
        clock_.energy_at_start = e.kinetic + e.potential + e.elastic;
        clock_.extremes.acceleration2 = dot(forces_.gravity, forces_.gravity);
        for (const auto& m : soils_) clock_.extremes.signal = std::max(clock_.extremes.signal, m.sound_speed);
    });
}

Simulation::Simulation(const Comm& comm, const Scene& scene, Particles particles, const Clock& clock, RunOptions options)
    : comm_(comm), scene_(scene), options_(std::move(options)),
      filling_(options_.filling ? std::move(*options_.filling) : scene::Filling(scene)), model_(choose_model(scene, options_.arithmetic)),
      columns_(Columns::of(scene, low_corner(filling_, scene))),
      domain_(comm, block_space(scene, filling_, comm.size(), options_.blocks_per_rank)), particles_(std::move(particles)),
      buffers_(Buffers<double>(scene.smoothing_length())), clock_(clock)
{
    timers_.timed(Phase::Setup, [&] {
        prepare();
        if (comm_.rank() != 0) clock_.pairs = 0, clock_.dissipated = {};
        std::map<Block, double> count;
        for (Index i = 0; i < particles_.size(); ++i) count[domain_.block_of(particles_[field::position][i])] += 1;
        std::vector<BlockWork> work;
        for (const auto& [b, n] : count) work.push_back({b, n, n});
        // Rows of a checkpoint lie anywhere: nobody can count pairs before a first cut has brought neighbours together.
        const double begin = omp_get_wtime();
        const HaloCost halo{reach_, double(row_bytes(*model_))};
        const bool again = clock_.step > 0 && comm_.size() > 1;
        auto report = domain_.cut(work, again ? Method::Hilbert : Method::Metis, halo, Labels::Free);
        domain_.migrate(particles_);
        if (clock_.step > 0) rebuild(false);
        if (again) {
            report = domain_.cut(block_work(), Method::Metis, halo, Labels::Free);
            domain_.migrate(particles_);
            rebuild(false);
        }
        domain_.forget_far();
        const double seconds = comm_.max(omp_get_wtime() - begin);
        rebalance_ = Rebalance(report.imbalance, seconds);
        whole_cut_ = {.left = report.imbalance, .seconds = seconds};
    });
}

Simulation::~Simulation() = default;

void Simulation::prepare()
{
    const bool mixed = model_->precision() == scene::Precision::Mixed;
    if (mixed) buffers_ = Buffers<float>(scene_.smoothing_length());
    for (const auto& s : scene_.soils) soils_.push_back(Material::from(s));
    reach_ = list_reach(scene_);
    skin_ = scene_.support() * scene_.accuracy.skin;
    forces_.gravity = scene_.effects.gravity.value_or(Vector{});
    water_ = PoreWater::from(scene_.effects);
    for (const auto& m : soils_) evolving_ = evolving_ || m.evolves();
    particles_.require(field::position, field::velocity, field::half_velocity, field::density, field::half_density, field::stress,
                       field::half_stress, field::plastic_strain, field::sorted_position, field::origin, field::id, field::soil);
    if (scene_.accuracy.sleep_below > 0) {
        particles_.require(field::activity);
        steps_between_looks_ = scene::steps_between_looks(scene_);
    }

    // Denormals are flushed in every thread, whatever ran before.
#pragma omp parallel
    flush_denormals();

    if (clock_.energy_unit == 0) {
        // A yardstick for the energy of the whole run: weight times height, or kinetic energy, or a little strain.
        const auto& b = filling_.soil_bounds();
        double scale = 0;
        for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
            const auto& body = scene_.bodies[k];
            const Material& m = soils_[body.soil];
            const double mass = m.density * scene_.particle_volume() * double(filling_.body_count(int(k)));
            const double size = std::max({b.high.x - b.low.x, b.high.z - b.low.z, scene_.space.spacing});
            scale +=
                mass * (length(forces_.gravity) * size + 0.5 * dot(body.velocity, body.velocity) + 1e-6 * m.sound_speed * m.sound_speed);
        }
        clock_.energy_unit = std::exp2(std::floor(std::log2(scale)) - 58);
    }
}

void Simulation::widen_energy_unit()
{
    // Particles may have been made faster than the scene says.
    double mass = 0;
    for (const auto& m : soils_) mass = std::max(mass, m.density * scene_.particle_volume() * double(filling_.soil_count()));
    const double scale = mass * clock_.extremes.speed2;
    if (scale > 0) clock_.energy_unit = std::max(clock_.energy_unit, std::exp2(std::floor(std::log2(scale)) - 58));
}

void Simulation::cut_by_counts()
{
    // Each rank counts a share of the blocks; nobody keeps a particle yet.
    const auto mine = weigh(StartSoil(scene_, filling_, domain_.space()), std::size_t(comm_.rank()), std::size_t(comm_.size())).listed;
    const auto report = timers_.timed(Phase::Partition, [&] {
        return domain_.cut(mine, Method::Metis, {reach_, double(row_bytes(*model_))}, Labels::Free);
    });
    rebalance_ = Rebalance(report.imbalance, report.seconds);
    whole_cut_ = {.left = report.imbalance, .seconds = report.seconds};
}

void Simulation::fill()
{
    struct Start {
        std::int64_t id;
        Vector x;
        int body;
    };
    std::vector<Start> start;
    for (std::size_t k = 0; k < domain_.blocks().size(); ++k) {
        if (domain_.owners()[k] != comm_.rank()) continue;
        const Block b = domain_.blocks()[k];
        const scene::Box box = box_of(domain_.space(), b, 1e-6 * scene_.space.spacing);
        filling_.for_each_soil_in(box, [&](std::int64_t id, Vector x, int body) {
            if (domain_.block_of(x) == b) start.push_back({id, x, body});
        });
    }
    domain_.forget_far();
    auto& p = particles_;
    p.resize(Index(start.size()));
    ensure(comm_.sum(std::int64_t(start.size())) == filling_.soil_count(), "the ranks together do not hold the scene's soil");
    const InitialStress at_rest(scene_, filling_, soils_);
    const Index n = p.size();
#pragma omp parallel for schedule(static)
    for (Index i = 0; i < n; ++i) {
        const auto& s = start[i];
        const auto& body = scene_.bodies[s.body];
        const Material& m = soils_[body.soil];
        Vector v = body.velocity;
        if (scene_.dimensions == 2) v.y = 0;
        p[field::position].set(i, s.x), p[field::origin].set(i, s.x), p[field::sorted_position].set(i, s.x);
        p[field::velocity].set(i, v), p[field::half_velocity].set(i, v);
        p[field::density].set(i, m.density), p[field::half_density].set(i, m.density);
        p[field::id].set(i, s.id), p[field::soil].set(i, std::int32_t(body.soil));
        if (body.stress == scene::InitialStress::AtRest) {
            const Stress sigma = at_rest(s.x, s.body, body.soil);
            p[field::stress].set(i, sigma), p[field::half_stress].set(i, sigma);
        }
    }
}

double Simulation::next_dt() const
{
    const double end = scene_.time.end;
    if (scene_.time.step) {
        const double dt = clock_.step_scale * *scene_.time.step;
        return clock_.step - clock_.base_step < std::llround((end - clock_.base_time) / dt) ? dt : 0;
    }
    if (clock_.time >= end) return 0;
    // dt = cfl min( h/(c_p + signal speed), sqrt(h/|a|) )
    const double h = scene_.smoothing_length(), a = std::sqrt(clock_.extremes.acceleration2);
    const double limit = std::min(h / clock_.extremes.signal, a > 0 ? std::sqrt(h / a) : std::numeric_limits<double>::infinity());
    const double dt = clock_.step_scale * scene_.accuracy.cfl * limit;
    // The last step is shortened to end on time; a remainder of round-off is not a step.
    return clock_.time + dt * (1 + 1e-9) >= end ? end - clock_.time : dt;
}

Rest Simulation::rest() const
{
    // Damping settles a state: there soil is slow before it is at rest.
    if (scene_.accuracy.sleep_below == 0 || forces_.damping > 0) return Rest::Nobody;
    const auto phase = clock_.step % steps_between_looks_;
    return phase == 0 ? Rest::Look : phase == 1 ? Rest::FallAsleep : Rest::Keep;
}

bool Simulation::outgrown() const { return !built_ || 2 * std::sqrt(clock_.extremes.moved2) > skin_ * (1 - 1e-6); }

Wishes Simulation::step(Wishes mine)
{
    const double dt = next_dt();
    ensure(dt > 0, "a finished run was asked for another step");
    if (outgrown()) {
        rebuild(true);
        if (options_.guard) inspect();
    }
    forces_.damping = 0;
    if (const auto& d = scene_.effects.damping; d && clock_.time < d->until) {
        // mu_d = ratio * 2 omega_1, omega_1 = pi c_p/(2 H): critical for the lowest mode of a column of height H
        const auto& b = filling_.soil_bounds();
        double c = 0;
        for (const auto& m : soils_) c = std::max(c, m.sound_speed);
        forces_.damping = d->ratio * std::numbers::pi * c / (b.high.z - b.low.z + scene_.space.spacing);
    }

    const bool prune = prune_lists_anew(dt);
    PassResult result;
    std::visit(
        [&](auto& buffers) {
            using T = std::remove_cvref_t<decltype(buffers.now[0].vx)>;
            const bool tensile = model_->tensile();
            const Index n = particles_.size();
            Pass<T> pass{.particles = &particles_,
                         .records = buffers.now.data(),
                         .next = buffers.next.data(),
                         .tension = tensile ? buffers.tension.data() : nullptr,
                         .next_tension = tensile ? buffers.next_tension.data() : nullptr,
                         .lists = &lists_,
                         .prune = prune,
                         .margin = pruned_margin_,
                         .walls = buffers.walls,
                         .soils = soils_,
                         .volume = scene_.particle_volume(),
                         .h = scene_.smoothing_length(),
                         .dt = dt,
                         .kick = 0.5 * (clock_.dt + dt),
                         .forces = forces_,
                         .water = water_.present() ? &water_ : nullptr,
                         .evolving = evolving_,
                         .energy_unit = clock_.energy_unit,
                         .low = scene_.space.low,
                         .high = scene_.space.high,
                         .rest = rest(),
                         .calm_speed = scene_.accuracy.sleep_below,
                         .nap = double(steps_between_looks_ - 1) * dt};
            for (int axis = 0; axis < 3; ++axis) // a periodic axis has no way out
                if (scene_.space.periodic[axis] && pass.low) {
                    const double all = std::numeric_limits<double>::infinity();
                    (axis == 0 ? pass.low->x : axis == 1 ? pass.low->y : pass.low->z) = -all;
                    (axis == 0 ? pass.high->x : axis == 1 ? pass.high->y : pass.high->z) = all;
                }
            timers_.timed(Phase::HaloBegin, [&] {
                halo_->begin([&](Index owned, Vector shift, std::byte* to) {
                    Record<T> r = buffers.now[owned];
                    if constexpr (std::is_same_v<T, double>) r.x += shift.x, r.y += shift.y, r.z += shift.z;
                    else
                        r.x = Place<T>(std::uint32_t(r.x) + std::uint32_t(buffers.place(shift.x))),
                        r.y = Place<T>(std::uint32_t(r.y) + std::uint32_t(buffers.place(shift.y))),
                        r.z = Place<T>(std::uint32_t(r.z) + std::uint32_t(buffers.place(shift.z)));
                    std::memcpy(to, &r, sizeof r);
                    if (tensile) std::memcpy(to + sizeof r, &buffers.tension[owned], sizeof buffers.tension[owned]);
                });
            });
            result = timers_.timed(Phase::Interior, [&] {
                // MPI moves long messages only when it is called: in a few portions of the work, none smaller than threads like.
                auto left = lists_.interior();
                const std::size_t portions = halo_->messages_per_refresh() > 0 ? 8 : 1;
                const std::size_t portion = std::max<std::size_t>((left.size() + portions - 1) / portions, 512);
                PassResult all;
                while (left.size() > portion) {
                    all.add(model_->run(pass, left.first(portion)));
                    left = left.subspan(portion);
                    halo_->progress();
                }
                all.add(model_->run(pass, left));
                return all;
            });
            count_work(Phase::Interior, result.pairs, lists_.interior().size());
            timers_.timed(Phase::HaloWait, [&] {
                halo_->arrive([&](Index slot, const std::byte* row) {
                    std::memcpy(&buffers.now[n + slot], row, sizeof(Record<T>));
                    if (tensile) std::memcpy(&buffers.tension[n + slot], row + sizeof(Record<T>), sizeof(Tension<T>));
                });
            });
            const PassResult rim = timers_.timed(Phase::Rim, [&] { return model_->run(pass, lists_.rim()); });
            count_work(Phase::Rim, rim.pairs, lists_.rim().size());
            result.add(rim);
            buffers.now.swap(buffers.next);
            buffers.tension.swap(buffers.next_tension);
        },
        buffers_);

    my_pairs_ += result.pairs, my_asleep_ += result.asleep;
    my_halo_bytes_ += halo_->bytes_per_refresh(), my_messages_ += halo_->messages_per_refresh();
    if (!first_step_) first_step_ = {particles_.size(), result.pairs, n_ghosts_, halo_->bytes_per_refresh(), halo_->messages_per_refresh()};
    my_particle_steps_ += particles_.size();
    clock_.dissipated.add(result.energy, clock_.energy_unit);
    clock_.step += 1;
    clock_.time = scene_.time.step                                   ? clock_.base_time + double(clock_.step - clock_.base_step) * dt
                  : clock_.time + dt * (1 + 1e-9) >= scene_.time.end ? scene_.time.end
                                                                     : clock_.time + dt;
    clock_.dt = dt;
    timers_.timed(Phase::Reduce, [&] {
        Extremes& e = result.extremes;
        double all[] = {e.acceleration2, e.signal,  e.moved2,   e.speed2,          e.drift2,
                        e.bad,           e.outside, e.strained, double(mine.stop), double(mine.checkpoint)};
        comm_.max(std::span<double>(all));
        clock_.extremes = {all[0], all[1], all[2], all[3], all[4], all[5], all[6], all[7]};
        mine = {all[8] != 0, all[9] != 0};
    });
    // Who sleeps does not report: the step is never longer than the soil at rest allows.
    if (scene_.accuracy.sleep_below > 0)
        for (const auto& m : soils_) clock_.extremes.signal = std::max(clock_.extremes.signal, m.sound_speed);
    pruned_way_ += dt * std::sqrt(clock_.extremes.drift2);
    judge_step();
    return mine;
}

bool Simulation::prune_lists_anew(double dt)
{
    // No pair comes nearer than by twice the longest way of any particle; positions in mixed precision have grains of h/2^20.
    const double grain = 4e-6 * scene_.smoothing_length();
    if (2 * pruned_way_ + grain <= pruned_margin_) return false;
    // Instructions a cluster: 113 an entry of the pruned list, of which a margin of m supports adds 95 * 2.3 m; 25 for each of 117
    // entries of the whole list in one of m/u steps, u the way of two particles in a step. Least in sum at m = sqrt(0.12 u).
    constexpr double prune_cost = 25.0 * 117 / (113 * 95 * 2.3);
    const double u = 2 * dt * std::sqrt(clock_.extremes.speed2) / scene_.support();
    pruned_margin_ = std::clamp(std::sqrt(prune_cost * u), 1e-4, scene_.accuracy.skin) * scene_.support();
    pruned_way_ = 0;
    return true;
}

void Simulation::count_work(Phase phase, std::int64_t pairs, std::size_t clusters)
{
    const double particles = double(clusters) / std::max<double>(1, double(lists_.size())) * particles_.size();
    timers_.did(phase, double(pairs) * model_->flops_per_pair() + particles * model_->flops_per_particle(),
                particles * model_->bytes_per_particle());
}

std::int64_t Simulation::fastest() const
{
    const auto& p = particles_;
    double v2 = -1;
    std::int64_t id = std::numeric_limits<std::int64_t>::max();
    for (Index i = 0; i < p.size(); ++i) {
        const Vector v = p[field::velocity][i];
        const double here = dot(v, v);
        if (here > v2 || (here == v2 && p[field::id][i] < id)) v2 = here, id = p[field::id][i];
    }
    if (v2 < comm_.max(v2)) id = std::numeric_limits<std::int64_t>::max();
    comm_.min(std::span(&id, 1));
    return id;
}

std::pair<std::string, std::string> Simulation::diagnosis() const
{
    const double h = scene_.smoothing_length(), courant = clock_.dt / scene::crossing_time(scene_);
    const double a = std::sqrt(clock_.extremes.acceleration2), free = a > 0 ? std::sqrt(h / a) : std::numeric_limits<double>::infinity();
    const bool tension = std::any_of(soils_.begin(), soils_.end(), [](const Material& m) { return m.k > 0; });
    if (courant > scene::recommended_courant)
        return {fmt::format("the time step is too long for the P-wave: dt c_p/h = {:.3g}, recommended up to {}", courant,
                            scene::recommended_courant),
                fmt::format("a time.step of {:.3g} s or less, or none (accuracy.cfl then sets it)", scene::recommended_step(scene_))};
    if (clock_.dt > scene::recommended_courant * free)
        return {fmt::format("the time step is too long for the acceleration: dt = {:.3g} s, sqrt(h/|a|) = {:.3g} s", clock_.dt, free),
                "a smaller time.step, or none (accuracy.cfl then sets it)"};
    if (!scene_.effects.viscosity)
        return {"there is no artificial viscosity to damp shocks and zero-energy modes", "effects.viscosity = { alpha = 0.1 }"};
    if (tension && !scene_.effects.artificial_stress)
        return {"cohesive soil under tension clumps without artificial stress", "effects.artificial_stress = \"auto\""};
    return {fmt::format("an outlier velocity, although dt c_p/h = {:.3g}", courant),
            "a smaller time.step or accuracy.cfl, more viscosity, or time.retry = true"};
}

void Simulation::blame(std::int64_t id, const std::string& what, const std::string& remedy)
{
    const auto& p = particles_;
    blamed_ = id;
    std::string text;
    int root = 0;
    for (Index i = 0; i < p.size(); ++i) {
        if (p[field::id][i] != id) continue;
        const Vector x = p[field::position][i], v = p[field::velocity][i];
        text = fmt::format("particle {} (body {}) {} at ({:.4g}, {:.4g}, {:.4g}) m with {:.3g} m/s in step {}, t = {:.6g} s. Remedy: {}",
                           id, filling_.body_of(id), what, x.x, x.y, x.z, length(v), clock_.step, clock_.time, remedy);
        root = comm_.rank();
    }
    root = int(comm_.max(std::int64_t(root)));
    throw NumbersFailed(comm_.broadcast(text, root));
}

void Simulation::judge_step()
{
    const Extremes& e = clock_.extremes;
    const double h = scene_.smoothing_length();
    const bool outran = std::sqrt(e.speed2) * clock_.dt > h;
    if (e.bad == 0 && e.outside == 0 && !outran && e.strained < limit::density) return;
    // The lowest id among the offenders, so that the message does not depend on the ranks.
    const auto& p = particles_;
    std::int64_t lowest = std::numeric_limits<std::int64_t>::max();
    const auto finite = [](Vector a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); };
    for (Index i = 0; i < p.size(); ++i) {
        const Vector x = p[field::position][i];
        const double ratio = p[field::density][i] / soils_[p[field::soil][i]].density;
        bool failed = !finite(x) || !finite(p[field::velocity][i]) || !std::isfinite(trace(p[field::stress][i])) || !std::isfinite(ratio) ||
                      length(p[field::velocity][i]) * clock_.dt > h || ratio >= limit::density || ratio * limit::density <= 1;
        if (scene_.space.low) {
            const Vector lo = *scene_.space.low, hi = *scene_.space.high;
            const auto out = [&](int axis, double v, double a, double b) { return !scene_.space.periodic[axis] && (v < a || v > b); };
            failed = failed || out(0, x.x, lo.x, hi.x) || (scene_.dimensions == 3 && out(1, x.y, lo.y, hi.y)) || out(2, x.z, lo.z, hi.z);
        }
        if (failed) lowest = std::min(lowest, std::int64_t(p[field::id][i]));
    }
    comm_.min(std::span(&lowest, 1));
    const auto [why, remedy] = diagnosis();
    if (e.bad != 0) blame(lowest, "has numbers that are no longer finite (" + why + ")", remedy);
    if (outran) blame(lowest, "went further than its smoothing length in one step (" + why + ")", remedy);
    if (e.outside != 0) blame(lowest, "left the box", "a larger space.low/space.high, a longer wall, or a smaller step");
    blame(lowest, fmt::format("changed its density {} fold (", limit::density) + why + ")", remedy);
}

void Simulation::inspect()
{
    const auto remember = [&] {
        if (scene_.time.retry) good_ = Good{particles_, clock_, my_pairs_, my_particle_steps_, my_asleep_, domain_.known()};
    };
    if (!good_) remember(); // the start of the run, or of its restart
    if (clock_.step - clock_.inspected < 64) return;
    timers_.timed(Phase::Guard, [&] {
        clock_.inspected = clock_.step;
        const Ledger l = ledger();
        // Against a thousandth of weight times height at least, so that the first movement is not judged by itself.
        const double yard = std::exp2(58) * clock_.energy_unit;
        const double scale =
            std::max({std::fabs(l.state.potential), l.state.kinetic, l.state.elastic, std::fabs(clock_.energy_at_start), 1e-3 * yard});
        const double grown = (l.sum() - clock_.energy_at_start) / scale;
        const auto [why, remedy] = diagnosis();
        if (!(grown < limit::energy_growth))
            blame(fastest(), fmt::format("is the fastest while energy grows out of nothing, by {:.0f} % ({})", 100 * grown, why), remedy);
        const auto seen =
            inspect_neighbours(comm_, scene_, filling_.soil_count(), particles_, lists_, ghost_x_.data(), ghost_y_.data(), ghost_z_.data());
        structure_.clumped = seen.clumped, structure_.most_clumped = std::max(structure_.most_clumped, seen.clumped);
        structure_.deepest = std::max(structure_.deepest, seen.deepest);
        if (seen.most_neighbours > limit::neighbours)
            blame(seen.crowded_id,
                  fmt::format("has {:.1f} times the neighbours of the lattice: soil has clumped ({})", seen.most_neighbours, why), remedy);
        if (seen.deepest > limit::penetration)
            blame(seen.sunk_id, fmt::format("has sunk {:.1f} spacings into a wall", seen.deepest),
                  "a thicker wall (2 h), a smaller step, or viscosity with beta = 1 for fast impacts");
        remember();
    });
}

bool Simulation::roll_back()
{
    if (!good_ || clock_.time <= trouble_) return false;
    trouble_ = clock_.time;
    particles_ = good_->particles;
    clock_ = good_->clock;
    my_pairs_ = good_->pairs, my_particle_steps_ = good_->particle_steps, my_asleep_ = good_->asleep;
    clock_.base_time = clock_.time, clock_.base_step = clock_.step;
    clock_.step_scale *= 0.5;
    // Cuts since then have moved blocks on, further than a rank knows.
    domain_.know_again(good_->known);
    domain_.migrate(particles_);
    rebuild(false);
    return true;
}

std::size_t row_bytes(const PairModel& model)
{
    const bool mixed = model.precision() == scene::Precision::Mixed;
    const std::size_t record = mixed ? sizeof(Record<float>) : sizeof(Record<double>);
    return record + (model.tensile() ? record / 2 : 0);
}

void Simulation::wrap_periodic()
{
    if (!scene_.space.low) return;
    const Vector lo = *scene_.space.low, hi = *scene_.space.high;
    const auto wrap = [&](int axis, double a, double b) {
        if (!scene_.space.periodic[axis]) return;
        double* x = particles_[field::position].column[axis];
        double* o = particles_[field::origin].column[axis];
        for (Index i = 0; i < particles_.size(); ++i) {
            const double turns = std::floor((x[i] - a) / (b - a));
            if (turns == 0) continue;
            x[i] -= turns * (b - a), o[i] -= turns * (b - a);
            x[i] = std::min(std::max(x[i], a), b);
        }
    };
    wrap(0, lo.x, hi.x), wrap(1, lo.y, hi.y), wrap(2, lo.z, hi.z);
}

std::vector<BlockWork> Simulation::block_work() const
{
    const auto x = particles_[field::position], sorted = particles_[field::sorted_position];
    const Index n = particles_.size();
    const double support = scene_.support(), support2 = support * support;
    std::vector<StepWork> of(std::size_t(n), {1, -1, 0}); // every particle meets itself once in its list
#pragma omp parallel for schedule(dynamic, 64)
    for (Index c = 0; c < lists_.size(); ++c)
        for (Index i = lists_.first(c); i < lists_.first(c) + lists_.count(c); ++i) {
            const Vector here = sorted[i];
            const auto close = [&](Vector there) { return dot(there - here, there - here) < support2; };
            for (const Index j : lists_.soil(c))
                of[i].soil_pairs += close(j < n ? sorted[j] : Vector{ghost_x_[j - n], ghost_y_[j - n], ghost_z_[j - n]});
            for (auto runs = lists_.walls(c); !runs.empty(); runs = runs.subspan(2 + runs[1])) {
                const WallPoints& w = walls_[runs[0]];
                for (const Index k : runs.subspan(2, runs[1])) of[i].wall_pairs += close({w.x[k], w.y[k], w.z[k]});
            }
        }
    std::map<Block, StepWork> blocks;
    for (Index i = 0; i < n; ++i) blocks[domain_.block_of(x[i])].add(of[i]);
    std::vector<BlockWork> work;
    for (const auto& [b, w] : blocks) work.push_back({b, w.total(), double(w.particles)});
    return work;
}

double Simulation::slowness(double work) const
{
    // Seconds per unit of work against those of all ranks: what pairs do not explain, such as a slow node. Less than a
    // tenth is noise.
    double all[] = {busy_since_cut_, work};
    comm_.sum(std::span<double>(all));
    if (!(busy_since_cut_ > 0.1) || !(work > 0) || !(all[0] > 0)) return 1;
    const double ratio = busy_since_cut_ / work / (all[0] / all[1]);
    return std::abs(ratio - 1) < 0.1 ? 1 : std::clamp(ratio, 0.5, 2.0);
}

void Simulation::recut()
{
    auto mine = block_work();
    double total = 0;
    for (const auto& b : mine) total += b.work;
    const double slow = slowness(total);
    for (auto& b : mine) b.work *= slow;
    const HaloCost halo{reach_, double(row_bytes(*model_))};
    // Handing blocks to neighbours costs nearly nothing, a cut of the whole domain much. The latter is made when what the
    // former left behind has cost as much idle time as it will cost, or when its parts have become ragged.
    WholeCut& whole = whole_cut_;
    whole.owed += std::max(0.0, left_ - whole.left - noticeable_) * comm_.sum(busy_since_cut_) / comm_.size();
    const bool again = whole.owed > whole.seconds || (whole.halo > 0 && halo_share_ > ragged_ * whole.halo);
    timers_.timed(Phase::Partition, [&] {
        if (again) {
            const auto report = domain_.cut(mine, Method::Metis, halo);
            whole = {.left = report.imbalance, .seconds = report.seconds};
            left_ = report.imbalance, halo_share_ = 0;
            ++structure_.whole_cuts;
        } else {
            const auto report = domain_.even_out(mine, halo);
            left_ = report.after, halo_share_ = report.halo;
            if (whole.halo == 0) whole.halo = report.halo;
        }
    });
    busy_since_cut_ = 0;
    ++structure_.cuts;
}

void Simulation::together(const std::function<void()>& work)
{
    std::string complaint;
    try {
        work();
    } catch (const NumbersFailed& e) {
        complaint = e.what();
    }
    const int worst = int(comm_.max(std::int64_t(complaint.empty() ? -1 : comm_.rank())));
    if (worst >= 0) throw NumbersFailed(comm_.broadcast(complaint, worst));
}

void Simulation::rebuild(bool sort_anew)
{
    auto& p = particles_;
    if (sort_anew) {
        timers_.timed(Phase::Migrate, [&] {
            wrap_periodic();
            if (comm_.size() > 1) {
                const double busy = timers_.seconds(Phase::Interior) + timers_.seconds(Phase::Rim);
                const bool due = built_ && rebalance_.due(comm_, busy - busy_before_);
                busy_since_cut_ += busy - busy_before_;
                busy_before_ = busy;
                structure_.imbalance = rebalance_.imbalance();
                const bool cut = due || (options_.recut_every > 0 && built_ && structure_.rebuilds % options_.recut_every == 0);
                const double begin = omp_get_wtime();
                if (cut) recut();
                structure_.migrated += domain_.migrate(p).left;
                domain_.forget_far();
                if (cut) rebalance_.cut(comm_, omp_get_wtime() - begin);
            }
            const Index n = p.size();
            const auto x = p[field::position], to = p[field::sorted_position];
            for (int c = 0; c < 3; ++c)
#pragma omp parallel for schedule(static)
                for (Index i = 0; i < n; ++i) to.column[c][i] = x.column[c][i];
        });
    }
    together([&] {
        timers_.timed(Phase::Sort, [&] {
            const auto x = p[field::sorted_position];
            sorted_ = sort_into_columns(columns_, x.column[0], x.column[1], x.column[2], p[field::id].column[0], p.size());
            p.gather(sorted_.order);
        });
        // every column read and written once
        timers_.did(Phase::Sort, 0,
                    2.0 * double(scene::column_bytes(filling_)) * double(p.size()) /
                        double(std::max<std::int64_t>(1, filling_.soil_count())));
    });
    timers_.timed(Phase::Ghosts, [&] {
        halo_.emplace(comm_, domain_.plan_halo(std::as_const(p)[field::sorted_position], p.size(), reach_), row_bytes(*model_));
        const auto arrived = halo_->ghosts(p);
        n_ghosts_ = Index(arrived.size());
        Array<double> x(n_ghosts_), y(n_ghosts_), z(n_ghosts_);
        Array<std::int64_t> id(n_ghosts_);
        for (Index k = 0; k < n_ghosts_; ++k)
            x[k] = arrived[k].sorted_position.x, y[k] = arrived[k].sorted_position.y, z[k] = arrived[k].sorted_position.z,
            id[k] = arrived[k].id;
        ghost_sorted_ = sort_into_columns(columns_, x.data(), y.data(), z.data(), id.data(), n_ghosts_);
        ghost_x_.resize(n_ghosts_), ghost_y_.resize(n_ghosts_), ghost_z_.resize(n_ghosts_), ghost_id_.resize(n_ghosts_);
        std::vector<Index> slot(n_ghosts_);
        for (Index k = 0; k < n_ghosts_; ++k) {
            const Index from = ghost_sorted_.order[k];
            ghost_x_[k] = x[from], ghost_y_[k] = y[from], ghost_z_[k] = z[from], ghost_id_[k] = id[from];
            slot[from] = k;
        }
        halo_->place(slot);
        renew_walls();
    });
    timers_.timed(Phase::Lists, [&] {
        const auto x = std::as_const(p)[field::sorted_position];
        const SortedPoints owned{x.column[0], x.column[1], x.column[2], std::as_const(p)[field::id].column[0], &sorted_, p.size()};
        const SortedPoints ghosts{ghost_x_.data(), ghost_y_.data(), ghost_z_.data(), ghost_id_.data(), &ghost_sorted_, n_ghosts_};
        lists_.build(columns_, owned, ghosts, walls_, reach_, model_->cluster_width());
        make_records();
    });
    // Of an entry that is kept: three differences, their squares and two sums; four bytes. Of a particle: its place and record.
    const auto entries = double(lists_.entries() + lists_.wall_entries());
    timers_.did(Phase::Lists, 8 * entries, 4 * entries + double(p.size()) * double(24 + row_bytes(*model_)));
    if (sort_anew) clock_.extremes.moved2 = 0;
    pruned_margin_ = 0;
    built_ = true;
    ++structure_.rebuilds;
}

void Simulation::renew_walls()
{
    if (scene_.walls.empty()) return;
    const auto x = std::as_const(particles_)[field::sorted_position];
    const double all = std::numeric_limits<double>::max();
    Vector lo{all, all, all}, hi{-all, -all, -all};
    for (Index i = 0; i < particles_.size(); ++i) {
        const Vector a = x[i];
        lo = {std::min(lo.x, a.x), std::min(lo.y, a.y), std::min(lo.z, a.z)};
        hi = {std::max(hi.x, a.x), std::max(hi.y, a.y), std::max(hi.z, a.z)};
    }
    const auto inside = [](const scene::Box& a, const scene::Box& b) {
        return a.low.x >= b.low.x && a.low.y >= b.low.y && a.low.z >= b.low.z && a.high.x <= b.high.x && a.high.y <= b.high.y &&
               a.high.z <= b.high.z;
    };
    if (particles_.size() == 0) return;
    const Vector margin{reach_, reach_, reach_}, ahead = 3.0 * margin;
    if (wall_region_ && inside({lo - margin, hi + margin}, *wall_region_)) return;
    wall_region_ = scene::Box{lo - margin - ahead, hi + margin + ahead};
    walls_.assign(scene_.walls.size(), {});
    for (std::size_t w = 0; w < walls_.size(); ++w) walls_[w].wall = int(w);
    // Walls repeat with the period as the soil does.
    Vector step = period(scene_);
    const int px = scene_.space.periodic[0], py = scene_.space.periodic[1], pz = scene_.space.periodic[2];
    for (int a = -px; a <= px; ++a)
        for (int b = -py; b <= py; ++b)
            for (int c = -pz; c <= pz; ++c) {
                const Vector shift{a * step.x, b * step.y, c * step.z};
                filling_.for_each_wall_in({wall_region_->low - shift, wall_region_->high - shift}, [&](std::int64_t id, Vector at, int w) {
                    walls_[w].x.push_back(at.x + shift.x), walls_[w].y.push_back(at.y + shift.y), walls_[w].z.push_back(at.z + shift.z);
                    walls_[w].id.push_back(id);
                });
            }
    for (auto& w : walls_) w.sort(columns_);
    std::visit(
        [&](auto& buffers) {
            buffers.walls.resize(walls_.size());
            for (std::size_t w = 0; w < walls_.size(); ++w) {
                auto& to = buffers.walls[w];
                const std::size_t n = walls_[w].x.size();
                to.wall = &scene_.walls[w];
                to.x.resize(n), to.y.resize(n), to.z.resize(n);
                for (std::size_t k = 0; k < n; ++k)
                    to.x[k] = buffers.place(walls_[w].x[k]), to.y[k] = buffers.place(walls_[w].y[k]),
                    to.z[k] = buffers.place(walls_[w].z[k]);
            }
        },
        buffers_);
}

void Simulation::make_records()
{
    std::visit(
        [&](auto& buffers) {
            using T = std::remove_cvref_t<decltype(buffers.now[0].vx)>;
            const auto& p = std::as_const(particles_);
            const Index n = p.size();
            const std::size_t count = std::size_t(n) + n_ghosts_ + Particles::padding + 1;
            buffers.now.resize(count), buffers.next.resize(count);
            const bool tensile = model_->tensile(), sleepy = p.has(field::activity);
            if (tensile) buffers.tension.resize(count), buffers.next_tension.resize(count);
            const double epsilon = scene_.effects.artificial_stress ? scene_.effects.artificial_stress->epsilon : 0;
#pragma omp parallel for schedule(static)
            for (Index i = 0; i < n; ++i) {
                const Material& m = soils_[p[field::soil][i]];
                const double rho = p[field::density][i];
                buffers.now[i] = make_record<T>(buffers.place, p[field::position][i], p[field::velocity][i],
                                                scene_.particle_volume() * m.density / rho, rho, p[field::stress][i], m.sound_speed);
                if (sleepy) buffers.now[i].restless = T(p[field::activity][i] == std::int32_t(Activity::Moves) ? 1 : 0);
                if (tensile) buffers.tension[i] = make_tension<T>(p[field::stress][i], epsilon);
            }
            for (std::size_t k = n; k < count; ++k) {
                buffers.now[k] = buffers.next[k] = far_away<T>();
                if (tensile) buffers.tension[k] = buffers.next_tension[k] = {};
            }
        },
        buffers_);
}

Ledger Simulation::ledger() const
{
    Ledger l;
    l.state = state_energy(comm_, particles_, soils_, scene_.particle_volume(), forces_.gravity, water_, clock_.energy_unit * 65536);
    const auto& d = clock_.dissipated;
    std::int64_t units[] = {d.plastic, d.viscous, d.wall, d.damping};
    comm_.sum(std::span<std::int64_t>(units));
    const double u = clock_.energy_unit;
    l.dissipated = {double(units[0]) * u, double(units[1]) * u, double(units[2]) * u, double(units[3]) * u};
    return l;
}

double Simulation::residual(const Ledger& l) const
{
    const double excess = l.sum() - clock_.energy_at_start;
    const double drop = -l.state.potential;
    const double scale =
        drop > 0 ? drop : std::max({std::fabs(l.state.potential), l.state.kinetic, l.state.elastic, std::fabs(clock_.energy_at_start)});
    return scale > 0 ? excess / scale : 0;
}

std::int64_t Simulation::pairs() const { return comm_.sum(my_pairs_ + clock_.pairs); }

Clock Simulation::clock() const
{
    Clock c = clock_;
    c.pairs = pairs();
    std::int64_t units[] = {c.dissipated.plastic, c.dissipated.viscous, c.dissipated.wall, c.dissipated.damping};
    comm_.sum(std::span<std::int64_t>(units));
    c.dissipated = {units[0], units[1], units[2], units[3]};
    return c;
}

WorkDone Simulation::work_done() const
{
    return {clock_.step, my_particle_steps_, my_pairs_, my_asleep_, my_halo_bytes_, my_messages_, first_step_.value_or(RankStep{})};
}

std::size_t Simulation::memory_bytes() const
{
    std::size_t b = particles_.bytes_per_particle() * particles_.size() + lists_.bytes();
    std::visit(
        [&](const auto& buffers) {
            b += (buffers.now.capacity() + buffers.next.capacity()) * sizeof(buffers.now[0]);
            b += (buffers.tension.capacity() + buffers.next_tension.capacity()) * sizeof(buffers.tension[0]);
            for (const auto& w : buffers.walls) b += w.x.size() * 3 * sizeof(w.x[0]);
        },
        buffers_);
    for (const auto& w : walls_) b += w.x.size() * (3 * sizeof(double) + sizeof(std::int64_t) + sizeof(Index));
    return b + std::size_t(n_ghosts_) * 32;
}

} // namespace kuzure
