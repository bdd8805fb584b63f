#pragma once
// Where the misfit of an event is least: which values are tried next, and what the ones that were tried say. Numbers only, and a function
// of what was tried alone: a search that was interrupted goes on as if it had not been.
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kuzure::hazard {

/// A number that is sought. Values lie on a lattice of `parts` parts from low to high, so that the same value is the same number.
struct Axis {
    std::string name, unit;
    double low = 0, high = 0;
    int scan = 0;  // values of the even scan, both ends included
    int parts = 0; // how finely it is searched: scan - 1 times a power of two
    double value(double at) const { return at >= parts ? high : low + (high - low) * at / parts; }
};
/// Sets `parts` of one axis, or of two.
void choose_parts(std::vector<Axis>&);

struct Trial {
    std::vector<int> at; // by axis
    double misfit = 0;   // NaN: the run failed
    bool operator<(const Trial& o) const { return at < o.at; }
};

/// The values to try next; none where the search is done. `alike`: by how much misfits differ that cannot be told apart. First the even
/// scan. Of one number then the middles of the gaps beside the best value, down to a lattice step; of gaps between a value that is as good
/// as the best and one that is not, down to two; between two that are as good, down to four. Of two numbers the eight neighbours of the
/// best at half the step, a quarter and so on.
std::vector<std::vector<int>> next_trials(const std::vector<Axis>&, std::vector<Trial>, double alike);

/// How far misfits of one number scatter about a smooth curve: two standard deviations, by the median distance of a value from the line
/// between its neighbours, those at the best left out. 0 for fewer than five such, and for two numbers.
double scatter_of(std::vector<Trial>);

/// What the trials say.
struct Verdict {
    std::vector<int> best;
    double misfit = 0;
    bool at_end = false; // the best is the first or last of a range: the least misfit may lie beyond
    struct Interval {
        double low = 0, high = 0;                 // of values that are as good as the best, in the axis's unit
        bool open_low = false, open_high = false; // as good up to the end of the range
    };
    std::vector<Interval> intervals = {}; // by axis; none where at_end
    bool split = false;                   // of one number: values between its ends are worse
};
/// Nothing where no trial has a misfit. Of equal misfits the middle one is the best.
std::optional<Verdict> judge(const std::vector<Axis>&, std::vector<Trial>, double alike);

} // namespace kuzure::hazard
