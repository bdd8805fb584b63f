#pragma once
// What the verification programs share: the text of a scene, initial fields, error norms and the record of results.
//
// Every measured quantity becomes one JSON line in $KUZURE_RESULTS/<case>.jsonl, every curve a table in
// $KUZURE_RESULTS/<case>_<name>.csv; without the variable nothing is written. A criterion that the solver does not meet
// stays in the record as failed; the test then asserts the bound that it does meet, so that a change for the worse shows.
// Momenta, energies and norms are those of all ranks; one rank alone keeps a record.
#include "io/scene_file.hpp"
#include "solver/run/simulation.hpp"
#include "tests/mpi/world.hpp"
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fmt/format.h>
#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace kuzure::validation {

inline constexpr double pi = std::numbers::pi, gravity = 9.81;

// ---- scenes ----

/// The text of a scene; fields hold the lines of their sections.
struct SceneText {
    int dimensions = 2;
    double spacing = 0.02, h = 1.2, end = 1.0;
    std::string space, time;
    double density = 1850, young = 1.8e6, poisson = 0.3;
    /// Elastic unless said otherwise: a cohesion that nothing reaches.
    std::string strength = "cohesion = 1.0e12";
    std::string more_soils, bodies, walls, effects, accuracy = "kernel = \"cubic spline\"";

    std::string text() const
    {
        return fmt::format("title = \"verification\"\ndimensions = {}\n[space]\nspacing = {}\nh = {}\n{}\n[time]\nend = {}\n{}\n"
                           "[soil.s]\ndensity = {}\nyoung = {}\npoisson = {}\n{}\n{}\n{}\n{}\n[effects]\n{}\n[accuracy]\n{}\n",
                           dimensions, spacing, h, space, end, time, density, young, poisson, strength, more_soils, bodies, walls, effects,
                           accuracy);
    }
    Scene scene() const { return io::parse_scene(text(), "verification"); }
    /// With the kernel and the smoothing length of a scene that asks for none.
    SceneText with_default_kernel() const
    {
        SceneText t = *this;
        t.h = scene::Space{}.h, t.accuracy.clear();
        return t;
    }

    double bulk() const { return young / (3 * (1 - 2 * poisson)); }                // Pa
    double shear() const { return young / (2 * (1 + poisson)); }                   // Pa
    double constrained() const { return bulk() + 4 * shear() / 3; }                // Pa, P-wave modulus M
    double p_wave() const { return std::sqrt(constrained() / density); }           // m/s
    double s_wave() const { return std::sqrt(shear() / density); }                 // m/s
    double k0() const { return poisson / (1 - poisson); }                          // elastic, sideways strain zero
    double step(double courant) const { return courant * h * spacing / p_wave(); } // s
};

/// [[body]] or [[wall]] of a box; y counts in 3-D only.
inline std::string box(const char* what, Vector low, Vector high, const std::string& more = "soil = \"s\"")
{
    return fmt::format("[[{}]]\nbox = {{ low = [{}, {}, {}], high = [{}, {}, {}] }}\n{}\n", what, low.x, low.y, low.z, high.x, high.y,
                       high.z, more);
}
inline std::string sphere(Vector center, double radius, const std::string& more = "soil = \"s\"")
{
    return fmt::format("[[body]]\nsphere = {{ center = [{}, {}, {}], radius = {} }}\n{}\n", center.x, center.y, center.z, radius, more);
}
inline std::string polygon(const char* what, const std::vector<std::array<double, 2>>& corners, const std::string& more = "soil = \"s\"")
{
    std::string points;
    for (const auto& c : corners) points += fmt::format("{}[{}, {}]", points.empty() ? "" : ", ", c[0], c[1]);
    return fmt::format("[[{}]]\npolygon = {{ points = [{}] }}\n{}\n", what, points, more);
}
/// Space that repeats along x (and y) from 0 to the width, open in z.
inline std::string periodic(double width, double low, double high, const char* axes = "\"x\"")
{
    return fmt::format("low = [0.0, 0.0, {}]\nhigh = [{}, {}, {}]\nperiodic = [{}]", low, width, width, high, axes);
}

