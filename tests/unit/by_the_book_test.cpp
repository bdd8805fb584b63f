// Every fast pass against solver/kernels/by_the_book.hpp: every compiled model, in 3-D and 2-D, plain, in lanes and in mixed precision,
// on lattice, jitter, disorder and hard arrangements, alone and beside walls of every shape and surface.
#include "solver/kernels/by_the_book.hpp"
#include "tests/unit/clouds.hpp"
#include "tests/unit/run_pass.hpp"
#include <gtest/gtest.h>
#include <numbers>

using namespace kuzure;
using namespace kuzure::measured;
using book::operator+;
using book::operator*;

namespace {

// ---- the book's side ---------------------------------------------------------------------------------------------------
constexpr double damping = 0.7; // 1/s
struct Read {
    std::vector<book::Rates> rates;
    int stick = 0, slip = 0, between = 0, off = 0, clear_of_walls = 0; // particles at Coulomb walls; and beside none
};
Read by_the_book(const Cloud& c, const book::WallLaw& law = book::mirrored, const Scene* other_scene = nullptr)
{
    const Scene& s = other_scene ? *other_scene : c.scene;
    const auto& p = c.particles;
    std::vector<Vector> x, v;
    std::vector<double> density;
    std::vector<Stress> stress;
    std::vector<std::int32_t> soil;
    for (Index i = 0; i < p.size(); ++i) {
        x.push_back(p[field::position][i]), v.push_back(p[field::velocity][i]), density.push_back(p[field::density][i]);
        stress.push_back(p[field::stress][i]), soil.push_back(p[field::soil][i]);
    }
    std::vector<book::WallPoint> points;
    for (const auto& w : c.walls)
        for (std::size_t k = 0; k < w.x.size(); ++k)
            points.push_back(book::wall_point({w.x[k], w.y[k], w.z[k]}, w.wall, s.walls, s.dimensions));
    const book::Setting setting{s.interactions(), c.soils, s.walls, damping, law};
    const book::Soil ground{x, v, density, stress, soil};
    Read read{book::rates(ground, points, setting)};
    for (std::size_t i = 0; i < x.size(); ++i) {
        read.clear_of_walls += !read.rates[i].beside_wall;
        for (int w = 0; w < int(s.walls.size()); ++w) {
            if (s.walls[w].surface != scene::Surface::Coulomb) continue;
            const auto share = book::wall_share(w, points, setting, book::particle(ground, i, setting));
            if (!share.felt) continue;
            ++(share.pulls ? read.off : share.sliding == 1 ? read.slip : share.sliding < 1e-2 ? read.stick : read.between);
        }
    }
    return read;
}

// ---- the two compared ----------------------------------------------------------------------------------------------------
double norm(const Mat3<double>& m) { return std::sqrt(dot(m.x, m.x) + dot(m.y, m.y) + dot(m.z, m.z)); }
double norm(const Stress& s) { return std::sqrt(contract(s, s)); }

/// Largest differences, each over what its sums may lose to rounding: the largest value, or what the largest stress or speed
/// makes of one neighbour.
struct Difference {
    double acceleration = 0, L = 0, density = 0, diffusion = 0, wall = 0, viscous = 0, damped = 0;
    std::int64_t pairs = 0;
    double largest() const { return std::max({acceleration, L, density, wall, viscous, damped}); } // but for diffusion
};
std::ostream& operator<<(std::ostream& to, const Difference& d)
{
    return to << "a " << d.acceleration << " L " << d.L << " density " << d.density << " diffusion " << d.diffusion << " wall power "
              << d.wall << " viscous power " << d.viscous << " damping power " << d.damped << " pairs " << d.pairs;
}
Difference difference(const Cloud& c, const measured::Rates& pass, const std::vector<book::Rates>& book)
{
    const auto& p = c.particles;
    const double h = c.scene.smoothing_length(), volume = c.scene.particle_volume();
    double stress = 0, speed = 0, density = 0, a = 0, L = 0, diffusion = 0;
    for (Index i = 0; i < p.size(); ++i) {
        stress = std::max(stress, norm(p[field::stress][i])), speed = std::max(speed, length(p[field::velocity][i]));
        density = std::max(density, p[field::density][i]);
        a = std::max(a, length(book[i].acceleration)), L = std::max(L, norm(book[i].L));
        diffusion = std::max(diffusion, norm(book[i].diffusion));
    }
    const double of_a = std::max(a, stress / (density * h)), of_L = std::max(L, speed / h);
    const double of_diffusion = std::max(diffusion, 1e-300);
    const double of_power = volume * (std::max(stress, density * a * h) * of_L + stress * diffusion / c.soils[0].shear);
    Difference d;
    const auto note = [](double& worst, double is, double of) { worst = is / of <= worst ? worst : is / of; }; // NaN is the worst
    for (Index i = 0; i < p.size(); ++i) {
        const auto& b = book[i];
        note(d.acceleration, length(pass.acceleration[i] - b.acceleration), of_a);
        note(d.L, norm(pass.L[i] + -1.0 * b.L), of_L);
        note(d.density, std::fabs(pass.density[i] - b.density), density * of_L);
        note(d.diffusion, norm(pass.diffusion[i] - b.diffusion), of_diffusion);
    }
    for (const auto& g : pass.groups) {
        book::Rates sum;
        for (Index i = g.first; i < g.first + g.count; ++i) {
            sum.wall_power += book[i].wall_power, sum.viscous_power += book[i].viscous_power;
            sum.damping_power += book[i].damping_power, sum.pairs += book[i].pairs;
        }
        note(d.wall, std::fabs(g.wall - sum.wall_power), g.count * of_power);
        note(d.viscous, std::fabs(g.viscous - sum.viscous_power), g.count * of_power);
        note(d.damped, std::fabs(g.damping - sum.damping_power), g.count * of_power);
        d.pairs = std::max(d.pairs, std::abs(g.pairs - sum.pairs));
    }
    return d;
}

// Rounding alone leaves 3e-15 in double, but the reciprocals of AVX-512 are good to 1e-12; in mixed precision 1e-5: places to
// h/2^20, stresses to 2^-24 of the largest. Stress diffusion of two on one point: the pass takes them to be 1e-6 h apart.
constexpr double sharp = 5e-12, sharp_diffusion = 5e-11, rough = 3e-5;
void expect_by_the_book(const Cloud& c, const Read& read, const std::string& what)
{
    for (const auto precision : {scene::Precision::Double, scene::Precision::Mixed})
        for (const auto arithmetic : {Arithmetic::Scalar, Arithmetic::Simd}) {
            Cloud d = c;
            d.scene.accuracy.precision = precision;
            const auto pass = measured::run_pass(d, arithmetic, damping);
            const auto off = difference(c, pass, read.rates);
            const bool exact = precision == scene::Precision::Double;
            EXPECT_LT(off.largest(), exact ? sharp : rough) << pass.model << ", " << c.scene.dimensions << "-D, " << what << ": " << off;
            EXPECT_LT(off.diffusion, exact ? sharp_diffusion : rough) << pass.model << ", " << c.scene.dimensions << "-D, " << what;
            EXPECT_EQ(off.pairs, 0) << pass.model << ", " << c.scene.dimensions << "-D, " << what;
        }
}

} // namespace

