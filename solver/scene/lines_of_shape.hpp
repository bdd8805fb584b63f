#pragma once
// What a line along x meets of a shape: where it is all inside, all outside, and where single points must be asked.
#include "solver/scene/shape.hpp"
#include <optional>
#include <vector>

namespace kuzure::scene {

/// A box's side must hold whole spacings within this share of one; two boxes may overlap by as much.
inline constexpr double tolerance = 1e-6;
/// Depth (m) to which shapes may overlap and still touch, or a box's side may miss whole spacings.
inline double slack(const Shape& shape, double spacing, int dimensions)
{
    return std::max(tolerance * spacing, rounding_of(shape, dimensions));
}

/// Part of a line along x.
struct Zone {
    double from, to;
};

/// Depth (m) of a line along x below the faces that the line runs along: those of a box in y and z, the ends of
/// a cylinder, the sides of a polygon. Negative outside.
double depth_between_faces(const Shape&, double y, double z, int dimensions);

/// Where a line along x passes a round shape: the x of its centre, and the square of the line's distance from it.
struct Passage {
    double centre, across2, radius;
};
std::optional<Passage> passage(const Shape&, double y, double z, int dimensions);

/// At most so many distances from a point to a polygon's edge are taken to fill it: for each line that an edge passes a few points
/// at the passage, more where it runs along the line, each against every edge.
double edge_tests(const Polygon&, double spacing);
/// Points next to a polygon's edges are looked at one by one, each against all corners: more of that than this takes too long.
inline constexpr double most_edge_tests = 1e9;

/// The parts of a line along x that come nearer than margin to the surface, faces along the line not counted,
/// from left to right. Between them a line is all inside or all outside.
std::vector<Zone> zones_near_surface(const Shape&, double y, double z, double margin, int dimensions);

} // namespace kuzure::scene
