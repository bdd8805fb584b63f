// Adding a pair force takes one struct in one file, and its name in a model's list. This one is made up: every pair of particles
// attracts with a constant pressure.
#include "perf/bench/cloud.hpp"
#include "solver/kernels/staggered.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

/// rho_i dv_i/dt = pressure sum_j V_j grad W
struct Attraction {
    static inline double pressure = 0; // Pa
    double p;
    static Attraction from(const scene::Interactions&, double) { return {pressure}; }
    template <class V> struct Sums {
        Vec3<V> pull; // sum V_j grad W
    };
    static constexpr double flops = 3;
    template <class V, class R> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const R*) const
    {
        for (int k = 0; k < batch.size; ++k) to.pull = to.pull + batch.at[k].grad;
    }
    template <class U> KUZURE_INLINE Vec3<U> force(const Sums<U>& sums) const { return U(p) * sums.pull; }
};
using Plain = Model<CubicSpline, LinearViscosity>;
using Attracting = Model<CubicSpline, LinearViscosity, NoArtificialStress, NoStressDiffusion, NoCorrection, NoShifting, Attraction>;

struct Result {
    std::vector<Vector> a;
    EnergySums energy;
};
template <class M, class V> Result run(double pressure)
{
    Attraction::pressure = pressure;
    bench::Cloud c(8, 0.3);
    Staggered<M, V> model(c.scene.interactions());
    c.prepare(model, 0.1);
    const PassResult result = c.step(model, c.input(1e-4));
    Result r{{}, result.energy};
    for (Index i = 0; i < c.particles.size(); ++i) r.a.push_back(c.particles[field::acceleration][i]);
    return r;
}

} // namespace

// Against the sum in plain loops.
TEST(AddingATerm, ItsForceIsAddedToTheOthers)
{
    const double p = 2e3;
    const auto without = run<Plain, Native<double>>(0), with = run<Attracting, Native<double>>(p);

    bench::Cloud c(8, 0.3);
    Staggered<Plain, double> model(c.scene.interactions());
    c.prepare(model, 0.1);
    c.step(model, c.input(1e-4));
    const auto& q = c.particles;
    const CubicSpline W(c.scene.smoothing_length(), 3);
    const double scale = gradient_norm<CubicSpline>(c.scene.accuracy.kernel_norm, 3, c.scene.space.h) * W.scale;
    double worst = 0, largest = 0;
    for (Index i = 0; i < q.size(); ++i) {
        Vector sum{};
        for (Index j = 0; j < q.size(); ++j) {
            const Vector r = q[field::position][i] - q[field::position][j];
            const double distance = length(r);
            if (i == j || distance >= 2 * W.h) continue;
            const double volume = c.scene.particle_volume() * c.soils[0].density / q[field::density][j];
            sum = sum + (volume * scale * W.F(2 * W.h - distance, distance, 1 / distance)) * r;
        }
        const Vector expected = (p / q[field::density][i]) * sum, found = with.a[std::size_t(i)] - without.a[std::size_t(i)];
        worst = std::max(worst, length(found - expected)), largest = std::max(largest, length(expected));
    }
    EXPECT_GT(largest, 1);
    EXPECT_LT(worst, 1e-11 * largest);
    EXPECT_NE(with.energy.stabilising, 0); // its work has a column
}

TEST(AddingATerm, AnyLanesGiveTheSameBitsAndNoStrengthChangesNone)
{
    const auto plain = run<Attracting, double>(2e3), lanes = run<Attracting, Native<double>>(2e3),
               two = run<Attracting, Simd<double, 2>>(2e3);
    const auto idle = run<Attracting, Native<double>>(0), without = run<Plain, Native<double>>(0);
    EXPECT_TRUE(plain.a == lanes.a);
    EXPECT_TRUE(plain.a == two.a);
    EXPECT_TRUE(idle.a == without.a);
    EXPECT_FALSE(plain.a == idle.a);
}

TEST(AddingATerm, ItsOperationsAreCounted)
{
    const scene::Interactions s = bench::dry_sand().interactions();
    EXPECT_EQ((Staggered<Attracting, double>(s).stages()[1].flops_per_pair), (Staggered<Plain, double>(s).stages()[1].flops_per_pair) + 3);
}