TEST(ByTheBook, EveryModelFarFromWalls)
{
    for (const Scene& s : scenes(scene::Scheme::LeapFrog))
        for (int kind = Lattice; kind <= Soils; ++kind) {
            if (kind == Creep) continue;
            const Cloud c = cloud(Arrangement(kind), s);
            expect_by_the_book(c, by_the_book(c), arrangements[kind]);
        }
}

TEST(ByTheBook, EveryModelBesideWallsOfEveryShapeAndSurface)
{
    int stick = 0, slip = 0, between = 0, off = 0, arrangement = 0;
    for (const Scene& bare : scenes(scene::Scheme::LeapFrog)) {
        for (int kind = 0; kind < 4; ++kind)
            for (int surface = 0; surface < 3; ++surface) {
                if (bare.dimensions == 2 && kind == 1) continue; // no cylinder in 2-D
                Scene s = bare;
                s.walls = {wall(kind, surface, s.dimensions)};
                const auto arranged = Arrangement(arrangement++ % 6); // another one for each wall and model
                const Cloud c = cloud(arranged, s);
                const Read read = by_the_book(c);
                EXPECT_GT(read.clear_of_walls, 0);
                EXPECT_LT(read.clear_of_walls, c.particles.size() - 10);
                expect_by_the_book(c, read, std::string(surfaces[surface]) + " " + shapes[kind] + ", " + arrangements[arranged]);
                stick += read.stick, slip += read.slip, between += read.between, off += read.off;
            }
        Scene s = bare;
        s.walls = corner(s.dimensions);
        const auto arranged = Arrangement(arrangement++ % 6);
        const Cloud c = cloud(arranged, s);
        expect_by_the_book(c, by_the_book(c), std::string("corner, ") + arrangements[arranged]);
    }
    // every branch of Coulomb's law has been taken
    EXPECT_GT(stick, 50);
    EXPECT_GT(slip, 50);
    EXPECT_GT(between, 50);
    EXPECT_GT(off, 50);
}

