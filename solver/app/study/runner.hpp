#pragma once
// A study from its sweep to its figures: every point a child `kuzure run` in its own directory; what is there is not run again.
#include "solver/app/cli/command.hpp"
#include <string>

namespace kuzure::study {

/// What kuzure study was told.
struct StudyArguments {
    std::string sweep, output;
    int threads = 0;        // of each run; 0: the sweep's
    double max_minutes = 0; // after which no run begins; 0: none
};
/// Runs the points, cheapest first, and writes study.json, study.csv and figures. Throws BadInput, IoFailed.
Exit run_study(const Comm&, const StudyArguments&);

} // namespace kuzure::study
