#pragma once
// The dimensionless numbers by which a scene is judged before it runs.
#include "solver/scene/check.hpp"
#include <vector>

namespace kuzure::scene {

struct Judgement {
    std::string name;  // "base_strain"
    double value;      // 1
    std::string about; // what it is and what it should be
    std::string doubt; // a warning, or empty
};

/// Base strain, Mach number, layers, step against the P-wave, slenderness, grain number; those that the scene has.
std::vector<Judgement> judge(const Scene&, const Filling&);

} // namespace kuzure::scene
