#pragma once
// The staggered leap-frog: two passes a step, stable to dt c_p/h of about 1.8 where one pass ends at 0.3. Between steps the state is
// that of time t^n: x, v, sigma, rho, and the acceleration a^n. A step of length dt is
//
//     v^{n+1/2} = v^n + dt/2 a^n,  x^{n+1} = x^n + dt v^{n+1/2}                                       move
//     L = grad v^{n+1/2} at the places of mid-step; rho, sigma -> n+1; viscous force                  stage 0, "strain"
//     a^{n+1} from sigma^{n+1} at x^{n+1} and that viscous force;  v^{n+1} = v^{n+1/2} + dt/2 a^{n+1}  stage 1, "force"
//
// The geometry of L must be that of mid-step: at x^{n+1} it makes an energy error of (dt/2) sigma : L.L, first order. A stage reads of
// neighbours only what the other one wrote, strain the kinematics and force the stresses beside positions, so no record is
// buffered twice. The work of a force between t^n and t^{n+1} is (F^n + F^{n+1})/2 . v^{n+1/2} dt: the half of F^n that comes after
// t^n is booked as `later`, with the length of the step to come, which is decided one step ahead.
#include "solver/kernels/cluster_pass.hpp"
#include "solver/scene/scene.hpp"
#include "solver/walls/adjoint.hpp"
#include "solver/walls/friction.hpp"

namespace kuzure {

/// Where a particle is and how it moves: x [m or units of h/2^20], v [m/s], volume [m^3], rho [kg/m^3].
template <class T> struct alignas(8 * sizeof(T)) Kinematics {
    Coordinate<T> x, y, z;
    T vx, vy, vz;
    T volume, density;
};
/// What pushes its neighbours: sigma [Pa], volume [m^3]; awake as in Record.
template <class T> struct alignas(8 * sizeof(T)) Stresses {
    T xx, yy, zz, xy, yz, xz;
    T volume, awake;
};
static_assert(sizeof(Kinematics<double>) == 64 && sizeof(Stresses<float>) == 32);

/// sum V_j rho_i rho_j Pi grad W: the force of viscosity, against the particle's.
struct ViscousForce {
    template <class V> struct Sums {
        Vec3<V> viscous;
    };
    static constexpr double flops = 6;
    template <class V> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch) const
    {
        for (int k = 0; k < batch.size; ++k) to.viscous = fma(batch.at[k].rho2_Pi, batch.at[k].grad, to.viscous);
    }
};
struct NoViscousForce {
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&) const {}
};

