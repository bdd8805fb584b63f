// Bodies without walls: free fall (SPH-2), stressed bodies that spin (SPH-3), the energy ledger (SPH-13).
#include "tests/validation/case.hpp"
#include <random>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

/// Mean distance (m) of the outermost particles from the centre: those that began within one spacing of the surface.
double mean_radius(const Simulation& sim, double radius)
{
    double sum = 0;
    int count = 0;
    each(sim, [&](Index i) {
        if (length(origin(sim, i)) < radius - sim.scene().space.spacing) return;
        sum += length(position(sim, i)), ++count;
    });
    return sum / count;
}

struct Spun {
    double radius_change = 0, angular_drift = 0, momentum = 0; // greatest |R/R_0 - 1|; |L/L_0 - 1| a turn; |P|/(m v_rim)
    double turns = 0, turns_to_a_tenth = 0;                    // until a tenth of L is lost; all turns if it never is
    double spurious = 0;                                       // greatest |D| over omega at the start
    int pieces = 0;
};

/// A body spinning about y at one turn a second, from the stress that carries its centrifugal force.
Spun spin(Case& c, const std::string& name, int dimensions, double spacing, double turns, const std::string& correction)
{
    const double R = 0.5, omega = 2 * pi;
    SceneText t;
    t.dimensions = dimensions, t.spacing = spacing, t.h = 1.5;
    t.accuracy = fmt::format("kernel = \"wendland c2\"\ncorrection = \"{}\"", correction);
    t.effects = "viscosity = { alpha = 0.1, beta = 0.0 }";
    t.bodies = sphere({0, 0, 0}, R);
    t.end = 1e-12, t.time = "step = 1.0e-12";
    Spun s;
    {
        // nothing has moved or turned within a picosecond: the stress is dt C : D
        Simulation still(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                             set_velocity(p, i, cross({0, omega, 0}, x));
                         }));
        still.step();
        each(still, [&](Index i) {
            const Stress sigma = stress(still, i), e = (1 / (2 * t.shear() * t.end)) * deviator(sigma);
            s.spurious = std::max(s.spurious, std::sqrt(contract(e, e)) / omega);
        });
    }
    t.end = turns, t.time.clear();
    const double nu = dimensions == 2 ? t.k0() : t.poisson, load = t.density * omega * omega;
    Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                       set_velocity(p, i, cross({0, omega, 0}, x));
                       // Rotating disc: sigma_r = (3 + nu)/8 rho w^2 (R^2 - r^2), sigma_t = rho w^2/8 ((3 + nu) R^2 - (1 + 3 nu) r^2),
                       // in plane strain with nu/(1 - nu) for nu. A sphere finds its own stress.
                       const double r2 = x.x * x.x + x.z * x.z, r = std::sqrt(std::max(r2, 1e-30));
                       if (dimensions == 3) return;
                       const double along = load / 8 * (3 + nu) * (R * R - r2), around = load / 8 * ((3 + nu) * R * R - (1 + 3 * nu) * r2);
                       const double nx = x.x / r, nz = x.z / r;
                       set_stress(p, i,
                                  {along * nx * nx + around * nz * nz, t.poisson * (along + around), along * nz * nz + around * nx * nx, 0,
                                   0, (along - around) * nx * nz});
                   }));
    const double L0 = angular_momentum(sim).y, R0 = mean_radius(sim, R);
    double mass = 0;
    each(sim, [&](Index i) { mass += particle_mass(sim, i); });
    std::vector<std::vector<double>> rows;
    double next = 0;
    while (!sim.finished()) {
        sim.step();
        if (sim.time() < next) continue;
        next += 0.05;
        const double radius = mean_radius(sim, R) / R0 - 1, L = angular_momentum(sim).y / L0 - 1;
        s.radius_change = std::max(s.radius_change, std::fabs(radius));
        s.momentum = std::max(s.momentum, length(linear_momentum(sim)) / (mass * omega * R));
        if (s.turns_to_a_tenth == 0 && L < -0.1) s.turns_to_a_tenth = sim.time();
        rows.push_back({sim.time(), radius, L, sim.ledger().sum()});
    }
    s.turns = sim.time();
    if (s.turns_to_a_tenth == 0) s.turns_to_a_tenth = s.turns;
    s.angular_drift = std::fabs(angular_momentum(sim).y / L0 - 1) / s.turns;
    s.pieces = pieces(sim, 2 * spacing);
    c.curve(name, {"turns", "radius_change", "angular_momentum_change", "energy"}, rows);
    return s;
}

} // namespace

