#pragma once
// What will be simulated and why, as kuzure check tells it: for programs and for people.
#include "solver/app/scaling/forecast.hpp"
#include <nlohmann/json_fwd.hpp>

namespace kuzure {

/// All that is known of a run before it begins.
struct SceneFacts {
    const Scene& scene;
    const scene::Filling& filling;
    const Estimate& estimate;
    std::string pair_model;
    double memory; // bytes of all processes
    Forecast time;
    std::string where; // on what machine it takes so long
    std::vector<std::string> warnings;
};
nlohmann::ordered_json to_json(const SceneFacts&);
/// The same in words, the scene with every default behind it.
std::string to_text(const SceneFacts&);

} // namespace kuzure
