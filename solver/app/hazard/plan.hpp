#pragma once
// What fits into the time: members and layers of particles, from what a run was measured or predicted to take. Numbers only.
#include <string>

namespace kuzure::hazard {

/// Pairs of a whole run go with this power of the layers: particles with the third, steps with the first, and the more layers, the fewer
/// particles are at the surface, where neighbours are missing (measured: 4.06 to 4.25, docs/hazard.md).
inline constexpr double cost_power = 4.25;

/// Seconds of a run with all cores of the machine: what it takes before its first step, and its steps.
struct Cost {
    double start = 0, steps = 0, layers = 4; // s, s, at so many layers
    double seconds(double at_layers) const;
};

/// By a run that took so many s.
Cost measured_cost(double seconds, double layers);

struct Plan {
    int members = 0;
    double layers = 0;  // of the ensemble
    double finer = 0;   // of a finer run afterwards; 0: none fits
    double seconds = 0; // all of it
};
inline constexpr double preliminary_layers = 4, most_layers = 40;
/// Members of a group where nobody says how many.
inline constexpr int usual_members = 12;

/// `left`: s. `members`: 0 for as many as are worth it. `layers`: of the ensemble, 0 for what fits.
Plan make_plan(const Cost&, double left, int members, double layers = 0);
/// Layers of a run that takes at most `left` s; 0 where that is not at least 1.15 times `than`.
double finer_layers(const Cost&, double left, double than);

/// "30m", "90s", "1h30m" or "45" (minutes) in seconds. Throws BadInput naming --within.
double parse_within(const std::string&);
/// "4", "4,6" or "4,6,8": preliminary, ensemble, finer; 0 where nothing is said. One number is that of all, and there is no finer run.
/// Throws BadInput naming --layers.
struct Layers {
    double preliminary = 0, ensemble = 0, finer = 0;
    bool given = false;
};
Layers parse_layers(const std::string&);

} // namespace kuzure::hazard
