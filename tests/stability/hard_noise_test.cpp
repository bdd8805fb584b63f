// Hard cases of the stress field: noise (H2), nearly incompressible soil (H5), irregular spacing (H15), layers (H16).
#include "tests/stability/hard.hpp"
#include <map>
#include <random>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

const std::string settling = "damping = { ratio = 1.0, until = 100.0 }\n";
const std::string diffusion = "stress_diffusion = { zeta = 0.1 }\n";

/// Surface: the highest particle in every strip two spacings wide.
std::map<long, double> surface(const Simulation& s)
{
    std::map<long, double> z;
    each(s, [&](Index i) {
        const Vector x = position(s, i);
        auto& highest = z.try_emplace(std::lround(x.x / (2 * s.scene().space.spacing)), -1.0).first->second;
        highest = std::max(highest, x.z);
    });
    return z;
}

struct Noise {
    double resting = 0, flowing = 0; // N of sigma_zz
    std::map<long, double> profile;
};
Noise collapse_noise(const std::string& effects)
{
    auto t = collapse(0.02, 0.6, 0.6, 2.0, weight + mild + effects);
    Simulation sim(Comm::world(), t.scene());
    Noise n;
    run_to(sim, 0.25);
    n.flowing = noise_of_sigma_zz(sim);
    run_to(sim, t.end);
    n.resting = noise_of_sigma_zz(sim), n.profile = surface(sim);
    return n;
}

struct Column {
    double p = 0, zz = 0, noise = 0; // L2 errors
    double kinetic = 0;              // greatest, over the potential energy above the floor
};
/// An elastic column of 1 m, sideways periodic; its particles may stand up to `jitter` spacings off the lattice.
Column column(double poisson, const std::string& effects, double jitter, const char* start, double crossings)
{
    SceneText t;
    t.spacing = 0.05, t.density = 2100, t.young = 15e6, t.poisson = poisson;
    const double width = 8 * t.spacing;
    t.space = periodic(width, -1, 3);
    t.bodies = box("body", {0, 0, 0}, {width, 0, 1}, fmt::format("soil = \"s\"\nstress = \"{}\"", start));
    t.walls = box("wall", {0, 0, -4 * t.spacing}, {width, 0, 0}, "");
    t.effects = weight + effects;
    t.end = crossings / t.p_wave();
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> kick(-jitter * t.spacing, jitter * t.spacing);
    const double k0 = t.k0();
    RunOptions options;
    if (jitter > 0)
        options = starting_with([&](Particles& p, Index i, Vector x) {
            x.x += kick(random), x.z = std::max(0.2 * t.spacing, x.z + kick(random));
            x.x = std::clamp(x.x, 1e-9, width - 1e-9);
            set_position(p, i, x);
            const double s = -t.density * gravity * std::max(0.0, 1 - x.z);
            if (start == std::string("at rest")) set_stress(p, i, {k0 * s, k0 * s, s, 0, 0, 0});
        });
    Simulation sim(Comm::world(), t.scene(), options);
    Column c;
    const double potential = 0.5 * t.density * gravity * width; // per metre of thickness
    const double thick = t.spacing / t.spacing;
    outcome(sim, [&](const Simulation& s) {
        if (s.steps() % 20 == 0) c.kinetic = std::max(c.kinetic, s.ledger().state.kinetic / (potential * thick));
    });
    ErrorNorms p, zz;
    each(sim, [&](Index i) {
        const double expected = -t.density * gravity * (1 - origin(sim, i).z);
        const Stress s = stress(sim, i);
        zz.add(s.zz, expected), p.add(trace(s) / 3, (1 + 2 * k0) / 3 * expected);
    });
    c.p = p.L2(), c.zz = zz.L2();
    c.noise = noise(
        sim, [&](Index i) { return trace(stress(sim, i)) / 3; }, t.density * gravity * t.spacing);
    return c;
}

} // namespace

