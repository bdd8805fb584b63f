#pragma once
// What is known of an event, an outline or a deposit, and how far a run is from it.
#include "solver/app/hazard/run_scene.hpp"
#include "solver/scene/contour.hpp"
#include "solver/scene/fill.hpp"

namespace kuzure::hazard {

/// In the coordinates of the scene's map.
struct Observed {
    std::string file;
    bool deposit = false;           // thickness of what lay there afterwards; else the outline of all that was reached
    std::vector<scene::Ring> rings; // inside is what an odd number of them encloses
    double area = 0;                // m^2
    double perimeter = 0;           // m
    double reach = 0;               // m, from the centre of the mass to the farthest corner
    std::vector<std::string> doubts;
};
/// Of a .shp or GeoJSON, else of a raster, where it is at least `wet` thick. Throws BadInput: with file and remedy; also where nothing of
/// it lies on the scene's map.
Observed read_observed(const std::string& file, const Base&, const scene::Filling&, double wet);

/// A run beside it. Areas are compared at 4 x 4 points of each cell of the maps.
struct Comparison {
    double misfit = std::numeric_limits<double>::quiet_NaN(); // 1 - overlap; NaN: not compared yet
    double overlap = 0;                                       // common area over that of both together
    double area = 0, reach = 0;                               // m^2, m, of the run
    double reach_error = 0;                                   // m, positive: the run goes too far
    double rms = 0;                                           // m, of the thickness where either lies; of a deposit alone
    std::vector<scene::Area> drawn;                           // the run's outline
};
/// `wet`: m, from which soil counts. Throws IoFailed, BadInput.
Comparison compare(const Observed&, const io::Path& run, const Base&, double cell, double wet);

/// By how much the misfit may change by the cells alone: where the outline crosses a cell, its area is known to 0.29 of a cell (even
/// distribution); twice the root of the sum of squares over all such cells, over the area.
double misfit_of_cells(const Observed&, double cell);

} // namespace kuzure::hazard