template <class M, class V> class Staggered final : public ClusterPass<M, V> {
    using Base = ClusterPass<M, V>;
    using Base::W, Base::unit_, Base::dimensions_, Base::h_, Base::volume_, Base::model_, Base::scale_, Base::place_, Base::water_;
    using typename Base::T, typename Base::U;
    using Viscous = std::conditional_t<M::viscous, ViscousForce, NoViscousForce>;

    /// What walls add to the sums of a cluster in each stage; sums over wall points j of volume 1, f_ij the mirror factor.
    struct WallStrain {
        template <class S> struct Sums {
            Mat3<S> mirrored, sliding; // sum f (P v_i) (x) grad W; of Coulomb faces apart
            Vec3<S> viscous;           // sum rho_i rho_j Pi P grad W
            S walled;                  // not zero for a particle that feels a wall
        };
    };
    struct WallForce {
        template <class S> struct Sums {
            Vec3<S> held, pressing; // sum f P (sigma_i grad W); of Coulomb faces apart
            S limit;                // sum f tan(delta) n.(sigma_i grad W)
            S approach;             // sum f (n.v_i)(n.grad W) of Coulomb faces
            S area;                 // sum f n.grad W of Coulomb faces
        };
    };
    template <class S> using StrainSums = SumsOf<S, VelocityGradient, Viscous, typename M::CorrectionTerm>;
    template <class S> using ForceSums = SumsOf<S, StressForce, typename M::ArtificialStressTerm, typename M::DiffusionTerm>;
    template <class S> using StrainWalls = WallStrain::template Sums<S>;
    template <class S> using ForceWalls = WallForce::template Sums<S>;
    using Lane = Row<W>;

public:
    explicit Staggered(const scene::Interactions& s) : Base(s)
    {
        // Geometry of strain: r and its half step 9, v 3, r.r 5, densities and softening 3, reciprocals 5, length 1, t 2, shape and
        // volume 8, grad W 3; viscosity: approach 6, pressure 6. Of force: r 3, r.r 5, reciprocal 1, length 1, t 2, shape and volume 8,
        // grad W 3. Updates: strain: scaled sums 12, rotation 110, increments 40, return to the cone 40, energies 60; force: 60.
        stages_[0] = {"strain", sizeof(Kinematics<T>),
                      39 + (M::viscous ? 12.0 : 0.0) + VelocityGradient::flops + Viscous::flops + M::CorrectionTerm::flops, 262,
                      23 * 8 + sizeof(Kinematics<T>) + sizeof(Stresses<T>) + 4 * 120.0 / W};
        stages_[1] = {"force", sizeof(Stresses<T>) + (M::tensile ? sizeof(Tension<T>) : 0),
                      23 + StressForce::flops + M::ArtificialStressTerm::flops + M::DiffusionTerm::flops, 60,
                      25 * 8 + sizeof(Kinematics<T>) + sizeof(Stresses<T>) + 4 * 120.0 / W};
    }
    std::string name() const override { return "staggered, " + Base::lanes_name(); }
    std::span<const Stage> stages() const override { return stages_; }
    bool moves_first() const override { return true; }
    std::size_t record_bytes() const override { return stages_[0].row_bytes + stages_[1].row_bytes; }
    void require_fields(Particles& p, bool coulomb) const override
    {
        p.require(field::acceleration);
        if (M::diffusive) p.require(field::stress_rate);
        if (coulomb) p.require(field::wall_slip, field::wall_pressure);
    }
    void start(Particles&) const override {}
    std::size_t bytes() const override
    {
        return kinematics_.capacity() * sizeof(Kinematics<T>) + stresses_.capacity() * sizeof(Stresses<T>) +
               tension_.capacity() * sizeof(Tension<T>) + speed_.capacity() * sizeof(T) + wall_bytes();
    }

    void make_records(const Particles& p, std::span<const Material> soils, std::span<const std::int32_t> ghost_soil) override
    {
        const Index n = n_ = p.size();
        const std::size_t count = std::size_t(n) + ghost_soil.size() + Particles::padding + 1;
        kinematics_.resize(count), stresses_.resize(count);
        if (M::tensile) tension_.resize(count);
        if (soils.size() > 1) speed_.resize(count);
        const bool sleepy = p.has(field::activity);
#pragma omp parallel for schedule(static)
        for (Index i = 0; i < n; ++i) {
            const Material& m = soils[p[field::soil][i]];
            const Vector x = p[field::position][i], v = p[field::velocity][i];
            const Stress s = p[field::stress][i];
            const double rho = p[field::density][i], volume = volume_ * m.density / rho;
            kinematics_[i] = {place_(x.x), place_(x.y), place_(x.z), T(v.x), T(v.y), T(v.z), T(volume), T(rho)};
            const bool awake = sleepy && p[field::activity][i] == std::int32_t(Activity::Moves);
            stresses_[i] = {T(s.xx), T(s.yy), T(s.zz), T(s.xy), T(s.yz), T(s.xz), T(volume), T(awake)};
            if constexpr (M::tensile) tension_[i] = make_tension<T>(s, model_.artificial_stress.epsilon);
        }
        for (std::size_t k = n; k < count; ++k) {
            kinematics_[k] = far_away<T, Kinematics>();
            stresses_[k] = {};
            if (M::tensile) tension_[k] = {};
        }
        if (soils.size() > 1) {
            for (Index i = 0; i < n; ++i) speed_[i] = T(soils[p[field::soil][i]].sound_speed);
            for (std::size_t k = 0; k < ghost_soil.size(); ++k) speed_[n + k] = T(soils[ghost_soil[k]].sound_speed);
            std::fill(speed_.begin() + n + ghost_soil.size(), speed_.end(), T(1));
        }
    }
    void place_walls(const Scene& scene, std::span<const WallPoints> points) override
    {
        const WallSurface surface(scene);
        walls_.assign(points.size(), {});
        for (std::size_t w = 0; w < points.size(); ++w) {
            auto& to = walls_[w];
            const Index n = Index(points[w].x.size());
            to.x.resize(n), to.y.resize(n), to.z.resize(n), to.first.assign(std::size_t(n) + 1, 0);
            std::vector<std::vector<Face>> found(n);
#pragma omp parallel for schedule(dynamic, 256)
            for (Index k = 0; k < n; ++k) {
                to.x[k] = place_(points[w].x[k]), to.y[k] = place_(points[w].y[k]), to.z[k] = place_(points[w].z[k]);
                surface.faces({points[w].x[k], points[w].y[k], points[w].z[k]}, 2 * h_, found[k]);
            }
            for (Index k = 0; k < n; ++k) {
                for (const Face& f : found[k]) {
                    const scene::Wall& wall = scene.walls[f.wall];
                    const bool coulomb = wall.surface == scene::Surface::Coulomb;
                    to.faces.push_back({T(f.normal.x), T(f.normal.y), T(f.normal.z), T(f.depth / unit_),
                                        T(wall.surface == scene::Surface::Rough), T(coulomb),
                                        T(coulomb ? std::tan(wall.friction_angle) : 0), T(0)});
                }
                to.first[k + 1] = Index(to.faces.size());
                if (to.first[k + 1] > to.first[k]) to.faces.back().last = T(1);
            }
        }
    }
    void pack(int stage, Index owned, Vector shift, std::byte* to) const override
    {
        if (stage == 0) {
            Kinematics<T> r = kinematics_[owned];
            r.x = place_.sum(r.x, place_(shift.x)), r.y = place_.sum(r.y, place_(shift.y)), r.z = place_.sum(r.z, place_(shift.z));
            std::memcpy(to, &r, sizeof r);
            return;
        }
        std::memcpy(to, &stresses_[owned], sizeof(Stresses<T>));
        if constexpr (M::tensile) std::memcpy(to + sizeof(Stresses<T>), &tension_[owned], sizeof(Tension<T>));
    }
    void unpack(int stage, Index slot, const std::byte* from) override
    {
        if (stage == 0) {
            std::memcpy(&kinematics_[n_ + slot], from, sizeof(Kinematics<T>));
            return;
        }
        std::memcpy(&stresses_[n_ + slot], from, sizeof(Stresses<T>));
        if constexpr (M::tensile) std::memcpy(&tension_[n_ + slot], from + sizeof(Stresses<T>), sizeof(Tension<T>));
    }
    void end_stage(int) override {}

    /// Half a kick and the whole way of a step, and the kinematics for its strain.
    void move(const StepInput& in) override
    {
        auto& p = *in.particles;
        const Index n = p.size();
        const U dt(in.dt), half_dt = U(0.5) * dt;
        const auto x = p[field::position], v = p[field::velocity];
        const auto a = std::as_const(p)[field::acceleration];
        const auto rho = std::as_const(p)[field::density];
        const auto soil = std::as_const(p)[field::soil];
        const std::int32_t* activity = in.sleep == SleepStage::Frozen ? std::as_const(p)[field::activity].column[0] : nullptr;
        const bool built = Index(kinematics_.size()) > n; // else the lists come next, and the records with them
#pragma omp parallel for schedule(static)
        for (Index at = 0; at < n; at += width<U>) {
            const int lanes = std::min<Index>(width<U>, n - at);
            const Vec3<U> x0 = x.template load<U>(at), v0 = v.template load<U>(at);
            Vec3<U> u = fma(half_dt, a.template load<U>(at), v0), x1 = fma(dt, u, x0);
            if (activity) {
                double awake[width<U>];
                for (int k = 0; k < width<U>; ++k) awake[k] = k < lanes && activity[at + k] != std::int32_t(Activity::Asleep);
                const auto moves = less(U(0.5), load<U>(awake));
                u = select(moves, u, v0), x1 = select(moves, x1, x0);
            }
            x.store(at, x1, lanes), v.store(at, u, lanes);
            if (!built) continue;
            for (int k = 0; k < lanes; ++k) {
                const double density = rho[at + k];
                const Material& m = in.soils[in.soils.size() == 1 ? 0 : soil[at + k]];
                const Vector here = x[at + k], moving = v[at + k];
                kinematics_[at + k] = {
                    place_(here.x), place_(here.y), place_(here.z), T(moving.x), T(moving.y), T(moving.z), T(volume_ * m.density / density),
                    T(density)};
            }
        }
    }

    PassResult run(int stage, const StepInput& in, std::span<const Index> clusters) override
    {
        if (stage == 0)
            return Base::over(
                clusters, [&](Index c, Tally<U> & tally) __attribute__((always_inline)) { strain_cluster(in, c, tally); });
        return Base::over(
            clusters, [&](Index c, Tally<U> & tally) __attribute__((always_inline)) { force_cluster(in, c, tally); });
    }

private:
    std::size_t wall_bytes() const
    {
        std::size_t b = 0;
        for (const auto& w : walls_)
            b += w.x.size() * 3 * sizeof(w.x[0]) + w.first.size() * sizeof(Index) + w.faces.size() * sizeof(FaceRecord<T>);
        return b;
    }

    // ---- stage 0: velocity gradient, density, stress, viscous force --------------------------------------------------

    KUZURE_INLINE void strain_cluster(const StepInput& in, Index cluster, Tally<U>& tally)
    {
        Cluster<V> i = Base::cluster_at(in, cluster, tally);
        if (i.moving == 0) { // its list is pruned when it wakes
            if (in.prune) in.lists->pruned(cluster).n = -1;
            return;
        }
        Base::load_lanes(i, in, kinematics_.data(), [&](Index k) { return speed_[k]; });
        const auto near = Base::near(i, in, cluster, kinematics_.data());
        StrainSums<Lane> sums;
        sum_strain(in, i, near, sums);
        StrainWalls<Lane> walls{};
        const auto runs = in.lists->walls(cluster);
        if (!runs.empty()) sum_wall_strain(in, i, runs, walls);
        Base::for_each_register(
            i, [&](const Lanes& lanes) __attribute__((always_inline)) { update_strain(in, sums, walls, !runs.empty(), lanes, tally); });
    }

    KUZURE_INLINE void sum_strain(const StepInput& in, const Cluster<V>& i, std::span<const Index> near, StrainSums<Lane>& out) const
    {
        const Kinematics<T>* records = kinematics_.data();
        const bool one_soil = in.soils.size() == 1;
        const T* speed = one_soil ? nullptr : speed_.data();
        const V support(T(2 * model_.kernel.h)), softening(T(0.01 * model_.kernel.h * model_.kernel.h));
        const V tiny(T(1e-12 * model_.kernel.h * model_.kernel.h)), zero(T(0)), half_dt(T(0.5 * in.dt / unit_));
        Batch<V> batch;
        StrainSums<V> sums{};
        const int n = int(near.size());
        for (int b = 0; b < n; b += batch.capacity) {
            batch.neighbour = &near[b];
            batch.size = std::min(batch.capacity, n - b);
            for (int k = 0; k < batch.size; ++k) {
                const Kinematics<T>& j = records[batch.neighbour[k]];
                Entry<V>& e = batch.at[k];
                const Vec3<V> v{j.vx - i.v.x, j.vy - i.v.y, j.vz - i.v.z};
                const Vec3<V> r = fma(half_dt, v, i.position.minus(j)); // half a step back
                const V r2 = max(dot(r, r), tiny);
                const V rho_sum = i.rho + j.density;
                const auto inv = roots<M::Kernel::divides>(r2, (r2 + softening) * rho_sum);
                const V t = max(support - inv.root, zero);
                e.grad = (model_.kernel.shape(t, inv.root, inv.inverse_root) * j.volume) * r;
                e.v = v;
                if constexpr (M::viscous) {
                    // rho_i rho_j Pi > 0 where the two approach
                    const V approach = max(dot(v, r), zero);
                    const V c = one_soil ? i.c : V(speed[batch.neighbour[k]]);
                    e.rho2_Pi = model_.viscosity(Pair<V>{approach, inv.inverse, rho_sum, i.rho, V(j.density), i.c, c});
                }
                if constexpr (M::corrected) e.r = r;
            }
            VelocityGradient{}.add(sums, batch);
            Viscous{}.add(sums, batch);
            if constexpr (M::corrected) model_.correction.add(sums, batch);
        }
        widen<V>(sums, out);
    }

    [[gnu::noinline]] void sum_wall_strain(const StepInput& in, const Cluster<V>& i, std::span<const Index> runs,
                                           StrainWalls<Lane>& out) const
    {
        const V half_dt(T(0.5 * in.dt / unit_));
        const Vec3<V> back{half_dt * i.v.x, half_dt * i.v.y, half_dt * i.v.z};
        StrainWalls<V> sums{};
        for_each_wall_pair(i, runs, back, [&](Vec3<V> r, V r2, unsigned, const Mirror<V>& m) {
            const V support(T(2 * model_.kernel.h)), softening(T(0.01 * model_.kernel.h * model_.kernel.h)), zero(T(0));
            const V rho_sum = i.rho + i.rho;
            const auto inv = roots<M::Kernel::divides>(r2, (r2 + softening) * rho_sum);
            const Vec3<V> g = model_.kernel.shape(max(support - inv.root, zero), inv.root, inv.inverse_root) * r;
            const Vec3<V> Pv = m.factor * project(m, i.v);
            const V slides = m.coulomb, holds = V(T(1)) - slides;
            const auto add = [&](Vec3<V>& held, Vec3<V>& sliding, V v) {
                held = fma(holds * v, g, held), sliding = fma(slides * v, g, sliding);
            };
            add(sums.mirrored.x, sums.sliding.x, Pv.x), add(sums.mirrored.y, sums.sliding.y, Pv.y),
                add(sums.mirrored.z, sums.sliding.z, Pv.z);
            sums.walled = sums.walled + dot(g, m.normal);
            if constexpr (M::viscous) {
                const V approach = max(-dot(Pv, r), zero);
                const V pressure = model_.viscosity(Pair<V>{approach, inv.inverse, rho_sum, i.rho, i.rho, i.c, i.c});
                sums.viscous = fma(pressure, project(m, g), sums.viscous);
            }
        });
        widen<V>(sums, out);
    }

    /// Visits the wall points inside the support: visit(r, r^2, lanes that they hit, mirror); `back` is taken off the positions.
    template <class Visit>
    KUZURE_INLINE void for_each_wall_pair(const Cluster<V>& i, std::span<const Index> runs, Vec3<V> back, Visit visit) const
    {
        const V support2(T(4 * model_.kernel.h * model_.kernel.h)), tiny(T(1e-12 * model_.kernel.h * model_.kernel.h));
        while (!runs.empty()) {
            const WallRecords<T>& wall = walls_[runs[0]];
            const auto list = runs.subspan(2, runs[1]);
            runs = runs.subspan(2 + runs[1]);
            for (const Index point : list) {
                const Vec3<V> r = i.position.minus(wall.x[point], wall.y[point], wall.z[point]) - back;
                const V r2 = dot(r, r);
                const unsigned hits = bits(less(r2, support2)) & i.owned;
                if (!hits || wall.first[point] == wall.first[point + 1]) continue;
                visit(r, max(r2, tiny), hits, mirror(MirrorImage{}, r, &wall.faces[wall.first[point]]));
            }
        }
    }

    struct Strained {
        Sym3<U> sigma;
        U rho, plastic_strain;
        Vec3<U> viscous; // acceleration, m/s^2
    };

    KUZURE_INLINE void update_strain(const StepInput& in, const StrainSums<Lane>& rows, const StrainWalls<Lane>& wall_rows, bool walled,
                                     const Lanes& lanes, Tally<U>& tally)
    {
        auto& p = *in.particles;
        const auto& was = std::as_const(p);
        const U one(1.0), zero(0.0), half(0.5), factor(scale_), dt(in.dt), half_dt = half * dt;
        const auto sums = lanes_at<U, StrainSums<U>, StrainSums<Lane>, W>(rows, lanes.first);
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
            const auto w = lanes_at<U, StrainWalls<U>, StrainWalls<Lane>, W>(wall_rows, lanes.first);
            const U volume = U(volume_) * soil.rho0 / rho; // a wall particle has the soil's
            at_walls = wall_gradient(in, w, lanes, -factor * volume);
            feels_wall = select(less(zero, abs(w.walled)), one, zero);
            if constexpr (M::viscous) viscous = viscous - (per_rho * volume) * w.viscous;
        }
        if constexpr (M::corrected)
            if (model_.correct) {
                const U to_m = U(-unit_) * factor; // the sums hold r = x_i - x_j in `unit`
                const Sym3<U> correction = GradientCorrection::inverse(to_m * sums.moment, dimensions_, one - feels_wall);
                L = {correction * L.x, correction * L.y, correction * L.z};
            }
        L = {L.x + at_walls.x, L.y + at_walls.y, L.z + at_walls.z};

        const Sym3<U> D = symmetric_part(L);
        if (in.evolving) soil.law = cone_of_now(soil.law, in.soils, was[field::soil].column[0], lanes, h_, plastic, D, sigma);
        Sym3<U> diffusion{zero, zero, zero, zero, zero, zero};
        if constexpr (M::diffusive) diffusion = was[field::stress_rate].template load<U>(lanes.at);
        // half before the turn and half after: second order in time, and exact in energy
        const Sym3<U> strain = dt * D;
        const Sym3<U> loading = half * (hooke(strain, soil.law) + dt * diffusion);
        const U opened = in.remembering ? was[field::opened_volume].template load<U>(lanes.at) : zero;
        auto mapped = return_to_cone(rotate(spin_increment(L, dt), sigma + loading) + loading, soil.law, opened);
        // drho/dt = -rho tr L, by the midpoint rule
        const U change = half_dt * trace(L);
        Strained next{mapped.sigma, rho * ((one - change) / (one + change)), plastic + mapped.shear_strain, viscous};

        const auto mine = written<U>(lanes);
        if (in.sleep == SleepStage::Frozen) {
            next.sigma = select(mine, next.sigma, sigma), next.rho = select(mine, next.rho, rho);
            next.plastic_strain = select(mine, next.plastic_strain, plastic);
            mapped.opened = select(mine, mapped.opened, opened);
            next.viscous = select(mine, next.viscous, was[field::acceleration].template load<U>(lanes.at));
        }
        if (in.dt > 0) { // at the start of a run only the viscous force is wanted
            p[field::stress].store(lanes.at, next.sigma, lanes.n);
            p[field::density].store(lanes.at, next.rho, lanes.n);
            p[field::plastic_strain].store(lanes.at, next.plastic_strain, lanes.n);
            if (in.remembering) p[field::opened_volume].store(lanes.at, mapped.opened, lanes.n);
        } else next.sigma = sigma, next.rho = rho;
        p[field::acceleration].store(lanes.at, next.viscous, lanes.n);
        write_stresses(in, lanes, soil, next);

        // ---- energies: plastic work is what the mean stress did less what is stored; exact sums of rounded addends
        const U magic(magic_of(in.energy_unit));
        const U mass = U(volume_) * soil.rho0, volume = half * (mass / rho + mass / next.rho);
        const Sym3<U> mean = half * (sigma + next.sigma);
        const U diffused = compliance(mean, dt * diffusion, soil.law); // work of the diffusion, J/m^3
        const U stored = half * (compliance(next.sigma, next.sigma, soil.law) - compliance(sigma, sigma, soil.law));
        const U worked = quantized(volume * (contract(mean, strain) + diffused - stored), magic);
        tally.energy.plastic += select(mine, worked, zero);
        if constexpr (M::diffusive) tally.energy.stabilising -= select(mine, quantized(volume * diffused, magic), zero);
        if (walled) {
            const U taken = quantized(volume * contract(mean, dt * symmetric_part(at_walls)), magic);
            tally.energy.wall -= select(mine, taken, zero);
        }
        const auto meet = [&](U& most, U value) { most = max(select(mine, value, zero), most); };
        meet(tally.maxima.density_ratio, max(next.rho / soil.rho0, soil.rho0 / next.rho));
        meet(tally.maxima.signal, fma(U(h_), sqrt(contract(D, D)), soil.c));
        tally.poison += select(mine, fma(zero, trace(next.sigma), zero * next.rho), zero);
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
    KUZURE_INLINE void write_stresses(const StepInput& in, const Lanes& lanes, const LaneSoil<U>& soil, const Strained& next)
    {
        double rows[7][width<U>];
        const U columns[7] = {
            next.sigma.xx, next.sigma.yy, next.sigma.zz, next.sigma.xy, next.sigma.yz, next.sigma.xz, U(volume_) * soil.rho0 / next.rho};
        for (int k = 0; k < 7; ++k) store(rows[k], columns[k]);
        const std::int32_t* activity = in.sleep == SleepStage::Off ? nullptr : std::as_const(*in.particles)[field::activity].column[0];
        for (int k = 0; k < lanes.n; ++k) {
            Stresses<T>& r = stresses_[lanes.at + k];
            r.xx = T(rows[0][k]), r.yy = T(rows[1][k]), r.zz = T(rows[2][k]);
            r.xy = T(rows[3][k]), r.yz = T(rows[4][k]), r.xz = T(rows[5][k]);
            r.volume = T(rows[6][k]);
            if (activity) r.awake = T(activity[lanes.at + k] == std::int32_t(Activity::Moves));
            if constexpr (M::tensile)
                tension_[lanes.at + k] = make_tension<T>(Stress{rows[0][k], rows[1][k], rows[2][k], rows[3][k], rows[4][k], rows[5][k]},
                                                         model_.artificial_stress.epsilon);
        }
    }

    // ---- stage 1: forces, acceleration, velocity -----------------------------------------------------------------------

    KUZURE_INLINE void force_cluster(const StepInput& in, Index cluster, Tally<U>& tally)
    {
        Tally<U> counted_before; // sleepers are counted in stage 0
        Cluster<V> i = Base::cluster_at(in, cluster, counted_before);
        if (i.moving == 0) return;
        i.position = positions_of<V>(kinematics_.data(), i.first);
        const auto pruned = in.lists->pruned(cluster);
        const std::span<const Index> near(pruned.entries, std::size_t(pruned.n));
        ForceSums<Lane> sums;
        // every particle meets itself once in its list
        tally.pairs += sum_forces(i, near, sums) - std::popcount(i.moving);
        unsigned awake = 0;
        if (in.sleep == SleepStage::Freeze) awake = awake_near(i, near, kinematics_.data(), stresses_.data(), 2 * model_.kernel.h);
        ForceWalls<Lane> walls{};
        const auto runs = in.lists->walls(cluster);
        if (!runs.empty()) tally.pairs += sum_wall_forces(in, i, runs, walls);
        Base::for_each_register(
            i, [&](const Lanes& lanes)
                   __attribute__((always_inline)) { update_force(in, sums, walls, !runs.empty(), lanes, awake, tally); });
    }

    /// Returns the pairs inside the support. Entries of the list beyond it add exact zeros.
    KUZURE_INLINE std::int64_t sum_forces(const Cluster<V>& i, std::span<const Index> near, ForceSums<Lane>& out) const
    {
        const Kinematics<T>* places = kinematics_.data();
        const Stresses<T>* records = stresses_.data();
        const V support(T(2 * model_.kernel.h)), support2(T(4 * model_.kernel.h * model_.kernel.h));
        const V softening(T(0.01 * model_.kernel.h * model_.kernel.h)), tiny(T(1e-12 * model_.kernel.h * model_.kernel.h));
        const V zero(T(0)), one(T(1));
        bool tension = false; // one of the cluster's particles is in tension
        if constexpr (M::tensile)
            for (int l = 0; l < i.count; ++l) tension = tension || tension_[i.first + l].any != 0;
        Batch<V> batch;
        ForceSums<V> sums{};
        V inside = zero;
        const int n = int(near.size());
        for (int b = 0; b < n; b += batch.capacity) {
            batch.neighbour = &near[b];
            batch.size = std::min(batch.capacity, n - b);
            for (int k = 0; k < batch.size; ++k) {
                const Index number = batch.neighbour[k];
                Entry<V>& e = batch.at[k];
                const Vec3<V> r = i.position.minus(places[number]);
                const V r2 = max(dot(r, r), tiny);
                inside = inside + select(less(r2, support2), one, zero);
                const auto inv = root<M::Kernel::divides>(r2);
                const V t = max(support - inv.root, zero);
                const V w = model_.kernel.shape(t, inv.root, inv.inverse_root) * records[number].volume;
                e.grad = w * r;
                if constexpr (M::tensile) e.w = model_.kernel.value(t);
                if constexpr (M::diffusive) {
                    e.q = w * (r2 / (r2 + softening));
                    const Vector g = model_.stress_diffusion.gravity;
                    e.along = dot(Vec3<V>{V(T(g.x)), V(T(g.y)), V(T(g.z))}, r);
                }
            }
            // rho_i dv/dt = sum_j V_j [ sigma_i + sigma_j + f^n (tau_i + tau_j) ] . grad W
            StressForce{}.add(
                sums, batch, records, [](Sym3<V> s, const Entry<V>&) __attribute__((always_inline)) { return s; });
            if constexpr (M::tensile) model_.artificial_stress.add(sums, batch, tension_.data(), tension);
            if constexpr (M::diffusive) model_.stress_diffusion.add(sums, batch, records);
        }
        widen<V>(sums, out);
        return Base::counted(i, inside);
    }

    /// Returns the wall pairs inside the support.
    [[gnu::noinline]] std::int64_t sum_wall_forces(const StepInput& in, const Cluster<V>& i, std::span<const Index> runs,
                                                   ForceWalls<Lane>& out) const
    {
        const auto& p = std::as_const(*in.particles);
        const auto s = p[field::stress];
        const auto v = p[field::velocity];
        const auto narrow = [&](const double* column) { return load_narrow<V>(column + i.first); };
        const Sym3<V> sigma{narrow(s.column[0]), narrow(s.column[1]), narrow(s.column[2]),
                            narrow(s.column[3]), narrow(s.column[4]), narrow(s.column[5])};
        const Vec3<V> velocity{narrow(v.column[0]), narrow(v.column[1]), narrow(v.column[2])};
        ForceWalls<V> sums{};
        std::int64_t pairs = 0;
        const V none(T(0));
        for_each_wall_pair(i, runs, {none, none, none}, [&](Vec3<V> r, V r2, unsigned hits, const Mirror<V>& m) {
            pairs += std::popcount(hits & i.moving);
            const V support(T(2 * model_.kernel.h)), zero(T(0));
            const auto inv = root<M::Kernel::divides>(r2);
            const Vec3<V> g = (m.factor * model_.kernel.shape(max(support - inv.root, zero), inv.root, inv.inverse_root)) * r;
            const Vec3<V> traction = sigma * g;
            const Vec3<V> crossing = project(m, traction);
            const V slides = m.coulomb, holds = V(T(1)) - slides;
            sums.held = fma(holds, crossing, sums.held), sums.pressing = fma(slides, crossing, sums.pressing);
            const V along = dot(traction, m.normal), facing = slides * dot(g, m.normal);
            sums.limit = fma(slides * m.tangent, along, sums.limit);
            sums.approach = fma(facing, dot(velocity, m.normal), sums.approach);
            sums.area = sums.area + facing;
        });
        widen<V>(sums, out);
        return pairs;
    }

    KUZURE_INLINE void update_force(const StepInput& in, const ForceSums<Lane>& rows, const ForceWalls<Lane>& wall_rows, bool walled,
                                    const Lanes& lanes, unsigned awake, Tally<U>& tally)
    {
        auto& p = *in.particles;
        const auto& was = std::as_const(p);
        const U zero(0.0), half(0.5), factor(scale_), dt(in.dt), next(in.next), half_dt = half * dt, half_next = half * next;
        const auto sums = lanes_at<U, ForceSums<U>, ForceSums<Lane>, W>(rows, lanes.first);
        const LaneSoil<U> soil = soil_of<U>(in.soils, was[field::soil].column[0], lanes);
        const Sym3<U> sigma = was[field::stress].template load<U>(lanes.at);
        const U rho = was[field::density].template load<U>(lanes.at);
        const Vec3<U> x = was[field::position].template load<U>(lanes.at), u = was[field::velocity].template load<U>(lanes.at);
        const Vec3<U> viscous = was[field::acceleration].template load<U>(lanes.at);
        const U per_rho = factor / rho;

        const Vec3<U> stress = per_rho * (sums.force + sigma * sums.grad_one);
        Vec3<U> pushed{zero, zero, zero}, wall = pushed;
        if constexpr (M::tensile) {
            const auto tau = lane_by_lane<Sym3, U>([&](int k) {
                const Tension<T>& t = tension_[lanes.particle(k)];
                return Stress{t.xx, t.yy, t.zz, t.xy, t.yz, t.xz};
            });
            pushed = per_rho * (tau * sums.closeness_grad + sums.art_stress_j);
        }
        if constexpr (M::diffusive) diffuse(in, sums, sigma, soil, lanes);
        if (walled) wall = wall_acceleration(in, wall_rows, lanes, U(volume_) * soil.rho0 / rho, rho);
        const Vec3<U> body = body_acceleration(in.forces, water_, was[field::position], soil.rho0, lanes);
        Vec3<U> a = ((stress + viscous) + (pushed + wall)) + body;
        // Damping over the whole kick, unconditionally stable: v+ = ((1 - mu k/2) v- + k a)/(1 + mu k/2)
        const U mu(in.forces.damping), kick = half_dt + half_next;
        a = (U(1.0) / fma(half * mu, kick, U(1.0))) * (a - mu * u);
        Vec3<U> v = fma(half_dt, a, u);
        const auto mine = written<U>(lanes);
        if (in.sleep == SleepStage::Frozen) v = select(mine, v, u), a = select(mine, a, viscous); // a sleeper's holds its acceleration
        p[field::velocity].store(lanes.at, v, lanes.n);
        p[field::acceleration].store(lanes.at, a, lanes.n);
        if (in.sleep == SleepStage::Detect || in.sleep == SleepStage::Freeze) detect_calm(in, lanes, a, v, awake);

        // ---- work of each force, half of the step before and half of the one to come
        const U magic(magic_of(in.energy_unit)), mass = U(volume_) * soil.rho0;
        const Vec3<U> coming = fma(half_next, a, v);
        const auto take = [&](U& before, U& later, Vec3<U> force) {
            before -= select(mine, quantized(mass * (half_dt * dot(force, u)), magic), zero);
            later -= select(mine, quantized(mass * (half_next * dot(force, coming)), magic), zero);
        };
        take(tally.energy.viscous, tally.later.viscous, viscous);
        if constexpr (M::tensile) take(tally.energy.stabilising, tally.later.stabilising, pushed);
        if (walled) take(tally.energy.wall, tally.later.wall, wall);
        if (in.forces.damping > 0) take(tally.energy.damping, tally.later.damping, -(half * mu) * (u + coming));
        // ---- maxima; displacement and drift are those of the step to come
        const Vec3<U> frame{U(in.frame.x), U(in.frame.y), U(in.frame.z)}, flown{U(in.frame_way.x), U(in.frame_way.y), U(in.frame_way.z)};
        const Vec3<U> moved = (fma(next, coming, x) - was[field::sorted_position].template load<U>(lanes.at)) - flown,
                      drift = coming - frame;
        const auto meet = [&](U& most, U value) { most = max(select(mine, value, zero), most); };
        meet(tally.maxima.acceleration2, dot(a, a));
        meet(tally.maxima.displacement2, dot(moved, moved));
        meet(tally.maxima.speed2, dot(v, v));
        meet(tally.maxima.drift2, dot(drift, drift));
        tally.poison += select(mine, fma(zero, dot(a, a), fma(zero, dot(v, v), zero * dot(x, x))), zero);
        if (in.low) {
            double at[3][16];
            store(at[0], x.x), store(at[1], x.y), store(at[2], x.z);
            if (any_outside(in, at, lanes.n)) tally.maxima.outside = U(1.0);
        }
    }
    /// Stress rate of the diffusion, kept for the next strain.
    KUZURE_INLINE void diffuse(const StepInput& in, const ForceSums<U>& sums, Sym3<U> sigma, const LaneSoil<U>& soil,
                               const Lanes& lanes) const
    {
        auto& p = *in.particles;
        const auto material = [&](int k) -> const Material& {
            return in.soils[in.soils.size() == 1 ? 0 : std::as_const(p)[field::soil][lanes.particle(k)]];
        };
        const U speed = lane_by_lane<U>([&](int k) { return material(k).rod_speed; });
        const U K0 = lane_by_lane<U>([&](int k) { return material(k).at_rest; });
        const U strength = U(2 * model_.stress_diffusion.zeta * h_ * scale_ / unit_) * speed;
        const auto kept = p[field::stress_rate];
        Sym3<U> rate = model_.stress_diffusion.rate(sums, sigma, soil.rho0, K0, strength, U(unit_));
        if (in.sleep == SleepStage::Frozen) rate = select(written<U>(lanes), rate, kept.template load<U>(lanes.at));
        kept.store(lanes.at, rate, lanes.n);
    }
    /// What walls do to each lane, m/s^2: the adjoint force, and Coulomb's friction, whose slip it moves on.
    KUZURE_INLINE Vec3<U> wall_acceleration(const StepInput& in, const ForceWalls<Lane>& rows, const Lanes& lanes, U volume, U rho) const
    {
        const auto w = lanes_at<U, ForceWalls<U>, ForceWalls<Lane>, W>(rows, lanes.first);
        const U scale = U(scale_) * volume / rho;
        const Vec3<U> held = scale * w.held;
        auto& p = *in.particles;
        if (!p.has(field::wall_slip)) return held;
        const auto slip = p[field::wall_slip];
        const auto pressure = p[field::wall_pressure];
        const auto v = std::as_const(p)[field::velocity];
        double out[3][width<U>] = {};
        const auto at = [&](U a, int k) { return lane(a, k); };
        for (int k = 0; k < lanes.n; ++k) {
            if (!(lanes.moving >> (lanes.first + k) & 1)) continue;
            const Index i = lanes.at + k;
            const double s = at(scale, k);
            const Vector push{s * at(w.pressing.x, k), s * at(w.pressing.y, k), s * at(w.pressing.z, k)};
            const double held_by = s * at(w.limit, k), area = s * at(w.area, k);
            // scale and grad W.n have opposite signs: the face is approached where their product with v.n is positive
            const bool faces = area != 0, approached = s * at(w.approach, k) > 0, pressed = held_by > 0;
            if (!faces || !(pressed || approached)) {
                slip.set(i, Vector{}), pressure.set(i, 0.0);
                continue;
            }
            const double size = length(push);
            const Vector normal = size > 0 ? (1 / size) * push : Vector{};
            const Material& m = in.soils[in.soils.size() == 1 ? 0 : std::as_const(p)[field::soil][i]];
            // a spring of the soil's own shear stiffness across half a smoothing length
            const double stiffness = pressed ? m.shear * std::fabs(area) / (0.5 * h_) : 0;
            const auto f = return_to_coulomb(slip[i], in.dt * v[i], normal, pressed ? size : 0, held_by, stiffness);
            slip.set(i, f.slip), pressure.set(i, pressed ? size : 0.0);
            out[0][k] = push.x + f.force.x, out[1][k] = push.y + f.force.y, out[2][k] = push.z + f.force.z;
        }
        return held + Vec3<U>{load<U>(out[0]), load<U>(out[1]), load<U>(out[2])};
    }
    KUZURE_INLINE void detect_calm(const StepInput& in, const Lanes& lanes, Vec3<U> a, Vec3<U> v, unsigned awake) const
    {
        const auto activity = (*in.particles)[field::activity];
        double soon[width<U>];
        store(soon, fma(U(in.detection_interval), sqrt(dot(a, a)), sqrt(dot(v, v))));
#pragma GCC unroll 1
        for (int k = 0; k < lanes.n; ++k) {
            const bool calm = soon[k] < in.calm_speed, alone = (awake >> (lanes.first + k) & 1) == 0;
            const auto now = !calm                            ? Activity::Moves
                             : in.sleep == SleepStage::Detect ? Activity::Calm
                             : alone                          ? Activity::Asleep
                                                              : Activity::Moves;
            activity.set(lanes.at + k, std::int32_t(now));
        }
    }

    Stage stages_[2];
    std::vector<WallRecords<T>> walls_;
    Index n_ = 0;
    Array<Kinematics<T>> kinematics_;
    Array<Stresses<T>> stresses_;
    Array<Tension<T>> tension_;
    Array<T> speed_; // c_p by record, where there are several soils
};

} // namespace kuzure
