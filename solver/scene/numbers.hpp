#pragma once
// The dimensionless numbers of a scene, known before it runs, and what they warn of.
#include "solver/scene/fill.hpp"
#include <vector>

namespace kuzure::scene {

struct Indicator {
    std::string name;    // "base_strain"
    double value;        // 1
    std::string about;   // what it is and what it should be
    std::string warning; // or empty
};

/// Soil that is slower rests: 0.05 sqrt(g spacing), m/s; 0 without gravity.
double resting_speed(const Scene&);

/// What a soil's keys mean for this scene.
struct SoilNumbers {
    std::string name;
    double unit_weight; // N/m^3; 0 without gravity
    double K0;          // under half the height of the soil
    double stability;   // c/(gamma H), H the height of all soil; 0 without gravity
    double c_p, c_s;    // m/s, P- and S-wave
};
std::vector<SoilNumbers> soil_numbers(const Scene&, const Filling&);

/// Base strain, Mach number, layers, step against the P-wave, slenderness, grain number; those that the scene has.
std::vector<Indicator> dimensionless_numbers(const Scene&, const Filling&);

} // namespace kuzure::scene
