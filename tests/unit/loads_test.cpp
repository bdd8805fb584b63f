// Loads: the lattice sum behind their pressures, and the area that is seen along a normal.
#include "solver/run/loads.hpp"
#include <gtest/gtest.h>
#include <random>

using namespace kuzure;

namespace {

/// A block of a lattice, n[0] x n[1] x n[2], turned about y; its faces' areas as the kernel sees them are those of its outer two layers.
Particles block(const Scene& s, std::array<int, 3> n, double angle, double jitter)
{
    Particles p;
    p.require(field::position, field::load, field::load_push);
    std::mt19937 g(7);
    const auto u = [&] { return jitter * std::uniform_real_distribution(-1.0, 1.0)(g); };
    const double d = s.space.spacing, c = std::cos(angle), e = std::sin(angle);
    for (int x = 0; x < n[0]; ++x)
        for (int y = 0; y < n[1]; ++y)
            for (int z = 0; z < n[2]; ++z) {
                const Index i = p.size();
                p.resize(i + 1);
                const double a = d * (x + 0.5) + u(), b = d * (z + 0.5) + u();
                p[field::position].set(i, Vector{c * a + e * b, s.dimensions == 3 ? d * (y + 0.5) + u() : 0, c * b - e * a});
                p[field::load].set(i, 1);
                const double seen = z == n[2] - 1 ? 0.85 : z == n[2] - 2 ? 0.15 : 0;
                p[field::load_push].set(i, -(seen * (s.dimensions == 3 ? d * d : d)) * Vector{e, 0, c});
            }
    return p;
}
Scene scene_of(int dimensions, Vector normal)
{
    Scene s;
    s.dimensions = dimensions, s.space.spacing = 0.1;
    s.loads = {{.pressure = 1.0, .normal = normal}};
    return s;
}
double pushed(const Particles& p, Vector along)
{
    double sum = 0;
    for (Index i = 0; i < p.size(); ++i) sum += dot(p[field::load_push][i], along);
    return sum;
}

} // namespace

TEST(Loads, UnitPressureIsThatOfTheLattice)
{
    // sums made independently in another language
    const auto of = [](int dimensions, double h, scene::Kernel kernel) {
        Scene s;
        s.dimensions = dimensions, s.space.h = h, s.accuracy.kernel = kernel;
        s.accuracy.kernel_norm = scene::KernelNorm::Continuum;
        return 1 / unit_pressure(s);
    };
    EXPECT_NEAR(of(2, 1.3, scene::Kernel::WendlandC2), 0.973921482143377, 1e-12);
    EXPECT_NEAR(of(2, 1.5, scene::Kernel::WendlandC2), 0.997399268443895, 1e-12);
    EXPECT_NEAR(of(3, 1.2, scene::Kernel::WendlandC2), 0.985229273917980, 1e-12);
    EXPECT_NEAR(of(3, 1.5, scene::Kernel::WendlandC2), 1.000619300137273, 1e-12);
    for (const auto kernel : {scene::Kernel::CubicSpline, scene::Kernel::WendlandC4})
        for (const int d : {2, 3}) EXPECT_NEAR(of(d, 2.5, kernel), 1, 3e-3) << d; // consistent where neighbours are many
}

TEST(Loads, TheAreaSeenAlongANormalIsTheFaces)
{
    const SingleRank alone;
    const std::array load{0};
    for (const int dimensions : {2, 3}) {
        const double wide = dimensions == 3 ? 0.5 : 1.0;
        for (const double angle : {0.0, 0.3, -1.1}) {
            const Vector normal{std::sin(angle), 0, std::cos(angle)};
            const Scene s = scene_of(dimensions, 3.0 * normal);
            Particles p = block(s, {12, dimensions == 3 ? 5 : 1, 4}, angle, 0);
            set_pushes(alone, s, load, p);
            EXPECT_NEAR(pushed(p, normal), -1.2 * wide, 1e-7) << angle;
            double deep = 0, second = 0;
            for (Index i = 0; i < p.size(); ++i) {
                const double z = dot(p[field::position][i], normal), f = -dot(p[field::load_push][i], normal);
                EXPECT_LT(length(p[field::load_push][i] + f * normal), 1e-12);
                (z < 0.2 ? deep : z < 0.3 ? second : deep) += z < 0.3 ? f : 0;
            }
            EXPECT_LT(deep, 1e-7);
            EXPECT_NEAR(second, 0.15 * 1.2 * wide, 1e-7); // as the kernels' areas
        }
        // seen from aside: the top and the side together
        const double angle = 0.5;
        const Vector aside{std::sin(angle), 0, std::cos(angle)};
        const Scene s = scene_of(dimensions, aside);
        Particles p = block(s, {12, dimensions == 3 ? 5 : 1, 4}, 0, 0);
        set_pushes(alone, s, load, p);
        EXPECT_NEAR(pushed(p, aside), -(1.2 * aside.z + 0.4 * aside.x) * wide, 0.1 * wide); // ends to half a spacing each
        // disorder leaves few gaps; the ends reach half a sample further
        Particles shaken = block(s, {40, dimensions == 3 ? 20 : 1, 4}, angle, 0.02);
        set_pushes(alone, scene_of(dimensions, aside), load, shaken);
        EXPECT_NEAR(pushed(shaken, aside), -4.0 * (dimensions == 3 ? 2.0 : 1.0), dimensions == 3 ? 0.3 : 0.05);
    }
}

TEST(Loads, ATractionGoesItsOwnWay)
{
    const SingleRank alone;
    const std::array load{0};
    Scene s = scene_of(3, {0, 0, 1});
    s.loads[0] = {.traction = Vector{5, -1, 2}, .normal = Vector{0, 0, 1}};
    Particles p = block(s, {6, 5, 4}, 0, 0);
    set_pushes(alone, s, load, p);
    const double area = 0.6 * 0.5;
    EXPECT_NEAR(pushed(p, {1, 0, 0}), 5 * area, 1e-9);
    EXPECT_NEAR(pushed(p, {0, 1, 0}), -1 * area, 1e-9);
    EXPECT_NEAR(pushed(p, {0, 0, 1}), 2 * area, 1e-9);
}
