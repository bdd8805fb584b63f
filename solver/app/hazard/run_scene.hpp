#pragma once
// The scenes of single runs: the user's own at another resolution and with other values, on files of their own where the ground or a
// thickness is another.
#include "io/file.hpp"
#include "io/scene_file.hpp"
#include "solver/app/hazard/sample.hpp"

namespace kuzure::hazard {

/// The user's scene, and what all runs share.
struct Base {
    Scene scene;
    scene::Uncertain uncertain; // without inputs where the scene has none
    double thickness = 0;       // m, mean of the soil over its columns
    double volume = 0;          // m^3
    Vector centre{};            // m, of the soil, in the scene's coordinates
    double coarsest = 0;        // m, of all runs: cells and least thickness of maps go by it
    double wet = 0;             // m, from which soil counts in all runs; 0: the scene's, or more where the coarsest run asks for it
    double recorded = 1;        // times that: from which runs record soil
    double spacing_of(double layers) const { return thickness / layers; } // m
    double layers_of(double spacing) const { return thickness / spacing; }
};
/// Throws BadInput where maps cannot be made: no [maps], two dimensions, a build without them; or where values cannot be varied.
Base base_of(const scene::CheckedScene&, const std::optional<scene::Uncertain>&, const std::string& file);

/// A resolution at which the bodies hold whole spacings with nearly the same volume, near the wanted one: m.
double possible_spacing(const Base&, double wanted);

/// What cells of all maps measure (m) where the coarsest run has this spacing, and from which thickness soil counts.
scene::Maps maps_for(const Scene&, double coarsest);
/// Those of all runs.
scene::Maps maps_of_runs(const Base&);

/// One run's scene as a file, what its command line adds, and what had to be changed, in words.
struct RunScene {
    std::string text;
    std::vector<std::string> sets;
    std::vector<std::string> notes;
};
/// `inputs`: a directory for rasters and outlines of its own, which it makes where it needs them. Throws BadInput, IoFailed.
RunScene run_scene(const Base&, double spacing, const Member&, const std::string& title, const io::Path& inputs);

/// The error of heights (m) at a point of the map: normal but for its farthest tails, alike over error.length.
double height_error(const scene::HeightError&, std::uint64_t seed, double x, double y);

} // namespace kuzure::hazard
