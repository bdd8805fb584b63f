#pragma once
// The sweep file of `kuzure study`: one scene, a table of settings, and what its results are compared with.
#include "io/file.hpp"
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kuzure::io {

/// What a study measures on a run, in the order of study.csv; the names in sweep files are measure_names().
enum class Measure { Profile, Runout, Height, PeakSpeed, FailureLine, Stress, Settlement, Residual };
const std::vector<std::string>& measure_names();

/// What errors count from.
struct SweepReference {
    enum class Kind { Finest, ClosedForm, Experiment } kind = Kind::Finest;
    std::string curve;     // Finest: whose finest run; empty: the one of the smallest spacing
    Path profile, failure; // Experiment: CSV of x, z in m; failure may be empty
    double scatter = 0;    // Experiment: relative, below which no error means anything
};

/// One run of a study.
struct SweepPoint {
    std::string curve;             // all settings but the spacing, in words
    std::vector<std::string> sets; // key.path=value, as --set takes them
    bool choice = false;           // from [[point]]: to be compared with the base
};

struct Sweep {
    std::string title;
    Path scene;
    int threads = 1;
    std::optional<double> grain; // m, height at which the run-out is taken; without it the largest spacing of the sweep
    std::vector<Measure> measures;
    SweepReference reference;
    std::vector<SweepPoint> points; // the grid of [vary], then the base, then every [[point]]
};

/// Reads a sweep; paths in it count from its directory. `name` is what messages call the file. Throws BadInput with file,
/// line, key, what was expected and the remedy.
Sweep parse_sweep(std::string_view text, const Path& name);

} // namespace kuzure::io
