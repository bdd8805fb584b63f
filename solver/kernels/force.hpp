#pragma once
// The force stage of the staggered scheme: forces of stresses, artificial stress and walls, with the viscous force of the strain stage
// the acceleration of t^(n+1), and with it the velocity.
#include "solver/kernels/contact_forces.hpp"
#include "solver/kernels/loads_on_faces.hpp"

namespace kuzure {

template <class Records> class ForceStage : public LoadsOnFaces<ContactForces<Records>> {
    using Below = LoadsOnFaces<ContactForces<Records>>;
    template <class S> using ForceWalls = typename Below::template ForceWalls<S>;
    template <class S> using WallPower = typename Below::template WallPower<S>;
    using typename Below::Watts;
    using M = typename Below::Model;
    using V = typename Below::LaneType;

protected:
    using Below::W, Below::unit_, Below::h_, Below::volume_, Below::model_, Below::scale_, Below::water_, Below::kinematics_,
        Below::stresses_, Below::tension_;
    using typename Below::T, typename Below::U;

    template <class S>
    using ForceSums = typename M::template WithMore<S, StressForce, typename M::ArtificialStressTerm, typename M::DiffusionTerm,
                                                    typename M::CarriedTerm, typename M::HourglassTerm>;
    using Wide = WideLanes<W>;

    explicit ForceStage(const scene::Interactions& s) : Below(s) {}

    /// Geometry: r 3, r.r 5, reciprocal 1, length 1, t 2, F and volume 8, grad W 3. Update: 60.
    Stage force_stage() const
    {
        return {"force",
                sizeof(Stresses<T>) + (Below::adjoint() ? sizeof(Traction<T>) : 0) + (Below::controls() ? sizeof(Affine<T>) : 0) +
                    (M::tensile ? sizeof(Tension<T>) : 0),
                23 + StressForce::flops + M::ArtificialStressTerm::flops + M::DiffusionTerm::flops +
                    (Below::shifting() ? M::CarriedTerm::flops / Shifting::every : 0) + (Below::controls() ? M::HourglassTerm::flops : 0) +
                    M::more_flops,
                60, 25 * 8 + sizeof(Kinematics<T>) + sizeof(Stresses<T>) + 4 * 120.0 / W};
    }
    PassResult run_force(const StepInput& in, std::span<const Index> clusters)
    {
        return Below::over(
            clusters, [&](Index c, Tally<U> & tally) __attribute__((always_inline)) { force_cluster(in, c, tally); });
    }

private:
    KUZURE_INLINE void force_cluster(const StepInput& in, Index cluster, Tally<U>& tally)
    {
        Tally<U> counted_before; // sleepers are counted in stage 0
        Cluster<V> i = Below::cluster_at(in, cluster, counted_before);
        if (i.moving == 0) return;
        i.position = positions_of<V>(kinematics_.data(), i.first);
        const auto near = in.lists->pruned(cluster);
        ForceSums<Wide> sums;
        // every particle meets itself once in its list
        tally.pairs +=
            (in.shifts ? sum_forces<M::shifts>(in, i, near, sums) : sum_forces<false>(in, i, near, sums)) - std::popcount(i.moving);
        unsigned awake = 0;
        if (in.sleep == SleepStage::Freeze) awake = awake_near(i, near, kinematics_.data(), stresses_.data(), 2 * model_.kernel.h);
        ForceWalls<Wide> walls{};
        WallPower<Wide> power;
        const auto runs = in.lists->walls(cluster);
        const bool moving = !runs.empty() && Below::walls_move();
        if (moving) power = {}, tally.pairs += sum_wall_forces<true>(in, i, runs, stress_of(in, i), walls, &power);
        else if (!runs.empty()) tally.pairs += sum_wall_forces<false>(in, i, runs, stress_of(in, i), walls, nullptr);
        ForceWalls<Wide> loaded;
        const bool pressed = !runs.empty() && Below::any_pressure(in, i);
        if (pressed) loaded = {}, sum_wall_forces<false>(in, i, runs, Below::pressure_of(in, i), loaded, nullptr);
        Below::for_each_register(
            i, [&](const Lanes& lanes) __attribute__((always_inline)) {
                update_force(in, sums, walls, !runs.empty(), moving ? &power : nullptr, pressed ? &loaded : nullptr, lanes, awake, tally);
            });
    }
    KUZURE_INLINE static Sym3<V> stress_of(const StepInput& in, const Cluster<V>& i)
    {
        const auto s = std::as_const(*in.particles)[field::stress];
        const auto narrow = [&](int k) { return load_narrow<V>(s.column[k] + i.first); };
        return {narrow(0), narrow(1), narrow(2), narrow(3), narrow(4), narrow(5)};
    }
    /// Returns the pairs inside the support. Entries of the list beyond it add exact zeros.
    /// `carries`: this step shifts particles, which carry stress along.
    template <bool carries>
    KUZURE_INLINE std::int64_t sum_forces(const StepInput& in, const Cluster<V>& i, std::span<const Index> near, ForceSums<Wide>& out) const
    {
        const Kinematics<T>* neighbours = kinematics_.data();
        const Stresses<T>* records = stresses_.data();
        const auto at = Below::lengths();
        const V support = at.support, support2 = at.support2, softening = at.softening, tiny = at.tiny, zero(T(0)), one(T(1));
        const bool tension = Below::in_tension(i, tension_);
        const bool adjoint = Below::adjoint(), controls = Below::controls();
        const Vec3<V> velocity = controls ? Below::velocity_of(in, i) : Vec3<V>{};
        const V weight = controls ? Below::weight_of(i) : V(T(0));
        const Vec3<V> shift = Below::shift_of(in, i, carries);
        const bool shifted = carries && Below::any(shift);
        Batch<V> batch;
        ForceSums<V> sums{};
        V inside = zero;
        Below::for_each_batch(
            near, batch, [&]() __attribute__((always_inline)) {
                for (int k = 0; k < batch.size; ++k) {
                    const Index number = batch.neighbour[k];
                    Entry<V>& e = batch.at[k];
                    const Vec3<V> r = i.position.minus(neighbours[number]);
                    const V r2 = max(dot(r, r), tiny);
                    inside = inside + select(less(r2, support2), one, zero);
                    const auto inv = root<M::Kernel::divides>(r2);
                    const V t = max(support - inv.root, zero);
                    const V w = model_.kernel.F(t, inv.root, inv.inverse_root) * records[number].volume;
                    e.grad = w * r;
                    if constexpr (M::tensile) e.t = t;
                    if constexpr (M::corrected) e.r = r;
                    if constexpr (M::corrected || M::diffusive)
                        if (M::diffusive || controls) e.q = w * (r2 / (r2 + softening));
                    if constexpr (M::diffusive) {
                        const Vector g = model_.stress_diffusion.gravity;
                        e.along = dot(Vec3<V>{V(T(g.x)), V(T(g.y)), V(T(g.z))}, r);
                    }
                }
                // rho_i dv/dt = sum_j V_j [ sigma_i + sigma_j + f (tau_i + tau_j) ] . grad W
                if (adjoint) CorrectedForce{}.add(sums, batch, Below::tractions_.data());
                else
                    StressForce{}.add(
                        sums, batch, records, [](Sym3<V> s, const Entry<V>&) __attribute__((always_inline)) { return s; });
                if constexpr (M::tensile)
                    model_.artificial_stress.add(sums, batch, tension_.data(), tension, model_.artificial_stress.mean);
                if constexpr (M::corrected)
                    if (controls) model_.hourglass.add(sums, batch, Below::affine_.data(), neighbours, velocity, weight, V(T(0.5 * unit_)));
                if constexpr (M::diffusive) model_.stress_diffusion.add(sums, batch, records);
                if constexpr (carries)
                    if (shifted) CarriedStress{}.add(sums, batch, records, shift);
                std::apply([&](const auto&... term) { (term.add(sums, batch, records), ...); }, model_.more);
            });
        widen<V>(sums, out);
        return Below::counted(i, inside);
    }

    /// Returns the wall pairs inside the support; sigma: what walls mirror of each lane's stress.
    template <bool moving>
    [[gnu::noinline]] std::int64_t sum_wall_forces(const StepInput& in, const Cluster<V>& i, const WallList& runs, const Sym3<V>& sigma,
                                                   ForceWalls<Wide>& out, WallPower<Wide>* power_out) const
    {
        const Vec3<V> velocity = Below::velocity_of(in, i);
        ForceWalls<V> sums{};
        WallPower<V> power{};
        sums.nearest = Below::lengths().support2;
        std::int64_t pairs = 0;
        const V none(T(0));
        Below::template for_each_wall_pair<moving>(i, runs, {none, none, none}, [&](Vec3<V> r, V r2, unsigned hits, const Mirror<V>& m) {
            pairs += std::popcount(hits & i.moving);
            const V support = Below::lengths().support, zero(T(0));
            const auto inv = root<M::Kernel::divides>(r2);
            const Vec3<V> g = (m.factor * model_.kernel.F(max(support - inv.root, zero), inv.root, inv.inverse_root)) * r;
            const Vec3<V> traction = sigma * g;
            const Vec3<V> crossing = project(m, traction);
            const V slides = m.coulomb, holds = V(T(1)) - slides;
            sums.held = fma(holds, crossing, sums.held), sums.pressing = fma(slides, crossing, sums.pressing);
            const V along = dot(traction, m.normal), facing = slides * dot(g, m.normal);
            sums.limit = fma(slides * m.tangent, along, sums.limit);
            Vec3<V> relative = velocity;
            if constexpr (moving) {
                relative = relative - m.v;
                const V now = dot(crossing, m.v), next = dot(crossing, m.next);
                power.held = fma(holds, now, power.held), power.held_next = fma(holds, next, power.held_next);
                power.pressing = fma(slides, now, power.pressing), power.pressing_next = fma(slides, next, power.pressing_next);
                power.carried = fma(facing, m.v, power.carried), power.carried_next = fma(facing, m.next, power.carried_next);
                power.facing = power.facing + facing;
            }
            sums.approach = fma(facing, dot(relative, m.normal), sums.approach);
            sums.area = fma(facing, m.normal, sums.area), sums.dragging = fma(facing, m.drag, sums.dragging);
            const auto nearer = less(r2, sums.nearest);
            sums.nearest = min(sums.nearest, r2), sums.sunk = select(nearer, m.sunk, sums.sunk);
            sums.grip = select(nearer, slides * m.tangent, sums.grip);
            sums.out = {select(nearer, m.normal.x, sums.out.x), select(nearer, m.normal.y, sums.out.y),
                        select(nearer, m.normal.z, sums.out.z)};
        });
        widen<V>(sums, out);
        if constexpr (moving) widen<V>(power, *power_out);
        return pairs;
    }

    /// `power`: of walls that move; none: they stand still. `loaded`: what walls add to pressures; none: nothing.
    KUZURE_INLINE void update_force(const StepInput& in, const ForceSums<Wide>& soil_sums, const ForceWalls<Wide>& wall_sums, bool walled,
                                    const WallPower<Wide>* power, const ForceWalls<Wide>* loaded, const Lanes& lanes, unsigned awake,
                                    Tally<U>& tally)
    {
        auto& p = *in.particles;
        const auto& was = std::as_const(p);
        const U zero(0.0), half(0.5), factor(scale_), dt(in.dt), next(in.next), half_dt = half * dt, half_next = half * next;
        const auto sums = lanes_at<U, ForceSums<U>, ForceSums<Wide>, W>(soil_sums, lanes.first);
        const LaneSoil<U> soil = soil_of<U>(in.soils, was[field::soil].column[0], lanes);
        const Sym3<U> sigma = was[field::stress].template load<U>(lanes.at);
        const U rho = was[field::density].template load<U>(lanes.at);
        const Vec3<U> x = was[field::position].template load<U>(lanes.at), u = was[field::velocity].template load<U>(lanes.at);
        const Vec3<U> viscous = was[field::acceleration].template load<U>(lanes.at);
        const U per_rho = factor / rho;

        Vec3<U> own = sums.grad_one;
        if (Below::adjoint()) own = was[field::gradient_matrix].template load<U>(lanes.at) * own;
        Vec3<U> stress = per_rho * (sums.force + sigma * own);
        Vec3<U> artificial{zero, zero, zero}, wall = artificial, by_loads = artificial;
        if constexpr (M::tensile) {
            stress = stress + per_rho * (Below::artificial_stress_of(lanes) * sums.closeness_grad + sums.art_stress_j);
        }
        std::apply([&](const auto&... term) { ((artificial = artificial + per_rho * term.force(sums)), ...); }, model_.more);
        if constexpr (M::corrected)
            if (Below::controls()) artificial = artificial + per_rho * Below::hourglass(sums, lanes);
        if (M::diffusive || in.shifts) rate_of_stress(in, sums, sigma, soil, lanes);
        if (in.shifted) artificial = artificial + was[field::shift_acceleration].template load<U>(lanes.at);
        if (walled) {
            Watts watts{zero, zero};
            wall = Below::wall_acceleration(in, wall_sums, lanes, U(volume_) * soil.rho0 / rho, rho, power, watts);
            if (power) {
                const U mass = U(volume_) * soil.rho0;
                Below::book_work_of_walls(in, lanes, mass * watts.now, mass * watts.next, tally.energy.wall, tally.later.wall, tally);
            }
        } else Below::forget_contact(p, lanes);
        if (p.has(field::wall_force)) Below::tell_of_walls(p, lanes, wall, walled);
        Vec3<U> body = body_acceleration(in.forces, water_, was[field::position], soil.rho0, lanes);
        if (!in.loads.empty()) {
            Vec3<U> at_walls;
            if (loaded) {
                const auto w = lanes_at<U, ForceWalls<U>, ForceWalls<Wide>, W>(*loaded, lanes.first);
                at_walls = w.held + w.pressing;
            }
            by_loads = Below::load_acceleration(in, U(2.0) * per_rho * sums.grad_one, loaded ? &at_walls : nullptr, lanes, soil.rho0, rho);
            body = body + by_loads;
            if (p.has(field::unstored)) p[field::unstored].store(lanes.at, (viscous + artificial) + (wall + by_loads), lanes.n);
        }
        Vec3<U> a = ((stress + viscous) + (artificial + wall)) + body;
        // Damping over the whole kick, unconditionally stable: v+ = ((1 - mu k/2) v- + k a)/(1 + mu k/2)
        const U mu(in.forces.damping), kick = half_dt + half_next;
        a = (U(1.0) / fma(half * mu, kick, U(1.0))) * (a - mu * u);
        Vec3<U> v = fma(half_dt, a, u);
        const auto mine = written<U>(lanes);
        if (in.sleep == SleepStage::Frozen) v = select(mine, v, u), a = select(mine, a, viscous); // a sleeper's holds its acceleration
        p[field::velocity].store(lanes.at, v, lanes.n);
        p[field::acceleration].store(lanes.at, a, lanes.n);
        if (in.sleep == SleepStage::Detect || in.sleep == SleepStage::Freeze) Below::detect_calm(in, lanes, a, v, awake);

        report(in, lanes, Moved{x, u, v, a}, Forces{viscous, artificial, wall, by_loads}, U(volume_) * soil.rho0, walled, tally);
    }
    struct Moved { // after the step: position, velocity half a step before, velocity, acceleration
        Vec3<U> x, u, v, a;
    };
    struct Forces { // per unit of mass, m/s^2
        Vec3<U> viscous, artificial, wall, loads;
    };
    /// Work of each force, half of the step before and half of the one to come; exact sums of rounded addends. Maxima; displacement and
    /// drift are those of the step to come.
    KUZURE_INLINE void report(const StepInput& in, const Lanes& lanes, const Moved& m, const Forces& f, U mass, bool walled,
                              Tally<U>& tally) const
    {
        const auto& p = std::as_const(*in.particles);
        const U zero(0.0), half(0.5), half_dt = half * U(in.dt), next(in.next), half_next = half * next, mu(in.forces.damping);
        const U magic(magic_of(in.energy_unit));
        const auto mine = written<U>(lanes);
        const Vec3<U> coming = fma(half_next, m.a, m.v);
        Vec3<U> way = coming;
        if (in.shifts) way = way + p[field::shift].template load<U>(lanes.at);
        const auto take = [&](U& before, U& later, Vec3<U> force) {
            before -= select(mine, quantized(mass * (half_dt * dot(force, m.u)), magic), zero);
            later -= select(mine, quantized(mass * (half_next * dot(force, coming)), magic), zero);
        };
        take(tally.energy.viscous, tally.later.viscous, f.viscous);
        if constexpr (M::pushes) take(tally.energy.stabilising, tally.later.stabilising, f.artificial);
        if (walled) take(tally.energy.wall, tally.later.wall, f.wall);
        if (!in.loads.empty()) take(tally.energy.loads, tally.later.loads, f.loads);
        if (in.forces.damping > 0) take(tally.energy.damping, tally.later.damping, -(half * mu) * (m.u + coming));
        const Vec3<U> frame{U(in.frame.x), U(in.frame.y), U(in.frame.z)}, flown{U(in.frame_way.x), U(in.frame_way.y), U(in.frame_way.z)};
        const Vec3<U> moved = (fma(next, way, m.x) - p[field::sorted_position].template load<U>(lanes.at)) - flown, drift = way - frame;
        const auto meet = [&](U& most, U value) { most = max(select(mine, value, zero), most); };
        meet(tally.maxima.acceleration2, dot(m.a, m.a));
        meet(tally.maxima.displacement2, dot(moved, moved));
        meet(tally.maxima.speed2, dot(m.v, m.v));
        meet(tally.maxima.half_step_speed2, dot(drift, drift));
        tally.poison += select(mine, fma(zero, dot(m.a, m.a), fma(zero, dot(m.v, m.v), zero * dot(m.x, m.x))), zero);
        if (in.low) {
            double at[3][16];
            store(at[0], m.x.x), store(at[1], m.x.y), store(at[2], m.x.z);
            if (any_outside(in, at, lanes.n)) tally.maxima.outside = U(1.0);
        }
    }
    /// Stress rate of diffusion and shifting, kept for the next strain.
    KUZURE_INLINE void rate_of_stress(const StepInput& in, const ForceSums<U>& sums, Sym3<U> sigma, const LaneSoil<U>& soil,
                                      const Lanes& lanes) const
    {
        auto& p = *in.particles;
        Sym3<U> rate{};
        if constexpr (M::diffusive) rate = diffusion(in, sums, sigma, soil, lanes);
        if constexpr (M::shifts)
            if (in.shifts) {
                const Vec3<U> shift = std::as_const(p)[field::shift].template load<U>(lanes.at);
                rate = rate + U(scale_) * (sums.carried - dot(shift, sums.grad_one) * sigma);
            }
        const auto kept = p[field::stress_rate];
        if (in.sleep == SleepStage::Frozen) rate = select(written<U>(lanes), rate, kept.template load<U>(lanes.at));
        kept.store(lanes.at, rate, lanes.n);
    }
    KUZURE_INLINE Sym3<U> diffusion(const StepInput& in, const ForceSums<U>& sums, Sym3<U> sigma, const LaneSoil<U>& soil,
                                    const Lanes& lanes) const
    {
        const auto material = [&](int k) -> const Material& {
            return in.soils[in.soils.size() == 1 ? 0 : std::as_const(*in.particles)[field::soil][lanes.particle(k)]];
        };
        const U speed = lane_by_lane<U>([&](int k) { return material(k).c_bar; });
        const U K0 = lane_by_lane<U>([&](int k) { return material(k).K0; });
        const U strength = U(2 * model_.stress_diffusion.zeta * h_ * scale_ / unit_) * speed;
        return model_.stress_diffusion.rate(sums, sigma, soil.rho0, K0, strength, U(unit_));
    }
};

} // namespace kuzure
