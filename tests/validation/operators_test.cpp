// SPH-1: what the sum over neighbours makes of a velocity field's gradient, on lattices and on jittered clouds.
//
// One step of 1 ps from zero stress leaves dt C : D in the stress of every particle, which gives back the strain rate D to
// round-off: dt is so short that nothing has moved.
#include "solver/physics/smoothing.hpp"
#include "tests/validation/case.hpp"
#include <random>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

struct VelocityField {
    const char* name;
    Vector (*value)(Vector x);
    Stress (*strain_rate)(Vector x); // 1/s
};
/// Linear: every component of D is at work.
const VelocityField linear{"linear",
                           [](Vector x) {
                               return Vector{0.7 * x.x - 0.3 * x.z, 0, 0.5 * x.x + 0.9 * x.z};
                           },
                           [](Vector) { return Stress{0.7, 0, 0.9, 0, 0, 0.1}; }};
const VelocityField quadratic{"quadratic",
                              [](Vector x) {
                                  return Vector{x.x * x.x, 0, x.x * x.z + 0.5 * x.z * x.z};
                              },
                              [](Vector x) { return Stress{2 * x.x, 0, x.x + x.z, 0, 0, 0.5 * x.z}; }};
const VelocityField wave{"sine",
                         [](Vector x) {
                             return Vector{std::sin(2 * pi * x.x), 0, std::sin(2 * pi * x.z)};
                         },
                         [](Vector x) { return Stress{2 * pi * std::cos(2 * pi * x.x), 0, 2 * pi * std::cos(2 * pi * x.z), 0, 0, 0}; }};

/// D from the stress of one step: eps = C^-1 sigma.
Stress strain_rate(const SceneText& t, const Stress& sigma, double dt)
{
    const double p = trace(sigma) / 3;
    const Stress s = deviator(sigma);
    const double volumetric = p / (3 * t.bulk());
    return (1 / dt) * plus_isotropic((1 / (2 * t.shear())) * s, volumetric);
}

/// Errors of D over the particles of a unit square whose support is full.
ErrorNorms gradient_error(SceneText t, const VelocityField& f, double jitter)
{
    t.bodies = box("body", {0, 0, 0}, {1, 0, 1});
    t.end = 1e-12, t.time = "step = 1.0e-12";
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> offset(-jitter * t.spacing, jitter * t.spacing);
    Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                       x = {x.x + offset(random), 0, x.z + offset(random)};
                       set_position(p, i, x);
                       set_velocity(p, i, f.value(x));
                   }));
    sim.step();
    ErrorNorms norms;
    const double margin = (2 * t.h + jitter + 0.5) * t.spacing;
    each(sim, [&](Index i) {
        const Vector x = origin(sim, i);
        if (x.x < margin || x.x > 1 - margin || x.z < margin || x.z > 1 - margin) return;
        const Stress d = strain_rate(t, stress(sim, i), sim.dt()), exact = f.strain_rate(x);
        norms.add(d.xx, exact.xx), norms.add(d.zz, exact.zz), norms.add(d.xz, exact.xz);
    });
    return norms;
}

} // namespace

TEST(Operators, StandardGradientConvergesToItsFloor)
{
    Case c("SPH-1");
    std::vector<std::vector<double>> rows;
    for (const double h : {1.2, 1.5, 2.0})
        for (const double jitter : {0.0, 0.1, 0.2})
            for (const VelocityField* f : {&linear, &quadratic, &wave})
                for (const int n : {20, 40, 80}) {
                    SceneText t;
                    t.spacing = 1.0 / n, t.h = h;
                    t.accuracy = "kernel = \"wendland c2\"";
                    const auto e = gradient_error(t, *f, jitter);
                    rows.push_back({h, jitter, double(f == &linear ? 1 : f == &quadratic ? 2 : 3), double(n), e.L2(), e.Linf()});
                    if (n == 40 && f == &linear)
                        c.report(fmt::format("L2 of a linear field, h/dx = {}, jitter {}, wendland c2", h, jitter), e.L2(), "1");
                }
    c.curve("gradient", {"h_over_dx", "jitter", "field", "spacings", "L2", "Linf"}, rows);
    const auto of = [&](double h, double jitter, int field, int n) {
        for (const auto& r : rows)
            if (r[0] == h && r[1] == jitter && r[2] == field && r[3] == n) return r[4];
        return std::numeric_limits<double>::quiet_NaN();
    };
    // On a lattice linear fields are exact at every spacing, by the norm of the gradients; the published ones are M grad v with M = m 1.
    for (const double h : {1.2, 1.5})
        EXPECT_TRUE(c.at_most(fmt::format("linear field on a lattice, h/dx = {}", h), of(h, 0, 1, 40), "1", 1e-10));
    SceneText t;
    t.spacing = 1.0 / 40, t.h = 1.5, t.accuracy = "kernel = \"wendland c2\"\nkernel_norm = \"continuum\"";
    EXPECT_TRUE(c.near("the same by the published norm: floor, h/dx = 1.5", std::fabs(lattice_moment(WendlandC2(1.5, 2), 2) - 1),
                       gradient_error(t, linear, 0).L2(), "1", 1e-9));
    // Away from the floor (h/dx = 2) the smoothing error (kh)^2 is seen.
    EXPECT_TRUE(c.near("order on a lattice, sine, h/dx = 2, 20 to 40", 2, observed_order(of(2, 0, 3, 20), of(2, 0, 3, 40)), "1", 0.15));
    // Jitter makes errors of order one that only more neighbours cure: the standard operator does not converge.
    EXPECT_TRUE(c.at_most("jitter 0.2, h/dx = 2, 80 spacings: L2", of(2, 0.2, 1, 80), "1", 0.1));
    EXPECT_TRUE(c.at_most("jitter 0.2: L2 at h/dx = 2 over that at 1.2", of(2, 0.2, 1, 80) / of(1.2, 0.2, 1, 80), "1", 0.8));
    // Negative control: without correction a linear field on a jittered cloud is not exact.
    EXPECT_FALSE(c.control_at_most("uncorrected gradient, jitter 0.2, L2 of a linear field", of(1.5, 0.2, 1, 40), "1", 1e-10));
}

TEST(Operators, CorrectedGradientIsExactForLinearFields)
{
    Case c("SPH-1");
    for (const double h : {1.2, 1.5})
        for (const double jitter : {0.0, 0.1, 0.2}) {
            SceneText t;
            t.spacing = 1.0 / 40, t.h = h;
            t.accuracy = "kernel = \"wendland c2\"\ncorrection = \"gradient\"";
            const auto e = gradient_error(t, linear, jitter);
            EXPECT_TRUE(c.at_most(fmt::format("corrected, Linf of a linear field, h/dx = {}, jitter {}", h, jitter), e.Linf(), "1", 1e-10));
        }
}
