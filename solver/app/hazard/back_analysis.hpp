#pragma once
// kuzure fit: the value of an input, bed friction as a rule, with which a scene covers what a known event covered. Each try is a child
// `kuzure run` in a directory of its own; what is finished is not run again.
#include "solver/app/cli/command.hpp"
#include "solver/app/hazard/observed.hpp"
#include "solver/app/hazard/queue.hpp"
#include "solver/app/hazard/runner.hpp"
#include "solver/app/hazard/search.hpp"

namespace kuzure::hazard {

/// What kuzure fit was told.
struct BackArguments {
    SceneArguments scene;
    std::string observed, output, within, layers;
    std::vector<std::string> inputs; // NAME or NAME=LOW,HIGH
    int values = 0, jobs = 0;
};
/// Throws BadInput, IoFailed, NumbersFailed where no run was finished.
Exit run_back_analysis(const Comm&, const BackArguments&);

/// What `asked` names (NAME or NAME=LOW,HIGH; none: bed_friction), with as many values to try first (0: the usual number). A range that is
/// asked for becomes that of `u`, and one that is nowhere 5 to 45 deg of friction, 0.5 to 2 of thickness. Throws BadInput naming --input.
std::vector<Axis> axes_for(std::vector<std::string> asked, int values, scene::Uncertain& u);

/// A run and how far it is from the event; its values are run->member.values of the axes' inputs.
struct Tried {
    Run* run = nullptr;
    std::vector<int> at; // on the axes
    Comparison compared; // of a finished one
};

/// What a back-analysis came to.
struct BackState {
    const Base& base;
    std::string scene_file;
    const Observed& observed;
    const std::vector<Axis>& axes;
    std::vector<Tried> tried, repeats; // repeats: the best values with the particles at other positions
    std::optional<Verdict> verdict = {};
    double alike = 0, of_cells = 0, of_curve = 0, of_repeats = 0; // misfits; of_repeats NaN: not known
    double cell = 0, wet = 0, layers = 0, spacing = 0, ended = 0;
    double moving = 0; // kinetic energy at the end of the best run over its greatest
    bool final = false;
    std::vector<Words> not_done = {};
    const Tried& best() const;
};
nlohmann::ordered_json to_json(const BackState&);
/// A row for each value that was tried, in order.
std::string curve_csv(const BackState&);
/// What the numbers mean, in a sentence each.
std::vector<Words> meaning(const BackState&);
/// The page; DIR/best.png is in it where it was drawn.
std::string html(const BackState&, const io::Path& directory);

} // namespace kuzure::hazard
