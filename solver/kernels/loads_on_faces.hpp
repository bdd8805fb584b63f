#pragma once
// Loads in the force stage: pressures that follow their face, and shares of a force that was measured once.
#include "solver/kernels/cluster_pass.hpp"

namespace kuzure {

/// A layer below the force stage.
template <class Below> class LoadsOnFaces : public Below {
    using V = typename Below::LaneType;

protected:
    using Below::Below, Below::W, Below::volume_, Below::scale_;
    using typename Below::T, typename Below::U;

    static LoadNow load_on(const StepInput& in, Index i)
    {
        const std::int32_t number = std::as_const(*in.particles)[field::load][i];
        return number > 0 ? in.loads[std::size_t(number) - 1] : LoadNow{};
    }
    /// True where a pressure that follows its face acts on one of the cluster's particles.
    static bool any_pressure(const StepInput& in, const Cluster<V>& i)
    {
        bool any = false;
        for (int k = 0; !in.loads.empty() && k < i.count; ++k) any = any || load_on(in, i.first + k).pressure != 0;
        return any;
    }
    /// Those pressures as stresses, in tension.
    static Sym3<V> pressure_of(const StepInput& in, const Cluster<V>& i)
    {
        T p[W];
        for (int k = 0; k < W; ++k) p[k] = k < i.count ? T(load_on(in, i.first + k).pressure) : T(0);
        const V all = load<V>(p), zero(T(0));
        return {all, all, all, zero, zero, zero};
    }

    /// What loads do to each lane, m/s^2. A pressure p that follows its face is what a tension p of the particle and of all around it would
    /// do, sum_j V_j 2 p grad W and at walls sum f P (p grad W): nothing inside soil and beside walls, p on the area of a free face.
    /// `inward`: of a unit of pressure without walls; `at_walls`: the sums there, none: no walls.
    KUZURE_INLINE Vec3<U> load_acceleration(const StepInput& in, Vec3<U> inward, const Vec3<U>* at_walls, const Lanes& lanes, U rho0,
                                            U rho) const
    {
        auto& p = *in.particles;
        const auto push = p[field::load_push];
        const U mass = U(volume_) * rho0;
        Vec3<U> a = lane_by_lane<U>([&](int k) { return load_on(in, lanes.particle(k)).pressure; }) * inward;
        if (at_walls) a = a + (U(scale_) * mass / (rho * rho)) * *at_walls;
        for (int k = 0; k < lanes.n; ++k)
            if (load_on(in, lanes.at + k).measured)
                push.set(lanes.at + k, lane(mass, k) * Vector{lane(a.x, k), lane(a.y, k), lane(a.z, k)});
        const U share = lane_by_lane<U>([&](int k) { return load_on(in, lanes.particle(k)).share; });
        return a + (share / mass) * std::as_const(p)[field::load_push].template load<U>(lanes.at);
    }
};

} // namespace kuzure