// A block that falls for a second: z = z_0 + v t - g t^2/2, no stress; and one that also rings, so that forces act inside it.
TEST(Bodies, FreeFall)
{
    Case c("SPH-2");
    for (const bool ringing : {false, true}) {
        SceneText t;
        t.dimensions = 3, t.spacing = 0.04;
        t.bodies = box("body", {0, 0, 0}, {0.24, 0.24, 0.24}, "soil = \"s\"\nvelocity = [1.0, 0.0, 2.0]");
        t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
        std::mt19937_64 random(3);
        std::uniform_real_distribution<double> kick(-0.01, 0.01);
        Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector) {
                           if (ringing) set_velocity(p, i, {1 + kick(random), kick(random), 2 + kick(random)});
                       }));
        const double mass = particle_mass(sim, 0) * sim.particles().size();
        const auto about_centre = [&] {
            Vector centre;
            each(sim, [&](Index i) { centre = fma(1.0 / sim.particles().size(), position(sim, i), centre); });
            return angular_momentum(sim) - cross(centre, linear_momentum(sim));
        };
        const Vector P0 = linear_momentum(sim), J0 = about_centre();
        run_to(sim, t.end);
        ASSERT_DOUBLE_EQ(sim.time(), 1);
        const Vector dP = linear_momentum(sim) - P0 - Vector{0, 0, -mass * gravity};
        const Vector dJ = about_centre() - J0;
        if (ringing) {
            EXPECT_TRUE(c.at_most("ringing: error of linear momentum over m g t", length(dP) / (mass * gravity), "1", 1e-12));
            // Stress forces are not central; the drift is measured against the greatest spin that the same speeds could be.
            c.report("ringing: drift of angular momentum over m v l", length(dJ) / (mass * 0.01 * 0.24), "1");
            continue;
        }
        double way = 0, most = 0;
        each(sim, [&](Index i) {
            const Vector d = position(sim, i) - origin(sim, i) - Vector{1, 0, 2 - 0.5 * gravity};
            way = std::max(way, length(d)), most = std::max(most, std::sqrt(J2(deviator(stress(sim, i)))));
            most = std::max(most, std::fabs(trace(stress(sim, i))));
        });
        EXPECT_TRUE(c.at_most("error of the way fallen in 1 s", way, "m", 1e-11));
        EXPECT_TRUE(c.at_most("stress over rho c_p^2", most / (t.density * t.p_wave() * t.p_wave()), "1", 1e-12));
        EXPECT_TRUE(c.at_most("error of linear momentum over m g t", length(dP) / (mass * gravity), "1", 1e-12));
        EXPECT_TRUE(c.at_most("drift of angular momentum over m v l", length(dJ) / (mass * 2.3 * 0.24), "1", 1e-10));
    }
}

