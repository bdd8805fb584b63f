#pragma once
// kuzure safety: the factor of safety of a slope by strength reduction, each trial a child `kuzure run` in a directory of its own; what is
// finished is not run again.
#include "solver/app/cli/command.hpp"
#include "solver/app/safety/trial.hpp"
#include "solver/app/study/runs.hpp"
#include <nlohmann/json_fwd.hpp>
#include <optional>

namespace kuzure::safety {

/// What kuzure safety was told.
struct Arguments {
    SceneArguments scene;
    std::string output;
    double from = 0.5, to = 4, bracket = 0.02;
    std::optional<double> at; // s: of the state at this time of the scene's own run
    int jobs = 0;
};
/// Throws BadInput, NumbersFailed, IoFailed.
Exit run_safety(const Comm&, const Arguments&);

/// A trial, and what came of it.
struct Trial {
    double factor = 0;
    std::string name; // of its scene, log and directory
    std::vector<Seen> seen;
    Outcome outcome = Outcome::Open;
    double seconds = 0;            // of its runs
    int waits = study::most_waits; // left, for a run of an earlier call in the same place
};

/// What was found: between which factors the soil fails.
struct Answer {
    std::optional<double> holds, fails; // nothing: beyond the range
    /// The middle of both, where there are both.
    std::optional<double> factor() const;
    std::string words() const;
};

/// All that safety.json, safety.csv and the page tell. Trials by their factor.
struct Told {
    const Setting& setting;
    std::string scene_file;
    std::vector<Trial> trials;
    Answer answer;
    std::optional<double> at;
    std::vector<std::string> notes; // what of the scene bears on how the factor is to be read
    std::string picture;            // file name in the directory; empty: none
};
/// What of the scene bears on how the factor is to be read.
std::vector<std::string> notes_of(const Scene&);
nlohmann::ordered_json to_json(const Told&);
std::string to_csv(const Told&);
/// The page.
std::string html(const Told&, const io::Path& directory);

} // namespace kuzure::safety