// ---- initial fields, on a field's half-step copy too where the scheme has one ----

inline void set_velocity(Particles& p, Index i, Vector v)
{
    p[field::velocity].set(i, v);
    if (p.has(field::half_velocity)) p[field::half_velocity].set(i, v);
}
inline void set_stress(Particles& p, Index i, const Stress& s)
{
    p[field::stress].set(i, s);
    if (p.has(field::half_stress)) p[field::half_stress].set(i, s);
}
inline void set_position(Particles& p, Index i, Vector x)
{
    p[field::position].set(i, x), p[field::origin].set(i, x), p[field::sorted_position].set(i, x);
}
/// Options of a run that calls set(particles, i, position) for every particle at its start.
template <class Set> RunOptions starting_with(Set set)
{
    RunOptions options;
    options.initial = [set](Particles& p) {
        for (Index i = 0; i < p.size(); ++i) set(p, i, std::as_const(p)[field::position][i]);
    };
    return options;
}

// ---- running and measuring ----

inline void run_to(Simulation& sim, double time)
{
    while (!sim.finished() && sim.time() < time * (1 - 1e-12)) sim.step();
}
/// Calls visit(i) for every particle.
template <class Visit> void each(const Simulation& sim, Visit visit)
{
    for (Index i = 0; i < sim.particles().size(); ++i) visit(i);
}
inline Vector position(const Simulation& s, Index i) { return s.particles()[field::position][i]; }
inline Vector origin(const Simulation& s, Index i) { return s.particles()[field::origin][i]; }
inline Vector velocity(const Simulation& s, Index i) { return s.particles()[field::velocity][i]; }
inline Stress stress(const Simulation& s, Index i) { return s.particles()[field::stress][i]; }

using Positions = std::map<std::int64_t, Vector>; // by id, m
inline Positions positions(const Simulation& s)
{
    Positions x;
    each(s, [&](Index i) { x[s.particles()[field::id][i]] = position(s, i); });
    return x;
}
/// Ways of all particles from where they were, m, each handed to visit.
template <class Visit> void each_way(const Simulation& s, const Positions& from, Visit visit)
{
    each(s, [&](Index i) { visit(length(position(s, i) - from.at(s.particles()[field::id][i]))); });
}

