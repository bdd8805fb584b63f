// Adding a stage takes one layer in one file, and a line in a scheme. This one is made up: after the forces, velocities are smoothed
// over the neighbours.
#include "perf/bench/cloud.hpp"
#include "solver/kernels/staggered.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

/// v_i += epsilon sum_j V_j (v_j - v_i) W_ij of the velocities at mid-step. Monaghan (1989), as XSPH.
template <class Below> class SmoothingStage : public Below {
    using M = typename Below::Model;
    using V = typename Below::LaneType;
    using Below::W, Below::model_, Below::kinematics_;
    using typename Below::T, typename Below::U;

    template <class S> struct Sums {
        Vec3<S> difference; // sum V_j (v_j - v_i) W
    };

protected:
    static constexpr double epsilon = 0.3;
    using Below::Below;
    static Stage smoothing_stage() { return {"smoothing", sizeof(Kinematics<T>), 30, 6, 48}; }
    PassResult run_smoothing(const StepInput& in, std::span<const Index> clusters)
    {
        return Below::over(clusters, [&](Index c, Tally<U>& tally) { one(in, c, tally); });
    }

private:
    void one(const StepInput& in, Index cluster, Tally<U>& tally)
    {
        Cluster<V> i = Below::cluster_at(in, cluster, tally);
        i.position = positions_of<V>(kinematics_.data(), i.first);
        const auto near = in.lists->pruned(cluster);
        Sums<V> sums{};
        const V support(T(2 * model_.kernel.h)), tiny(T(1e-12)), zero(T(0));
        T own[3][W];
        for (int k = 0; k < W; ++k) {
            const auto& r = kinematics_[std::size_t(i.first + std::min(k, i.count - 1))];
            own[0][k] = r.vx, own[1][k] = r.vy, own[2][k] = r.vz;
        }
        const Vec3<V> v{load<V>(own[0]), load<V>(own[1]), load<V>(own[2])};
        for (const Index k : near) {
            const auto& j = kinematics_[std::size_t(k)];
            const Vec3<V> r = i.position.minus(j);
            const V w = V(j.volume) * model_.kernel.value(max(support - root<M::Kernel::divides>(max(dot(r, r), tiny)).root, zero));
            sums.difference = fma(w, Vec3<V>{j.vx - v.x, j.vy - v.y, j.vz - v.z}, sums.difference);
        }
        Sums<WideLanes<W>> wide;
        widen<V>(sums, wide);
        Below::for_each_register(i, [&](const Lanes& lanes) {
            const auto s = lanes_at<U, Sums<U>, Sums<WideLanes<W>>, W>(wide, lanes.first);
            const auto column = (*in.particles)[field::velocity];
            column.store(lanes.at, fma(U(epsilon), s.difference, column.template load<U>(lanes.at)), lanes.n);
        });
    }
};

template <class M, class V> class Smoothing final : public SmoothingStage<Staggered<M, V>> {
    using Base = SmoothingStage<Staggered<M, V>>;
    Stage stages_[3];

public:
    explicit Smoothing(const scene::Interactions& s) : Base(s), stages_{Base::strain_stage(), Base::force_stage(), Base::smoothing_stage()}
    {
    }
    std::span<const Stage> stages() const override { return stages_; }
    PassResult run(int stage, const StepInput& in, std::span<const Index> clusters) override
    {
        return stage == 2 ? Base::run_smoothing(in, clusters) : Base::run(stage, in, clusters);
    }
};
using M = Model<CubicSpline, LinearViscosity>;

struct Result {
    std::vector<Vector> v, half, x; // half: at mid-step, as neighbours saw it
    std::vector<double> volume;
};
template <class Scheme> Result run()
{
    bench::Cloud c(7, 0.2);
    Scheme model(c.scene.interactions());
    c.prepare(model, 0.1);
    Result r;
    std::vector<double> before;
    for (Index i = 0; i < c.particles.size(); ++i) before.push_back(c.particles[field::density][i]);
    std::vector<Vector> start;
    for (Index i = 0; i < c.particles.size(); ++i) start.push_back(c.particles[field::velocity][i]); // at rest in acceleration
    c.step(model, c.input(1e-4));
    for (Index i = 0; i < c.particles.size(); ++i) {
        r.v.push_back(c.particles[field::velocity][i]), r.x.push_back(c.particles[field::position][i]);
        r.half.push_back(start[std::size_t(i)]);
        r.volume.push_back(c.scene.particle_volume() * c.soils[0].density / before[std::size_t(i)]);
    }
    return r;
}

} // namespace

TEST(AddingAStage, ItRunsAfterTheOthersOnWhatTheyLeft)
{
    const auto with = run<Smoothing<M, Native<double>>>(), without = run<Staggered<M, Native<double>>>();
    const double h = bench::dry_sand().smoothing_length();
    const CubicSpline W(h, 3);
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < with.v.size(); ++i) {
        Vector sum{};
        for (std::size_t j = 0; j < with.v.size(); ++j) {
            const double r = length(with.x[i] - with.x[j]);
            if (r < 2 * h) sum = sum + (with.volume[j] * W.value(2 * h - r)) * (with.half[j] - with.half[i]);
        }
        const Vector expected = 0.3 * sum;
        worst = std::max(worst, length((with.v[i] - without.v[i]) - expected)), largest = std::max(largest, length(expected));
    }
    EXPECT_GT(largest, 1e-3);
    EXPECT_LT(worst, 1e-11 * largest);
}

TEST(AddingAStage, AnyLanesGiveTheSameBits)
{
    const auto plain = run<Smoothing<M, double>>(), lanes = run<Smoothing<M, Native<double>>>();
    EXPECT_TRUE(plain.v == lanes.v);
}
