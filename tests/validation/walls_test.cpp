// Friction: a block on an incline (SPH-11) and the slope at which a pile of dry soil comes to rest (SPH-17).
#include "tests/validation/case.hpp"
#include <map>

using namespace kuzure;
using namespace kuzure::validation;

namespace {

constexpr double incline = pi / 6;

/// Way (m) that an elastic block slides down an incline of 30 degrees in `time`, less what it would have gone with its first speed; gravity
/// is tilted instead of the ground. Before, it is damped for `settling` s: a block that is loaded at once rings, and while its lowest row
/// vibrates, friction is not that of Coulomb's law for a block.
double slide(double tan_delta, double time, double settling, std::vector<std::vector<double>>* rows = nullptr)
{
    SceneText t;
    t.spacing = 0.02;
    const double high = 0.16, along = gravity * std::sin(incline), down = gravity * std::cos(incline);
    t.bodies = box("body", {0, 0, 0}, {0.4, 0, high});
    t.walls =
        box("wall", {-0.2, 0, -0.08}, {2.0, 0, 0}, fmt::format("surface = {{ friction_angle = {} }}", std::atan(tan_delta) * 180 / pi));
    t.effects = fmt::format("gravity = [{}, 0.0, {}]\nviscosity = {{ alpha = 0.1, beta = 0.0 }}", along, -down);
    if (settling > 0) t.effects += fmt::format("\ndamping = {{ ratio = 1.0, until = {} }}", settling);
    t.end = settling + time;
    Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                       // its own weight on it, free sideways
                       const double s = -t.density * down * (high - x.z);
                       set_stress(p, i, {0, t.poisson * s, s, 0, 0, 0});
                   }));
    const auto way = [&] {
        double sum = 0;
        each(sim, [&](Index i) { sum += position(sim, i).x - origin(sim, i).x; });
        return sum / sim.particles().size();
    };
    const auto speed = [&] { return linear_momentum(sim).x / (particle_mass(sim, 0) * sim.particles().size()); };
    run_to(sim, settling);
    const double from = way(), first = speed(), begin = sim.time();
    while (!sim.finished()) {
        sim.step();
        if (rows && sim.steps() % 50 == 0) rows->push_back({tan_delta, sim.time(), way(), speed()});
    }
    return way() - from - first * (sim.time() - begin);
}

/// Mean angle (deg) of both flanks of a pile of dry soil that starts at `start` degrees, between 20 and 80 % of its height.
double repose(double spacing, double start, double friction_angle, double end, double* speed, std::vector<std::vector<double>>* profile)
{
    SceneText t;
    t.spacing = spacing, t.end = end;
    t.strength = fmt::format("friction_angle = {}\ncone = \"plane strain\"", friction_angle);
    const double half = 0.8, high = half * std::tan(start * pi / 180);
    t.bodies = polygon("body", {{-half, 0}, {half, 0}, {0, high}}, "soil = \"s\"\nstress = \"at rest\"");
    const double wide = std::ceil(1.6 / spacing) * spacing;
    t.walls = box("wall", {-wide, 0, -4 * spacing}, {wide, 0, 0}, "");
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
    Simulation sim(Comm::world(), t.scene());
    run_to(sim, end);
    // surface: the highest particle of every strip two spacings wide
    std::map<long, Vector> top;
    *speed = 0;
    each(sim, [&](Index i) {
        const Vector x = position(sim, i);
        auto& highest = top.try_emplace(std::lround(x.x / (2 * spacing)), Vector{0, 0, -1}).first->second;
        if (x.z > highest.z) highest = x;
        *speed = std::max(*speed, length(velocity(sim, i)));
    });
    double summit = 0;
    for (const auto& [strip, x] : top) summit = std::max(summit, x.z);
    // least squares through both flanks: height over distance from the middle
    double n = 0, sx = 0, sz = 0, sxx = 0, sxz = 0;
    for (const auto& [strip, x] : top) {
        if (profile) profile->push_back({friction_angle, start, x.x, x.z});
        if (x.z < 0.2 * summit || x.z > 0.8 * summit) continue;
        const double d = std::fabs(x.x);
        n += 1, sx += d, sz += x.z, sxx += d * d, sxz += d * x.z;
    }
    return std::atan(-(n * sxz - sx * sz) / (n * sxx - sx * sx)) * 180 / pi;
}

} // namespace

