#pragma once
// Geometry of the shapes of bodies and walls. Distances are negative inside, and every function is defined
// everywhere: on faces, edges and corners and at centres. With dimensions = 2 only x and z count.
#include "solver/scene/parts.hpp"
#include <algorithm>
#include <cmath>
#include <limits>

namespace kuzure::scene {

/// Distance (m, negative inside) from a point to a surface, and the outward unit normal at the closest point.
struct Contact {
    double distance;
    Vector normal;
};

namespace detail {
/// Where the surfaces of two slabs meet: outside both the edge is closest, else the farther surface counts.
KUZURE_INLINE Contact intersect(const Contact& a, const Contact& b)
{
    if (a.distance > 0 && b.distance > 0) {
        const double d = std::hypot(a.distance, b.distance);
        return {d, (a.distance / d) * a.normal + (b.distance / d) * b.normal};
    }
    return a.distance >= b.distance ? a : b;
}
/// The slab low .. high along one axis.
KUZURE_INLINE Contact slab(double x, double low, double high, Vector axis)
{
    return x - high >= low - x ? Contact{x - high, axis} : Contact{low - x, -1.0 * axis};
}
} // namespace detail

/// Distance and normal of a box; at equal distances z comes before x before y.
KUZURE_INLINE Contact contact(const Box& box, Vector x, int dimensions = 3)
{
    const auto along_z = detail::slab(x.z, box.low.z, box.high.z, {0, 0, 1});
    const auto along_x = detail::slab(x.x, box.low.x, box.high.x, {1, 0, 0});
    const auto in_plane = detail::intersect(along_z, along_x);
    if (dimensions == 2) return in_plane;
    return detail::intersect(in_plane, detail::slab(x.y, box.low.y, box.high.y, {0, 1, 0}));
}
/// Distance and normal of a sphere; the normal at the centre is z.
inline Contact contact(const Sphere& sphere, Vector x, int dimensions = 3)
{
    Vector d = x - sphere.center;
    if (dimensions == 2) d.y = 0;
    const double r = std::hypot(d.x, d.y, d.z);
    return {r - sphere.radius, r > 0 ? Vector{d.x / r, d.y / r, d.z / r} : Vector{0, 0, 1}};
}
/// Distance and normal of an upright cylinder (3-D only); the side's normal on the axis is x.
inline Contact contact(const Cylinder& c, Vector x, int = 3)
{
    const double dx = x.x - c.base.x, dy = x.y - c.base.y, r = std::hypot(dx, dy);
    const Contact side{r - c.radius, r > 0 ? Vector{dx / r, dy / r, 0} : Vector{1, 0, 0}};
    return detail::intersect(detail::slab(x.z, c.base.z, c.base.z + c.height, {0, 0, 1}), side);
}
/// Distance and normal of an extruded polygon with any number of corners, in either sense of rotation.
Contact contact(const Polygon&, Vector x, int dimensions = 3);
/// Distance and normal of the surface of the ground; infinitely far above where there is none.
Contact contact(const Ground&, Vector x, int dimensions = 3);
/// Distance and normal of the soil of a release, to first order near its top and foot.
Contact contact(const Release&, Vector x, int dimensions = 3);
/// Distance and normal of any shape.
inline Contact contact(const Shape& shape, Vector x, int dimensions = 3)
{
    if (const Box* box = std::get_if<Box>(&shape)) return contact(*box, x, dimensions);
    return std::visit([&](const auto& s) { return contact(s, x, dimensions); }, shape);
}

/// Distance (m) from a point to the surface, negative inside.
inline double signed_distance(const Shape& shape, Vector x, int dimensions = 3) { return contact(shape, x, dimensions).distance; }
/// True strictly inside: not on the surface.
inline bool contains(const Shape& shape, Vector x, int dimensions = 3) { return signed_distance(shape, x, dimensions) < 0; }
/// Half-open interval: low with it, high without, ends known to the tolerance.
inline bool between(double x, double low, double high, double tolerance) { return x >= low - tolerance && x < high - tolerance; }
/// True if a point belongs to a shape with half-open faces: inside, or within `tolerance` (m) of a face that has the interior on the
/// side of greater coordinates, x then y then z. Of shapes that touch, exactly one has a point of their common face.
bool holds(const Shape&, Vector x, int dimensions, double tolerance);
/// How far (m) rounding may have moved what is computed from coordinates of this size (m).
inline double rounding_of(double coordinate) { return 8 * std::numeric_limits<double>::epsilon() * std::abs(coordinate); }
/// The same for a shape: by the largest of its coordinates.
double rounding_of(const Shape&, int dimensions);
/// Volume (m^3), in 2-D area (m^2).
double volume(const Shape&, int dimensions);
/// The smallest box around a shape; in 2-D its y is that of the file and means nothing.
Box bounds(const Shape&);
/// Thickness of a release above a point in plan, m along z; 0 outside its outline and where its bed or thicknesses are unknown.
double thickness(const Release&, double x, double y);
/// Volume (m^3) and area in plan (m^2) of a release, and its greatest thickness (m).
struct Extent {
    double volume, area, thickest;
};
Extent extent(const Release&);
/// "box", "cylinder", "sphere", "polygon" or "release": the scene's key; "ground".
const char* name_of(const Shape&);
/// Area (m^2) of the polygon, positive if its corners run from x towards z.
double area(const Polygon&);
/// True if two edges that are not neighbours meet, or an edge has no length.
bool crosses_itself(const Polygon&);

} // namespace kuzure::scene
