#pragma once
// From a wanted error to settings: read off the table of measured studies (measured.inl, made by jobs/studies/publish.py).
#include "solver/app/cli/command.hpp"
#include "solver/scene/check.hpp"
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kuzure::study {

/// What makes one scene like another for the dial.
struct Likeness {
    int dimensions = 3;
    double slenderness = 1;    // height over half the width
    double layers = 20;        // height over spacing
    double friction_angle = 0; // deg, greatest
    double cohesion = 0;       // over the weight of the height, 1
};
Likeness likeness(const Scene&);

struct MeasuredPoint {
    double layers, error;
};
/// Errors of one preset on one measured scene, coarse to fine.
struct MeasuredCurve {
    std::string scene, measure, preset;
    Likeness about;
    std::vector<MeasuredPoint> points;
};
/// The table of a JSON text. Throws Broken where it is none.
std::vector<MeasuredCurve> read_measured(std::string_view json);
/// The table this program was built with.
const std::vector<MeasuredCurve>& measured();

/// Error of a curve at a number of layers: linear in the logarithms between its points, beyond them by the slope of the last two,
/// taken between 0.5 and 2.
double error_at(const MeasuredCurve&, double layers);
/// The least number of layers with that error.
double layers_for(const MeasuredCurve&, double error);
/// 0: as one of the measured scenes; above 1 it is another kind of scene. `why` gets the parts, largest first.
double distance(const Likeness& scene, const Likeness& measured, std::string* why = nullptr);

struct Proposal {
    std::string preset;
    std::optional<scene::CheckedScene> checked; // the scene with the proposed spacing and keys, and its warnings
    double expected = 0;                        // error, 1
    double low = 0, high = 0;                   // of all measured scenes
    double work = 0;                            // as `work` gave it
    std::string nearest, difference;            // the measured scene it rests on, and how that differs
    double distance = 0;
    double least_layers = 0, most_layers = 0; // measured; beyond them the error is an extrapolation
    std::string note;                         // what could not be had
};
/// The settings that reach the error on this scene with the least work. Spacings are tried that fill its bodies whole; fixed steps
/// go with the smoothing length. Throws BadInput where none is found.
Proposal propose(const Scene&, double error, const std::vector<MeasuredCurve>&,
                 const std::function<double(const scene::CheckedScene&)>& work);
/// For the terminal, and for --json; with the seconds that it will take here.
std::string to_text(const Proposal&, double wanted, double seconds);
nlohmann::ordered_json to_json(const Proposal&, double wanted, double seconds);

/// "5%", "5 %" or "0.05" as 0.05. Throws BadInput.
double parse_accuracy(const std::string&);

/// kuzure check --accuracy: settings for this error, with time and expected error, on the root's terminal. Collective.
Exit print_proposal(const Comm&, const Scene&, const std::string& accuracy, bool json);

} // namespace kuzure::study
