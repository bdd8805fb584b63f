#pragma once
// The force stage of the staggered scheme: forces of stresses, artificial stress and walls, with the viscous force of the strain stage
// the acceleration of t^(n+1), and with it the velocity.
#include "solver/kernels/loads_on_faces.hpp"
#include "solver/kernels/staggered_records.hpp"
#include "solver/walls/friction.hpp"

namespace kuzure {

template <class Records> class ForceStage : public LoadsOnFaces<Records> {
    using Below = LoadsOnFaces<Records>;
    using M = typename Below::Model;
    using V = typename Below::LaneType;

protected:
    using Below::W, Below::unit_, Below::h_, Below::volume_, Below::model_, Below::scale_, Below::water_, Below::kinematics_,
        Below::stresses_, Below::tension_;
    using typename Below::T, typename Below::U;

    /// What walls add to the sums of a cluster; over wall points j of volume 1, f_ij the mirror factor.
    template <class S> struct ForceWalls {
        Vec3<S> held, pressing; // sum f P (sigma_i grad W); of Coulomb faces apart
        S limit;                // sum f tan(delta) n.(sigma_i grad W)
        S approach;             // sum f (n.v_i)(n.grad W) of Coulomb faces
        Vec3<S> area;           // sum f (n.grad W) n of Coulomb faces
        S dragging;             // sum f drag n.grad W of these
        S nearest, sunk, grip;  // square of the distance to the nearest wall point; how far behind its face; tan(delta) there
        Vec3<S> out;            // that face's normal
    };
    /// Power of walls that move: sum f (P (sigma_i grad W)).v_w, with v_w of this step and of the one to come, of Coulomb faces apart; of
    /// those sum f (n.grad W) v_w and sum f n.grad W.
    template <class S> struct WallPower {
        S held, held_next, pressing, pressing_next;
        Vec3<S> carried, carried_next;
        S facing;
    };
    /// Work of walls a second, W, before and to come.
    struct Watts {
        U now, next;
    };
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
        const auto pruned = in.lists->pruned(cluster);
        const std::span<const Index> near(pruned.entries, std::size_t(pruned.n));
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
    KUZURE_INLINE static Vec3<V> velocity_of(const StepInput& in, const Cluster<V>& i)
    {
        const auto v = std::as_const(*in.particles)[field::velocity];
        const auto narrow = [&](int k) { return load_narrow<V>(v.column[k] + i.first); };
        return {narrow(0), narrow(1), narrow(2)};
    }
    /// In the hourglass control.
    KUZURE_INLINE V weight_of(const Cluster<V>& i) const
    {
        T w[W];
        for (int k = 0; k < W; ++k) w[k] = Below::affine_[i.first + std::min(k, i.count - 1)].weight;
        return load<V>(w);
    }
    KUZURE_INLINE static bool any(Vec3<V> a)
    {
        const V none(T(0)), most = max(max(abs(a.x), abs(a.y)), abs(a.z));
        return bits(less(none, most)) != 0;
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
        const Vec3<V> velocity = controls ? velocity_of(in, i) : Vec3<V>{};
        const V weight = controls ? weight_of(i) : V(T(0));
        const Vec3<V> shift = Below::shift_of(in, i, carries);
        const bool shifted = carries && any(shift);
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
                    if constexpr (M::corrected && !M::diffusive)
                        if (controls) e.q = w * (r2 / (r2 + softening));
                    if constexpr (M::diffusive) {
                        e.q = w * (r2 / (r2 + softening));
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
    [[gnu::noinline]] std::int64_t sum_wall_forces(const StepInput& in, const Cluster<V>& i, std::span<const Index> runs,
                                                   const Sym3<V>& sigma, ForceWalls<Wide>& out, WallPower<Wide>* power_out) const
    {
        const Vec3<V> velocity = velocity_of(in, i);
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
            const auto tau = lane_by_lane<Sym3, U>([&](int k) {
                const Tension<T>& t = tension_[lanes.particle(k)];
                return Stress{t.xx, t.yy, t.zz, t.xy, t.yz, t.xz};
            });
            stress = stress + per_rho * (tau * sums.closeness_grad + sums.art_stress_j);
        }
        std::apply([&](const auto&... term) { ((artificial = artificial + per_rho * term.force(sums)), ...); }, model_.more);
        if constexpr (M::corrected)
            if (Below::controls()) artificial = artificial + per_rho * hourglass(sums, lanes);
        if (M::diffusive || in.shifts) rate_of_stress(in, sums, sigma, soil, lanes);
        if (in.shifted) artificial = artificial + was[field::shift_acceleration].template load<U>(lanes.at);
        if (walled) {
            Watts watts{zero, zero};
            wall = wall_acceleration(in, wall_sums, lanes, U(volume_) * soil.rho0 / rho, rho, power, watts);
            if (power) {
                const U mass = U(volume_) * soil.rho0;
                Below::book_work_of_walls(in, lanes, mass * watts.now, mass * watts.next, tally.energy.wall, tally.later.wall, tally);
            }
        } else forget_contact(p, lanes);
        if (p.has(field::wall_force)) tell_of_walls(p, lanes, wall, walled);
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
    /// All that walls do to each lane; of viscosity the strain stage has left it.
    static void tell_of_walls(Particles& p, const Lanes& lanes, Vec3<U> wall, bool walled)
    {
        const auto told = p[field::wall_force];
        const Vec3<U> before = told.template load<U>(lanes.at);
        Vec3<U> all = wall;
        if constexpr (M::viscous)
            if (walled) all = before + wall;
        told.store(lanes.at, select(written<U>(lanes), all, before), lanes.n);
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
    /// Force of the hourglass control, Pa/m without the kernel's constant.
    KUZURE_INLINE Vec3<U> hourglass(const ForceSums<U>& sums, const Lanes& lanes) const
    {
        const auto of = [&](auto read) { return lane_by_lane<U>([&](int k) { return double(read(Below::affine_[lanes.particle(k)])); }); };
        using A = const Affine<T>&;
        const Vec3<U> half = U(0.5 * unit_) * sums.arm;
        const Vec3<U> x{of([](A a) { return a.xx; }), of([](A a) { return a.xy; }), of([](A a) { return a.xz; })};
        const Vec3<U> y{of([](A a) { return a.yx; }), of([](A a) { return a.yy; }), of([](A a) { return a.yz; })};
        const Vec3<U> z{of([](A a) { return a.zx; }), of([](A a) { return a.zy; }), of([](A a) { return a.zz; })};
        return U(2 * model_.hourglass.strength * h_ / unit_) * (sums.apart - Vec3<U>{dot(x, half), dot(y, half), dot(z, half)});
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
    /// Soil with no wall around has none of a contact before.
    static void forget_contact(Particles& p, const Lanes& lanes)
    {
        if (!p.has(field::wall_slip)) return;
        for (Index i = lanes.at; i < lanes.at + lanes.n; ++i) forget_contact(p, i);
    }
    static void forget_contact(Particles& p, Index i)
    {
        p[field::wall_slip].set(i, Vector{}), p[field::wall_pressure].set(i, 0.0), p[field::wall_friction].set(i, 0.0);
    }
    /// What walls do to each lane, m/s^2: the adjoint force, and Coulomb's friction, whose slip it moves on. `watts`: the power of walls
    /// that move, of a unit of mass.
    KUZURE_INLINE Vec3<U> wall_acceleration(const StepInput& in, const ForceWalls<Wide>& wall_sums, const Lanes& lanes, U volume, U rho,
                                            const WallPower<Wide>* wall_power, Watts& watts) const
    {
        const auto w = lanes_at<U, ForceWalls<U>, ForceWalls<Wide>, W>(wall_sums, lanes.first);
        const U scale = U(scale_) * volume / rho;
        auto& p = *in.particles;
        const U push_out = lane_by_lane<U>([&](int k) {
            const Material& m = in.soils[in.soils.size() == 1 ? 0 : std::as_const(p)[field::soil][lanes.particle(k)]];
            return hold_out(unit_ * lane(w.sunk, k), m.c_p, h_);
        });
        const Vec3<U> held = scale * w.held + push_out * w.out;
        WallPower<U> power{};
        if (wall_power) {
            power = lanes_at<U, WallPower<U>, WallPower<Wide>, W>(*wall_power, lanes.first);
            watts = {scale * power.held, scale * power.held_next};
        }
        if (!p.has(field::wall_slip)) return held;
        const auto slip = p[field::wall_slip];
        const auto pressure = p[field::wall_pressure];
        const auto limit = p[field::wall_friction];
        const auto v = std::as_const(p)[field::velocity];
        double out[3][width<U>] = {}, worked[2][width<U>] = {};
        const auto at = [&](U a, int k) { return lane(a, k); };
        for (int k = 0; k < lanes.n; ++k) {
            if (!(lanes.moving >> (lanes.first + k) & 1)) continue;
            const Index i = lanes.at + k;
            const double s = at(scale, k);
            const Vector push{s * at(w.pressing.x, k), s * at(w.pressing.y, k), s * at(w.pressing.z, k)};
            const Vector faces = s * Vector{at(w.area.x, k), at(w.area.y, k), at(w.area.z, k)};
            const double area = length(faces), held_by = s * at(w.limit, k);
            if (!(area > 0)) {
                forget_contact(p, i);
                continue;
            }
            // scale and grad W.n have opposite signs: the face is approached where their product with v.n is positive
            const bool pressed = held_by > 0, counts = pressed || s * at(w.approach, k) > 0;
            const Material& m = in.soils[in.soils.size() == 1 ? 0 : std::as_const(p)[field::soil][i]];
            const double presses = (counts ? held_by : 0) + at(push_out, k) * at(w.grip, k);
            const double most = limit[i] + lag(in.dt, m.c_p, h_).take * presses;
            // the faces' mean velocity
            Vector carried{}, carried_next{};
            if (wall_power && at(power.facing, k) != 0) {
                const double share = 1 / at(power.facing, k);
                carried = share * Vector{at(power.carried.x, k), at(power.carried.y, k), at(power.carried.z, k)};
                carried_next = share * Vector{at(power.carried_next.x, k), at(power.carried_next.y, k), at(power.carried_next.z, k)};
            }
            // a spring of the soil's own shear stiffness across half a smoothing length
            const Vector slides = v[i] - carried, normal = (1 / area) * faces;
            // rho (g/xi) v_t^2 on the faces' area
            const double drag =
                counts ? -s * at(w.dragging, k) * at(rho, k) * (dot(slides, slides) - dot(slides, normal) * dot(slides, normal)) : 0;
            const auto f = return_to_coulomb(slip[i], in.dt * slides, normal, most + drag, spring_stiffness(m.shear, area, h_));
            slip.set(i, f.slip), pressure.set(i, pressed ? length(push) : 0.0), limit.set(i, most);
            const Vector all = counts ? push + f.force : f.force;
            out[0][k] = all.x, out[1][k] = all.y, out[2][k] = all.z;
            if (!wall_power) continue;
            worked[0][k] = (counts ? s * at(power.pressing, k) : 0) + dot(f.force, carried);
            worked[1][k] = (counts ? s * at(power.pressing_next, k) : 0) + dot(f.force, carried_next);
        }
        if (wall_power) watts.now = watts.now + load<U>(worked[0]), watts.next = watts.next + load<U>(worked[1]);
        return held + Vec3<U>{load<U>(out[0]), load<U>(out[1]), load<U>(out[2])};
    }
};

} // namespace kuzure
