#pragma once
// Metrics of the hard cases H1..H20: noise N, clumping C, drift D, energy residual E, lost particles Q, wall penetration W.
#include "tests/validation/case.hpp"
#include <algorithm>

namespace kuzure::validation {

inline const std::string weight = "gravity = [0.0, 0.0, -9.81]\n";
inline const std::string mild = "viscosity = { alpha = 0.1, beta = 0.0 }\n";

/// How a run ended.
struct Outcome {
    std::string failure; // words of NumbersFailed; empty if it reached its end
    int retries = 0;
    bool held() const { return failure.empty(); }
};
/// Runs to the end or to the first failure that no retry mends; calls each_step(sim) after every step.
template <class EachStep> Outcome outcome(Simulation& sim, EachStep each_step)
{
    Outcome o;
    while (!sim.finished()) {
        try {
            sim.step();
            each_step(sim);
        } catch (const NumbersFailed& e) {
            if (sim.scene().time.retry && sim.roll_back()) {
                ++o.retries;
                continue;
            }
            o.failure = e.what();
            fmt::print("             detected: {}\n", o.failure);
            break;
        }
    }
    return o;
}
inline Outcome outcome(Simulation& sim)
{
    return outcome(sim, [](const Simulation&) {});
}

/// Q: particles that are not finite, or outside of low..high.
inline int lost(const Simulation& s, Vector low, Vector high)
{
    int count = 0;
    each(s, [&](Index i) {
        const Vector x = position(s, i);
        const Stress t = stress(s, i);
        const bool good = std::isfinite(contract(t, t)) && std::isfinite(dot(velocity(s, i), velocity(s, i))) && x.x >= low.x &&
                          x.x <= high.x && x.z >= low.z && x.z <= high.z;
        count += !good;
    });
    return count;
}
/// E: what the ledger misses, over the potential drop.
inline double ledger_error(const Simulation& s) { return std::fabs(s.residual(s.ledger())); }

/// C, of now: share of particles with a neighbour nearer than 0.6 spacings.
inline double clumped(const Simulation& s)
{
    const double near = 0.6 * s.scene().space.spacing;
    const Index n = s.particles().size();
    std::vector<char> is(n, 0);
    each(s, [&](Index i) {
        for (Index j = 0; j < i; ++j) {
            const Vector d = position(s, i) - position(s, j);
            if (dot(d, d) < near * near) is[i] = is[j] = 1;
        }
    });
    return double(std::count(is.begin(), is.end(), 1)) / n;
}

/// N: RMS of f - <f> over the larger of |<f>| and `scale`, <> the Shepard mean over a cubic spline's support; particles whose support is
/// nearly full.
template <class F> double noise(const Simulation& s, F f, double scale)
{
    const double h = s.scene().smoothing_length(), dx = s.scene().space.spacing;
    const auto spline = [&](double r) {
        const double q = r / h;
        return q >= 2 ? 0 : (q < 1 ? 1 - 1.5 * q * q + 0.75 * q * q * q : 0.25 * (2 - q) * (2 - q) * (2 - q)) * 10 / (7 * pi * h * h);
    };
    double sum = 0;
    int count = 0;
    each(s, [&](Index i) {
        double w = 0, fw = 0;
        each(s, [&](Index j) {
            const Vector d = position(s, i) - position(s, j);
            const double r2 = dot(d, d);
            if (r2 >= 4 * h * h) return;
            const double k = spline(std::sqrt(r2));
            w += k, fw += k * f(j);
        });
        if (w * dx * dx < 0.95) return;
        const double mean = fw / w, e = (f(i) - mean) / std::max(std::fabs(mean), scale);
        sum += e * e, ++count;
    });
    return count ? std::sqrt(sum / count) : 0;
}
inline double noise_of_sigma_zz(const Simulation& s)
{
    const double scale = s.soils()[0].density * gravity * s.scene().space.spacing;
    return noise(
        s, [&](Index i) { return stress(s, i).zz; }, scale);
}

/// Front: the mean x of the farthest per cent of particles; and the highest particle.
inline double front(const Simulation& s)
{
    std::vector<double> x;
    each(s, [&](Index i) { x.push_back(position(s, i).x); });
    std::sort(x.begin(), x.end());
    const std::size_t n = std::max<std::size_t>(1, x.size() / 100);
    double sum = 0;
    for (std::size_t k = x.size() - n; k < x.size(); ++k) sum += x[k];
    return sum / n;
}
inline double top(const Simulation& s)
{
    double z = -1e300;
    each(s, [&](Index i) { z = std::max(z, position(s, i).z); });
    return z;
}

/// A dry or cohesive column that collapses on a floor from x = 0 to both sides, or against a plane of symmetry.
inline SceneText collapse(double spacing, double wide, double high, double end, const std::string& effects = weight + mild)
{
    SceneText t;
    t.spacing = spacing, t.end = end, t.effects = effects;
    t.strength = "friction_angle = 25.0\ncone = \"plane strain\"";
    t.bodies = box("body", {0, 0, 0}, {wide, 0, high});
    const double d = 4 * spacing, reach = std::ceil(4 * high / spacing) * spacing;
    t.walls = box("wall", {-reach, 0, -d}, {wide + reach, 0, 0}, "");
    return t;
}

} // namespace kuzure::validation
