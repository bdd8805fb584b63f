#pragma once
// What kuzure check says of an ensemble: its members, and what could be answered in a given time, before anything is run.
#include "solver/app/cli/command.hpp"
#include "solver/app/hazard/run_scene.hpp"
#include <nlohmann/json_fwd.hpp>

namespace kuzure::hazard {

/// What kuzure check --within was told.
struct FitArguments {
    std::string scene, within, machine; // machine: a profile; empty: this one
    int ranks = 0;
    bool json = false;
};
/// Prints layers and members that fit. Writes nothing. Throws BadInput.
Exit print_what_fits(const Comm&, const scene::CheckedScene&, const std::optional<scene::Uncertain>&, const FitArguments&);

/// The members that kuzure hazard would run, for the terminal and for --json.
std::string uncertain_text(const scene::Uncertain&);
nlohmann::ordered_json uncertain_json(const scene::Uncertain&);

} // namespace kuzure::hazard
