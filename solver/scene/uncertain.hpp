#pragma once
// What is not known of a scene, and how far it may be off. A run takes the scene as it is written; kuzure hazard varies these.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kuzure::scene {

/// A triangular distribution.
struct Triangle {
    double low = 0, likely = 0, high = 0;
    bool operator==(const Triangle&) const = default;
};
/// Errors of the heights of the ground: normal, alike over a length.
struct HeightError {
    double height = 0; // m, root mean square
    double length = 0; // m, over which errors fall to about 0.4 of their likeness
    bool operator==(const HeightError&) const = default;
};
/// Any number of the scene by its path.
struct UncertainKey {
    std::string key; // "soil.debris.cohesion"
    Triangle value;  // in the key's unit, as files have it
    bool operator==(const UncertainKey&) const = default;
};
struct Uncertain {
    int seed = 1;
    int members = 0;                      // 0: as many as the time allows
    std::optional<Triangle> friction;     // deg, of every soil
    std::optional<Triangle> bed_friction; // deg, of the ground and of every wall with friction
    std::optional<Triangle> thickness;    // 1, times the thickness of releases and the height of bodies
    std::optional<HeightError> dem_error;
    std::vector<UncertainKey> keys;
    std::vector<double> pressures; // kPa, limits whose exceedance is mapped
    bool operator==(const Uncertain&) const = default;
};

} // namespace kuzure::scene
