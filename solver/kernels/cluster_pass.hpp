#pragma once
// What every compiled model does whatever its integrator: walk the clusters, prune their lists, make the batches. Included by
// variant.cpp only, so that each model is compiled once, in its own object.
//
// V: number type of the pair sums (lanes of float in mixed precision), U: of the update, always double. Sums are centred on i,
// which owns a lane; j is broadcast to all lanes and comes in the global order. What lies beyond the support adds exact zeros, so
// the bits do not depend on list or cluster.
#include "solver/effects/pore_water.hpp"
#include "solver/kernels/model.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/pairs/cluster.hpp"
#include "solver/physics/drucker_prager.hpp"
#include <bit>
#include <omp.h>

namespace kuzure {

template <class V> using Update = std::conditional_t<width<V> == 1, double, Native<double>>;

/// Lanes first .. first + n - 1 of a cluster, at particle `at` and on, as the update takes them; `moving`: a bit for each lane of
/// the cluster that is not asleep.
struct Lanes {
    Index at;
    int first, n;
    unsigned moving;
    Index particle(int k) const { return at + (k < n ? k : n - 1); } // lanes beyond the n-th hold others, or nothing
};

/// Material of each lane.
template <class U> struct LaneSoil {
    Elastoplastic<U> law;
    U c, rho0; // m/s, kg/m^3
};
template <class U> KUZURE_INLINE LaneSoil<U> soil_of(std::span<const Material> soils, const std::int32_t* soil, const Lanes& lanes)
{
    if (soils.size() == 1) return {Elastoplastic<U>::from(soils[0]), U(soils[0].c_p), U(soils[0].density)};
    const auto material = [&](int k) -> const Material& { return soils[soil[lanes.particle(k)]]; };
    return {lane_by_lane<Elastoplastic, U>([&](int k) { return Elastoplastic<double>::from(material(k)); }),
            lane_by_lane<U>([&](int k) { return material(k).c_p; }), lane_by_lane<U>([&](int k) { return material(k).density; })};
}

/// True in the lanes that this update writes: neither beyond the n-th nor asleep.
template <class U> KUZURE_INLINE auto written(const Lanes& lanes)
{
    double number_of[width<U>];
    for (int k = 0; k < width<U>; ++k) number_of[k] = lanes.moving >> (lanes.first + k) & 1 ? k : width<U>;
    return less(load<U>(number_of), U(double(lanes.n)));
}
template <class M, class U> KUZURE_INLINE Vec3<U> select(M mine, Vec3<U> a, Vec3<U> b)
{
    return {select(mine, a.x, b.x), select(mine, a.y, b.y), select(mine, a.z, b.z)};
}
template <class M, class U> KUZURE_INLINE Sym3<U> select(M mine, Sym3<U> a, Sym3<U> b)
{
    return {select(mine, a.xx, b.xx), select(mine, a.yy, b.yy), select(mine, a.zz, b.zz),
            select(mine, a.xy, b.xy), select(mine, a.yz, b.yz), select(mine, a.xz, b.xz)};
}

/// Gravity and still water, m/s^2: rho_0 a = -grad p_w, with the reference density the force has the potential V_0 p_w.
template <class U, class X>
KUZURE_INLINE Vec3<U> body_acceleration(const StepForces& forces, const PoreWater& water, const X& x, U rho0, const Lanes& lanes)
{
    Vec3<U> body{U(forces.gravity.x), U(forces.gravity.y), U(forces.gravity.z)};
    if (!water.present()) return body;
    const auto pressure = [&](int k) { return water.at(x[lanes.particle(k)]).gradient; };
    body.x = body.x - lane_by_lane<U>([&](int k) { return pressure(k).x; }) / rho0;
    body.z = body.z - lane_by_lane<U>([&](int k) { return pressure(k).z; }) / rho0;
    return body;
}

/// The cone of now, where it changes with plastic strain or the rate of shear.
template <class U>
KUZURE_INLINE Elastoplastic<U> cone_of_now(const Elastoplastic<U>& law, std::span<const Material> soils, const std::int32_t* soil,
                                           const Lanes& lanes, double h, U plastic_strain, Sym3<U> D, Sym3<U> sigma)
{
    const auto evolution = lane_by_lane<Evolution, U>(
        [&](int k) { return Evolution<double>::from(soils.size() == 1 ? soils[0] : soils[soil[lanes.particle(k)]], h); });
    const Sym3<U> sheared = deviator(D);
    const U shear_rate = sqrt(U(4.0) * J2(sheared));
    return evolved(law, evolution, plastic_strain, shear_rate, trace(sigma) * U(-1.0 / 3));
}

/// True where a particle of these lanes is outside the box. Through memory: GCC 12 would take lanes out of the register by an
/// instruction that Knights Landing lacks.
[[gnu::noinline]] inline bool any_outside(const StepInput& in, const double (&x)[3][16], int n)
{
    for (int k = 0; k < n; ++k)
        if (x[0][k] < in.low->x || x[1][k] < in.low->y || x[2][k] < in.low->z || x[0][k] > in.high->x || x[1][k] > in.high->y ||
            x[2][k] > in.high->z)
            return true;
    return false;
}

/// Common ground of the schemes compiled for one model and one number type of the pair sums.
template <class M, class V> class ClusterPass : public PairModel {
public:
    int cluster_width() const override { return W; }
    void renew(const scene::Interactions& s) override { model_ = M::from(s, unit_), water_ = PoreWater::from(s.effects); }
    scene::Precision precision() const override { return single<V> ? scene::Precision::Mixed : scene::Precision::Double; }

protected:
    using T = number<V>;
    using U = Update<V>;
    static constexpr int W = width<V>;

    explicit ClusterPass(const scene::Interactions& s)
        : unit_(single<V> ? s.h : 1.0), dimensions_(s.dimensions), h_(s.h),
          volume_(s.dimensions == 3 ? s.spacing * s.spacing * s.spacing : s.spacing * s.spacing), model_(M::from(s, unit_)),
          // grad W in 1/m^(dimensions + 1) from sums in units of unit_
          scale_(gradient_norm<typename M::Kernel>(s.norm, s.dimensions, s.h / s.spacing) * model_.kernel.scale /
                 std::pow(unit_, s.dimensions + 1)),
          fixed_(s.h), water_(PoreWater::from(s.effects))
    {
    }
    std::string lanes_name() const
    {
        return M::name() + (single<V> ? ", mixed" : ", double") + (W > 1 ? " x " + std::to_string(W) : ", plain");
    }
    /// body(cluster, tally) over all clusters, by all threads.
    template <class Body> PassResult over(std::span<const Index> clusters, Body body) const
    {
        PassResult total;
        const std::int64_t n = std::int64_t(clusters.size());
        if (n == 0) return total;
#pragma omp parallel
        {
            Tally<U> mine;
#pragma omp for schedule(dynamic, 32) nowait
            for (std::int64_t k = 0; k < n; ++k) body(clusters[k], mine);
#pragma omp critical
            total.add(mine.over_lanes());
        }
        return total;
    }

    /// Where the cluster lies and who of it is awake.
    Cluster<V> cluster_at(const StepInput& in, Index cluster, Tally<U>& tally) const
    {
        Cluster<V> i;
        i.first = in.lists->first(cluster), i.count = in.lists->count(cluster);
        i.owned = i.moving = (1u << i.count) - 1;
        if (in.sleep == SleepStage::Frozen) {
            const auto activity = std::as_const(*in.particles)[field::activity];
            for (int k = 0; k < i.count; ++k)
                if (activity[i.first + k] == std::int32_t(Activity::Asleep)) i.moving &= ~(1u << k), ++tally.asleep;
        }
        return i;
    }
    /// Positions, velocities and densities of the cluster's lanes; sound speeds by speed(particle) where there are several soils.
    template <class R, class Speed> KUZURE_INLINE void load_lanes(Cluster<V>& i, const StepInput& in, const R* records, Speed speed) const
    {
        const auto& store = std::as_const(*in.particles);
        i.position = positions_of<V>(records, i.first);
        const auto v = store[field::velocity];
        i.v = {load_narrow<V>(v.column[0] + i.first), load_narrow<V>(v.column[1] + i.first), load_narrow<V>(v.column[2] + i.first)};
        i.rho = load_narrow<V>(store[field::density].column[0] + i.first);
        if (in.soils.size() == 1) i.c = V(T(in.soils[0].c_p));
        else {
            T c[W];
            for (int k = 0; k < W; ++k) c[k] = speed(i.first + std::min(k, i.count - 1));
            i.c = load<V>(c);
        }
    }
    /// The neighbours that can be in reach, pruned anew where the step says so.
    template <class R>
    KUZURE_INLINE std::span<const Index> near(const Cluster<V>& i, const StepInput& in, Index cluster, const R* records) const
    {
        const auto pruned = in.lists->pruned(cluster);
        if (in.prune || pruned.n < 0) {
            const double reach = 2 * model_.kernel.h + in.margin / unit_;
            pruned.n = kuzure::prune(i, in.lists->soil(cluster), records, reach, pruned.entries);
        }
        return {pruned.entries, std::size_t(pruned.n)};
    }
    /// Lengths of the pair loops, in every lane: the support and its square; (0.01 h^2) and what stands for r^2 where two coincide.
    struct Lengths {
        V support, support2, softening, tiny;
    };
    KUZURE_INLINE Lengths lengths() const
    {
        const double h = model_.kernel.h;
        return {V(T(2 * h)), V(T(4 * h * h)), V(T(0.01 * h * h)), V(T(1e-12 * h * h))};
    }
    /// True if one of the cluster's particles is in tension; only of models with artificial stress.
    KUZURE_INLINE static bool in_tension(const Cluster<V>& i, const Array<Tension<T>>& tension)
    {
        bool any = false;
        if constexpr (M::tensile)
            for (int l = 0; l < i.count; ++l) any = any || tension[i.first + l].any != 0;
        return any;
    }
    /// body() for every batch of the list, which `batch` then is.
    template <class Body> KUZURE_INLINE static void for_each_batch(std::span<const Index> near, Batch<V>& batch, Body body)
    {
        const int n = int(near.size());
        for (int b = 0; b < n; b += batch.capacity) {
            batch.neighbour = &near[b];
            batch.size = std::min(batch.capacity, n - b);
            body();
        }
    }
    /// How many of the lanes' counts (one a lane) belong to particles that moved.
    static std::int64_t counted(const Cluster<V>& i, V inside)
    {
        T in_lane[W];
        store(in_lane, inside);
        std::int64_t pairs = 0;
#pragma GCC unroll 1 // GCC 12 would take lanes out of the register by an instruction that Knights Landing lacks
        for (int k = 0; k < i.count; ++k) pairs += std::int64_t(in_lane[k]) & -std::int64_t(i.moving >> k & 1);
        return pairs;
    }
    /// update(lanes) for every register of the cluster.
    template <class Body> KUZURE_INLINE static void for_each_register(const Cluster<V>& i, Body update)
    {
        for (int first = 0; first < i.count; first += width<U>)
            update(Lanes{i.first + first, first, std::min(width<U>, i.count - first), i.moving});
    }

    /// Who is calm, or falls asleep, by what a lane will have moved with until the next detection; `awake`: lanes with an awake neighbour.
    KUZURE_INLINE static void detect_calm(const StepInput& in, const Lanes& lanes, Vec3<U> a, Vec3<U> v, unsigned awake)
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

    double unit_;
    int dimensions_;
    double h_, volume_; // m, m^3 (m^2 in 2-D) of one particle at reference density
    M model_;
    double scale_;
    FixedPoint<T> fixed_;
    PoreWater water_;
};

} // namespace kuzure
