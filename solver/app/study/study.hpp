#pragma once
// One scene over a table of settings: runs, errors, costs, and the table and figures they end in.
#include "io/sweep_file.hpp"
#include "solver/app/study/convergence.hpp"
#include "solver/app/study/profile.hpp"
#include <array>
#include <nlohmann/json_fwd.hpp>

namespace kuzure::study {

inline constexpr std::size_t measure_count = 8; // io::Measure

/// A point of the study: what was asked, what it cost, what came out.
struct Point {
    io::SweepPoint asked;
    std::optional<Scene> scene;        // absent where the settings were refused
    std::string hash, folder, message; // the folder goes by the scene: points of one scene are run once, whatever they are called
    int exit_code = -1;                // as kuzure run gave it; -1: not run yet
    bool resumed = false;
    double spacing = 0;        // m
    double predicted_work = 0; // in directed pairs of the one-pass scheme
    // of a finished run
    std::int64_t particles = 0, steps = 0;
    double pairs = 0, core_seconds = 0, wall_seconds = 0;
    double work = 0; // pairs at the price of the scheme's step, in those of the one-pass scheme
    double base_strain = 0, mach = 0;
    double settlement = 0; // m, of the closed form
    Profile profile;
    std::vector<std::array<double, 2>> failure;
    /// By io::Measure. Value: in its unit, nan where it is an error already. Error: relative.
    std::array<double, measure_count> value{}, error{};
    bool finished() const { return exit_code == 0; }
};

/// Why and by how much a curve converges, for one measure.
struct CurveConvergence {
    std::string curve;
    io::Measure measure;
    Convergence result;
};
/// The error bar that the spacings h, 2 h and 4 h of one curve give, against what is known of the truth.
struct ErrorBar {
    std::string curve;
    io::Measure measure;
    double spacing, value, half_width, truth;
    std::string why_not; // no bar, and why
    bool covers() const;
};

struct Study {
    io::Sweep sweep;
    std::vector<Point> points;
    double window = 0, grain = 0; // m
    Profile experiment;
    std::vector<std::array<double, 2>> experiment_failure;
    std::array<double, measure_count> reference{}; // by measure, in the unit of its values
    std::array<std::string, measure_count> reference_note;
    std::array<double, measure_count> reference_spacing{}; // m, of the run that errors count from; 0: they count from something else
    std::vector<CurveConvergence> convergence;
    std::vector<ErrorBar> bars;

    /// Names of the curves of [vary] in their order.
    std::vector<std::string> curves() const;
    /// Finished points of a curve, coarse to fine.
    std::vector<const Point*> along(const std::string& curve) const;
    /// True if a point's error is there and says how far it is from the truth: at the spacing of the run that errors count from it
    /// says how near the settings are to each other.
    bool tells(const Point&, io::Measure) const;
    /// Costs (core-seconds or work) and errors of a curve.
    std::vector<Price> prices(const std::string& curve, io::Measure, bool work) const;
    const Point* base() const;
};

/// The study of a sweep, with every point's scene read and checked; nothing is run. Throws BadInput where the scene file, the
/// reference or every single point is wrong.
Study plan(const io::Sweep&);
/// Fills in values of a finished run from its directory. Throws IoFailed.
void measure(const Study&, Point&, const io::Path& run);
/// Errors, convergence and error bars, once the runs are done.
void compare(Study&);

nlohmann::ordered_json to_json(const Study&);
std::string to_csv(const Study&);
/// A plain table for the terminal.
std::string to_text(const Study&);

/// Writes data and gnuplot scripts into `folder`, and SVG and PNG where gnuplot is there; gives what to say of it.
std::string draw(const Study&, const io::Path& folder);

} // namespace kuzure::study
