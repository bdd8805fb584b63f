#include "solver/scene/shape.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/ring.hpp"
#include <initializer_list>
#include <numbers>

namespace kuzure::scene {

bool Ground::operator==(const Ground& o) const
{
    return depth == o.depth && lattice == o.lattice && (field == o.field || (field && o.field && field->grid() == o.field->grid())) &&
           (friction == o.friction || (friction && o.friction && *friction == *o.friction));
}
bool Release::operator==(const Release& o) const
{
    return outline == o.outline && thickness == o.thickness && thickness_map == o.thickness_map && surface == o.surface &&
           before == o.before && after == o.after && on_top == o.on_top;
}
namespace {

struct Point {
    double x, z;
};
Point operator-(Point a, Point b) { return {a.x - b.x, a.z - b.z}; }
double cross(Point a, Point b) { return a.x * b.z - a.z * b.x; }
double dot(Point a, Point b) { return a.x * b.x + a.z * b.z; }
/// The k-th corner, k less than twice their number: a division here would be most of the time of filling a polygon.
Point corner(const Polygon& p, std::size_t k)
{
    const std::size_t n = p.points.size();
    const auto& q = p.points[k < n ? k : k - n];
    return {q[0], q[1]};
}

/// Distance (m) in plan to the outline of a release.
double distance_to_rings(const Release& r, Vector x)
{
    double least = std::numeric_limits<double>::infinity();
    for (const Ring& ring : r.rings)
        for (std::size_t k = 0; k < ring.size(); ++k) {
            const auto &a = ring[k], &b = ring[k + 1 < ring.size() ? k + 1 : 0];
            const double ex = b[0] - a[0], ey = b[1] - a[1], l2 = ex * ex + ey * ey;
            const double t = l2 > 0 ? std::clamp(((x.x - a[0]) * ex + (x.y - a[1]) * ey) / l2, 0.0, 1.0) : 0;
            least = std::min(least, std::hypot(x.x - a[0] - t * ex, x.y - a[1] - t * ey));
        }
    return least;
}

/// Half-open ball or disc: x minus its centre, in the order in which coordinates decide.
bool round_holds(std::initializer_list<double> from_centre, double radius, double tolerance)
{
    double r2 = 0;
    for (const double d : from_centre) r2 += d * d;
    const double beyond = std::sqrt(r2) - radius;
    if (std::abs(beyond) > tolerance) return beyond < 0;
    for (const double d : from_centre)
        if (std::abs(d) > tolerance) return d < 0;
    return false;
}

/// Half-open polygon: the even-odd rule for the point moved by as good as nothing along x and by far less along z. What lies within
/// the tolerance of the point counts as at it.
bool polygon_holds(const Polygon& polygon, Point x, double tolerance)
{
    const auto above = [&](Point corner) { return corner.z - x.z > tolerance; };
    bool inside = false;
    for (std::size_t k = 0; k < polygon.points.size(); ++k) {
        const Point a = corner(polygon, k), b = corner(polygon, k + 1);
        if (above(a) == above(b)) continue; // does not pass the point's height
        bool right;                         // of the moved point
        if (x.x < std::min(a.x, b.x) - tolerance) right = true;
        else if (x.x > std::max(a.x, b.x) + tolerance) right = false;
        else {
            const Point e = b - a;
            const double t = std::clamp(dot(x - a, e) / dot(e, e), 0.0, 1.0);
            const Point d = x - Point{a.x + t * e.x, a.z + t * e.z};
            const bool on = dot(d, d) <= tolerance * tolerance;
            right = !on && (cross(e, x - a) > 0) == (e.z > 0);
        }
        if (right) inside = !inside;
    }
    return inside;
}

Contact contact_in_plane(const Polygon& polygon, Point x)
{
    const std::size_t n = polygon.points.size();
    const double turn = area(polygon) >= 0 ? 1 : -1;
    const auto outward = [&](std::size_t k) {
        const Point e = corner(polygon, k + 1) - corner(polygon, k);
        const double l = std::hypot(e.x, e.z);
        return Point{turn * e.z / l, -turn * e.x / l};
    };
    double nearest = std::numeric_limits<double>::infinity(), where = 0;
    std::size_t edge = 0;
    for (std::size_t k = 0; k < n; ++k) {
        const Point a = corner(polygon, k), e = corner(polygon, k + 1) - a;
        const double t = std::clamp(dot(x - a, e) / dot(e, e), 0.0, 1.0);
        const Point d = x - Point{a.x + t * e.x, a.z + t * e.z};
        if (const double d2 = dot(d, d); d2 < nearest) nearest = d2, where = t, edge = k;
    }
    if (where > 0 && where < 1) {
        const Point out = outward(edge);
        return {dot(x - corner(polygon, edge), out), {out.x, 0, out.z}};
    }
    // A corner is closest: the normal points from it to the point outside or, on the corner, between its edges.
    const std::size_t k = where <= 0 ? edge : edge + 1 < n ? edge + 1 : 0;
    const Point d = x - corner(polygon, k);
    const double l = std::hypot(d.x, d.z);
    const double sign = encloses(polygon.points, x.x, x.z) ? -1 : 1;
    const Point e = corner(polygon, k + 1) - corner(polygon, k);
    if (l > 1e-12 * std::hypot(e.x, e.z)) return {sign * l, {sign * d.x / l, 0, sign * d.z / l}};
    const Point before = outward(k > 0 ? k - 1 : n - 1), after = outward(k), sum{before.x + after.x, before.z + after.z};
    const double s = std::hypot(sum.x, sum.z);
    return {0, s > 1e-12 ? Vector{sum.x / s, 0, sum.z / s} : Vector{after.x, 0, after.z}};
}

/// True if the segments a-b and c-d share a point.
bool meet(Point a, Point b, Point c, Point d)
{
    const auto side = [](Point p, Point q, Point r) { return cross(q - p, r - p); };
    const auto within = [](Point p, Point q, Point r) {
        return std::min(p.x, q.x) <= r.x && r.x <= std::max(p.x, q.x) && std::min(p.z, q.z) <= r.z && r.z <= std::max(p.z, q.z);
    };
    const double c1 = side(a, b, c), d1 = side(a, b, d), a1 = side(c, d, a), b1 = side(c, d, b);
    if (((c1 > 0) != (d1 > 0)) && ((a1 > 0) != (b1 > 0)) && c1 != 0 && d1 != 0 && a1 != 0 && b1 != 0) return true;
    return (c1 == 0 && within(a, b, c)) || (d1 == 0 && within(a, b, d)) || (a1 == 0 && within(c, d, a)) || (b1 == 0 && within(c, d, b));
}

} // namespace

Contact contact(const Polygon& polygon, Vector x, int dimensions)
{
    const auto in_plane = contact_in_plane(polygon, {x.x, x.z});
    if (dimensions == 2) return in_plane;
    return detail::intersect(in_plane, detail::slab(x.y, polygon.y[0], polygon.y[1], {0, 1, 0}));
}

Contact contact(const Ground& ground, Vector x, int)
{
    const auto n = ground.field->nearest(x);
    if (!std::isfinite(n.distance)) return {std::numeric_limits<double>::infinity(), {0, 0, 1}};
    return {n.distance, n.normal};
}

Contact contact(const Release& r, Vector x, int)
{
    const double h = thickness(r, x.x, x.y);
    if (!(h > 0)) return {distance_to_rings(r, x), {0, 0, 1}};
    const auto bed = r.bed->at(x.x, x.y);
    const double slope = 1 / bed.steepness(), up = x.z - bed.z;
    const Vector normal{-slope * bed.dz_dx, -slope * bed.dz_dy, slope};
    return up - h >= -up ? Contact{slope * (up - h), normal} : Contact{-slope * up, -1.0 * normal};
}

double thickness(const Release& r, double x, double y)
{
    if (!std::isfinite(r.bed->at(x, y).z) || !(r.rings.empty() || encloses(r.rings, x, y))) return 0;
    if (!r.thicknesses) return r.thickness.value_or(0);
    const double h = bilinear(*r.thicknesses, x, y); // what has no number there holds no soil
    return h > 0 ? h : 0;
}

Extent extent(const Release& r)
{
    const Box b = bounds(r);
    constexpr int n = 512; // samples along each axis
    const double dx = (b.high.x - b.low.x) / n, dy = (b.high.y - b.low.y) / n;
    Extent e{0, 0, 0};
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
            if (const double h = thickness(r, b.low.x + (i + 0.5) * dx, b.low.y + (j + 0.5) * dy); h > 0)
                e.volume += h * dx * dy, e.area += dx * dy, e.thickest = std::max(e.thickest, h);
    return e;
}

bool holds(const Shape& shape, Vector x, int dimensions, double tolerance)
{
    const bool flat = dimensions == 2;
    struct {
        Vector x;
        bool flat;
        double tolerance;
        bool operator()(const Box& b) const
        {
            return between(x.x, b.low.x, b.high.x, tolerance) && between(x.z, b.low.z, b.high.z, tolerance) &&
                   (flat || between(x.y, b.low.y, b.high.y, tolerance));
        }
        bool operator()(const Cylinder& c) const
        {
            return between(x.z, c.base.z, c.base.z + c.height, tolerance) &&
                   round_holds({x.x - c.base.x, x.y - c.base.y}, c.radius, tolerance);
        }
        bool operator()(const Sphere& s) const
        {
            return round_holds({x.x - s.center.x, flat ? 0 : x.y - s.center.y, x.z - s.center.z}, s.radius, tolerance);
        }
        bool operator()(const Ground& g) const { return scene::contact(g, x).distance < -tolerance; }
        bool operator()(const Release& r) const
        {
            const double h = scene::thickness(r, x.x, x.y);
            if (!(h > 0)) return false;
            const double foot = r.bed->at(x.x, x.y).z;
            return between(x.z, foot, foot + h, tolerance);
        }
        bool operator()(const Polygon& p) const
        {
            return (flat || between(x.y, p.y[0], p.y[1], tolerance)) && polygon_holds(p, {x.x, x.z}, tolerance);
        }
    } of{x, flat, tolerance};
    return std::visit(of, shape);
}

double rounding_of(const Shape& shape, int dimensions)
{
    const Box b = bounds(shape);
    double largest = std::max({std::abs(b.low.x), std::abs(b.high.x), std::abs(b.low.z), std::abs(b.high.z)});
    if (dimensions == 3) largest = std::max({largest, std::abs(b.low.y), std::abs(b.high.y)});
    return rounding_of(largest);
}

double volume(const Shape& shape, int dimensions)
{
    const bool flat = dimensions == 2;
    const double pi = std::numbers::pi;
    struct {
        bool flat;
        double pi;
        double operator()(const Box& b) const { return (b.high.x - b.low.x) * (b.high.z - b.low.z) * (flat ? 1 : b.high.y - b.low.y); }
        double operator()(const Cylinder& c) const { return pi * c.radius * c.radius * c.height; }
        double operator()(const Sphere& s) const { return pi * s.radius * s.radius * (flat ? 1 : 4 * s.radius / 3); }
        double operator()(const Polygon& p) const { return std::abs(area(p)) * (flat ? 1 : p.y[1] - p.y[0]); }
        double operator()(const Ground& g) const
        {
            return g.depth * (g.field->high_x() - g.field->low_x()) * (g.field->high_y() - g.field->low_y());
        }
        double operator()(const Release& r) const { return extent(r).volume; }
    } of{flat, pi};
    return std::visit(of, shape);
}

namespace {

/// In plan, within its outline or its map of thicknesses; z not yet.
Box plan_of(const Release& r)
{
    const auto& f = *r.bed;
    const double far = std::numeric_limits<double>::infinity();
    Box box{{f.low_x(), f.low_y(), far}, {f.high_x(), f.high_y(), -far}};
    if (!r.rings.empty()) {
        Box around{{far, far, 0}, {-far, -far, 0}};
        for (const Ring& ring : r.rings)
            for (const auto& [px, py] : ring) {
                around.low.x = std::min(around.low.x, px), around.low.y = std::min(around.low.y, py);
                around.high.x = std::max(around.high.x, px), around.high.y = std::max(around.high.y, py);
            }
        box.low.x = std::max(box.low.x, around.low.x), box.low.y = std::max(box.low.y, around.low.y);
        box.high.x = std::min(box.high.x, around.high.x), box.high.y = std::min(box.high.y, around.high.y);
    } else if (r.thicknesses) {
        const Grid& g = *r.thicknesses;
        box.low.x = std::max(box.low.x, g.x), box.low.y = std::max(box.low.y, g.y);
        box.high.x = std::min(box.high.x, g.x + (g.columns - 1) * g.cell), box.high.y = std::min(box.high.y, g.y + (g.rows - 1) * g.cell);
    }
    return box;
}

Box bounds_of(const Release& r)
{
    Box box = plan_of(r);
    double thickest = r.thicknesses ? 0 : r.thickness.value_or(0);
    if (r.thicknesses)
        for (const double h : r.thicknesses->values) thickest = std::max(thickest, h);
    // Between its points a quadratic surface leaves their heights by less than they differ.
    const Grid& g = r.bed->grid();
    const double cell = g.cell;
    for (int j = 0; j < g.rows; ++j)
        for (int i = 0; i < g.columns; ++i) {
            const double x = g.x + i * cell, y = g.y + j * cell;
            if (x < box.low.x - cell || x > box.high.x + cell || y < box.low.y - cell || y > box.high.y + cell) continue;
            if (const double z = g.at(i, j); std::isfinite(z)) box.low.z = std::min(box.low.z, z), box.high.z = std::max(box.high.z, z);
        }
    box.high.z += thickest;
    return box;
}

} // namespace

Box bounds(const Shape& shape)
{
    struct {
        Box operator()(const Box& b) const { return b; }
        Box operator()(const Cylinder& c) const
        {
            return {{c.base.x - c.radius, c.base.y - c.radius, c.base.z}, {c.base.x + c.radius, c.base.y + c.radius, c.base.z + c.height}};
        }
        Box operator()(const Sphere& s) const
        {
            const Vector r{s.radius, s.radius, s.radius};
            return {s.center - r, s.center + r};
        }
        Box operator()(const Ground& g) const
        {
            return {{g.field->low_x(), g.field->low_y(), g.field->lowest() - g.depth},
                    {g.field->high_x(), g.field->high_y(), g.field->highest()}};
        }
        Box operator()(const Release& r) const { return bounds_of(r); }
        Box operator()(const Polygon& p) const
        {
            const double far = std::numeric_limits<double>::infinity();
            Box box{{far, p.y[0], far}, {-far, p.y[1], -far}};
            for (const auto& [px, pz] : p.points) {
                box.low.x = std::min(box.low.x, px), box.low.z = std::min(box.low.z, pz);
                box.high.x = std::max(box.high.x, px), box.high.z = std::max(box.high.z, pz);
            }
            return box;
        }
    } of;
    return std::visit(of, shape);
}

const char* name_of(const Shape& shape)
{
    static constexpr const char* names[] = {"box", "cylinder", "sphere", "polygon", "ground", "release"};
    return names[shape.index()];
}

double area(const Polygon& polygon) { return signed_area(polygon.points); }

bool crosses_itself(const Polygon& polygon)
{
    const std::size_t n = polygon.points.size();
    for (std::size_t i = 0; i < n; ++i) {
        const Point a = corner(polygon, i), b = corner(polygon, i + 1), c = corner(polygon, i + 2);
        if (a.x == b.x && a.z == b.z) return true;
        // Neighbouring edges share a corner; they may not run back over each other.
        if (cross(b - a, c - b) == 0 && dot(b - a, c - b) < 0) return true;
        for (std::size_t j = i + 2; j < n; ++j)
            if (!(i == 0 && j == n - 1) && meet(a, b, corner(polygon, j), corner(polygon, j + 1))) return true;
    }
    return false;
}

} // namespace kuzure::scene
