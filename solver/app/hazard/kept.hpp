#pragma once
// What hazard and fit leave in their directories and read again: a file from somebody else may hold anything.
#include "solver/app/hazard/answer.hpp"
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kuzure::hazard {

/// plan.json: what an earlier call in a directory decided.
struct KeptPlan {
    std::string of;                 // what makes runs those of one answer
    double preliminary_spacing = 0; // m
    int group = 0;                  // members drawn together; 0: not decided yet
    std::optional<double> ensemble_layers;
    std::vector<double> finer_layers;
    bool operator==(const KeptPlan&) const = default;
};
/// Throws std::runtime_error with what is wrong.
KeptPlan plan_from_text(std::string_view json);
std::string to_text(const KeptPlan&);

/// fit_plan.json.
struct KeptFit {
    std::string of;
    std::optional<double> spacing; // m
    bool operator==(const KeptFit&) const = default;
};
/// Throws std::runtime_error with what is wrong.
KeptFit fit_from_text(std::string_view json);
std::string to_text(const KeptFit&);

/// The runs that a hazard.json lists, without their maps; directories lie below that of the file.
struct KeptRuns {
    double coarsest = 0, deadline = 0, ended = 0; // m, s, s
    int group = 0;
    std::vector<Run> runs;
};
/// `inputs`: names of what was varied. Throws std::runtime_error with what is wrong.
KeptRuns runs_from_text(std::string_view json, const std::vector<std::string>& inputs);

/// What a run's summary.json says of its end; nothing where it is none, or none that ended.
struct KeptEnd {
    Status status = Status::NotRun;
    double seconds = 0;
    std::string message;
};
std::optional<KeptEnd> end_from_text(std::string_view json);

} // namespace kuzure::hazard