inline double particle_mass(const Simulation& s, Index i)
{
    return s.soils()[s.particles()[field::soil][i]].density * s.scene().particle_volume();
}
/// Kinetic and elastic energy, J.
inline double mechanical_energy(const Simulation& s)
{
    const auto l = s.ledger();
    return l.state.kinetic + l.state.elastic;
}
inline Vector cross(Vector a, Vector b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
/// The sum over all ranks.
inline Vector over_ranks(Vector part)
{
    double sums[3] = {part.x, part.y, part.z};
    world().sum(std::span<double>(sums));
    return {sums[0], sums[1], sums[2]};
}
inline Vector linear_momentum(const Simulation& s)
{
    Vector sum;
    each(s, [&](Index i) { sum = fma(particle_mass(s, i), velocity(s, i), sum); });
    return over_ranks(sum);
}
/// About the origin.
inline Vector angular_momentum(const Simulation& s)
{
    Vector sum;
    each(s, [&](Index i) { sum = fma(particle_mass(s, i), cross(position(s, i), velocity(s, i)), sum); });
    return over_ranks(sum);
}
/// The smallest distance of two particles, m; for a few thousand of them.
inline double least_distance(const Simulation& s)
{
    double least = std::numeric_limits<double>::max();
    each(s, [&](Index i) {
        const Vector x = position(s, i);
        for (Index j = 0; j < i; ++j) {
            const Vector d = position(s, j) - x;
            least = std::min(least, dot(d, d));
        }
    });
    return std::sqrt(least);
}
/// Pieces of matter: sets of particles that are linked by distances below `link` (m).
inline int pieces(const Simulation& s, double link)
{
    const Index n = s.particles().size();
    std::vector<Index> seen(n, 0), queue;
    int count = 0;
    for (Index first = 0; first < n; ++first) {
        if (seen[first]) continue;
        ++count, seen[first] = 1, queue = {first};
        while (!queue.empty()) {
            const Vector x = position(s, queue.back());
            queue.pop_back();
            for (Index j = 0; j < n; ++j) {
                if (seen[j]) continue;
                const Vector d = position(s, j) - x;
                if (dot(d, d) < link * link) seen[j] = 1, queue.push_back(j);
            }
        }
    }
    return count;
}

/// L2 = sqrt(sum (f - f_ref)^2/sum f_ref^2) and Linf = max |f - f_ref|/max |f_ref| over what was added.
class ErrorNorms {
public:
    void add(double value, double reference)
    {
        const double e = value - reference;
        e2_ += e * e, r2_ += reference * reference;
        e_ = std::max(e_, std::fabs(e)), r_ = std::max(r_, std::fabs(reference));
    }
    double L2() const
    {
        double sums[2] = {e2_, r2_};
        world().sum(std::span<double>(sums)); // of doubles there is no sum of one: it would be taken for a whole number
        return std::sqrt(sums[0] / sums[1]);
    }
    double Linf() const { return world().max(e_) / world().max(r_); }

private:
    double e2_ = 0, r2_ = 0, e_ = 0, r_ = 0;
};
/// p of error ~ dx^p from two resolutions.
inline double observed_order(double coarse_error, double fine_error, double refinement = 2)
{
    return std::log(coarse_error / fine_error) / std::log(refinement);
}

/// Finds where a sampled signal changes sign, by linear interpolation; every = 0 takes all samples.
class ZeroCrossings {
public:
    void add(double t, double f)
    {
        if (have_ && ((f_ < 0) != (f < 0))) times_.push_back(t_ - f_ * (t - t_) / (f - f_));
        have_ = true, t_ = t, f_ = f;
    }
    const std::vector<double>& times() const { return times_; }

private:
    bool have_ = false;
    double t_ = 0, f_ = 0;
    std::vector<double> times_;
};

// ---- record ----

/// What else a result may carry.
struct Extra {
    std::string note = {};
    /// The bound that is met where the criterion is not; the test asserts this one.
    std::optional<double> achieved = {};
    /// The number of another code or a closed form, and whose it is: a criterion that is missed is closed where the result is within 5 %
    /// of it.
    double independent = 0;
    std::string whose = {};
};

/// One case of the verification suite and its results.
class Case {
public:
    explicit Case(std::string name) : name_(std::move(name)), begin_(Clock::now())
    {
        static std::set<std::string> begun; // tests of one case share its file
        if (begun.insert(name_).second)
            if (const auto path = file(".jsonl"); !path.empty()) std::ofstream(path, std::ios::trunc);
    }

    /// |result/reference - 1| <= tolerance.
    testing::AssertionResult near(const std::string& what, double reference, double result, const std::string& unit, double tolerance,
                                  const Extra& extra = {})
    {
        const double error = std::fabs(result / reference - 1);
        record(what, fmt::format("{:.6g}", reference), result, unit, fmt::format("+-{:.3g} %", 100 * tolerance), error <= tolerance, extra);
        return judge(error <= extra.achieved.value_or(tolerance), what, result, unit,
                     fmt::format("{:.6g} +-{:.3g} %", reference, 100 * extra.achieved.value_or(tolerance)));
    }
    /// result <= limit.
    testing::AssertionResult at_most(const std::string& what, double result, const std::string& unit, double limit, const Extra& extra = {})
    {
        record(what, "\"0\"", result, unit, fmt::format("<= {:.4g}", limit), result <= limit, extra);
        return judge(result <= extra.achieved.value_or(limit), what, result, unit,
                     fmt::format("at most {:.4g}", extra.achieved.value_or(limit)));
    }
    /// result >= limit.
    testing::AssertionResult at_least(const std::string& what, double result, const std::string& unit, double limit,
                                      const Extra& extra = {})
    {
        record(what, "\"bound\"", result, unit, fmt::format(">= {:.4g}", limit), result >= limit, extra);
        return judge(result >= extra.achieved.value_or(limit), what, result, unit,
                     fmt::format("at least {:.4g}", extra.achieved.value_or(limit)));
    }
    /// A negative control: a setting that must not meet the criterion. Recorded as passed if it does not; returns whether it does.
    bool control(const std::string& what, double result, const std::string& unit, const std::string& criterion, bool met)
    {
        record("control: " + what, "\"must fail\"", result, unit, criterion, !met);
        return met;
    }
    bool control(const std::string& what, double reference, double result, const std::string& unit, double tolerance)
    {
        return control(what, result, unit, fmt::format("{:.6g} +-{:.3g} %", reference, 100 * tolerance),
                       std::fabs(result / reference - 1) <= tolerance);
    }
    bool control_at_most(const std::string& what, double result, const std::string& unit, double limit)
    {
        return control(what, result, unit, fmt::format("<= {:.4g}", limit), result <= limit);
    }
    /// A number that no criterion is put on.
    void report(const std::string& what, double result, const std::string& unit, const std::string& note = {})
    {
        record(what, "\"none\"", result, unit, "reported", true, {.note = note});
    }
    /// A table for plotting, <case>_<name>.csv.
    void curve(const std::string& name, const std::vector<std::string>& columns, const std::vector<std::vector<double>>& rows) const
    {
        const auto path = file("_" + name + ".csv");
        if (path.empty()) return;
        std::ofstream out(path);
        for (std::size_t k = 0; k < columns.size(); ++k) out << (k ? "," : "") << columns[k];
        for (const auto& row : rows) {
            out << '\n';
            for (std::size_t k = 0; k < row.size(); ++k) out << (k ? "," : "") << fmt::format("{:.9g}", row[k]);
        }
        out << '\n';
    }

private:
    using Clock = std::chrono::steady_clock;
    static testing::AssertionResult judge(bool good, const std::string& what, double result, const std::string& unit,
                                          const std::string& expected)
    {
        if (good) return testing::AssertionSuccess();
        return testing::AssertionFailure() << fmt::format("{}: expected {} {}, found {:.6g}", what, expected, unit, result);
    }
    std::string file(const std::string& ending) const
    {
        const char* directory = std::getenv("KUZURE_RESULTS");
        return world().size() == 1 && directory && *directory ? std::string(directory) + "/" + name_ + ending : std::string();
    }
    /// One JSON line; `reference` is JSON already. Seconds count from the result before.
    void record(const std::string& what, const std::string& reference, double result, const std::string& unit, const std::string& tolerance,
                bool passed, const Extra& extra = {})
    {
        const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
        begin_ = Clock::now();
        const bool near = extra.independent != 0 && std::fabs(result / extra.independent - 1) <= 0.05;
        const std::string closed = !passed && near ? fmt::format("{}: {:.4g}", extra.whose, extra.independent) : "";
        const std::string note = extra.note.empty() ? "" : "; " + extra.note;
        if (world().rank() == 0)
            fmt::print("[{:>8}] {}: {} = {:.6g} {} (reference {}, {}) {:.2f} s{} {}\n",
                       passed ? "met" : (closed.empty() ? "NOT MET" : "closed"), name_, what, result, unit, reference, tolerance, seconds,
                       note, closed);
        const auto path = file(".jsonl");
        if (path.empty()) return;
        const std::string number = std::isfinite(result) ? fmt::format("{:.9g}", result) : "null";
        std::ofstream(path, std::ios::app) << fmt::format("{{\"case\": \"{}\", \"what\": \"{}\", \"reference\": {}, \"result\": {}, "
                                                          "\"unit\": \"{}\", \"tolerance\": \"{}\", \"passed\": {}, \"seconds\": {:.3f}, "
                                                          "\"note\": \"{}\", \"closed\": \"{}\"}}\n",
                                                          name_, what, reference, number, unit, tolerance, passed, seconds, extra.note,
                                                          closed);
    }

    std::string name_;
    Clock::time_point begin_;
};

} // namespace kuzure::validation
