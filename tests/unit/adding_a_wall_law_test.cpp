// Adding a wall law takes one struct in one file. This one is made up: behind the surface the wall stands still.
#include "perf/bench/cloud.hpp"
#include "solver/kernels/staggered.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

/// f = 1: v_j = 0; the mirror image's 2 where the point were in front of the surface.
struct StandsStill {
    template <class V> KUZURE_INLINE V factor(V, V depth) const
    {
        using T = number<V>;
        return select(less(depth, V(T(0))), V(T(2)), V(T(1)));
    }
};
using M = Model<CubicSpline, NoViscosity>;

Scene on_a_floor()
{
    Scene s = bench::dry_sand();
    s.effects.viscosity.reset(), s.effects.gravity.reset();
    s.walls.push_back({scene::Box{{-1, -1, -0.16}, {2, 2, 0}}, scene::Surface::Rough, 0});
    return s;
}
struct Result {
    std::vector<Vector> a;
    std::vector<double> rho;
    std::vector<std::int64_t> id;
    EnergySums energy;
};
template <class Law, class V> Result run(const Scene& s)
{
    bench::Cloud c(8, 0.2, s);
    Staggered<M, V, Law> model(s.interactions());
    c.prepare(model, 0.1);
    Result r;
    r.energy = c.step(model, c.input(1e-5)).energy;
    for (Index i = 0; i < c.particles.size(); ++i) {
        r.a.push_back(c.particles[field::acceleration][i]), r.rho.push_back(c.particles[field::density][i]);
        r.id.push_back(c.particles[field::id][i]);
    }
    return r;
}
/// What the walls of a law did: the difference to the same cloud without walls, by id.
template <class Law, class V> std::vector<Vector> share_of_walls()
{
    Scene bare = on_a_floor();
    bare.walls.clear();
    const auto with = run<Law, V>(on_a_floor()), without = run<Law, V>(bare);
    std::vector<Vector> share(with.a.size());
    for (std::size_t k = 0; k < with.a.size(); ++k) share[std::size_t(with.id[k])] = share[std::size_t(with.id[k])] + with.a[k];
    for (std::size_t k = 0; k < without.a.size(); ++k) share[std::size_t(without.id[k])] = share[std::size_t(without.id[k])] - without.a[k];
    return share;
}

} // namespace

// At a plane rough floor every wall point lies at a positive depth, so this law's factor is half of the mirror image's everywhere; its
// first step starts from the same stresses, so its walls' forces differ by their share of the strain of this step alone.
TEST(AddingAWallLaw, ItsFactorScalesTheForceOfTheWalls)
{
    const auto mirrored = share_of_walls<MirrorImage, Native<double>>(), half = share_of_walls<StandsStill, Native<double>>();
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < mirrored.size(); ++i) {
        worst = std::max(worst, length(half[i] - 0.5 * mirrored[i])), largest = std::max(largest, length(mirrored[i]));
    }
    EXPECT_GT(largest, 1);
    EXPECT_LT(worst, 0.02 * largest);
}

TEST(AddingAWallLaw, AnyLanesGiveTheSameBits)
{
    const auto plain = run<StandsStill, double>(on_a_floor()), lanes = run<StandsStill, Native<double>>(on_a_floor());
    EXPECT_TRUE(plain.a == lanes.a);
    EXPECT_EQ(plain.energy.wall, lanes.energy.wall);
}
