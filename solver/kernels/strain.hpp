#pragma once
// The strain stage of the staggered scheme: velocity gradient at mid-step, from it density, stress and plastic strain, and the viscous
// force, which waits in the acceleration's column for the force stage.
#include "solver/kernels/staggered_records.hpp"
#include "solver/walls/friction.hpp"
#include <algorithm>

namespace kuzure {

template <class Below> class StrainStage : public Below {
    using M = typename Below::Model;
    using V = typename Below::LaneType;

protected:
    using Below::W, Below::unit_, Below::dimensions_, Below::h_, Below::volume_, Below::model_, Below::scale_, Below::kinematics_,
        Below::stresses_, Below::tension_, Below::speed_, Below::walls_, Below::water_;
    using typename Below::T, typename Below::U;
    using Viscous = std::conditional_t<M::viscous, ViscousForce, NoViscousForce>;

    /// What walls add to the sums of a cluster; over wall points j of volume 1, f_ij the mirror factor.
    template <class S> struct StrainWalls : M::ShiftingTerm::template Sums<S> {
        Mat3<S> mirrored, sliding; // sum f (P v_i) (x) grad W; of Coulomb faces apart
        Vec3<S> viscous;           // sum rho_i rho_j Pi P grad W
        S rubbing;                 // sum tan(delta) rho_i rho_j Pi n.grad W of Coulomb faces
        S walled;                  // not zero for a particle that feels a wall
    };
    /// Power of walls that move, by viscosity: sum rho_i rho_j Pi (P grad W).v_w, with v_w of this step and of the one to come.
    template <class S> struct ViscousPower {
        S now, next;
    };
    template <class S>
    using StrainSums = SumsOf<S, VelocityGradient, Viscous, typename M::CorrectionTerm, typename M::ShiftingTerm, typename M::TensionTerm>;
    using Wide = WideLanes<W>;

    explicit StrainStage(const scene::Interactions& s) : Below(s) {}

    /// Geometry: r and its half step 9, v 3, r.r 5, densities and softening 3, reciprocals 5, length 1, t 2, F and volume 8, grad W 3;
    /// viscosity: approach 6, pressure 6. Update: scaled sums 12, rotation 110, increments 40, return to the cone 40, energies 60.
    Stage strain_stage() const
    {
        return {"strain", sizeof(Kinematics<T>) + (Below::shifting() ? sizeof(ShiftOf<T>) : 0),
                39 + (M::viscous ? 12.0 : 0.0) + VelocityGradient::flops + Viscous::flops + M::CorrectionTerm::flops +
                    (Below::shifting() ? M::ShiftingTerm::flops / Shifting::every : 0),
                262, 23 * 8 + sizeof(Kinematics<T>) + sizeof(Stresses<T>) + 4 * 120.0 / W};
    }
    PassResult run_strain(const StepInput& in, std::span<const Index> clusters)
    {
        return Below::over(
            clusters, [&](Index c, Tally<U> & tally) __attribute__((always_inline)) { strain_cluster(in, c, tally); });
    }

private:
    KUZURE_INLINE void strain_cluster(const StepInput& in, Index cluster, Tally<U>& tally)
    {
        Cluster<V> i = Below::cluster_at(in, cluster, tally);
        if (i.moving == 0) { // its list is pruned when it wakes
            if (in.prune) in.lists->pruned(cluster).n = -1;
            if (Below::controls()) std::fill_n(&Below::affine_[i.first], i.count, Affine<T>{});
            return;
        }
        Below::load_lanes(i, in, kinematics_.data(), [&](Index k) { return speed_[k]; });
        const auto near = Below::near(i, in, cluster, kinematics_.data());
        StrainSums<Wide> sums;
        if (in.shifts || in.shifted) sum_strain<M::shifts>(in, i, near, sums);
        else sum_strain<false>(in, i, near, sums);
        StrainWalls<Wide> walls{};
        const auto runs = in.lists->walls(cluster);
        if (!runs.empty()) {
            if (Below::walls_move()) {
                ViscousPower<Wide> power{};
                sum_wall_strain<true>(in, i, runs, walls, &power);
                if constexpr (M::viscous)
                    Below::for_each_register(i, [&](const Lanes& lanes) { book_viscous_power(in, power, lanes, tally); });
            } else sum_wall_strain<false>(in, i, runs, walls, nullptr);
        }
        Below::for_each_register(
            i, [&](const Lanes& lanes) __attribute__((always_inline)) { update_strain(in, sums, walls, !runs.empty(), lanes, tally); });
    }
    /// What viscosity takes is less by what walls do through it.
    [[gnu::noinline]] void book_viscous_power(const StepInput& in, const ViscousPower<Wide>& wide, const Lanes& lanes,
                                              Tally<U>& tally) const
    {
        const auto& was = std::as_const(*in.particles);
        const auto power = lanes_at<U, ViscousPower<U>, ViscousPower<Wide>, W>(wide, lanes.first);
        const LaneSoil<U> soil = soil_of<U>(in.soils, was[field::soil].column[0], lanes);
        const U rho = was[field::density].template load<U>(lanes.at), mass = U(volume_) * soil.rho0;
        const U watts = (-mass * U(scale_) / rho) * (mass / rho);
        Below::book_work_of_walls(in, lanes, watts * power.now, watts * power.next, tally.energy.viscous, tally.later.viscous, tally);
    }

    /// `shifting`: this step shifts particles, or decides how the next does.
    template <bool shifting>
    KUZURE_INLINE void sum_strain(const StepInput& in, const Cluster<V>& i, std::span<const Index> near, StrainSums<Wide>& out) const
    {
        const Kinematics<T>* records = kinematics_.data();
        const bool one_soil = in.soils.size() == 1;
        const T* speed = one_soil ? nullptr : speed_.data();
        const auto at = Below::lengths();
        const V support = at.support, softening = at.softening, tiny = at.tiny, zero(T(0)), half_dt(T(0.5 * in.dt / unit_));
        [[maybe_unused]] const bool shifted = in.shifted, decides = in.shifts;
        const ShiftOf<T>* shifts = Below::shifts_.data();
        const Vec3<V> own = Below::shift_of(in, i, in.shifted);
        const bool tension = Below::in_tension(i, tension_);
        Batch<V> batch;
        StrainSums<V> sums{};
        Below::for_each_batch(
            near, batch, [&]() __attribute__((always_inline)) {
                for (int k = 0; k < batch.size; ++k) {
                    const Kinematics<T>& j = records[batch.neighbour[k]];
                    Entry<V>& e = batch.at[k];
                    const Vec3<V> v{j.vx - i.v.x, j.vy - i.v.y, j.vz - i.v.z};
                    Vec3<V> r = fma(half_dt, v, i.position.minus(j)); // half a step back
                    if (shifting && shifted) {
                        const ShiftOf<T>& w = shifts[batch.neighbour[k]];
                        r = fma(half_dt, Vec3<V>{w.x - own.x, w.y - own.y, w.z - own.z}, r);
                    }
                    const V r2 = max(dot(r, r), tiny);
                    const V rho_sum = i.rho + j.density;
                    const auto inv = roots<M::Kernel::divides>(r2, (r2 + softening) * rho_sum);
                    const V t = max(support - inv.root, zero);
                    e.grad = (model_.kernel.F(t, inv.root, inv.inverse_root) * j.volume) * r;
                    e.v = v;
                    if constexpr (M::viscous) {
                        // rho_i rho_j Pi > 0 where the two approach
                        const V approach = max(dot(v, r), zero);
                        const V c = one_soil ? i.c : V(speed[batch.neighbour[k]]);
                        e.rho2_Pi = model_.viscosity(Pair<V>{approach, inv.inverse, rho_sum, i.rho, V(j.density), i.c, c});
                    }
                    if constexpr (M::corrected || shifting) e.r = r;
                    if constexpr (M::tensile) e.t = t;
                    if constexpr (shifting)
                        if (decides) e.w = model_.kernel.value(t);
                }
                VelocityGradient{}.add(sums, batch);
                Viscous{}.add(sums, batch);
                if constexpr (M::corrected) model_.correction.add(sums, batch);
                if constexpr (M::tensile)
                    if (tension) StrainOfTension{}.add(sums, batch, model_.artificial_stress);
                if constexpr (shifting)
                    if (decides) model_.shifting.add(sums, batch);
            });
        widen<V>(sums, out);
    }

    template <bool moving>
    [[gnu::noinline]] void sum_wall_strain(const StepInput& in, const Cluster<V>& i, std::span<const Index> runs, StrainWalls<Wide>& out,
                                           ViscousPower<Wide>* power_out) const
    {
        const V half_dt(T(0.5 * in.dt / unit_));
        const Vec3<V> way = i.v + Below::shift_of(in, i, in.shifted), back{half_dt * way.x, half_dt * way.y, half_dt * way.z};
        StrainWalls<V> sums{};
        ViscousPower<V> power{};
        Below::template for_each_wall_pair<moving>(i, runs, back, [&](Vec3<V> r, V r2, unsigned, const Mirror<V>& m) {
            const auto [support, support2, softening, tiny] = Below::lengths();
            const V zero(T(0));
            const V rho_sum = i.rho + i.rho;
            const auto inv = roots<M::Kernel::divides>(r2, (r2 + softening) * rho_sum);
            const V t = max(support - inv.root, zero);
            const Vec3<V> g = model_.kernel.F(t, inv.root, inv.inverse_root) * r;
            if constexpr (M::shifts)
                if (in.shifts) {
                    sums.crowd = fma(model_.shifting.crowding(model_.kernel.value(t)), g, sums.crowd);
                    sums.spread = sums.spread + dot(r, g);
                }
            Vec3<V> v = i.v;
            if constexpr (moving) v = v - m.v;
            const Vec3<V> Pv = m.factor * project(m, v);
            const V slides = m.coulomb, holds = V(T(1)) - slides;
            const auto add = [&](Vec3<V>& held, Vec3<V>& sliding, V Pv_a) {
                held = fma(holds * Pv_a, g, held), sliding = fma(slides * Pv_a, g, sliding);
            };
            add(sums.mirrored.x, sums.sliding.x, Pv.x), add(sums.mirrored.y, sums.sliding.y, Pv.y),
                add(sums.mirrored.z, sums.sliding.z, Pv.z);
            sums.walled = sums.walled + dot(g, m.normal);
            if constexpr (M::viscous) {
                const V approach = max(-dot(Pv, r), zero);
                const V pressure = model_.viscosity(Pair<V>{approach, inv.inverse, rho_sum, i.rho, i.rho, i.c, i.c});
                sums.viscous = fma(pressure, project(m, g), sums.viscous);
                sums.rubbing = fma(m.coulomb * m.tangent * pressure, dot(g, m.normal), sums.rubbing);
                if constexpr (moving) {
                    const Vec3<V> push = project(m, g);
                    power.now = fma(pressure, dot(push, m.v), power.now), power.next = fma(pressure, dot(push, m.next), power.next);
                }
            }
        });
        widen<V>(sums, out);
        if constexpr (moving) widen<V>(power, *power_out);
    }

    /// What walls do to viscosity waits for the force stage.
    static void keep_of_walls(Particles& p, const Lanes& lanes, Vec3<U> force)
    {
        const auto kept = p[field::wall_force];
        kept.store(lanes.at, select(written<U>(lanes), force, kept.template load<U>(lanes.at)), lanes.n);
    }
    /// What corrects the pair forces of the step's end, from this step's correction and that of the strain before, both of mid-step; one
    /// that jumps is none to go on from. Sleepers keep theirs.
    static void keep_correction(const StepInput& in, const Lanes& lanes, Sym3<U> K)
    {
        const auto at_end = (*in.particles)[field::gradient_matrix], before = (*in.particles)[field::strain_matrix];
        const auto mine = written<U>(lanes);
        const Sym3<U> old = before.template load<U>(lanes.at), change = K - old;
        const U on = select(less(contract(change, change), U(0.01)), U(in.dt > 0 ? 0.5 * in.dt / in.kick : 0.0), U(0.0));
        at_end.store(lanes.at, select(mine, fma(on, change, K), at_end.template load<U>(lanes.at)), lanes.n);
        before.store(lanes.at, select(mine, K, old), lanes.n);
    }
    struct Strained {
        Sym3<U> sigma;
        U rho, plastic_strain;
        Vec3<U> viscous; // acceleration, m/s^2
    };

    /// Writes a step's state where it has a length and the particle is awake; `next` is what counts then.
    static KUZURE_INLINE void keep_strained(const StepInput& in, const Lanes& lanes, const Strained& was, U was_opened, Strained& next,
                                            U opened)
    {
        auto& p = *in.particles;
        if (in.sleep == SleepStage::Frozen) {
            const auto mine = written<U>(lanes);
            next.sigma = select(mine, next.sigma, was.sigma), next.rho = select(mine, next.rho, was.rho);
            next.plastic_strain = select(mine, next.plastic_strain, was.plastic_strain);
            opened = select(mine, opened, was_opened);
            next.viscous = select(mine, next.viscous, std::as_const(p)[field::acceleration].template load<U>(lanes.at));
        }
        if (in.dt > 0) { // at the start of a run only the viscous force is wanted
            p[field::stress].store(lanes.at, next.sigma, lanes.n);
            p[field::density].store(lanes.at, next.rho, lanes.n);
            p[field::plastic_strain].store(lanes.at, next.plastic_strain, lanes.n);
            if (in.remembering) p[field::opened_volume].store(lanes.at, opened, lanes.n);
        } else next.sigma = was.sigma, next.rho = was.rho;
        p[field::acceleration].store(lanes.at, next.viscous, lanes.n);
    }

    KUZURE_INLINE void update_strain(const StepInput& in, const StrainSums<Wide>& soil_sums, const StrainWalls<Wide>& wall_sums,
                                     bool walled, const Lanes& lanes, Tally<U>& tally)
    {
        auto& p = *in.particles;
        const auto& was = std::as_const(p);
        const U one(1.0), zero(0.0), half(0.5), factor(scale_), dt(in.dt), half_dt = half * dt;
        const auto sums = lanes_at<U, StrainSums<U>, StrainSums<Wide>, W>(soil_sums, lanes.first);
        LaneSoil<U> soil = soil_of<U>(in.soils, was[field::soil].column[0], lanes);
        const Sym3<U> sigma = was[field::stress].template load<U>(lanes.at);
        const U rho = was[field::density].template load<U>(lanes.at);
        const U plastic = was[field::plastic_strain].template load<U>(lanes.at);
        const U per_rho = factor / rho;

        Mat3<U> L{factor * sums.grad_v.x, factor * sums.grad_v.y, factor * sums.grad_v.z};
        Vec3<U> viscous{zero, zero, zero};
        if constexpr (M::viscous) viscous = -per_rho * sums.viscous;
        Mat3<U> at_walls{{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}};
        U feels_wall = zero;
        if (walled) {
            const auto w = lanes_at<U, StrainWalls<U>, StrainWalls<Wide>, W>(wall_sums, lanes.first);
            const U volume = U(volume_) * soil.rho0 / rho; // a wall particle has the soil's
            at_walls = wall_gradient(in, w, lanes, -factor * volume);
            feels_wall = select(less(zero, abs(w.walled)), one, zero);
            U rubbing = zero;
            if constexpr (M::viscous) {
                const Vec3<U> by_walls = (per_rho * volume) * w.viscous;
                viscous = viscous - by_walls;
                rubbing = -(per_rho * volume) * w.rubbing;
                if (p.has(field::wall_force)) keep_of_walls(p, lanes, U(-1.0) * by_walls);
            }
            friction_lags(in, lanes, rubbing, soil.c);
        }
        U sees_all = zero; // of the hourglass control: 1 where L has all of an affine motion
        if constexpr (M::corrected) {
            const Sym3<U> moment = U(-unit_) * factor * sums.moment; // the sums hold r = x_i - x_j in `unit`
            if (Below::controls()) sees_all = Shifting::inside(U(1.0 / dimensions_) * trace(moment));
            if (model_.correct) {
                const auto [correction, trusted] = GradientCorrection::inverse(moment, dimensions_, one - feels_wall);
                sees_all = max(sees_all, trusted);
                L = {correction * L.x, correction * L.y, correction * L.z};
                if (model_.adjoint) keep_correction(in, lanes, correction);
            }
        }
        const U opened = in.remembering ? was[field::opened_volume].template load<U>(lanes.at) : zero;
        if (walled) {
            // with the volume of mid-step, as the forces of both ends have it in the mean: else walls would give energy
            // in first order of dt. That of soil which has opened stays what it is
            const U grown = select(less(zero, opened), one, fma(half_dt, trace(L) + trace(at_walls), one));
            at_walls = {grown * at_walls.x, grown * at_walls.y, grown * at_walls.z};
        }
        L = {L.x + at_walls.x, L.y + at_walls.y, L.z + at_walls.z};

        Sym3<U> D = symmetric_part(L);
        if constexpr (M::tensile) D = D - less_in_tension(sums, sigma + hooke(half_dt * D, soil.law), lanes); // of mid-step
        if (in.evolving) soil.law = cone_of_now(soil.law, in.soils, was[field::soil].column[0], lanes, h_, plastic, D, sigma);
        Sym3<U> diffusion{zero, zero, zero, zero, zero, zero};
        if (M::diffusive || in.shifted) diffusion = was[field::stress_rate].template load<U>(lanes.at);
        // half before the turn and half after: second order in time, and exact in energy
        const Sym3<U> strain = dt * D;
        const Sym3<U> loading = half * (hooke(strain, soil.law) + dt * diffusion);
        const auto mapped = return_to_cone(rotate(spin_increment(L, dt), sigma + loading) + loading, soil.law, opened);
        // drho/dt = -rho tr L, by the midpoint rule, but for what opens and closes: the soil between the gaps keeps its density
        const U change = half_dt * trace(L) - half * (mapped.opened - opened);
        Strained next{mapped.sigma, rho * ((one - change) / (one + change)), plastic + mapped.d_lambda, viscous};
        if (Below::controls()) {
            const U yields = mapped.d_lambda + mapped.opened, holds = select(less(zero, yields), zero, one);
            write_affine(in, lanes, L, holds * sees_all * (in.dt > 0 ? next.rho : rho) * soil.c);
        }
        if (in.shifts || in.shifted) shift(in, soil_sums, wall_sums, walled, lanes, soil, rho, L, mapped.d_lambda, tally);

        keep_strained(in, lanes, Strained{sigma, rho, plastic, viscous}, opened, next, mapped.opened);
        write_stresses(in, lanes, soil, next);

        report(in, lanes, Strain{sigma, next.sigma, rho, next.rho, D, diffusion, at_walls}, soil, walled, tally);
    }
    /// epsilon N [sum_j V_j f (v_j - v_i) (x) grad W] N: what the strain of soil in tension is less by.
    KUZURE_INLINE Sym3<U> less_in_tension(const StrainSums<U>& sums, const Sym3<U>& sigma, const Lanes& lanes) const
    {
        const Sym3<U> near = U(model_.artificial_stress.adjoint_epsilon * scale_) * symmetric_part(sums.near_grad_v);
        const auto at = [](const Sym3<U>& s, int k) {
            return Stress{lane(s.xx, k), lane(s.yy, k), lane(s.zz, k), lane(s.xy, k), lane(s.yz, k), lane(s.xz, k)};
        };
        return lane_by_lane<Sym3, U>(
            [&](int k) { return tension_[lanes.particle(k)].any == 0 ? Stress{} : tensile_part(at(sigma, k), at(near, k)); });
    }
    /// The way beside its velocity that a particle goes in the step to come, and what this step's has changed: its velocity, and its
    /// potential energy, which is booked here whole.
    KUZURE_INLINE void shift(const StepInput& in, const StrainSums<Wide>& soil_sums, const StrainWalls<Wide>& wall_sums, bool walled,
                             const Lanes& lanes, const LaneSoil<U>& soil, U rho, const Mat3<U>& L, U sheared, Tally<U>& tally) const
    {
        if constexpr (M::shifts) {
            if (!(in.dt > 0)) return; // what is to come was decided before
            auto& p = *in.particles;
            const auto shifted = p[field::shift], carried = p[field::shift_acceleration];
            const auto mine = written<U>(lanes);
            const U none(0.0), mass = U(volume_) * soil.rho0, factor(scale_), dt(in.dt);
            if (in.shifted) {
                const Vec3<U> w = shifted.template load<U>(lanes.at);
                const Vec3<U> body = body_acceleration(in.forces, water_, std::as_const(p)[field::position], soil.rho0, lanes);
                const U fallen = quantized(mass * (dt * dot(body, w)), U(magic_of(in.energy_unit)));
                tally.energy.stabilising += select(mine, fallen, none);
                carried.store(lanes.at, select(mine, Vec3<U>{dot(L.x, w), dot(L.y, w), dot(L.z, w)}, Vec3<U>{none, none, none}), lanes.n);
            }
            if (!in.shifts) return;
            const auto sums = lanes_at<U, StrainSums<U>, StrainSums<Wide>, W>(soil_sums, lanes.first);
            Vec3<U> crowd = sums.crowd;
            U spread = sums.spread;
            if (walled) {
                const auto w = lanes_at<U, StrainWalls<U>, StrainWalls<Wide>, W>(wall_sums, lanes.first);
                crowd = fma(mass / rho, w.crowd, crowd), spread = fma(mass / rho, w.spread, spread);
            }
            const U inside = Shifting::inside(U(-unit_ / dimensions_) * factor * spread);
            const U strength = U(-Shifting::every * model_.shifting.constant * h_ * h_) * inside * (sheared / dt);
            shifted.store(lanes.at, select(mine, (strength * factor) * crowd, Vec3<U>{none, none, none}), lanes.n);
        }
    }
    struct Strain { // of one step: stress and density before and after, rate of strain, stress rate of the diffusion, L of the walls
        Sym3<U> before, after;
        U rho_before, rho_after;
        Sym3<U> D, diffusion;
        Mat3<U> at_walls;
    };
    /// Energies: plastic work is what the mean stress did less what is stored; exact sums of rounded addends. Maxima.
    KUZURE_INLINE void report(const StepInput& in, const Lanes& lanes, const Strain& s, const LaneSoil<U>& soil, bool walled,
                              Tally<U>& tally) const
    {
        const U zero(0.0), half(0.5), dt(in.dt), magic(magic_of(in.energy_unit));
        const auto mine = written<U>(lanes);
        const U mass = U(volume_) * soil.rho0, volume = half * (mass / s.rho_before + mass / s.rho_after);
        const Sym3<U> mean = half * (s.before + s.after);
        const U diffused = compliance(mean, dt * s.diffusion, soil.law); // work of the diffusion, J/m^3
        const U stored = half * (compliance(s.after, s.after, soil.law) - compliance(s.before, s.before, soil.law));
        const U worked = quantized(volume * (contract(mean, dt * s.D) + diffused - stored), magic);
        tally.energy.plastic += select(mine, worked, zero);
        if (M::diffusive || in.shifted) tally.energy.stabilising -= select(mine, quantized(volume * diffused, magic), zero);
        if (walled) {
            const U taken = quantized(volume * contract(mean, dt * symmetric_part(s.at_walls)), magic);
            tally.energy.wall -= select(mine, taken, zero);
        }
        const auto meet = [&](U& most, U value) { most = max(select(mine, value, zero), most); };
        meet(tally.maxima.density_ratio, max(s.rho_after / soil.rho0, soil.rho0 / s.rho_after));
        meet(tally.maxima.signal, fma(U(h_), sqrt(contract(s.D, s.D)), soil.c));
        tally.poison += select(mine, fma(zero, trace(s.after), zero * s.rho_after), zero);
    }
    /// sigma : C^-1 : tau = s : dev(tau)/(2 G) + tr(sigma) tr(tau)/(9 K)
    static KUZURE_INLINE U compliance(Sym3<U> sigma, Sym3<U> tau, const Elastoplastic<U>& soil)
    {
        return contract(deviator(sigma), deviator(tau)) / (soil.shear + soil.shear) + trace(sigma) * trace(tau) / (U(9.0) * soil.bulk);
    }
    /// L of the walls from their sums. A Coulomb face counts where it was pressed on at the step's start, or is approached.
    KUZURE_INLINE Mat3<U> wall_gradient(const StepInput& in, const StrainWalls<U>& w, const Lanes& lanes, U scale) const
    {
        Mat3<U> L{scale * w.mirrored.x, scale * w.mirrored.y, scale * w.mirrored.z};
        const auto& p = std::as_const(*in.particles);
        if (!p.has(field::wall_pressure)) return L;
        const U zero(0.0), one(1.0);
        const U pressed = select(less(zero, p[field::wall_pressure].template load<U>(lanes.at)), one, zero);
        const U use = select(less(scale * trace(w.sliding), zero), one, pressed) * scale;
        return {fma(use, w.sliding.x, L.x), fma(use, w.sliding.y, L.y), fma(use, w.sliding.z, L.z)};
    }
    /// The limit of friction loses its share of the step, and gains that of the viscous push; the force stage adds that of the stress.
    KUZURE_INLINE void friction_lags(const StepInput& in, const Lanes& lanes, U rubbing, U c_p) const
    {
        if (!in.particles->has(field::wall_friction)) return;
        const auto limit = (*in.particles)[field::wall_friction];
        const Lag<U> of = lag(in.dt, c_p, h_);
        const U was = std::as_const(*in.particles)[field::wall_friction].template load<U>(lanes.at);
        const U next = fma(of.keep, was, of.take * rubbing);
        limit.store(lanes.at, in.sleep == SleepStage::Frozen ? select(written<U>(lanes), next, was) : next, lanes.n);
    }
    /// What the force stage's hourglass control reads; sleepers have none.
    KUZURE_INLINE void write_affine(const StepInput& in, const Lanes& lanes, const Mat3<U>& L, U weight)
    {
        if (in.sleep == SleepStage::Frozen) weight = select(written<U>(lanes), weight, U(0.0));
        double fields[10][width<U>];
        const U columns[10] = {L.x.x, L.x.y, L.x.z, L.y.x, L.y.y, L.y.z, L.z.x, L.z.y, L.z.z, weight};
        for (int k = 0; k < 10; ++k) store(fields[k], columns[k]);
        for (int k = 0; k < lanes.n; ++k) {
            const auto at = [&](int c) { return T(fields[c][k]); };
            Below::affine_[lanes.at + k] = {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8), at(9), {}};
        }
    }
    KUZURE_INLINE void write_stresses(const StepInput& in, const Lanes& lanes, const LaneSoil<U>& soil, const Strained& next)
    {
        double fields[7][width<U>];
        const U columns[7] = {
            next.sigma.xx, next.sigma.yy, next.sigma.zz, next.sigma.xy, next.sigma.yz, next.sigma.xz, U(volume_) * soil.rho0 / next.rho};
        for (int k = 0; k < 7; ++k) store(fields[k], columns[k]);
        const std::int32_t* activity = in.sleep == SleepStage::Off ? nullptr : std::as_const(*in.particles)[field::activity].column[0];
        for (int k = 0; k < lanes.n; ++k) {
            Stresses<T>& r = stresses_[lanes.at + k];
            r.xx = T(fields[0][k]), r.yy = T(fields[1][k]), r.zz = T(fields[2][k]);
            r.xy = T(fields[3][k]), r.yz = T(fields[4][k]), r.xz = T(fields[5][k]);
            r.volume = T(fields[6][k]);
            if (activity) r.awake = T(activity[lanes.at + k] == std::int32_t(Activity::Moves));
            if (Below::adjoint())
                Below::tractions_[lanes.at + k] =
                    make_traction<T>(Stress{fields[0][k], fields[1][k], fields[2][k], fields[3][k], fields[4][k], fields[5][k]},
                                     std::as_const(*in.particles)[field::gradient_matrix][lanes.at + k]);
            if constexpr (M::tensile)
                tension_[lanes.at + k] =
                    make_tension<T>(Stress{fields[0][k], fields[1][k], fields[2][k], fields[3][k], fields[4][k], fields[5][k]},
                                    model_.artificial_stress.adjoint_epsilon);
        }
    }
};

} // namespace kuzure