TEST(Noise, NoiseOfTheStress)
{
    Case c("H2");
    const auto with = collapse_noise(diffusion), without = collapse_noise("");
    EXPECT_TRUE(c.at_most("collapse, zeta = 0.1: N of sigma_zz while it flows", with.flowing, "1", 0.10,
                          {.note = "2.5 times less than without", .achieved = 0.25}));
    EXPECT_TRUE(c.at_most("collapse, zeta = 0.1: N of sigma_zz at rest", with.resting, "1", 0.02,
                          {.note = "3.6 times less than without", .achieved = 0.12}));
    double apart = 0, worst = 0;
    int count = 0;
    for (const auto& [strip, z] : with.profile)
        if (const auto other = without.profile.find(strip); other != without.profile.end() && z > 0.04)
            apart += std::fabs(z - other->second), worst = std::max(worst, std::fabs(z - other->second)), ++count;
    EXPECT_TRUE(c.at_most("mean distance of the surfaces with and without diffusion", apart / count / 0.02, "dx", 1));
    c.report("greatest distance of the surfaces with and without diffusion", worst / 0.02, "dx");
    EXPECT_FALSE(c.control_at_most("no diffusion: N of sigma_zz while it flows", without.flowing, "1", 0.10));
    EXPECT_FALSE(c.control_at_most("no diffusion: N of sigma_zz at rest", without.resting, "1", 0.02));
    const auto still = column(0.3, settling + diffusion, 0, "none", 30);
    EXPECT_TRUE(c.at_most("settled column, zeta = 0.1: N of the mean stress", still.noise, "1", 0.02));
}

TEST(Noise, NearlyIncompressibleColumn)
{
    Case c("H5");
    const auto cured = column(0.49, settling + mild + diffusion, 0, "none", 30);
    EXPECT_TRUE(c.at_most("column, nu = 0.49: L2 error of the mean stress", cured.p, "1", 0.05));
    EXPECT_TRUE(c.at_most("column, nu = 0.49: N of the mean stress", cured.noise, "1", 0.05));
    const auto bare = column(0.49, "", 0, "none", 30);
    EXPECT_FALSE(c.control("column, nu = 0.49, neither damping nor viscosity: L2 error of the mean stress", bare.p, "1",
                           "<= 0.05, N <= 0.05", bare.p <= 0.05 && bare.noise <= 0.05));
}

TEST(Noise, IrregularStart)
{
    Case c("H15");
    const std::string unequal = "all particles have the same mass and volume: sum of V grad W is not zero; the cure (volumes of a Voronoi "
                                "cell, relaxed start) is not in the solver";
    const auto rest = column(0.3, mild, 0.3, "at rest", 3);
    EXPECT_TRUE(c.at_most("jitter 0.3 dx, stress at rest: greatest kinetic over potential energy", rest.kinetic, "1", 1e-4,
                          {.note = unequal, .achieved = 3e-4}));
    EXPECT_TRUE(c.at_most("jitter 0.3 dx, stress at rest: L2 error of sigma_zz after 3 H/c_p", rest.zz, "1", 0.05,
                          {.note = unequal, .achieved = 1.5}));
    const auto settled = column(0.3, settling + mild, 0.3, "at rest", 30);
    c.report("jitter 0.3 dx, settled: L2 error of sigma_zz", settled.zz, "1");
    c.report("jitter 0.3 dx, settled with stress diffusion: L2 error of sigma_zz",
             column(0.3, settling + mild + diffusion, 0.3, "at rest", 30).zz, "1");
    const auto shocked = column(0.3, mild, 0.3, "none", 3);
    EXPECT_FALSE(
        c.control_at_most("jitter 0.3 dx, no stress at the start: greatest kinetic over potential energy", shocked.kinetic, "1", 1e-4));
}

