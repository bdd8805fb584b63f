#pragma once
// SPH-5: the free swing of a plate clamped at one end (Gray, Monaghan & Swift 2001).
#include "tests/validation/case.hpp"

namespace kuzure::validation {

struct Swing {
    double period = 0, amplitude = 0; // s, m
    int pieces = 0;
};

/// A plate L = 0.2 m, H = 0.02 m, thrown with V_f c_0 at its tip; the root is held by rough walls above, below and behind it.
inline Swing swing(Case& c, int across, double throw_speed, double periods, double epsilon = 0.3,
                   const std::string& accuracy = "kernel = \"cubic spline\"")
{
    const double L = 0.2, H = 0.02, root = 0.05;
    SceneText t;
    t.spacing = H / across, t.h = 1.3, t.accuracy = accuracy;
    t.density = 1000, t.young = 2e6, t.poisson = 0.3975;
    const double thick = 4 * t.spacing, c0 = std::sqrt(t.bulk() / t.density), k = 1.875 / L;
    t.bodies = box("body", {-root, 0, 0}, {L, 0, H});
    t.walls = box("wall", {-root, 0, H}, {0, 0, H + thick}, "") + box("wall", {-root, 0, -thick}, {0, 0, 0}, "") +
              box("wall", {-root - thick, 0, 0}, {-root, 0, H}, "");
    if (epsilon > 0) t.effects = fmt::format("artificial_stress = {{ epsilon = {}, exponent = 4.0 }}", epsilon);
    t.end = periods * 0.2540 * 1.3;
    // F(x) = (cos kL + cosh kL)(cosh kx - cos kx) + (sin kL - sinh kL)(sinh kx - sin kx)
    const auto mode = [=](double x) {
        return (std::cos(k * L) + std::cosh(k * L)) * (std::cosh(k * x) - std::cos(k * x)) +
               (std::sin(k * L) - std::sinh(k * L)) * (std::sinh(k * x) - std::sin(k * x));
    };
    Simulation sim(Comm::world(), t.scene(), starting_with([&](Particles& p, Index i, Vector x) {
                       if (x.x > 0) set_velocity(p, i, {0, 0, throw_speed * c0 * mode(x.x) / mode(L)});
                   }));
    Swing s;
    ZeroCrossings tip;
    std::vector<std::vector<double>> rows;
    while (!sim.finished() && tip.times().size() < std::size_t(2 * periods)) {
        sim.step();
        if (sim.steps() % 20) continue;
        double sum = 0;
        int count = 0;
        each(sim, [&](Index i) {
            if (origin(sim, i).x > L - 2 * t.spacing) sum += position(sim, i).z - origin(sim, i).z, ++count;
        });
        tip.add(sim.time(), sum / count);
        s.amplitude = std::max(s.amplitude, std::fabs(sum / count));
        rows.push_back({sim.time(), sum / count});
    }
    // the swing begins at t = 0 in its middle
    if (!tip.times().empty()) s.period = 2 * tip.times().back() / double(tip.times().size());
    s.pieces = pieces(sim, 2 * t.spacing);
    c.curve(fmt::format("tip_{}_{}_{}", across, throw_speed, epsilon), {"time", "deflection"}, rows);
    return s;
}

} // namespace kuzure::validation
