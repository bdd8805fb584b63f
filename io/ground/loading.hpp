#pragma once
// What reads a scene's ground and what reads its releases share.
#include "io/ground/ground.hpp"
#include "io/ground/vectors.hpp"
#include "solver/core/ensure.hpp"
#include <cmath>
#include <numbers>

namespace kuzure::io::ground {

/// What flows comes to rest above this line, as nearly all have.
inline const double reach_slope = std::tan(11 * std::numbers::pi / 180);

/// What is wrong, at a key of the scene.
struct Refused {
    std::string key, text;
};
/// What the work on a key throws, with the key.
template <class Work> auto at_key(const std::string& key, Work work)
{
    try {
        return work();
    } catch (const BadInput& e) {
        throw Refused{key, e.what()};
    } catch (const IoFailed& e) {
        throw Refused{key, e.what()};
    }
}

/// A release with what its files say, in map coordinates.
struct Mass {
    scene::Release* release;
    std::string key; // "body.0.release"
    std::vector<Outline> outlines;
    std::vector<scene::Ring> rings; // of all
    Window box;                     // around it
    // On the grid of the ground:
    std::vector<double> thickness, bed; // NaN: none
};

/// The middle of a cell, as messages name it.
std::string cell_text(const scene::Grid&, int i, int j);
std::string shown(const Window&);
/// The scene's elevation models, as messages name them.
std::string dem_files(const Scene&);

/// Reads what a release's files say of its thickness onto the heights (map coordinates), and where its bed lies; adds what is doubtful.
/// Throws Refused.
void thickness_and_bed(Mass&, const scene::Grid& heights, const std::string& crs, const Scene&, scene::Issues&);

} // namespace kuzure::io::ground
