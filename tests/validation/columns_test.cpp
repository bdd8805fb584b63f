// Soil at rest and in slow shear: the K0 column (SPH-7), a basin with a wedge (SPH-9), Couette shear (SPH-10).
#include "tests/validation/case.hpp"

using namespace kuzure;
using namespace kuzure::validation;

namespace {

const std::string weight = "gravity = [0.0, 0.0, -9.81]\n";

struct Settled {
    double L2 = 0, base = 0, sideways = 0, settlement = 0; // of sigma_zz; of the lowest row; of sigma_xx; m
    std::vector<std::vector<double>> profile;
};

/// An elastic column of 1 m, periodic sideways, that settles under its weight.
Settled settle(int spacings, const std::string& effects, const std::string& stress, SceneText t = {})
{
    t.spacing = 1.0 / spacings, t.density = 2100, t.young = 15e6;
    const double width = 8 * t.spacing;
    t.space = periodic(width, -1, 3);
    t.bodies = box("body", {0, 0, 0}, {width, 0, 1}, fmt::format("soil = \"s\"\nstress = \"{}\"", stress));
    t.walls = box("wall", {0, 0, -4 * t.spacing}, {width, 0, 0}, "");
    t.effects = weight + effects;
    t.end = 30 / t.p_wave();
    Simulation sim(Comm::world(), t.scene());
    run_to(sim, t.end);
    Settled s;
    ErrorNorms vertical, sideways, base;
    each(sim, [&](Index i) {
        const Vector x = origin(sim, i);
        const Stress sigma = kuzure::validation::stress(sim, i);
        // sigma_zz = -rho g depth, sigma_xx = nu/(1 - nu) sigma_zz: of the soil's mass above, so at the depth it began at
        const double expected = -t.density * gravity * (1 - x.z);
        vertical.add(sigma.zz, expected), sideways.add(sigma.xx, t.k0() * expected);
        if (x.z < t.spacing) base.add(sigma.zz, expected);
        if (x.z > 1 - t.spacing) s.settlement = x.z - position(sim, i).z;
        if (x.x < t.spacing) s.profile.push_back({double(spacings), x.z, sigma.zz, sigma.xx, expected});
    });
    s.L2 = vertical.L2(), s.base = base.L2(), s.sideways = sideways.L2();
    return s;
}

/// A basin 2 m wide with a ramp of 45 degrees in its right corner, filled 1 m deep with what hardly resists shear.
Simulation basin(double spacing, const std::string& effects, double end, bool fluid = true)
{
    SceneText t;
    t.spacing = spacing, t.density = 2100;
    // K = 5 MPa and G = 1 kPa, with a strength of 1 Pa: a fluid that bears tension; else an elastic solid of the same K
    if (fluid) t.poisson = 0.4999, t.strength = "cohesion = 1.0";
    t.young = 3 * 5e6 * (1 - 2 * t.poisson);
    // Half a spacing off, so that lattice points stand as far from the ramp on both sides.
    const double d = 4 * spacing, foot = 1.6 - 0.5 * spacing, top = 0.4 + 0.5 * spacing;
    t.bodies = polygon("body", {{0, 0}, {foot, 0}, {2, top}, {2, 1}, {0, 1}});
    t.walls = box("wall", {-d, 0, -d}, {2 + d, 0, 0}, "") + box("wall", {-d, 0, 0}, {0, 0, 1.2}, "") +
              box("wall", {2, 0, 0}, {2 + d, 0, 1.2}, "") + polygon("wall", {{foot, 0}, {2, 0}, {2, top}}, "");
    t.effects = weight + effects;
    t.end = end;
    const double density = t.density;
    return Simulation(Comm::world(), t.scene(), starting_with([=](Particles& p, Index i, Vector x) {
                          const double pressure = fluid ? density * gravity * (1 - x.z) : 0;
                          set_stress(p, i, {-pressure, -pressure, -pressure, 0, 0, 0});
                      }));
}

/// Error of the velocity and displacement profiles of soil sheared between a wall and a plate at 1 mm/s.
struct Sheared {
    double velocity = 0, displacement = 0, stress = 0; // L2, L2, relative error of the mean shear stress
    std::vector<std::vector<double>> profile;
};
Sheared shear(int spacings, bool smooth_wall)
{
    SceneText t;
    t.spacing = 1.0 / spacings, t.h = 2.2, t.accuracy = "kernel = \"wendland c2\"\nskin = 0.1";
    t.young = 5e6, t.density = 2100;
    const double width = 10 * t.spacing, thick = 5 * t.spacing, V = 1e-3;
    // Walls do not move. The plate is soil a million times as dense, whose layers go on at V z/H, as dummy particles of a moving
    // wall do: what shears it slows it by 1e-6.
    t.more_soils = fmt::format("[soil.plate]\ndensity = {}\nyoung = 5.0e6\npoisson = 0.3\ncohesion = 1.0e12\n", 1e6 * t.density);
    t.space = periodic(width, -1, 3);
    t.bodies = box("body", {0, 0, 0}, {width, 0, 1}) + box("body", {0, 0, 1}, {width, 0, 1 + thick}, "soil = \"plate\"");
    t.walls = box("wall", {0, 0, -thick}, {width, 0, 0}, smooth_wall ? "surface = \"smooth\"" : "");
    t.effects = "viscosity = { alpha = 0.1, beta = 0.0 }";
    t.end = 5 / t.s_wave(); // five crossings of the shear wave
    Simulation sim(Comm::world(), t.scene(), starting_with([=](Particles& p, Index i, Vector x) { set_velocity(p, i, {V * x.z, 0, 0}); }));
    run_to(sim, t.end);
    ErrorNorms v, u;
    Sheared s;
    double tau = 0;
    int count = 0;
    each(sim, [&](Index i) {
        const double z = origin(sim, i).z;
        if (z > 1) return;
        const double moved = position(sim, i).x - origin(sim, i).x;
        v.add(velocity(sim, i).x, V * z), u.add(moved, V * z * t.end);
        tau += stress(sim, i).xz, ++count;
        if (origin(sim, i).x < t.spacing) s.profile.push_back({double(spacings), z, velocity(sim, i).x, moved / t.end, V * z});
    });
    s.velocity = v.L2(), s.displacement = u.L2(), s.stress = tau / count / (t.shear() * V * t.end) - 1;
    return s;
}

} // namespace