// The gradient of the standard sums is M grad v with M far from 1 near a free surface, so a rigid rotation W strains the
// surface with D = (W M - M W)/2: a spring between the body and its first orientation, which takes up the spin and gives it back.
// Only the correction of kernel gradients removes it.
TEST(Bodies, SpinOfTheStandardGradientIsHeldByItsSurface)
{
    Case c("SPH-3");
    for (const int dimensions : {2, 3}) {
        const std::string name = dimensions == 2 ? "disc" : "sphere";
        const auto s = spin(c, name, dimensions, dimensions == 2 ? 0.05 : 0.1, 1, "none");
        const std::string cause = "surface strained by rigid rotation: accuracy.correction is the cure";
        EXPECT_TRUE(c.at_most(name + ", standard gradient: spurious strain rate over omega", s.spurious, "1", 1e-3,
                              {.note = cause, .achieved = 0.2}));
        EXPECT_TRUE(c.at_most(name + ", standard gradient, 1 turn: change of radius", s.radius_change, "1", 0.01,
                              {.note = cause, .achieved = 0.08}));
        EXPECT_TRUE(c.at_most(name + ", standard gradient: linear momentum over m v", s.momentum, "1", 1e-12));
        EXPECT_TRUE(c.at_least(name + ", standard gradient: turns until a tenth of the spin is lost", s.turns_to_a_tenth, "1", 100,
                               {.note = cause, .achieved = 0.2}));
        EXPECT_EQ(s.pieces, 1);
    }
}

TEST(Bodies, SpinOfTheCorrectedGradientIsKept)
{
    Case c("SPH-3");
    for (const int dimensions : {2, 3}) {
        const std::string name = dimensions == 2 ? "disc" : "sphere";
        const double turns = dimensions == 2 ? 10 : 2;
        const auto s = spin(c, name + "_corrected", dimensions, dimensions == 2 ? 0.05 : 0.1, turns, "gradient");
        EXPECT_TRUE(c.at_most(fmt::format("{}, {} turns: change of radius", name, turns), s.radius_change, "1", 0.01));
        EXPECT_TRUE(c.at_most(name + ": linear momentum over m v", s.momentum, "1", 1e-12));
        EXPECT_TRUE(c.at_most(name + ": drift of angular momentum a turn", s.angular_drift, "1", 1e-3,
                              {.note = "stress forces are not central", .achieved = 3e-3}));
        EXPECT_EQ(s.pieces, 1);
    }
}

// SPH-13. Elastic: a column that swings under sudden gravity for five periods. Plastic: a collapse, also with cohesion.
TEST(Bodies, EnergyLedgerCloses)
{
    Case c("SPH-13");
    struct Scenario {
        const char *name, *strength, *effects;
        bool collapse;
        double limit, young;
        Extra extra = {};
    };
    // Hooke's law in rates has no energy function: (1/2) V sigma : C^-1 sigma misses strain/3 of the elastic energy.
    const Extra hypoelastic{.note = "base strain 1.5 %: a hypoelastic law has no exact elastic energy, error strain/3", .achieved = 5e-3};
    const Extra tensile{.note = "", .achieved = 0.02};
    for (const Scenario& s :
         {Scenario{"elastic column", "cohesion = 1.0e12", "", false, 1e-3, 15e6},
          Scenario{"soft elastic column", "cohesion = 1.0e12", "", false, 1e-3, 1.8e6, hypoelastic},
          Scenario{"elastic column with artificial stress", "cohesion = 1.0e12", "artificial_stress = {}", false, 1e-3, 15e6},
          Scenario{"collapse of dry soil", "friction_angle = 25.0\ncone = \"plane strain\"", "", true, 0.01, 1.8e6},
          Scenario{"collapse of cohesive soil", "cohesion = 300.0\nfriction_angle = 25.0\ncone = \"plane strain\"",
                   "artificial_stress = \"auto\"", true, 0.01, 1.8e6, tensile}}) {
        SceneText t;
        t.spacing = 0.02, t.strength = s.strength, t.young = s.young;
        t.effects =
            fmt::format("gravity = [0.0, 0.0, -9.81]\n{}\n{}", s.collapse ? "viscosity = { alpha = 0.1, beta = 0.0 }" : "", s.effects);
        if (s.collapse) {
            t.bodies = box("body", {0, 0, 0}, {0.6, 0, 0.6});
            t.walls = box("wall", {-1.6, 0, -0.08}, {2.2, 0, 0}, "");
            t.end = 0.6;
        } else {
            t.space = periodic(0.16, -1, 3);
            t.bodies = box("body", {0, 0, 0}, {0.16, 0, 1});
            t.walls = box("wall", {0, 0, -0.08}, {0.16, 0, 0}, "");
            t.end = 20 / t.p_wave();
        }
        Simulation sim(Comm::world(), t.scene());
        const double start = sim.ledger().sum();
        double worst = 0, drop = 0; // J; the swing comes back to where it began, so its greatest drop is the measure
        std::vector<std::vector<double>> rows;
        while (!sim.finished()) {
            sim.step();
            if (sim.steps() % 20) continue;
            const Ledger l = sim.ledger();
            worst = std::max(worst, std::fabs(l.sum() - start)), drop = std::max(drop, -l.state.potential);
            rows.push_back({sim.time(), l.state.kinetic, l.state.potential, l.state.elastic, l.dissipated.plastic, l.dissipated.viscous,
                            l.dissipated.wall, l.dissipated.damping, l.sum()});
        }
        EXPECT_TRUE(
            c.at_most(std::string(s.name) + ": greatest residual over greatest potential drop", worst / drop, "1", s.limit, s.extra));
        std::string file = s.name;
        std::replace(file.begin(), file.end(), ' ', '_');
        c.curve(file, {"time", "kinetic", "potential", "elastic", "plastic", "viscous", "wall", "damping", "sum"}, rows);
        if (s.collapse) { // negative control: a ledger that forgets its viscous dissipation does not close
            const Ledger l = sim.ledger();
            EXPECT_FALSE(c.control(std::string(s.name) + ", no viscous part: sum over potential drop", 1,
                                   1 + sim.residual(l) - l.dissipated.viscous / -l.state.potential, "1", s.limit));
        }
    }
}

