#pragma once
// What strain and force tell each other beside stresses: velocity gradients for the hourglass control, and who is in tension.
#include "solver/kernels/staggered_records.hpp"

namespace kuzure {

/// A layer between the records and the stages.
template <class Below> class AffineMotion : public Below {
    using V = typename Below::LaneType;

protected:
    using Below::Below, Below::W, Below::unit_, Below::h_, Below::model_, Below::scale_, Below::tension_, Below::affine_;
    using typename Below::T, typename Below::U;

    /// v of the lanes.
    KUZURE_INLINE static Vec3<V> velocity_of(const StepInput& in, const Cluster<V>& i)
    {
        const auto v = std::as_const(*in.particles)[field::velocity];
        const auto narrow = [&](int k) { return load_narrow<V>(v.column[k] + i.first); };
        return {narrow(0), narrow(1), narrow(2)};
    }
    /// True where some lane's is not zero.
    KUZURE_INLINE static bool any(Vec3<V> a)
    {
        const V none(T(0)), most = max(max(abs(a.x), abs(a.y)), abs(a.z));
        return bits(less(none, most)) != 0;
    }
    /// Weights of the lanes in the hourglass control.
    KUZURE_INLINE V weight_of(const Cluster<V>& i) const
    {
        T w[W];
        for (int k = 0; k < W; ++k) w[k] = affine_[i.first + std::min(k, i.count - 1)].weight;
        return load<V>(w);
    }
    /// Force of the hourglass control, Pa/m without the kernel's constant.
    template <class Sums> KUZURE_INLINE Vec3<U> hourglass(const Sums& sums, const Lanes& lanes) const
    {
        const auto of = [&](auto read) { return lane_by_lane<U>([&](int k) { return double(read(affine_[lanes.particle(k)])); }); };
        using A = const Affine<T>&;
        const Vec3<U> half = U(0.5 * unit_) * sums.arm;
        const Vec3<U> x{of([](A a) { return a.xx; }), of([](A a) { return a.xy; }), of([](A a) { return a.xz; })};
        const Vec3<U> y{of([](A a) { return a.yx; }), of([](A a) { return a.yy; }), of([](A a) { return a.yz; })};
        const Vec3<U> z{of([](A a) { return a.zx; }), of([](A a) { return a.zy; }), of([](A a) { return a.zz; })};
        return U(2 * model_.hourglass.strength * h_ / unit_) * (sums.apart - Vec3<U>{dot(x, half), dot(y, half), dot(z, half)});
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
            affine_[lanes.at + k] = {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8), at(9), {}};
        }
    }
    /// tau of each lane.
    KUZURE_INLINE Sym3<U> artificial_stress_of(const Lanes& lanes) const
    {
        return lane_by_lane<Sym3, U>([&](int k) {
            const Tension<T>& t = tension_[lanes.particle(k)];
            return Stress{t.xx, t.yy, t.zz, t.xy, t.yz, t.xz};
        });
    }
    /// epsilon N [sum_j V_j f (v_j - v_i) (x) grad W] N: what the strain of soil in tension is less by.
    template <class Sums> KUZURE_INLINE Sym3<U> less_in_tension(const Sums& sums, const Sym3<U>& sigma, const Lanes& lanes) const
    {
        const auto tensile = [&](int k) { return tension_[lanes.particle(k)].any != 0; };
        bool any = false;
        for (int k = 0; k < lanes.n; ++k) any = any || tensile(k);
        if (!any) return {};
        const Sym3<U> near = U(model_.artificial_stress.adjoint_epsilon * scale_) * symmetric_part(sums.near_grad_v);
        const auto at = [](const Sym3<U>& s, int k) {
            return Stress{lane(s.xx, k), lane(s.yy, k), lane(s.zz, k), lane(s.xy, k), lane(s.yz, k), lane(s.xz, k)};
        };
        return lane_by_lane<Sym3, U>([&](int k) { return tensile(k) ? tensile_part(at(sigma, k), at(near, k)) : Stress{}; });
    }
};

} // namespace kuzure