TEST(Columns, SettleToTheirWeight)
{
    Case c("SPH-7");
    SceneText t;
    t.density = 2100, t.young = 15e6;
    const double settlement = t.density * gravity / (2 * t.constrained());
    std::vector<std::vector<double>> rows;
    for (const std::string stress : {"none", "at rest"}) {
        const std::string from = stress == "none" ? "damped gravity" : "K0 start";
        std::vector<double> L2;
        for (const int n : {10, 20, 50, 100}) {
            if (n > 50 && stress != "none") continue;
            const auto s = settle(n, "damping = { ratio = 1.0, until = 100.0 }", stress);
            L2.push_back(s.L2);
            if (stress == "none") rows.insert(rows.end(), s.profile.begin(), s.profile.end());
            const std::string at = fmt::format(", {} spacings, {}", n, from);
            if (n < 50) {
                c.report("L2 of sigma_zz" + at, s.L2, "1");
                continue;
            }
            EXPECT_TRUE(c.at_most("L2 of sigma_zz" + at, s.L2, "1", 0.02));
            EXPECT_TRUE(c.at_most("L2 of sigma_xx" + at, s.sideways, "1", 0.02));
            EXPECT_TRUE(c.at_most("error of sigma_zz at the base" + at, s.base, "1", 0.05));
            if (stress != "none") continue;
            EXPECT_TRUE(c.near("settlement" + at, settlement, s.settlement, "m", 0.05));
        }
        EXPECT_TRUE(c.at_least("observed order of L2, 10 to 50 spacings, " + from, observed_order(L2[0], L2[2], 5), "1", 0.8));
    }
    const auto s = settle(50, "damping = { ratio = 1.0, until = 100.0 }", "none", SceneText{}.with_default_kernel());
    EXPECT_TRUE(c.at_most("L2 of sigma_zz, 50 spacings, damped gravity, default kernel", s.L2, "1", 0.02));
    EXPECT_TRUE(c.near("settlement, 50 spacings, damped gravity, default kernel", settlement, s.settlement, "m", 0.05));
    c.curve("stress", {"spacings", "height", "sigma_zz", "sigma_xx", "closed_form_zz"}, rows);
    // Negative control: without damping the column still swings.
    EXPECT_FALSE(c.control_at_most("L2 of sigma_zz, 50 spacings, undamped", settle(50, "", "none").L2, "1", 0.02));
}

