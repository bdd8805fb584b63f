#pragma once
// A map as a picture: colours over the shaded ground, outlines, named points, coordinates, scale bar, north arrow.
#include "io/map_style.hpp"
#include "io/named_points.hpp"
#include "solver/scene/contour.hpp"
#include <functional>

namespace kuzure::io {

struct MapPicture {
    MapKind kind;
    std::string title;
    scene::Grid values;                                    // in the coordinates of the map; NaN: clear
    std::function<double(double x, double y)> ground = {}; // m, in the same coordinates, NaN where there is none; empty: level
    struct Outline {
        double limit; // m
        std::vector<scene::Area> areas;
        std::string label = {}; // in the legend; empty: h_max at the limit
    };
    std::vector<Outline> outlines;
    bool whole_outlines = false;         // all of them are shown, also where there are no values
    std::vector<NamedPoint> points = {}; // rings with their names, those on the picture or not far beyond what it would show
};

/// The bytes of a PNG that shows where there are values, and some of what is around them. Throws BadInput where can_draw() is false.
std::string map_png(const MapPicture&);

} // namespace kuzure::io