TEST(ByTheBook, PoreWaterAndNoGravity)
{
    for (const int dimensions : {2, 3}) {
        Scene s = everything(dimensions, scene::Scheme::LeapFrog);
        expect_by_the_book(cloud(Jitter, s), by_the_book(cloud(Jitter, s)), "pore water");
        s.walls = corner(dimensions);
        expect_by_the_book(cloud(Soils, s), by_the_book(cloud(Soils, s)), "pore water, corner, two soils");
        s.effects.gravity.reset();
        expect_by_the_book(cloud(Disorder, s), by_the_book(cloud(Disorder, s)), "no gravity, corner");
    }
}

// The kernels of the book themselves: their integral over space is one, and the slope is the value's.
TEST(ByTheBook, KernelsAreNormalizedAndTheirSlopesAreTheirDerivatives)
{
    for (const auto kind : {scene::Kernel::CubicSpline, scene::Kernel::WendlandC2, scene::Kernel::WendlandC4})
        for (const int dimensions : {2, 3}) {
            const book::Kernel kernel{kind, dimensions, 0.3};
            const int n = 2000;
            const double step = 0.6 / n, pi = std::numbers::pi, scale = std::pow(0.3, -dimensions);
            double integral = 0;
            for (int k = 0; k < n; ++k) {
                const double r = (k + 0.5) * step;
                integral += kernel.value(r) * (dimensions == 2 ? 2 * pi * r : 4 * pi * r * r) * step;
                const double derivative = (kernel.value(r + 1e-6) - kernel.value(r - 1e-6)) / 2e-6;
                ASSERT_NEAR(kernel.slope(r), derivative, 1e-5 * scale / 0.3) << int(kind) << " " << dimensions << " at " << r;
            }
            EXPECT_NEAR(integral, 1, 1e-6) << int(kind) << " " << dimensions;
            EXPECT_EQ(kernel.value(0.6), 0);
            EXPECT_EQ(kernel.slope(0.6), 0);
        }
}

// ---- controls: what a comparison as sharp as this must notice ------------------------------------------------------------
namespace {

/// Today's law with another range of 1 + d_B/d_A, or another sign.
book::WallLaw other_mirror(double least, double most, double sign = 1)
{
    return [=](const book::Particle& i, const book::WallPoint& j, const scene::Contact& nearest, double volume) {
        const double both = dot(i.x - j.x, nearest.normal);
        const double factor = std::clamp(nearest.distance > 0 ? both / nearest.distance : both > 0 ? most : least, least, most);
        book::Shown shown = book::mirrored(i, j, nearest, volume);
        shown.soil.v = (1 - sign * factor) * i.v;
        return shown;
    };
}
/// A law that reads the wall point: d_A = x_ij . n_j - d_B with the point's own normal and depth.
book::Shown mirrored_at_each_point(const book::Particle& i, const book::WallPoint& j, const scene::Contact&, double volume)
{
    const double above = dot(i.x - j.x, j.normal) - j.depth;
    const double factor = above > 0 ? std::clamp(1 + j.depth / above, 1.0, 1.5) : 1.5;
    return {{j.x, (1 - factor) * i.v, i.density, i.stress, volume, i.c_p}, j.normal};
}
Difference off_from(const Cloud& c, const Read& read)
{
    return difference(c, measured::run_pass(c, Arithmetic::Simd, damping), read.rates);
}

} // namespace

