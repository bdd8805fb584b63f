#pragma once
// Numbers of ranks side by side: the real cut of the scene for each, counted on one machine, and what a step should take elsewhere.
#include "solver/app/scaling/drift.hpp"
#include "solver/app/scaling/predict.hpp"
#include <nlohmann/json_fwd.hpp>

namespace kuzure {

/// What is said of one number of ranks.
struct Case {
    int ranks, nodes;
    double cores; // of all ranks together
    CutShare cut;
    StepSeconds step, slow_messages, thin_wires;
    double efficiency = 1, memory = 0; // bytes of the fullest rank
};

/// The soil of a checkpoint, wrapped into the periods, and its ways there from the start, m.
struct State {
    std::vector<Vector> x, way;
};
/// Collective. Throws BadInput where there is no checkpoint, or another scene's.
State state_of(const Comm&, const Scene&, const io::Path& from);

/// Counts the cut for the ranks of a deployment and predicts a step of it; efficiency is left at 1. `x`: the soil's positions, m, or none
/// for those of the start.
Case count_case(const Scene&, const scene::Filling&, const Estimate&, Deployment, const std::vector<Vector>& x, Method);

nlohmann::ordered_json to_json(const std::vector<ReplayedCut>&);
/// `ghost_bytes`: of a ghost's record.
nlohmann::ordered_json to_json(const Case&, double ghost_bytes, bool per_rank);
/// Tables for people; `state` says which soil was counted.
std::string to_text(const std::vector<Case>&, const Scene&, const Deployment&, std::int64_t soil, const std::string& state);

} // namespace kuzure
