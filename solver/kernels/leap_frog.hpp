#pragma once
// Bui's leap-frog (2008): one pass a step. Half-step values advance by a whole kick; values at the step's end are predicted from
// them with half a step of the rates. With velocity and stress from one pass this is Adams-Bashforth 2. One file beyond 400 lines: it
// is one pass, the published method, and does not grow.
#include "solver/kernels/cluster_pass.hpp"
#include "solver/scene/scene.hpp"
#include "solver/walls/mirrored.hpp"

namespace kuzure {

/// What the walls add to the sums of a cluster, one number a lane.
template <int W> struct WallShare {
    double walled[wide_length<W>] = {}; // 1 for a particle that feels a wall
    double power[wide_length<W>] = {};  // taken by the walls, per unit of rho_i V_i/m_i
};

template <class M, class V> class LeapFrog final : public ClusterPass<M, V> {
    using Base = ClusterPass<M, V>;
    using Base::W, Base::unit_, Base::dimensions_, Base::h_, Base::volume_, Base::model_, Base::scale_, Base::fixed_, Base::water_;
    using typename Base::T, typename Base::U;

    /// sum V_j rho_i rho_j Pi approach grad W: the power that viscosity takes.
    struct ViscousPower {
        template <class S> struct Sums {
            S viscous_power;
        };
    };
    template <class S>
    using Sums = SumsOf<S, VelocityGradient, StressForce, ViscousPower, typename M::ArtificialStressTerm, typename M::DiffusionTerm,
                        typename M::CorrectionTerm>;
    using WideSums = Sums<WideLanes<W>>;

public:
    explicit LeapFrog(const scene::Interactions& s) : Base(s)
    {
        const std::size_t bytes = sizeof(Record<T>) + (M::tensile ? sizeof(Tension<T>) : 0);
        // Without terms: r 3, v 3, r.r 5, densities and softening 3, reciprocals 5, length 1, t 2, F and volume 8, grad W 3;
        // viscosity: approach 6, pressure 6, on the diagonal 3, power 3.
        // Update: scaled sums 9, force 27, rates 25, rotation 110, two strain increments 50, two returns to the cone 80, values 70.
        // Columns read 23 and written 21, one record read and one written, four bytes a list entry.
        stage_ = {"pass", bytes,
                  33 + (M::viscous ? 18.0 : 0.0) + VelocityGradient::flops + StressForce::flops + M::ArtificialStressTerm::flops +
                      M::DiffusionTerm::flops + M::CorrectionTerm::flops,
                  494, 44 * 8 + 2 * sizeof(Record<T>) + 4 * 120.0 / W};
    }
    std::string name() const override { return Base::lanes_name(); }
    std::span<const Stage> stages() const override { return {&stage_, 1}; }
    std::size_t record_bytes() const override { return 2 * stage_.ghost_bytes; }
    void require_fields(Particles& p, bool) const override { p.require(field::half_velocity, field::half_density, field::half_stress); }
    void start(Particles& p) const override
    {
        for (Index i = 0; i < p.size(); ++i) {
            p[field::half_velocity].set(i, p[field::velocity][i]);
            p[field::half_density].set(i, p[field::density][i]);
            p[field::half_stress].set(i, p[field::stress][i]);
        }
    }
    std::size_t bytes() const override
    {
        return (now_.capacity() + next_.capacity()) * sizeof(Record<T>) +
               (tension_.capacity() + next_tension_.capacity()) * sizeof(Tension<T>) + wall_bytes();
    }

    void make_records(const Particles& p, std::span<const Material> soils, std::span<const std::int32_t> ghost_soil) override
    {
        const Index n = p.size();
        const std::size_t count = std::size_t(n) + ghost_soil.size() + Particles::padding + 1;
        n_ = n;
        now_.resize(count), next_.resize(count);
        const bool sleepy = p.has(field::activity);
        if (M::tensile) tension_.resize(count), next_tension_.resize(count);
#pragma omp parallel for schedule(static)
        for (Index i = 0; i < n; ++i) {
            const Material& m = soils[p[field::soil][i]];
            const double rho = p[field::density][i];
            now_[i] = make_record<T>(fixed_, p[field::position][i], p[field::velocity][i], volume_ * m.density / rho, rho,
                                     p[field::stress][i], m.c_p);
            if (sleepy) now_[i].awake = T(p[field::activity][i] == std::int32_t(Activity::Moves) ? 1 : 0);
            if constexpr (M::tensile) tension_[i] = make_tension<T>(p[field::stress][i], model_.artificial_stress.epsilon);
        }
        Record<T> far = far_away<T, Record>();
        far.c_p = T(1);
        for (std::size_t k = n; k < count; ++k) {
            now_[k] = next_[k] = far;
            if (M::tensile) tension_[k] = next_tension_[k] = {};
        }
    }
    void set_walls(const Scene& scene, std::span<const WallPoints> points) override
    {
        walls_.resize(points.size());
        for (std::size_t w = 0; w < points.size(); ++w) {
            auto& to = walls_[w];
            const std::size_t n = points[w].x.size();
            to.wall = scene.walls[points[w].wall];
            to.x.resize(n), to.y.resize(n), to.z.resize(n);
            for (std::size_t k = 0; k < n; ++k)
                to.x[k] = fixed_(points[w].x[k]), to.y[k] = fixed_(points[w].y[k]), to.z[k] = fixed_(points[w].z[k]);
        }
    }
    void pack(int, Index owned, Vector shift, std::byte* to) const override
    {
        Record<T> r = now_[owned];
        r.x = fixed_.sum(r.x, fixed_(shift.x)), r.y = fixed_.sum(r.y, fixed_(shift.y)), r.z = fixed_.sum(r.z, fixed_(shift.z));
        std::memcpy(to, &r, sizeof r);
        if constexpr (M::tensile) std::memcpy(to + sizeof r, &tension_[owned], sizeof(Tension<T>));
    }
    void unpack(int, Index slot, const std::byte* from) override
    {
        std::memcpy(&now_[n_ + slot], from, sizeof(Record<T>));
        if constexpr (M::tensile) std::memcpy(&tension_[n_ + slot], from + sizeof(Record<T>), sizeof(Tension<T>));
    }
    void end_stage(int) override { now_.swap(next_), tension_.swap(next_tension_); }

    PassResult run(int, const StepInput& in, std::span<const Index> clusters) override
    {
        return Base::over(
            clusters, [&](Index c, Tally<U> & tally) __attribute__((always_inline)) { one_cluster(in, c, tally); });
    }

private:
    std::size_t wall_bytes() const
    {
        std::size_t b = 0;
        for (const auto& w : walls_) b += w.x.size() * 3 * sizeof(w.x[0]);
        return b;
    }

    KUZURE_INLINE void one_cluster(const StepInput& in, Index cluster, Tally<U>& tally)
    {
        Cluster<V> i = Base::cluster_at(in, cluster, tally);
        if (i.moving == 0) return copy_sleeping_records(in, cluster, i.first, i.count);
        const Record<T>* records = now_.data();
        Base::load_lanes(i, in, records, [&](Index k) { return records[k].c_p; });
        const auto near = Base::near(i, in, cluster, records);
        WideSums sums;
        // every particle meets itself once in its list
        tally.pairs += sum_over_soil(i, near, sums) - std::popcount(i.moving);
        unsigned awake = 0;
        if (in.sleep == SleepStage::Freeze) awake = awake_near(i, near, records, records, 2 * model_.kernel.h);
        WallShare<W> share;
        const auto walls = in.lists->walls(cluster);
        if (!walls.empty()) tally.pairs += sum_over_walls(in, i, walls, sums, share);
        Base::for_each_register(
            i, [&](const Lanes& lanes) __attribute__((always_inline)) { update(in, sums, share, lanes, awake, tally); });
    }

    /// The records of a cluster that sleeps as a whole; its list is pruned when it wakes.
    void copy_sleeping_records(const StepInput& in, Index cluster, Index first, int count)
    {
        std::copy_n(now_.data() + first, count, next_.data() + first);
        if constexpr (M::tensile) std::copy_n(tension_.data() + first, count, next_tension_.data() + first);
        if (in.prune) in.lists->pruned(cluster).n = -1;
    }

    /// Adds the pairs with soil; returns those inside the support. Entries of the list beyond it add exact zeros.
    KUZURE_INLINE std::int64_t sum_over_soil(const Cluster<V>& i, std::span<const Index> near, WideSums& out) const
    {
        const Record<T>* records = now_.data();
        const auto at = Base::lengths();
        const V support = at.support, support2 = at.support2, softening = at.softening, tiny = at.tiny, zero(T(0)), one(T(1));
        const bool tension = Base::in_tension(i, tension_);
        Batch<V> batch;
        Sums<V> sums{};
        V inside = zero;
        Base::for_each_batch(
            near, batch, [&]() __attribute__((always_inline)) {
                // ---- geometry: gradient of W, approach, viscosity
                for (int k = 0; k < batch.size; ++k) {
                    const Record<T>& j = records[batch.neighbour[k]];
                    Entry<V>& e = batch.at[k];
                    const Vec3<V> r = i.position.minus(j);
                    const Vec3<V> v{j.vx - i.v.x, j.vy - i.v.y, j.vz - i.v.z};
                    const V r2 = max(dot(r, r), tiny);
                    inside = inside + select(less(r2, support2), one, zero);
                    const V rho_sum = i.rho + j.density;
                    const auto inv = roots<M::Kernel::divides>(r2, (r2 + softening) * rho_sum);
                    const V t = max(support - inv.root, zero);
                    const V w = model_.kernel.F(t, inv.root, inv.inverse_root) * j.volume;
                    e.grad = w * r;
                    e.v = v;
                    if constexpr (M::viscous) {
                        // rho_i rho_j Pi > 0 where the two approach
                        const V approach = max(dot(v, r), zero);
                        const Pair<V> pair{approach, inv.inverse, rho_sum, i.rho, V(j.density), i.c, V(j.c_p)};
                        e.rho2_Pi = model_.viscosity(pair);
                        sums.viscous_power = fma(e.rho2_Pi * w, approach, sums.viscous_power);
                    }
                    if constexpr (M::tensile) e.t = t;
                    if constexpr (M::diffusive) {
                        e.q = w * (r2 * (inv.inverse * rho_sum));
                        const Vector g = model_.stress_diffusion.gravity;
                        e.along = dot(Vec3<V>{V(T(g.x)), V(T(g.y)), V(T(g.z))}, r);
                    }
                    if constexpr (M::corrected) e.r = r;
                }
                VelocityGradient{}.add(sums, batch);
                // rho_i dv/dt = sum_j V_j [ sigma_i + sigma_j - rho_i rho_j Pi + f^n (tau_i + tau_j) ] . grad W
                StressForce{}.add(
                    sums, batch, records, [](Sym3<V> s, const Entry<V>& e) __attribute__((always_inline)) {
                        if constexpr (M::viscous) return plus_isotropic(s, -e.rho2_Pi);
                        else return s;
                    });
                if constexpr (M::tensile) model_.artificial_stress.add(sums, batch, tension_.data(), tension, 0);
                if constexpr (M::diffusive) model_.stress_diffusion.add(sums, batch, records);
                if constexpr (M::corrected) model_.correction.add(sums, batch);
            });
        widen<V>(sums, out);
        return Base::counted(i, inside);
    }

    /// Adds the walls' share to the sums of a cluster; returns the pairs inside the support.
    [[gnu::noinline]] std::int64_t sum_over_walls(const StepInput& in, const Cluster<V>& i, std::span<const Index> runs, WideSums& out,
                                                  WallShare<W>& share) const
    {
        const Mirrored law;
        const auto [support, support2, softening, tiny] = Base::lengths();
        const V zero(T(0));
        std::int64_t pairs = 0;
        while (!runs.empty()) {
            const Index number = runs[0];
            const MirroredWall<T>& wall = walls_[number];
            const auto list = runs.subspan(2, runs[1]);
            runs = runs.subspan(2 + runs[1]);
            const Contacts at = contacts_with(wall.wall, in, i);
            Vec3<V> G{zero, zero, zero}, B = G, P = G;
            for (const Index point : list) {
                const Vec3<V> r = i.position.minus(wall.x[point], wall.y[point], wall.z[point]);
                const V r2_exact = dot(r, r), r2 = max(r2_exact, tiny);
                const unsigned hits = bits(less(r2_exact, support2)) & i.owned;
                if (!hits) continue;
                pairs += std::popcount(hits & i.moving);
                const V rho_sum = i.rho + i.rho;
                const auto inv = roots<M::Kernel::divides>(r2, (r2 + softening) * rho_sum);
                const V w = model_.kernel.F(max(support - inv.root, zero), inv.root, inv.inverse_root);
                const Vec3<V> g = w * r;
                const V factor = law.factor(WallPoint<V>{r, number, point}, at.wall);
                G = G + g;
                B = fma(factor, g, B);
                if constexpr (M::viscous) {
                    const V approach = max(-(factor * dot(at.colliding, r)), zero);
                    const V pressure = model_.viscosity(Pair<V>{approach, inv.inverse, rho_sum, i.rho, i.rho, i.c, i.c});
                    P = fma(pressure, g, P);
                }
            }
            double sums[9][W];
            const V* members[] = {&G.x, &G.y, &G.z, &B.x, &B.y, &B.z, &P.x, &P.y, &P.z};
            for (int k = 0; k < 9; ++k) store_wide(sums[k], *members[k]);
            for (int k = 0; k < i.count; ++k) {
                const auto of = [&](int first) {
                    return Vector{volume_ * sums[first][k], volume_ * sums[first + 1][k], volume_ * sums[first + 2][k]};
                };
                feel_wall(wall.wall, in, i.first + k, at.contact[k], of(0), of(3), of(6), k, out, share);
            }
        }
        return pairs;
    }
    /// How the lanes of a cluster touch one wall.
    struct Contacts {
        WallContact contact[W];
        AtWall<V> wall;
        Vec3<V> colliding;
    };
    KUZURE_INLINE Contacts contacts_with(const scene::Wall& wall, const StepInput& in, const Cluster<V>& i) const
    {
        const auto& p = std::as_const(*in.particles);
        Contacts of;
        T normal[3][W], colliding[3][W], inverse_distance[W];
        for (int k = 0; k < W; ++k) {
            const Index at = i.first + std::min(k, i.count - 1);
            const auto& c = of.contact[k] =
                wall_contact(wall, p[field::position][at], p[field::velocity][at], p[field::stress][at], dimensions_);
            normal[0][k] = T(c.normal.x), normal[1][k] = T(c.normal.y), normal[2][k] = T(c.normal.z);
            colliding[0][k] = T(c.colliding.x), colliding[1][k] = T(c.colliding.y), colliding[2][k] = T(c.colliding.z);
            // at or below the surface the factor is at its cap
            inverse_distance[k] = T(c.distance > 1e-9 * unit_ ? unit_ / c.distance : 1e9);
        }
        of.wall = {{load<V>(normal[0]), load<V>(normal[1]), load<V>(normal[2])}, load<V>(inverse_distance)};
        of.colliding = {load<V>(colliding[0]), load<V>(colliding[1]), load<V>(colliding[2])};
        return of;
    }
    /// What one wall does to the particle `at`, lane k: from its sums of grad W, of factors times grad W, of viscous pressures.
    void feel_wall(const scene::Wall& wall, const StepInput& in, Index at, const WallContact& c, Vector g, Vector b, Vector q, int k,
                   WideSums& out, WallShare<W>& share) const
    {
        const auto& p = std::as_const(*in.particles);
        Vector force = 2.0 * (c.stress * g) - q, mirrored = c.mirrored;
        if (wall.surface == scene::Surface::Coulomb) {
            // scale, the kernel's constant, is negative: the force on the particle points along scale * force
            const Vector slip = mirrored - c.colliding;
            const double impedance = p[field::density][at] * now_[at].c_p * length(scale_ * g);
            const auto limited = limit_to_friction(scale_ * force, c.normal, wall.friction_angle, slip, impedance);
            force = (1 / scale_) * limited.force;
            mirrored = c.colliding + limited.drag * slip;
            if (limited.pulls) b = {};
        }
        add_wall(out, k, force, mirrored, b);
        if (g.x != 0 || g.y != 0 || g.z != 0) share.walled[k] = 1;
        // taken by the wall per unit of rho_i V_i/m_i: -(v.f + sigma : L_wall); viscous: v.q
        const Vector sb = p[field::stress][at] * b;
        const double stress_power = -(mirrored.x * sb.x + mirrored.y * sb.y + mirrored.z * sb.z);
        share.power[k] -= scale_ * (dot(p[field::velocity][at], force) + stress_power);
    }
    /// The force of one wall and its share of the velocity gradient, -v (x) b, to lane k.
    static void add_wall(WideSums& out, int k, Vector force, Vector v, Vector b)
    {
        out.force.x.at[k] += force.x, out.force.y.at[k] += force.y, out.force.z.at[k] += force.z;
        const auto add = [&](Vec3<WideLanes<W>>& L, double vk) {
            L.x.at[k] = fma(vk, b.x, L.x.at[k]), L.y.at[k] = fma(vk, b.y, L.y.at[k]), L.z.at[k] = fma(vk, b.z, L.z.at[k]);
        };
        add(out.grad_v.x, -v.x), add(out.grad_v.y, -v.y), add(out.grad_v.z, -v.z);
    }

    // ---- the update ----
    struct Before { // the state that the step starts from
        Vec3<U> v;
        Sym3<U> sigma;
        U rho;
    };
    struct Rates {
        Vec3<U> a;
        Mat3<U> L;
        Sym3<U> D, diffusion; // 1/s; stress rate of the diffusion, Pa/s
        U rho_rate;
        U diffused{0.0}, stressed{0.0}; // power of stress diffusion and artificial stress, W/m^3
    };
    struct After { // half-step values _h, and those at the step's end
        Vec3<U> x, v_h, v;
        U rho_h, rho;
        ReturnMapping<U> h;
        Sym3<U> sigma;
    };

    /// The constitutive law and the leap-frog of some lanes.
    KUZURE_INLINE void update(const StepInput& in, const WideSums& wide, const WallShare<W>& share, const Lanes& lanes, unsigned awake,
                              Tally<U>& tally)
    {
        auto& p = *in.particles;
        const auto sums = lanes_at<U, Sums<U>, WideSums, W>(wide, lanes.first);
        LaneSoil<U> soil = soil_of<U>(in.soils, std::as_const(p)[field::soil].column[0], lanes);
        const Before now{p[field::velocity].template load<U>(lanes.at), p[field::stress].template load<U>(lanes.at),
                         p[field::density].template load<U>(lanes.at)};
        const Rates rate = rates(in, sums, share, lanes, now, soil);
        After next = kicked(in, lanes, rate, soil.law);
        predict(in, lanes, rate, soil.law, next);
        const auto mine = written<U>(lanes);
        if (in.sleep == SleepStage::Frozen) keep_sleepers(in, lanes, mine, now, next);
        write_state(in, lanes, next);
        write_records(lanes, soil, next);
        if (in.sleep == SleepStage::Detect || in.sleep == SleepStage::Freeze) detect(in, lanes, rate.a, next.v, awake);
        report(in, sums, share, lanes, mine, now, rate, soil, next, tally);
    }

    KUZURE_INLINE Rates rates(const StepInput& in, const Sums<U>& sums, const WallShare<W>& share, const Lanes& lanes, const Before& now,
                              LaneSoil<U>& soil) const
    {
        const auto& p = std::as_const(*in.particles);
        const U one(1.0), zero(0.0), factor(scale_);
        Rates r;
        r.L = {factor * sums.grad_v.x, factor * sums.grad_v.y, factor * sums.grad_v.z};
        Vec3<U> f = sums.force + now.sigma * sums.grad_one;
        if constexpr (M::tensile) {
            const auto tau = lane_by_lane<Sym3, U>([&](int k) {
                const Tension<T>& t = tension_[lanes.particle(k)];
                return Stress{t.xx, t.yy, t.zz, t.xy, t.yz, t.xz};
            });
            const Vec3<U> artificial = tau * sums.closeness_grad + sums.art_stress_j;
            f = f + artificial;
            r.stressed = factor * dot(now.v, artificial);
        }
        if constexpr (M::corrected)
            if (model_.correct) {
                const U to_m = U(-unit_) * factor; // the sums hold r = x_i - x_j in `unit`
                const Sym3<U> correction =
                    GradientCorrection::inverse(to_m * sums.moment, dimensions_, one - load<U>(share.walled + lanes.first)).K;
                r.L = {correction * r.L.x, correction * r.L.y, correction * r.L.z};
            }
        const auto material = [&](int k) -> const Material& {
            return in.soils[in.soils.size() == 1 ? 0 : p[field::soil][lanes.particle(k)]];
        };
        r.diffusion = {zero, zero, zero, zero, zero, zero};
        if constexpr (M::diffusive) {
            const U speed = lane_by_lane<U>([&](int k) { return material(k).c_bar; });
            const U K0 = lane_by_lane<U>([&](int k) { return material(k).K0; });
            const U strength = U(2 * model_.stress_diffusion.zeta * h_ * scale_ / unit_) * speed;
            r.diffusion = model_.stress_diffusion.rate(sums, now.sigma, soil.rho0, K0, strength, U(unit_));
            // sigma : C^-1 : D = s : dev(D)/(2 G) + I1 tr(D)/(9 K)
            const Sym3<U> s = deviator(now.sigma);
            r.diffused = contract(s, r.diffusion) / (soil.law.shear + soil.law.shear) +
                         trace(now.sigma) * trace(r.diffusion) / (U(9.0) * soil.law.bulk);
        }
        // dv/dt = f/rho + g - mu_d v
        const Vec3<U> body = body_acceleration(in.forces, water_, p[field::position], soil.rho0, lanes);
        const U mu_d(in.forces.damping), inverse_rho = one / now.rho;
        r.a = {fnma(mu_d, now.v.x, fma(factor * inverse_rho, f.x, body.x)), fnma(mu_d, now.v.y, fma(factor * inverse_rho, f.y, body.y)),
               fnma(mu_d, now.v.z, fma(factor * inverse_rho, f.z, body.z))};
        // drho/dt = -rho tr L
        r.rho_rate = -(now.rho * trace(r.L));
        r.D = symmetric_part(r.L);
        if (in.evolving)
            soil.law = cone_of_now(soil.law, in.soils, p[field::soil].column[0], lanes, h_,
                                   p[field::plastic_strain].template load<U>(lanes.at), r.D, now.sigma);
        return r;
    }
    /// Half-step values: one whole kick. The stress rotates with the material, then the strain loads it.
    KUZURE_INLINE After kicked(const StepInput& in, const Lanes& lanes, const Rates& r, const Elastoplastic<U>& soil) const
    {
        const auto& p = std::as_const(*in.particles);
        const U kick(in.kick), half(0.5);
        After a;
        a.v_h = fma(kick, r.a, p[field::half_velocity].template load<U>(lanes.at));
        // half before the turn and half after: second order in time
        const Sym3<U> loading = half * (hooke(kick * r.D, soil) + kick * r.diffusion);
        const Sym3<U> sigma_h = p[field::half_stress].template load<U>(lanes.at);
        const U opened = in.remembering ? p[field::opened_volume].template load<U>(lanes.at) : U(0.0);
        a.h = return_to_cone(rotate(spin_increment(r.L, kick), sigma_h + loading) + loading, soil, opened);
        const U rho = p[field::density].template load<U>(lanes.at); // the soil between the gaps keeps its density
        a.rho_h = fma(rho, a.h.opened - opened, fma(kick, r.rho_rate, p[field::half_density].template load<U>(lanes.at)));
        return a;
    }
    /// Values at the end of the step: half a step on from there.
    KUZURE_INLINE void predict(const StepInput& in, const Lanes& lanes, const Rates& r, const Elastoplastic<U>& soil, After& a) const
    {
        const U dt(in.dt), half_dt = U(0.5) * dt;
        a.x = fma(dt, a.v_h, std::as_const(*in.particles)[field::position].template load<U>(lanes.at));
        a.v = fma(half_dt, r.a, a.v_h);
        const auto predicted =
            return_to_cone(a.h.sigma + spin(spin_increment(r.L, half_dt), a.h.sigma) + hooke(half_dt * r.D, soil) + half_dt * r.diffusion,
                           soil, a.h.opened);
        a.sigma = predicted.sigma;
        const U rho = std::as_const(*in.particles)[field::density].template load<U>(lanes.at);
        a.rho = fma(rho, predicted.opened - a.h.opened, fma(half_dt, r.rho_rate, a.rho_h));
    }
    template <class Mine>
    KUZURE_INLINE void keep_sleepers(const StepInput& in, const Lanes& lanes, Mine mine, const Before& now, After& a) const
    {
        const auto& p = std::as_const(*in.particles);
        a.x = select(mine, a.x, p[field::position].template load<U>(lanes.at));
        a.v_h = select(mine, a.v_h, p[field::half_velocity].template load<U>(lanes.at)), a.v = select(mine, a.v, now.v);
        a.rho_h = select(mine, a.rho_h, p[field::half_density].template load<U>(lanes.at)), a.rho = select(mine, a.rho, now.rho);
        a.h.sigma = select(mine, a.h.sigma, p[field::half_stress].template load<U>(lanes.at)), a.sigma = select(mine, a.sigma, now.sigma);
        a.h.d_lambda = select(mine, a.h.d_lambda, U(0.0));
        if (in.remembering) a.h.opened = select(mine, a.h.opened, p[field::opened_volume].template load<U>(lanes.at));
    }
    KUZURE_INLINE void write_state(const StepInput& in, const Lanes& lanes, const After& a) const
    {
        auto& p = *in.particles;
        const Index at = lanes.at;
        const int n = lanes.n;
        p[field::position].store(at, a.x, n);
        p[field::half_velocity].store(at, a.v_h, n), p[field::velocity].store(at, a.v, n);
        p[field::half_density].store(at, a.rho_h, n), p[field::density].store(at, a.rho, n);
        p[field::half_stress].store(at, a.h.sigma, n), p[field::stress].store(at, a.sigma, n);
        const auto plastic = p[field::plastic_strain];
        plastic.store(at, plastic.template load<U>(at) + a.h.d_lambda, n);
        if (in.remembering) p[field::opened_volume].store(at, a.h.opened, n);
    }
    /// Records for the next step's pairs.
    KUZURE_INLINE void write_records(const Lanes& lanes, const LaneSoil<U>& soil, const After& a)
    {
        const U volume = U(volume_) * soil.rho0 / a.rho;
        double fields[14][width<U>];
        const U columns[14] = {a.x.x, a.x.y,      a.x.z,      a.v.x,      a.v.y,      a.v.z,      volume,
                               a.rho, a.sigma.xx, a.sigma.yy, a.sigma.zz, a.sigma.xy, a.sigma.yz, a.sigma.xz};
        for (int k = 0; k < 14; ++k) store(fields[k], columns[k]);
        for (int k = 0; k < lanes.n; ++k) {
            Record<T>& r = next_[lanes.at + k];
            r.x = fixed_(fields[0][k]), r.y = fixed_(fields[1][k]), r.z = fixed_(fields[2][k]);
            r.vx = T(fields[3][k]), r.vy = T(fields[4][k]), r.vz = T(fields[5][k]);
            r.volume = T(fields[6][k]), r.density = T(fields[7][k]);
            r.xx = T(fields[8][k]), r.yy = T(fields[9][k]), r.zz = T(fields[10][k]);
            r.xy = T(fields[11][k]), r.yz = T(fields[12][k]), r.xz = T(fields[13][k]);
            r.c_p = T(lane(soil.c, k)), r.awake = T(0);
            if constexpr (M::tensile)
                next_tension_[lanes.at + k] =
                    make_tension<T>(Stress{fields[8][k], fields[9][k], fields[10][k], fields[11][k], fields[12][k], fields[13][k]},
                                    model_.artificial_stress.epsilon);
        }
    }
    KUZURE_INLINE void detect(const StepInput& in, const Lanes& lanes, Vec3<U> a, Vec3<U> v, unsigned awake)
    {
        Base::detect_calm(in, lanes, a, v, awake);
        const auto activity = std::as_const(*in.particles)[field::activity];
        for (int k = 0; k < lanes.n; ++k) next_[lanes.at + k].awake = T(activity[lanes.at + k] == std::int32_t(Activity::Moves));
    }
    /// Energies, exact sums of rounded addends, and maxima; both over the lanes that moved.
    template <class Mine>
    KUZURE_INLINE void report(const StepInput& in, const Sums<U>& sums, const WallShare<W>& share, const Lanes& lanes, Mine mine,
                              const Before& now, const Rates& r, const LaneSoil<U>& soil, const After& a, Tally<U>& tally) const
    {
        const auto& p = std::as_const(*in.particles);
        const U one(1.0), half(0.5), zero(0.0), magic(magic_of(in.energy_unit)), kick(in.kick), factor(scale_), mu_d(in.forces.damping);
        const U inverse_rho = one / now.rho;
        const U volume = U(volume_) * soil.rho0 * inverse_rho;
        // viscous power of i's half of its pairs: V_i/2 sum_j V_j rho_i rho_j Pi approach |grad W|/r
        // artificial stress takes -V v.f, stress diffusion -V sigma : C^-1 : D
        const U viscous = quantized(volume * (half * (-factor) * sums.viscous_power) * kick, magic);
        const U worked = quantized(volume * a.h.plastic_work, magic);
        const U damped = quantized(volume * now.rho * mu_d * dot(now.v, now.v) * kick, magic);
        const U walled = quantized(volume * load<U>(share.power + lanes.first) * kick, magic);
        tally.energy.plastic += select(mine, worked, zero);
        tally.energy.viscous += select(mine, viscous, zero);
        tally.energy.damping += select(mine, damped, zero);
        if constexpr (M::tensile || M::diffusive)
            tally.energy.stabilising -= select(mine, quantized(volume * (r.diffused + r.stressed) * kick, magic), zero);
        tally.energy.wall += select(mine, walled, zero);
        const Vec3<U> frame{U(in.frame.x), U(in.frame.y), U(in.frame.z)}, flown{U(in.frame_way.x), U(in.frame_way.y), U(in.frame_way.z)};
        const Vec3<U> moved = (a.x - p[field::sorted_position].template load<U>(lanes.at)) - flown, drift = a.v_h - frame;
        const auto meet = [&](U& most, U value) { most = max(select(mine, value, zero), most); };
        meet(tally.maxima.acceleration2, dot(r.a, r.a));
        meet(tally.maxima.displacement2, dot(moved, moved));
        meet(tally.maxima.speed2, dot(a.v, a.v));
        meet(tally.maxima.half_step_speed2, dot(drift, drift));
        meet(tally.maxima.density_ratio, max(a.rho / soil.rho0, soil.rho0 / a.rho));
        meet(tally.maxima.signal, fma(U(h_), sqrt(contract(r.D, r.D)), soil.c));
        const U finite = fma(zero, dot(r.a, r.a), fma(zero, dot(a.v, a.v), fma(zero, trace(a.sigma), zero * a.rho)));
        tally.poison += select(mine, finite, zero);
        if (in.low) {
            double x[3][16];
            store(x[0], a.x.x), store(x[1], a.x.y), store(x[2], a.x.z);
            if (any_outside(in, x, lanes.n)) tally.maxima.outside = one;
        }
    }

    Stage stage_;
    std::vector<MirroredWall<T>> walls_;
    Index n_ = 0;
    Array<Record<T>> now_, next_;
    Array<Tension<T>> tension_, next_tension_;
};

} // namespace kuzure