TEST(ByTheBook, NoticesAPlantedFaultInTheWalls)
{
    for (const int dimensions : {2, 3})
        for (int surface = 0; surface < 3; ++surface) {
            Scene s = everything(dimensions, scene::Scheme::LeapFrog);
            s.walls = {wall(2, surface, dimensions)};
            const Cloud c = cloud(Jitter, s);
            const std::string what = std::string(surfaces[surface]) + ", " + std::to_string(dimensions) + "-D";
            const auto expect_noticed = [&](const Read& planted, const char* fault) {
                EXPECT_GT(off_from(c, planted).largest(), 10 * rough) << what << ": " << fault;
            };
            EXPECT_LT(off_from(c, by_the_book(c, other_mirror(1, 1.5))).largest(), sharp) << what; // the control of the controls
            expect_noticed(by_the_book(c, other_mirror(1, 2)), "cap of 1 + d_B/d_A");
            expect_noticed(by_the_book(c, other_mirror(0, 1.5)), "least 1 + d_B/d_A");
            expect_noticed(by_the_book(c, other_mirror(1, 1.5, -1)), "sign of the mirrored velocity");
            expect_noticed(by_the_book(c, mirrored_at_each_point), "another wall law");
            for (int other = 0; other < 3; ++other) {
                Scene mistaken = s;
                mistaken.walls = {wall(2, other, dimensions)};
                if (other != surface) expect_noticed(by_the_book(c, book::mirrored, &mistaken), surfaces[other]);
            }
            if (surface == 2) {
                Scene mistaken = s;
                mistaken.walls[0].friction_angle *= 1.01;
                expect_noticed(by_the_book(c, book::mirrored, &mistaken), "friction angle");
            }
        }
}

TEST(ByTheBook, NoticesAPlantedFaultInEveryTerm)
{
    for (const int dimensions : {2, 3}) {
        const Scene s = everything(dimensions, scene::Scheme::LeapFrog);
        const Cloud c = cloud(Hard, s);
        const auto planted = [&](const char* fault, auto change) {
            Scene mistaken = s;
            change(mistaken);
            const auto off = off_from(c, by_the_book(c, book::mirrored, &mistaken));
            EXPECT_GT(std::max(off.largest(), off.diffusion), 10 * rough) << fault << ", " << dimensions << "-D";
        };
        plant_faults(planted);
    }
}

// Each of the nine components of L, and its transpose, is seen.
TEST(ByTheBook, NoticesAFaultInAnyComponentOfL)
{
    Scene s = everything(3, scene::Scheme::LeapFrog);
    s.walls = {wall(3, 2, 3)};
    const Cloud c = cloud(Jitter, s);
    const auto pass = measured::run_pass(c, Arithmetic::Simd, damping);
    const Read read = by_the_book(c);
    EXPECT_LT(difference(c, pass, read.rates).L, sharp);
    for (int component = 0; component < 10; ++component) {
        auto planted = read.rates;
        for (auto& b : planted) {
            Mat3<double>& L = b.L;
            double* of[] = {&L.x.x, &L.x.y, &L.x.z, &L.y.x, &L.y.y, &L.y.z, &L.z.x, &L.z.y, &L.z.z};
            if (component < 9) *of[component] *= -1;
            else std::swap(L.x.y, L.y.x), std::swap(L.x.z, L.z.x), std::swap(L.y.z, L.z.y);
        }
        EXPECT_GT(difference(c, pass, planted).L, 0.01) << component;
    }
}

// A wall law is one function: beside a plane the law that reads each wall point says what today's says, beside a bent wall not.
TEST(ByTheBook, AWallLawIsOneFunctionExchanged)
{
    const double e = edge(3);
    for (int surface = 0; surface < 3; ++surface) {
        Scene s = everything(3, scene::Scheme::LeapFrog);
        s.walls = {{scene::Box{{-6 * dx, -6 * dx, -6 * dx}, {e + 6 * dx, e + 6 * dx, 0}}, scene::Surface(surface), 0.3}};
        const Cloud plane = cloud(Jitter, s);
        EXPECT_LT(off_from(plane, by_the_book(plane, mirrored_at_each_point)).largest(), sharp) << surfaces[surface];
    }
}
