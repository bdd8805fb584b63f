#pragma once
// What kuzure safety leaves in its directory and reads again: a file from somebody else may hold anything.
#include "solver/app/safety/trial.hpp"
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace kuzure::safety {

/// The looks at a trial, as its record and safety.json have them.
nlohmann::ordered_json legs_of(const std::vector<Seen>&);

/// trials/NAME.json: what was seen of a trial so far.
struct KeptTrial {
    double factor = 0;
    std::vector<Seen> seen; // at most one a leg
    double seconds = 0;
};
/// Throws std::runtime_error with what is wrong.
KeptTrial trial_from_text(std::string_view json);
std::string to_text(const KeptTrial&);

/// plan.json: what makes trials those of one answer. Throws std::runtime_error with what is wrong.
std::string identity_from_text(std::string_view json);
std::string plan_text(const std::string& identity);

} // namespace kuzure::safety