TEST(Walls, BlockSlidesByCoulombsLaw)
{
    Case c("SPH-11");
    std::vector<std::vector<double>> rows;
    const double t = 0.5, settling = 0.1;
    const auto by_coulomb = [&](double tan_delta) { return 0.5 * gravity * (std::sin(incline) - tan_delta * std::cos(incline)) * t * t; };
    const Extra vibrates{.note =
                             "vibrates as it slides, the more the nearer it is to sticking; settled for 0.2 s 2.9 %, for 0.4 s 0.4 % short",
                         .achieved = 0.05};
    for (const double tan_delta : {0.1, 0.3, 0.5})
        EXPECT_TRUE(c.near(fmt::format("way slid in 0.5 s, tan(delta) = {}", tan_delta), by_coulomb(tan_delta),
                           slide(tan_delta, t, settling, &rows), "m", 0.02, tan_delta < 0.4 ? Extra{} : vibrates));
    c.report("way over that of Coulomb's law, tan(delta) = 0.55", slide(0.55, t, settling) / by_coulomb(0.55), "1",
             "settled for 0.4 s 1.35");
    // tan(delta) above tan(30 deg) = 0.577: the block stays
    const double free_way = 0.5 * gravity * std::sin(incline) * t * t;
    EXPECT_TRUE(c.at_most("way over frictionless way, tan(delta) = 0.7", std::fabs(slide(0.7, t, settling, &rows)) / free_way, "1", 0.02));
    c.curve("way", {"tan_delta", "time", "way", "speed"}, rows);
    c.report("old criterion, +-2 %: way over that of Coulomb's law, loaded at once, tan(delta) = 0.5", slide(0.5, t, 0) / by_coulomb(0.5),
             "1", "rings while it begins to slide");
    c.report("old criterion, <= 0.02: way over frictionless way, loaded at once, tan(delta) = 0.7", slide(0.7, t, 0) / free_way, "1");
    // Negative control: another friction is another way.
    EXPECT_FALSE(c.control("way slid in 0.5 s, tan(delta) = 0.2 for 0.3", by_coulomb(0.3), slide(0.2, t, settling), "m", 0.02));
}

TEST(Walls, PileRestsAtItsFrictionAngle)
{
    Case c("SPH-17");
    std::vector<std::vector<double>> rows;
    // plane strain cone of phi = 25 deg: soil that flows over a rough bed stops at tan = 3 alpha; sin(phi_e) = 3 alpha by the stress circle
    const double tangent = std::tan(25 * pi / 180), slope = 3 * tangent / std::sqrt(9 + 12 * tangent * tangent);
    const double bed = std::atan(slope) * 180 / pi, phi_e = std::asin(slope) * 180 / pi;
    double speed;
    // Two degrees flatter than phi_e it stands, two degrees steeper it slides and comes to rest at the angle of a rough bed.
    const double stands = repose(0.02, phi_e - 2, 25, 1.5, &speed, &rows);
    EXPECT_TRUE(c.near("slope that stands, from phi_e - 2 deg", phi_e - 2, stands, "deg", 0.04));
    const double found = repose(0.02, phi_e + 2, 25, 3.0, &speed, &rows);
    EXPECT_TRUE(c.near("slope at rest, from phi_e + 2 deg: atan(3 alpha)", bed, found, "deg", 0.04));
    EXPECT_TRUE(c.at_least("phi_e less the slope at rest, from phi_e + 2 deg", phi_e - found, "deg", 0));
    EXPECT_TRUE(c.at_most("greatest speed at the end", speed, "m/s", 0.01));
    // The farther it falls, the flatter it comes to rest: inertia carries it past the angle of repose.
    c.report("slope at rest, from 34 deg", repose(0.02, 34, 25, 1.5, &speed, &rows), "deg");
    // Negative control: softer soil.
    const double wrong = repose(0.02, phi_e + 2, 18, 1.5, &speed, &rows);
    EXPECT_FALSE(c.control("slope at rest of phi = 18 deg, within 4 %", bed, wrong, "deg", 0.04));
    c.curve("surface", {"friction_angle", "start", "x", "z"}, rows);
}

// A cohesive block thrown along a floor: a smooth one leaves its speed, a rough one takes it, friction is in between.
TEST(Walls, SmoothOnesLetSlideRoughOnesHold)
{
    double left[3];
    const char* surfaces[3] = {"\"smooth\"", "\"rough\"", "{ friction_angle = 20.0 }"};
    for (int k = 0; k < 3; ++k) {
        SceneText t;
        t.dimensions = 3, t.spacing = 0.04, t.end = 0.1, t.time = "step = 1.0e-4", t.strength = "cohesion = 2.0e4\nfriction_angle = 25.0";
        t.bodies = box("body", {0, 0, 0}, {0.4, 0.24, 0.16}, "soil = \"s\"\nvelocity = [0.5, 0.0, 0.0]");
        t.walls = box("wall", {-0.4, -0.4, -0.16}, {1.2, 0.64, 0}, fmt::format("surface = {}", surfaces[k]));
        t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
        Simulation sim(Comm::world(), t.scene());
        run_to(sim, t.end);
        left[k] = linear_momentum(sim).x / (particle_mass(sim, 0) * sim.particles().size()) / 0.5;
    }
    EXPECT_GT(left[0], 0.98) << "a smooth wall must not brake";
    EXPECT_LT(left[1], 0.60) << "a rough wall must brake";
    // v = v0 - tan(20 deg) g t, while the block bounces on its first contact with gravity
    EXPECT_NEAR(left[2], 1 - std::tan(20 * pi / 180) * gravity * 0.1 / 0.5, 0.1);
    EXPECT_GT(left[2], left[1]) << "friction cannot brake more than no slip";
}
