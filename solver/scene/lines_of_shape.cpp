#include "solver/scene/lines_of_shape.hpp"
#include <algorithm>
#include <cmath>
#include <limits>

namespace kuzure::scene {

double depth_between_faces(const Shape& shape, double y, double z, int dimensions)
{
    const auto depth = [](double x, double low, double high) { return std::min(x - low, high - x); };
    const double none = std::numeric_limits<double>::infinity();
    if (const auto* b = std::get_if<Box>(&shape))
        return std::min(depth(z, b->low.z, b->high.z), dimensions == 2 ? none : depth(y, b->low.y, b->high.y));
    if (const auto* c = std::get_if<Cylinder>(&shape)) return depth(z, c->base.z, c->base.z + c->height);
    if (const auto* p = std::get_if<Polygon>(&shape); p && dimensions == 3) return depth(y, p->y[0], p->y[1]);
    return none;
}

std::optional<Passage> passage(const Shape& shape, double y, double z, int dimensions)
{
    if (const auto* c = std::get_if<Cylinder>(&shape)) return Passage{c->base.x, (y - c->base.y) * (y - c->base.y), c->radius};
    const auto* s = std::get_if<Sphere>(&shape);
    if (!s) return std::nullopt;
    const double dy = dimensions == 2 ? 0 : y - s->center.y, dz = z - s->center.z;
    return Passage{s->center.x, dy * dy + dz * dz, s->radius};
}

double edge_tests(const Polygon& polygon, double spacing)
{
    const std::size_t n = polygon.points.size();
    double points = 0;
    for (std::size_t k = 0; k < n; ++k) {
        const auto &a = polygon.points[k], &b = polygon.points[(k + 1) % n];
        const double along = std::abs(b[0] - a[0]) / spacing, low = std::min(a[1], b[1]) / spacing, high = std::max(a[1], b[1]) / spacing;
        const double passed = std::floor(high + tolerance - 0.5) - std::ceil(low - tolerance - 0.5) + 1;
        const double beside = high > low ? std::min(along, 2 * tolerance * along / (high - low)) : along;
        if (passed > 0) points += passed * (5 + beside);
    }
    return points * double(n);
}

namespace {

/// Zones near the edges of a polygon.
std::vector<Zone> zones_near_edges(const std::vector<std::array<double, 2>>& points, double z, double margin)
{
    std::vector<Zone> zones;
    for (std::size_t k = 0; k < points.size(); ++k) {
        const auto &a = points[k], &b = points[(k + 1) % points.size()];
        const double ax = a[0], az = a[1], bx = b[0], bz = b[1]; // no bindings: clang 14 keeps them out of lambdas
        if (std::max(az, bz) < z - margin || std::min(az, bz) > z + margin) continue;
        // The part of the edge within margin of the line's height.
        const auto x_at = [&](double height) {
            return az == bz ? height < z ? ax : bx : ax + std::clamp((height - az) / (bz - az), 0.0, 1.0) * (bx - ax);
        };
        const double x1 = x_at(z - margin), x2 = x_at(z + margin);
        zones.push_back({std::min(x1, x2) - margin, std::max(x1, x2) + margin});
    }
    std::sort(zones.begin(), zones.end(), [](const Zone& a, const Zone& b) { return a.from < b.from; });
    return zones;
}

} // namespace

std::vector<Zone> zones_near_surface(const Shape& shape, double y, double z, double margin, int dimensions)
{
    std::vector<Zone> zones;
    if (const auto* b = std::get_if<Box>(&shape)) {
        zones = {{b->low.x - margin, b->low.x + margin}, {b->high.x - margin, b->high.x + margin}};
    } else if (const auto p = passage(shape, y, z, dimensions)) {
        const double inner = std::max(p->radius - margin, 0.0), outer = p->radius + margin;
        if (p->across2 > outer * outer) return zones;
        const double from = std::sqrt(std::max(inner * inner - p->across2, 0.0)), to = std::sqrt(outer * outer - p->across2);
        zones = {{p->centre - to, p->centre - from}, {p->centre + from, p->centre + to}};
    } else {
        return zones_near_edges(std::get<Polygon>(shape).points, z, margin);
    }
    return zones;
}

} // namespace kuzure::scene
