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

/// What a soil's keys mean for this scene.
struct SoilNumbers {
    std::string name;
    double unit_weight; // N/m^3; 0 without gravity
    double at_rest;     // K0 under half the height of the soil
    double stability;   // c/(gamma H), H the height of all soil; 0 without gravity
    double c_p, c_s;    // m/s, P- and S-wave
};
std::vector<SoilNumbers> soil_numbers(const Scene&, const Filling&);

/// Base strain, Mach number, layers, step against the P-wave, slenderness, grain number; those that the scene has.
std::vector<Judgement> judge(const Scene&, const Filling&);

} // namespace kuzure::scene
