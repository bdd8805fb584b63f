// Elastic waves: speeds (SPH-4), a column under sudden gravity (SPH-8), impact on a rigid wall (SPH-12).
#include "solver/physics/smoothing.hpp"
#include "tests/validation/case.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// Phase speed (m/s) of a standing wave of length 1 m in a fully periodic strip, from the period of its mode's velocity.
double phase_speed(int spacings, bool shear, const SceneText& like)
{
    SceneText t = like;
    t.spacing = 1.0 / spacings;
    const double width = 8 * t.spacing, k = 2 * pi, c = shear ? t.s_wave() : t.p_wave();
    t.space = periodic(width, 0, 1, "\"x\", \"z\"");
    t.bodies = box("body", {0, 0, 0}, {width, 0, 1});
    t.end = 1.5 / c;
    // 1e-4 of the wave speed: strains of 1e-4, so that the wave is linear to 1e-4
    const double v0 = 1e-4 * c;
    Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                       const double v = v0 * std::cos(k * x.z);
                       set_velocity(p, i, shear ? Vector{v, 0, 0} : Vector{0, 0, v});
                   }));
    ZeroCrossings mode;
    while (!sim.finished() && mode.times().size() < 3) {
        double sum = 0;
        each(sim, [&](Index i) { sum += (shear ? velocity(sim, i).x : velocity(sim, i).z) * std::cos(k * origin(sim, i).z); });
        mode.add(sim.time(), sum);
        sim.step();
    }
    if (mode.times().size() < 3) return 0;
    return 1 / (mode.times()[2] - mode.times()[0]);
}

/// An elastic column over a wall, one spacing after another: height 1 m, periodic sideways.
SceneText column(int spacings)
{
    SceneText t;
    t.spacing = 1.0 / spacings;
    const double width = 8 * t.spacing, deep = 4 * t.spacing;
    t.space = periodic(width, -1, 3);
    t.bodies = box("body", {0, 0, 0}, {width, 0, 1});
    t.walls = box("wall", {0, 0, -deep}, {width, 0, 0}, "");
    return t;
}

} // namespace

TEST(Waves, TravelWithTheSpeedOfTheirModulus)
{
    Case c("SPH-4");
    std::vector<std::vector<double>> rows;
    for (const bool shear : {false, true}) {
        const std::string name = shear ? "S-wave" : "P-wave";
        SceneText t;
        const double exact = shear ? t.s_wave() : t.p_wave();
        std::vector<double> speed;
        for (const int n : {25, 50, 100}) {
            speed.push_back(phase_speed(n, shear, t));
            rows.push_back({double(shear), double(n), speed.back(), exact});
            const std::string what = fmt::format("{} speed, {} spacings a wavelength", name, n);
            if (n < 50) c.report(what, speed.back(), "m/s", fmt::format("closed form {:.4g} m/s", exact));
            else EXPECT_TRUE(c.near(what, exact, speed.back(), "m/s", 0.02));
        }
        // Gradients of linear fields are exact on the lattice: what is left is A (kh)^2, so the order is that of differences.
        const double limit = speed[2] + (speed[2] - speed[1]) / 3;
        EXPECT_TRUE(
            c.near(name + " observed order, 25, 50, 100 spacings", 2, observed_order(speed[1] - speed[0], speed[2] - speed[1]), "1", 0.1));
        EXPECT_TRUE(c.near(name + " limit of fine spacings", exact, limit, "m/s", 5e-4));
    }
    for (const bool shear : {false, true}) {
        const SceneText t = SceneText{}.with_default_kernel();
        const double exact = shear ? t.s_wave() : t.p_wave(), M = lattice_moment(WendlandC2(t.h, 2), 2);
        const auto name = fmt::format("{}-wave speed, 100 spacings a wavelength, default kernel", shear ? "S" : "P");
        EXPECT_TRUE(c.near(name, exact, phase_speed(100, shear, t), "m/s", 0.02));
        // The published gradients are M grad f for a linear f.
        SceneText published = t;
        published.accuracy += "\nkernel_norm = \"continuum\"";
        EXPECT_TRUE(c.near(name + ", published norm", M * exact, phase_speed(100, shear, published), "m/s", 2e-3,
                           {.note = fmt::format("closed form {:.4g} m/s times the lattice sum of the kernel", exact)}));
    }
    // Negative control: another Poisson's ratio is another speed.
    SceneText wrong;
    wrong.poisson = 0.25;
    EXPECT_FALSE(c.control("P-wave speed with poisson = 0.25", SceneText{}.p_wave(), phase_speed(50, false, wrong), "m/s", 0.02));
    c.curve("speed", {"shear", "spacings_per_wavelength", "speed", "closed_form"}, rows);
}

