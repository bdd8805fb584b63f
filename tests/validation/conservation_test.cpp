// What is kept whatever happens: momentum of a body that falls (SPH-2), energy in all its accounts (SPH-13). On one rank, and on two.
#include "tests/validation/case.hpp"
#include <random>

using namespace kuzure;
using namespace kuzure::validation;

// A block that falls for a second: z = z_0 + v t - g t^2/2, no stress; and one that also rings, so that forces act inside it.
TEST(Conservation, OfMomentumInFreeFall)
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
        const double count = double(world().sum(std::int64_t(sim.particles().size()))), mass = particle_mass(sim, 0) * count;
        const auto about_centre = [&] {
            Vector centre;
            each(sim, [&](Index i) { centre = fma(1.0 / count, position(sim, i), centre); });
            return angular_momentum(sim) - cross(over_ranks(centre), linear_momentum(sim));
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
        way = world().max(way), most = world().max(most);
        EXPECT_TRUE(c.at_most("error of the way fallen in 1 s", way, "m", 1e-11));
        EXPECT_TRUE(c.at_most("stress over rho c_p^2", most / (t.density * t.p_wave() * t.p_wave()), "1", 1e-12));
        EXPECT_TRUE(c.at_most("error of linear momentum over m g t", length(dP) / (mass * gravity), "1", 1e-12));
        EXPECT_TRUE(c.at_most("drift of angular momentum over m v l", length(dJ) / (mass * 2.3 * 0.24), "1", 1e-10));
    }
}

// SPH-13. Elastic: a column that swings under sudden gravity for five periods. Plastic: a collapse, also with cohesion.
TEST(Conservation, OfEnergyInColumnsAndCollapses)
{
    Case c("SPH-13");
    struct Scenario {
        const char *name, *strength, *effects;
        bool collapse;
        double limit, young;
        Extra extra = {};
    };
    // Hooke's law in rates has no energy function: (1/2) V sigma : C^-1 sigma misses strain/3 of the elastic energy. With strains e =
    // 2 rho g (H - z)/M at the lowest point of the swing it misses M e^3/6 a volume, which is rho g H/(2 M) of the potential drop.
    const SceneText soft;
    const Extra hypoelastic{.note = "a hypoelastic law has no exact elastic energy; base strain 1.5 %",
                            .achieved = 5e-3,
                            .independent = soft.density * gravity / (2 * soft.constrained()),
                            .whose = "closed form rho g H/(2 M)"};
    for (const Scenario& s :
         {Scenario{"elastic column", "cohesion = 1.0e12", "", false, 1e-3, 15e6},
          Scenario{"soft elastic column", "cohesion = 1.0e12", "", false, 1e-3, 1.8e6, hypoelastic},
          Scenario{"elastic column with artificial stress", "cohesion = 1.0e12", "artificial_stress = {}", false, 1e-3, 15e6},
          Scenario{"collapse of dry soil", "friction_angle = 25.0\ncone = \"plane strain\"", "", true, 0.01, 1.8e6},
          Scenario{"collapse of cohesive soil", "cohesion = 300.0\nfriction_angle = 25.0\ncone = \"plane strain\"",
                   "artificial_stress = \"auto\"", true, 0.01, 1.8e6}}) {
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

// The same in three dimensions, with a fixed step; nothing is asked of its record.
TEST(Conservation, OfEnergyInACollapsingCube)
{
    SceneText t;
    t.dimensions = 3, t.spacing = 0.04, t.end = 0.25, t.time = "step = 1.0e-4", t.strength = "friction_angle = 25.0";
    t.bodies = box("body", {0, 0, 0}, {0.32, 0.32, 0.32});
    t.walls = box("wall", {-0.8, -0.8, -0.16}, {1.12, 1.12, 0}, "");
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
    Simulation sim(Comm::world(), t.scene());
    run_to(sim, t.end);
    const Ledger l = sim.ledger();
    EXPECT_LT(std::fabs(sim.residual(l)), 0.01);
    EXPECT_LT(l.state.potential, 0);
    EXPECT_GT(l.dissipated.plastic, 0.3 * -l.state.potential);
    EXPECT_GT(l.dissipated.viscous, 0);
    EXPECT_DOUBLE_EQ(sim.time(), 0.25);
}