// A free elastic block that rings with noise on every wavelength: without viscosity its energy must stay, with it must not grow.
// H6, H12. Whole steps alone: the energy that the staggered scheme keeps differs from the true one by a part (omega dt)^2/4, so that
// a shortened last step shows percents of noise that are no growth.
TEST(Bodies, NoiseDoesNotGrow)
{
    Case c("H12");
    const auto left = [](double courant, double alpha, const std::string& scheme) {
        SceneText t;
        t.bodies = box("body", {0, 0, 0}, {0.4, 0, 0.4});
        t.accuracy = fmt::format("kernel = \"cubic spline\"\nscheme = \"{}\"", scheme);
        if (alpha > 0) t.effects = fmt::format("viscosity = {{ alpha = {}, beta = 0.0 }}", alpha);
        t.end = 4 / t.p_wave();
        t.time = fmt::format("step = {}", t.end / std::ceil(t.end / t.step(courant)));
        std::mt19937_64 random(5);
        std::uniform_real_distribution<double> kick(-1e-4, 1e-4);
        Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector) {
                           set_velocity(p, i, {kick(random), 0, kick(random)});
                       }));
        const double start = mechanical_energy(sim);
        run_to(sim, t.end);
        return mechanical_energy(sim) / start;
    };
    const auto what = [](double courant, double alpha) {
        return fmt::format("energy of noise after 200 dx/c_p over that at the start, dt c_p/h = {}, alpha = {}", courant, alpha);
    };
    for (const double courant : {0.2, 1.0, 1.4}) {
        EXPECT_TRUE(c.at_most(what(courant, 0) + ", less 1", std::fabs(left(courant, 0, "staggered") - 1), "1", 1e-4));
        EXPECT_TRUE(c.at_most(what(courant, 0.1), left(courant, 0.1, "staggered"), "1", 1));
    }
    // Negative control: for velocity and stress from one pass the leap-frog is Adams-Bashforth 2, which grows by (omega dt)^4/4 a step.
    EXPECT_FALSE(c.control_at_most(what(0.2, 0) + ", leap-frog, less 1", std::fabs(left(0.2, 0, "leap-frog") - 1), "1", 1e-4));
}