// Still water carries its part: effective stress is (rho g - gamma_w) times the depth, and a column at rest stays there.
TEST(Columns, SubmergedOnesRestOnTheirBuoyantWeight)
{
    for (const bool wet : {true, false}) {
        SceneText t;
        t.dimensions = 3, t.spacing = 0.04, t.end = 0.1, t.time = "step = 1.0e-4", t.strength = "friction_angle = 25.0";
        t.space = periodic(0.24, -1, 3, "\"x\", \"y\"");
        t.bodies = box("body", {0, 0, 0}, {0.24, 0.24, 0.8}, "soil = \"s\"\nstress = \"at rest\"");
        t.walls = box("wall", {0, 0, -0.16}, {0.24, 0.24, 0}, "");
        t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
        if (wet) t.effects += "\npore_pressure = { table = [[0.0, 2.0]] }";
        Simulation sim(Comm::world(), t.scene());
        double fastest = 0;
        while (!sim.finished()) sim.step(), fastest = std::max(fastest, sim.max_speed());
        const double weight = wet ? t.density * gravity - 9810 : t.density * gravity;
        ErrorNorms norms;
        each(sim, [&](Index i) { norms.add(stress(sim, i).zz, -weight * (0.8 - position(sim, i).z)); });
        EXPECT_LT(norms.L2(), 0.05) << (wet ? "wet" : "dry");
        EXPECT_LT(fastest, 0.03) << "m/s, of 4 m/s in free fall";
    }
}

// What stands between a floor, two sides and a ramp: hydrostatic everywhere, the corners too.
TEST(Columns, BasinWithARampIsHydrostatic)
{
    Case c("SPH-9");
    for (const double dx : {0.04, 0.02}) {
        auto sim = basin(dx, "damping = { ratio = 1.0, until = 100.0 }", dx > 0.03 ? 1.0 : 0.5);
        run_to(sim, 100);
        ErrorNorms all, corner;
        std::vector<std::vector<double>> rows;
        each(sim, [&](Index i) {
            const Vector x = origin(sim, i);
            const double p = -trace(stress(sim, i)) / 3, expected = 2100 * gravity * (1 - x.z);
            all.add(p, expected);
            if (std::hypot(x.x - 1.6, x.z) < 0.15 || std::hypot(x.x, x.z) < 0.15 || std::hypot(x.x - 2, x.z - 0.4) < 0.15)
                corner.add(p, expected);
            rows.push_back({x.x, x.z, p, expected, length(position(sim, i) - x)});
        });
        c.curve(fmt::format("pressure_{}", dx), {"x", "z", "pressure", "hydrostatic", "displacement"}, rows);
        const std::string at = fmt::format(", dx = {} m", dx);
        if (dx > 0.03) {
            c.report("L2 of the pressure" + at, all.L2(), "1");
            continue;
        }
        EXPECT_TRUE(c.at_most("L2 of the pressure" + at, all.L2(), "1", 0.03));
        EXPECT_TRUE(c.at_most("L2 of the pressure within 0.15 m of the corners" + at, corner.L2(), "1", 0.10));
    }
    // Negative control: a solid is not hydrostatic, its mean stress is (1 + 2 K0)/3 of the weight.
    auto solid = basin(0.04, "damping = { ratio = 1.0, until = 100.0 }", 0.3, false);
    run_to(solid, 100);
    ErrorNorms wrong;
    each(solid, [&](Index i) { wrong.add(-trace(stress(solid, i)) / 3, 2100 * gravity * (1 - origin(solid, i).z)); });
    EXPECT_FALSE(c.control_at_most("L2 of the pressure in a solid, dx = 0.04 m", wrong.L2(), "1", 0.03));
}

TEST(Columns, CouetteShearIsLinear)
{
    Case c("SPH-10");
    std::vector<double> L2;
    std::vector<std::vector<double>> rows;
    for (const int n : {25, 50, 100}) {
        const auto s = shear(n, false);
        L2.push_back(s.displacement);
        rows.insert(rows.end(), s.profile.begin(), s.profile.end());
        const std::string at = fmt::format(", {} particles", n);
        c.report("L2 of the velocity at the end" + at, s.velocity, "1");
        c.report("error of the mean shear stress" + at, s.stress, "1");
        if (n < 50) c.report("L2 of the mean velocity" + at, s.displacement, "1");
        else EXPECT_TRUE(c.at_most("L2 of the mean velocity" + at, s.displacement, "1", 0.0075));
    }
    EXPECT_TRUE(c.at_least("observed order, 25 to 100 particles", observed_order(L2[0], L2[2], 4), "1", 0.9));
    c.curve("profile", {"particles", "height", "velocity", "mean_velocity", "linear"}, rows);
    // Negative control: over a smooth wall the soil slips.
    EXPECT_FALSE(c.control_at_most("L2 of the mean velocity, smooth wall, 50 particles", shear(50, true).displacement, "1", 0.0075));
}