// Gravity that acts at once on an elastic column: the base stress swings between 0 and twice the weight with T = 4 H/c_p.
TEST(Waves, SuddenGravitySwingsTheColumn)
{
    Case c("SPH-8");
    struct Swung {
        double period = 0, peak = 0; // s, Pa
        std::vector<std::vector<double>> base;
    };
    const auto swing = [](SceneText t) {
        t.effects = "gravity = [0.0, 0.0, -9.81]";
        t.end = 5 / t.p_wave();
        Simulation sim(Comm::world(), t.scene());
        ZeroCrossings mean;
        Swung s;
        while (!sim.finished() && mean.times().size() < 2) {
            sim.step();
            double v = 0, base = 0;
            each(sim, [&](Index i) {
                v += velocity(sim, i).z;
                if (origin(sim, i).z < t.spacing) base -= stress(sim, i).zz / 8;
            });
            mean.add(sim.time(), v);
            s.peak = std::max(s.peak, base);
            s.base.push_back({sim.time(), base});
        }
        if (mean.times().size() == 2) s.period = mean.times()[1];
        return s;
    };
    for (const int n : {25, 50, 100}) {
        SceneText t = column(n);
        t.density = 2100, t.young = 15e6;
        const auto s = swing(t);
        const double period = 4 / t.p_wave();
        // the lowest particles stand half a spacing above the wall
        const double twice = 2 * t.density * gravity * (1 - 0.5 * t.spacing);
        const std::string at = fmt::format(", {} spacings", n);
        if (n < 50) {
            c.report("period" + at, s.period, "s", fmt::format("closed form {:.5g} s", period));
            c.report("peak base stress" + at, s.peak, "Pa", fmt::format("closed form {:.5g} Pa", twice));
            continue;
        }
        EXPECT_TRUE(c.near("period" + at, period, s.period, "s", 0.03));
        EXPECT_TRUE(c.near("peak base stress" + at, twice, s.peak, "Pa", 0.05));
        if (n > 50) continue;
        c.curve("base_stress", {"time", "stress"}, s.base);
        t.young = 12e6; // negative control
        EXPECT_FALSE(c.control("period with young = 12 MPa for 15 MPa", period, swing(t).period, "s", 0.03));
    }
}

// A bar that meets a rigid wall at v0: a stress of rho c_p v0 stands behind the wave until its reflection comes back.
TEST(Waves, ImpactOnARigidWall)
{
    Case c("SPH-12");
    const double v0 = 1, expected = SceneText{}.density * SceneText{}.p_wave() * v0;
    std::vector<std::vector<double>> rows;
    struct Impact {
        double plateau = 0, peak = 0; // Pa
    };
    const auto strike = [&](double alpha, double poisson) {
        SceneText t = column(100);
        t.poisson = poisson;
        t.bodies = box("body", {0, 0, 0}, {8 * t.spacing, 0, 1}, fmt::format("soil = \"s\"\nvelocity = [0.0, 0.0, -{}]", v0));
        if (alpha > 0) t.effects = fmt::format("viscosity = {{ alpha = {}, beta = 0.0 }}", alpha);
        t.end = 1.5 / t.p_wave();
        Simulation sim(Comm::world(), t.scene());
        Impact s;
        int samples = 0;
        while (!sim.finished()) {
            sim.step();
            double base = 0;
            each(sim, [&](Index i) { base -= origin(sim, i).z < 0.1 ? stress(sim, i).zz / 80 : 0; });
            // a tenth of the bar by the wall, once the wave has passed it and before it comes back
            if (sim.time() * t.p_wave() > 0.3) s.plateau += base, ++samples;
            s.peak = std::max(s.peak, base);
            rows.push_back({alpha, poisson, sim.time(), base});
        }
        s.plateau /= samples;
        return s;
    };
    const Impact s = strike(0.1, 0.3);
    EXPECT_TRUE(c.near("plateau stress, alpha = 0.1", expected, s.plateau, "Pa", 0.03));
    EXPECT_TRUE(c.at_most("overshoot, alpha = 0.1", s.peak / expected - 1, "1", 0.15));
    c.report("overshoot without viscosity", strike(0, 0.3).peak / expected - 1, "1");
    EXPECT_FALSE(c.control("plateau stress with poisson = 0.2 for 0.3", expected, strike(0.1, 0.2).plateau, "Pa", 0.03));
    c.curve("base_stress", {"alpha", "poisson", "time", "stress"}, rows);
}