TEST(Noise, LayersOfStiffnessAndDensity)
{
    Case c("H16");
    const double dx = 0.05, width = 8 * dx;
    const std::string kink = "probably the kink: d sigma_zz/dz doubles at the interface and the kernel rounds it over its support";
    for (const double ratio : {10.0, 100.0}) {
        SceneText t;
        t.spacing = dx, t.density = 1000, t.young = 2e6;
        t.space = periodic(width, -1, 3);
        t.more_soils = fmt::format("[soil.below]\ndensity = 2000\nyoung = {}\npoisson = 0.3\ncohesion = 1.0e12\n", ratio * t.young);
        t.bodies = box("body", {0, 0, 0}, {width, 0, 0.5}, "soil = \"below\"") + box("body", {0, 0, 0.5}, {width, 0, 1});
        t.walls = box("wall", {0, 0, -4 * dx}, {width, 0, 0}, "");
        t.effects = weight + settling + mild;
        t.end = 20 / t.p_wave();
        Simulation sim(Comm::world(), t.scene());
        EXPECT_TRUE(outcome(sim).held());
        const double load = t.density * gravity * 0.5; // at the interface
        double worst = 0;
        std::vector<std::vector<double>> rows;
        const auto expected = [&](double z) { return z > 0.5 ? -t.density * gravity * (1 - z) : -load - 2000 * gravity * (0.5 - z); };
        each(sim, [&](Index i) {
            const double z = origin(sim, i).z;
            if (std::fabs(z - 0.5) < 2.1 * dx) worst = std::max(worst, std::fabs(stress(sim, i).zz - expected(z)) / load);
            if (origin(sim, i).x < dx) rows.push_back({z, stress(sim, i).zz, expected(z)});
        });
        // Continuity: both sides extrapolated to the interface from their two rows next to it.
        double row[4] = {};
        int in_row[4] = {};
        each(sim, [&](Index i) {
            const int k = int(std::floor((origin(sim, i).z - 0.5) / dx)) + 2;
            if (k >= 0 && k < 4) row[k] += stress(sim, i).zz, ++in_row[k];
        });
        for (int k = 0; k < 4; ++k) row[k] /= in_row[k];
        const double below = 1.5 * row[1] - 0.5 * row[0], above = 1.5 * row[2] - 0.5 * row[3];
        EXPECT_TRUE(c.at_most(fmt::format("E 1:{}, density 1:2: jump of sigma_zz at the interface over its value", ratio),
                              std::fabs(above - below) / load, "1", 0.02, {.note = kink, .achieved = 0.25}));
        EXPECT_TRUE(
            c.at_most(fmt::format("E 1:{}, density 1:2: worst error of sigma_zz within 2 dx of the interface over that at it", ratio),
                      worst, "1", 0.02, {.note = kink, .achieved = 0.1}));
        c.curve(fmt::format("ratio_{}", ratio), {"z", "sigma_zz", "exact"}, rows);
        // Negative control: the form sigma_i/rho_i^2 + sigma_j/rho_j^2 under one uniform stress that both layers bear at the interface:
        // no force should act there. Measured as the acceleration it gives over g, next to the one of (sigma_i + sigma_j)/(rho_i rho_j).
        const double h = t.h * dx;
        double adjoint = 0, textbook = 0;
        each(sim, [&](Index i) {
            const Vector x = origin(sim, i);
            if (std::fabs(x.x - 0.5 * width) > dx || std::fabs(x.z - 0.5) > 0.6 * dx) return;
            double a = 0, b = 0;
            each(sim, [&](Index j) {
                const Vector d = x - origin(sim, j);
                const double r = length(d), q = r / h;
                if (q >= 2 || r == 0) return;
                const double slope = (q < 1 ? -3 * q + 2.25 * q * q : -0.75 * (2 - q) * (2 - q)) * 10 / (7 * pi * h * h * h);
                const double gz = slope * d.z / r, ri = x.z > 0.5 ? 1000 : 2000, rj = origin(sim, j).z > 0.5 ? 1000 : 2000,
                             m = rj * dx * dx;
                a += m * 2 * load / (ri * rj) * gz, b += m * load * (1 / (ri * ri) + 1 / (rj * rj)) * gz;
            });
            adjoint = std::max(adjoint, std::fabs(a) / gravity), textbook = std::max(textbook, std::fabs(b) / gravity);
        });
        if (ratio > 10) continue;
        EXPECT_TRUE(c.at_most("acceleration at the interface under uniform stress over g", adjoint, "1", 0.02));
        EXPECT_FALSE(c.control_at_most("the same with sigma/rho^2", textbook, "1", 0.02));
    }
}
