#include "solver/scene/fill.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/nearby.hpp"
#include <fmt/format.h>

namespace kuzure::scene {
namespace {

/// A box's side must hold whole spacings within this share of one; two boxes may overlap by as much.
const double tolerance = 1e-6;
/// A lattice point this close to a face, in spacings, lies on it; where coordinates are so large that rounding moves them by more,
/// one within that.
const double on_the_face = 1e-9;
/// Where rounding moves coordinates by more than this share of a spacing, it is undefined which shape holds a point.
const double most_rounding = 0.01;
/// More points, or more rows to be stored, than this mean a spacing that is not meant. The rows of all shapes count together: each
/// takes 40 bytes, and 0.1 microseconds to be found.
const double most_points = 1e11, most_rows = 2e7;
/// Points next to a polygon's edges are looked at one by one, each against all corners: more of that than this takes too long.
const double most_edge_tests = 1e9;

double at(const Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Box united(const Box& a, const Box& b)
{
    return {{std::min(a.low.x, b.low.x), std::min(a.low.y, b.low.y), std::min(a.low.z, b.low.z)},
            {std::max(a.high.x, b.high.x), std::max(a.high.y, b.high.y), std::max(a.high.z, b.high.z)}};
}

/// Depth (m) to which shapes may overlap and still touch, or a box's side may miss whole spacings.
double slack(const Shape& shape, double spacing, int dimensions) { return std::max(tolerance * spacing, rounding_of(shape, dimensions)); }

/// Side of the thinnest common part of two boxes along the axes that count; negative if they are apart.
double common(const Box& a, const Box& b, int dimensions)
{
    double least = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
        if (axis != 1 || dimensions == 3)
            least = std::min(least, std::min(at(a.high, axis), at(b.high, axis)) - std::max(at(a.low, axis), at(b.low, axis)));
    return least;
}

/// Part of a row along x.
struct Zone {
    double from, to;
};

/// Depth (m) of a row along x below the faces that the row runs along: those of a box in y and z, the ends of
/// a cylinder, the sides of a polygon. Negative outside.
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

/// Where a row along x passes a round shape: the x of its centre, and the square of the row's distance from it.
struct Passage {
    double centre, across2, radius;
};
std::optional<Passage> passage(const Shape& shape, double y, double z, int dimensions)
{
    if (const auto* c = std::get_if<Cylinder>(&shape)) return Passage{c->base.x, (y - c->base.y) * (y - c->base.y), c->radius};
    const auto* s = std::get_if<Sphere>(&shape);
    if (!s) return std::nullopt;
    const double dy = dimensions == 2 ? 0 : y - s->center.y, dz = z - s->center.z;
    return Passage{s->center.x, dy * dy + dz * dz, s->radius};
}

/// At most so many distances from a point to a polygon's edge are taken to fill it: for each row that an edge passes a few points
/// at the passage, more where it runs along the row, each against every edge.
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

/// The parts of a row along x that come nearer than margin to the surface, faces along the row not counted,
/// from left to right. Between them a row is all inside or all outside.
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
        const auto& points = std::get<Polygon>(shape).points;
        for (std::size_t k = 0; k < points.size(); ++k) {
            const auto &a = points[k], &b = points[(k + 1) % points.size()];
            const double ax = a[0], az = a[1], bx = b[0], bz = b[1]; // no bindings: clang 14 keeps them out of lambdas
            if (std::max(az, bz) < z - margin || std::min(az, bz) > z + margin) continue;
            // The part of the edge within margin of the row's height.
            const auto x_at = [&](double height) {
                return az == bz ? height < z ? ax : bx : ax + std::clamp((height - az) / (bz - az), 0.0, 1.0) * (bx - ax);
            };
            const double x1 = x_at(z - margin), x2 = x_at(z + margin);
            zones.push_back({std::min(x1, x2) - margin, std::max(x1, x2) + margin});
        }
        std::sort(zones.begin(), zones.end(), [](const Zone& a, const Zone& b) { return a.from < b.from; });
    }
    return zones;
}

bool on_ground(const Shape& shape) { return std::holds_alternative<Ground>(shape) || std::holds_alternative<Release>(shape); }

} // namespace

/// Cuts indices along x into runs that lie all inside or all outside: single points within the zones and at
/// their rims, whole stretches between them. Calls visit(first, last), inclusive.
template <class Zones, class Visit> void Lattice::for_each_run(Range r, const Zones& zones, Visit visit) const
{
    std::int64_t next = r.first;
    const auto stretch = [&](std::int64_t last) {
        if (next <= last) visit(next, last);
        next = std::max(next, last + 1);
    };
    const auto index = [&](double x) {
        return std::int64_t(std::clamp(std::floor((x - x_.origin) / spacing_ - 0.5), double(r.first) - 2, double(r.last) + 2));
    };
    for (const auto& zone : zones) {
        if (next > r.last) return;
        stretch(std::min(index(zone.from) - 1, r.last));
        const std::int64_t end = std::min(index(zone.to) + 2, r.last);
        while (next <= end) visit(next, next), ++next;
    }
    stretch(r.last);
}

std::string Lattice::problem(const Shape& shape, double spacing, int dimensions)
{
    const Box outer = scene::bounds(shape);
    double points = 1;
    for (int axis = 0; axis < 3; ++axis) {
        if (axis == 1 && dimensions == 2) continue;
        const double low = at(outer.low, axis), high = at(outer.high, axis), n = (high - low) / spacing;
        const char name = "xyz"[axis];
        if (!(high > low)) return fmt::format("expected low < high along {}, found {} and {}", name, low, high);
        if (std::holds_alternative<Box>(shape) && std::abs(n - std::round(n)) * spacing > slack(shape, spacing, dimensions)) {
            const double less = low + std::floor(n) * spacing, more = low + std::ceil(n) * spacing;
            return fmt::format("expected a whole number of spacings ({} m) a side, found {:.9g} along {}; let high.{} be {}{:.9g}", spacing,
                               n, name, name, n > 1 ? fmt::format("{:.9g} or ", less) : "", more);
        }
        points *= n;
    }
    if (const double rounding = rounding_of(shape, dimensions); rounding > most_rounding * spacing)
        return fmt::format(
            "expected coordinates that tell particles {:g} m apart from each other, found such that rounding moves by {:.2g} m; "
            "move the scene nearer to the origin",
            spacing, rounding);
    if (points > most_points || rows(shape, spacing, dimensions) > most_rows)
        return fmt::format("expected a shape that a computer can hold, found {:.3g} particles at a spacing of {} m; "
                           "is space.spacing in metres?",
                           points, spacing);
    if (const auto* p = std::get_if<Polygon>(&shape); p && edge_tests(*p, spacing) > most_edge_tests)
        return fmt::format("expected a polygon that can be filled in a minute, found {} corners and {:.3g} particles next to its edges at "
                           "a spacing of {} m; leave out corners, or is space.spacing in metres?",
                           p->points.size(), edge_tests(*p, spacing) / double(p->points.size()), spacing);
    return {};
}

double Lattice::rows(const Shape& shape, double spacing, int dimensions)
{
    if (std::holds_alternative<Box>(shape)) return 0;
    const Box outer = scene::bounds(shape);
    return (outer.high.z - outer.low.z) / spacing * (dimensions == 2 ? 1 : (outer.high.y - outer.low.y) / spacing);
}

Lattice::Lattice(const Shape& shape, double spacing, int dimensions, Vector least) : dimensions_(dimensions), spacing_(spacing)
{
    on_face_ = std::max(on_the_face * spacing, rounding_of(shape, dimensions));
    near_ = std::max(tolerance * spacing, 4 * on_face_);
    ensure(problem(shape, spacing, dimensions).empty(), "a shape is filled that cannot be");
    const Box outer = scene::bounds(shape);
    if (std::holds_alternative<Box>(shape)) {
        const auto side = [&](double low, double high) { return Axis{low, {0, std::int64_t(std::llround((high - low) / spacing)) - 1}}; };
        x_ = side(outer.low.x, outer.high.x), z_ = side(outer.low.z, outer.high.z);
        if (dimensions == 3) y_ = side(outer.low.y, outer.high.y);
        is_box_ = true;
        row_start_ = {0, 1};
        intervals_ = {{0, x_.range.last, 0}};
        layer_id_ = {0, count(y_.range) * count(x_.range)};
    } else {
        const auto side = [&](double low, double high) {
            return Axis{0, {std::int64_t(std::floor(low / spacing - 0.5)), std::int64_t(std::ceil(high / spacing - 0.5))}};
        };
        x_ = side(outer.low.x, outer.high.x), z_ = side(outer.low.z, outer.high.z);
        if (dimensions == 3) y_ = side(outer.low.y, outer.high.y);
        const auto inside = [&](std::int64_t kx, std::int64_t ky, std::int64_t kz) {
            const Vector x{coordinate(x_, kx), y_of(ky), coordinate(z_, kz)};
            return holds(shape, x, dimensions, on_face_);
        };
        // The row through a round shape is one interval. Its ends are estimated, then put right by what lies inside; the distance
        // itself is taken only where the squares do not tell.
        const auto round_row = [&](const Passage& p, std::int64_t ky, std::int64_t kz) {
            const double inner = p.radius - near_, outer = p.radius + near_;
            if (p.across2 > outer * outer) return Range{0, -1};
            const auto in = [&](std::int64_t kx) {
                const double dx = coordinate(x_, kx) - p.centre, d2 = dx * dx + p.across2;
                if (d2 > outer * outer) return false;
                return (inner > 0 && d2 < inner * inner) || inside(kx, ky, kz);
            };
            const double half = std::sqrt(std::max(p.radius * p.radius - p.across2, 0.0));
            const double least = double(x_.range.first), most = double(x_.range.last);
            Range r{std::int64_t(std::clamp(std::ceil((p.centre - half) / spacing - 0.5), least, most)),
                    std::int64_t(std::clamp(std::floor((p.centre + half) / spacing - 0.5), least, most))};
            while (r.first > x_.range.first && in(r.first - 1)) --r.first;
            while (r.last < x_.range.last && in(r.last + 1)) ++r.last;
            while (r.first <= r.last && !in(r.first)) ++r.first;
            while (r.first <= r.last && !in(r.last)) --r.last;
            return r;
        };
        const auto trim = [&](Axis& axis, auto any) {
            while (axis.range.first <= axis.range.last && !any(axis.range.first)) ++axis.range.first;
            while (axis.range.first <= axis.range.last && !any(axis.range.last)) --axis.range.last;
        };
        // Along the axis of extrusion the first and last layers may lie outside: cut them off, then rows repeat.
        if (const auto* c = std::get_if<Cylinder>(&shape)) {
            trim(z_, [&](auto k) { return between(coordinate(z_, k), c->base.z, c->base.z + c->height, on_face_); });
            stride_y_ = 1;
        } else if (const auto* p = std::get_if<Polygon>(&shape)) {
            if (dimensions == 3) trim(y_, [&](auto k) { return between(y_of(k), p->y[0], p->y[1], on_face_); });
            stride_z_ = 1;
        } else {
            stride_z_ = count(y_.range), stride_y_ = 1;
        }
        if (count(z_.range) <= 0 || count(y_.range) <= 0) z_.range.last = z_.range.first - 1;

        const std::int64_t stored_z = stride_z_ ? count(z_.range) : std::min<std::int64_t>(count(z_.range), 1);
        const std::int64_t stored_y = stride_y_ ? count(y_.range) : 1;
        row_start_.reserve(std::size_t(stored_z * stored_y) + 1);
        intervals_.reserve(std::size_t(stored_z * stored_y));
        if (stride_y_) row_id_.reserve(std::size_t(stored_z * stored_y));
        row_start_ = {0};
        layer_id_ = {0};
        for (std::int64_t iz = 0; iz < stored_z; ++iz) {
            std::int64_t in_layer = 0;
            for (std::int64_t iy = 0; iy < stored_y; ++iy) {
                if (stride_y_) row_id_.push_back(in_layer);
                const std::int64_t kz = z_.range.first + iz, ky = y_.range.first + iy;
                std::int64_t in_row = 0;
                const auto add = [&](std::int64_t first, std::int64_t last) {
                    if (in_row > 0 && intervals_.back().last == first - 1) intervals_.back().last = last;
                    else intervals_.push_back({first, last, in_row});
                    in_row += last - first + 1;
                };
                if (const auto p = passage(shape, y_of(ky), coordinate(z_, kz), dimensions)) {
                    if (const Range r = round_row(*p, ky, kz); r.first <= r.last) add(r.first, r.last);
                } else {
                    const auto zones = zones_near_surface(shape, y_of(ky), coordinate(z_, kz), near_, dimensions);
                    for_each_run(x_.range, zones, [&](std::int64_t first, std::int64_t last) {
                        if (inside(first, ky, kz)) add(first, last);
                    });
                }
                row_start_.push_back(intervals_.size());
                in_layer += stride_y_ ? in_row : in_row * count(y_.range);
            }
            layer_id_.push_back(layer_id_.back() + in_layer);
        }
    }
    x_.least = least.x, y_.least = least.y, z_.least = least.z;
    size_ = stride_z_ ? layer_id_.back() : count(z_.range) > 0 ? count(z_.range) * layer_id_[1] : 0;

    if (size_ == 0) return;
    const double far = std::numeric_limits<double>::infinity();
    bounds_ = {{far, far, far}, {-far, -far, -far}};
    const std::int64_t stored_z = std::int64_t(layer_id_.size()) - 1, stored_y = stride_y_ ? count(y_.range) : 1;
    for (std::int64_t iz = 0; iz < stored_z; ++iz)
        for (std::int64_t iy = 0; iy < stored_y; ++iy) {
            const std::int64_t kz = z_.range.first + iz, ky = y_.range.first + iy;
            const auto in = row(kz, ky).intervals;
            if (in.empty()) continue;
            const std::int64_t top = stride_z_ ? kz : z_.range.last, back = stride_y_ ? ky : y_.range.last;
            bounds_ = united(bounds_, {{coordinate(x_, in.front().first), y_of(ky), coordinate(z_, kz)},
                                       {coordinate(x_, in.back().last), y_of(back), coordinate(z_, top)}});
        }
}

Lattice::Range Lattice::within(const Axis& a, double low, double high) const
{
    // Estimate in numbers that fit, then let the coordinates themselves decide.
    const double first = double(a.range.first), last = double(a.range.last);
    Range r{std::int64_t(std::clamp(std::ceil((low - a.origin) / spacing_ - 0.5), first, last + 1)),
            std::int64_t(std::clamp(std::floor((high - a.origin) / spacing_ - 0.5), first - 1, last))};
    while (r.first > a.range.first && coordinate(a, r.first - 1) >= low) --r.first;
    while (r.first <= a.range.last && coordinate(a, r.first) < low) ++r.first;
    while (r.last < a.range.last && coordinate(a, r.last + 1) <= high) ++r.last;
    while (r.last >= a.range.first && coordinate(a, r.last) > high) --r.last;
    return r;
}

Vector Lattice::position(std::int64_t local) const
{
    ensure(local >= 0 && local < size_, "a lattice point is asked for that does not exist");
    std::int64_t iz, index, iy = 0;
    if (stride_z_) {
        iz = std::upper_bound(layer_id_.begin(), layer_id_.end(), local) - layer_id_.begin() - 1;
        index = local - layer_id_[std::size_t(iz)];
    } else {
        iz = local / layer_id_[1];
        index = local % layer_id_[1];
    }
    const std::int64_t kz = z_.range.first + iz;
    if (stride_y_) {
        const auto begin = row_id_.begin() + (stride_z_ ? iz * count(y_.range) : 0), end = begin + count(y_.range);
        iy = std::upper_bound(begin, end, index) - begin - 1;
        index -= begin[iy];
    } else {
        const std::int64_t n = row(kz, y_.range.first).size;
        iy = index / n;
        index %= n;
    }
    const std::int64_t ky = y_.range.first + iy;
    const auto in = row(kz, ky).intervals;
    auto here = in.begin();
    while (index > here->before + here->last - here->first) ++here;
    return {coordinate(x_, here->first + index - here->before), y_of(ky), coordinate(z_, kz)};
}

std::int64_t Lattice::count_in(const Box& region) const
{
    const Range zs = within(z_, region.low.z, region.high.z), xs = within(x_, region.low.x, region.high.x);
    const Range ys = dimensions_ == 2 ? y_.range : within(y_, region.low.y, region.high.y);
    if (size_ == 0 || count(zs) <= 0 || count(ys) <= 0) return 0;
    std::int64_t sum = 0;
    for (std::int64_t kz = zs.first; kz <= (stride_z_ ? zs.last : zs.first); ++kz)
        for (std::int64_t ky = ys.first; ky <= (stride_y_ ? ys.last : ys.first); ++ky)
            for (const Interval& in : row(kz, ky).intervals)
                sum += std::max<std::int64_t>(0, std::min(in.last, xs.last) - std::max(in.first, xs.first) + 1);
    return sum * (stride_z_ ? 1 : count(zs)) * (stride_y_ ? 1 : count(ys));
}

std::optional<GridPart> Lattice::grid_in(const Box& region) const
{
    if (!is_box_) return std::nullopt;
    const Range xs = within(x_, region.low.x, region.high.x), zs = within(z_, region.low.z, region.high.z);
    const Range ys = dimensions_ == 2 ? y_.range : within(y_, region.low.y, region.high.y);
    const auto n = [](const Range& r) { return std::max<std::int64_t>(0, count(r)); };
    // In 2-D points have y = 0 (y_of): half a spacing before the first coordinate of a lattice from there.
    const double y = dimensions_ == 2 ? -0.5 * spacing_ : y_.origin;
    return GridPart{{x_.origin, y, z_.origin}, {xs.first, ys.first, zs.first}, {n(xs), n(ys), n(zs)}, spacing_, false};
}

bool Lattice::reaches_into(const Shape& other) const
{
    const Box region = scene::bounds(other);
    const Range zs = within(z_, region.low.z, region.high.z), xs = within(x_, region.low.x, region.high.x);
    const Range ys = dimensions_ == 2 ? y_.range : within(y_, region.low.y, region.high.y);
    if (size_ == 0) return false;
    const double depth = std::max(slack(other, spacing_, dimensions_), 2 * on_face_);
    for (std::int64_t kz = zs.first; kz <= zs.last; ++kz)
        for (std::int64_t ky = ys.first; ky <= ys.last; ++ky) {
            const double y = y_of(ky), z = coordinate(z_, kz);
            const auto in = row(kz, ky).intervals;
            if (in.empty() || depth_between_faces(other, y, z, dimensions_) <= depth) continue;
            const auto zones = zones_near_surface(other, y, z, 2 * depth, dimensions_);
            bool found = false;
            for (const Interval& i : in)
                for_each_run({std::max(i.first, xs.first), std::min(i.last, xs.last)}, zones, [&](std::int64_t first, std::int64_t) {
                    found = found || signed_distance(other, {coordinate(x_, first), y, z}, dimensions_) < -depth;
                });
            if (found) return true;
        }
    return false;
}

namespace {

/// True if particles of one shape lie inside another, either way. Particles draped over the ground lie where it is: soil on top of it, the
/// ground below.
bool reaches_into(const Points& a, const Shape& of_a, const Points& b, const Shape& of_b, const Scene& scene)
{
    if (a.lattice() && b.lattice()) return a.lattice()->reaches_into(of_b) || b.lattice()->reaches_into(of_a);
    if (std::holds_alternative<Ground>(of_a) || std::holds_alternative<Ground>(of_b))
        if (std::holds_alternative<Release>(of_a) || std::holds_alternative<Release>(of_b)) return false;
    const double depth = std::max(slack(of_a, scene.space.spacing, scene.dimensions), slack(of_b, scene.space.spacing, scene.dimensions));
    const auto inside = [&](const Points& points, const Shape& other) {
        bool found = false;
        points.for_each_in(bounds(other), [&](std::int64_t, Vector x) { found = found || signed_distance(other, x) < -depth; });
        return found;
    };
    return inside(a, of_b) || inside(b, of_a);
}

} // namespace

Filling::Survey Filling::survey(const Scene& scene)
{
    struct Piece {
        std::string name, key;
        const Shape* shape;
        std::vector<std::array<double, 2>> times; // s, from which and to which it is there
        std::string problem;
        std::optional<Points> points;
    };
    std::vector<Piece> pieces;
    const auto add = [&](const std::string& key, const auto& part) {
        pieces.push_back({key, key + "." + name_of(part.shape), &part.shape, presence(scene, part.name), {}, {}});
    };
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) add(fmt::format("body.{}", b), scene.bodies[b]);
    for (std::size_t w = 0; w < scene.walls.size(); ++w) add(fmt::format("wall.{}", w), scene.walls[w]);
    const auto ever_together = [](const Piece& a, const Piece& b) {
        for (const auto& s : a.times)
            for (const auto& t : b.times)
                if (s[0] < t[1] && t[0] < s[1]) return true;
        return false;
    };

    Issues issues;
    const int dimensions = scene.dimensions;
    double rows = 0, edge_tests = 0;
    for (auto& p : pieces) {
        p.problem = on_ground(*p.shape) ? Draped::problem(*p.shape, scene.space.spacing, dimensions)
                                        : Lattice::problem(*p.shape, scene.space.spacing, dimensions);
        if (!p.problem.empty()) continue;
        if (!on_ground(*p.shape)) rows += Lattice::rows(*p.shape, scene.space.spacing, dimensions);
        if (const auto* polygon = std::get_if<Polygon>(p.shape)) edge_tests += scene::edge_tests(*polygon, scene.space.spacing);
        if (rows <= most_rows && edge_tests <= most_edge_tests) continue;
        issues.push_back({Severity::Error,
                          p.key,
                          fmt::format("expected shapes that a computer can hold together, found {:.3g} rows of particles up to this one at "
                                      "a spacing of {} m{}; is space.spacing in metres?",
                                      rows, scene.space.spacing, edge_tests > most_edge_tests ? ", with too many corners" : ""),
                          {}});
        return {std::move(issues), {}};
    }
    for (auto& p : pieces) {
        if (!p.problem.empty()) {
            issues.push_back({Severity::Error, p.key, std::move(p.problem), {}});
            continue;
        }
        if (const auto* ground = std::get_if<Ground>(p.shape)) p.points.emplace(Draped(*ground, scene.space.spacing));
        if (const auto* release = std::get_if<Release>(p.shape)) p.points.emplace(Draped(*release, scene.space.spacing));
        // Bodies lie within the space, walls within its periods: no point of theirs may lie on the other side by rounding.
        Vector least = Lattice::nowhere;
        if (scene.space.low) {
            const bool body = &p < pieces.data() + scene.bodies.size();
            const auto& periodic = scene.space.periodic;
            if (body || periodic[0]) least.x = scene.space.low->x;
            if (body || periodic[1]) least.y = scene.space.low->y;
            if (body || periodic[2]) least.z = scene.space.low->z;
        }
        if (!p.points) p.points.emplace(Lattice(*p.shape, scene.space.spacing, dimensions, least));
        if (p.points->size() == 0)
            issues.push_back({Severity::Error,
                              p.key,
                              fmt::format("expected particles inside, found none at a spacing of {} m; make "
                                          "the shape larger or space.spacing smaller",
                                          scene.space.spacing),
                              {}});
    }
    // One mistake may make every shape overlap every other: a million lines are of no use.
    const std::size_t enough = 100;
    std::vector<Box> boxes;
    for (const auto& p : pieces) boxes.push_back(scene::bounds(*p.shape));
    const Nearby near(boxes, dimensions);
    for (std::size_t i = 0; i < pieces.size() && issues.size() < enough; ++i)
        for (const std::size_t j : near.meeting(boxes[i])) {
            const auto &a = pieces[i], &b = pieces[j];
            if (j <= i || issues.size() >= enough || !a.points || !b.points || !ever_together(a, b)) continue;
            const double depth = common(boxes[i], boxes[j], dimensions);
            if (depth <= std::max(slack(*a.shape, scene.space.spacing, dimensions), slack(*b.shape, scene.space.spacing, dimensions)))
                continue;
            const bool boxes = std::holds_alternative<Box>(*a.shape) && std::holds_alternative<Box>(*b.shape);
            // Points of one shape outside another are half a spacing from a box's points, and shapes other
            // than boxes share one lattice: no points strictly inside means no points too close.
            if (boxes || reaches_into(*a.points, *a.shape, *b.points, *b.shape, scene))
                issues.push_back({Severity::Error, b.name,
                                  fmt::format("expected shapes that at most touch, found an overlap of {} with {}{}; "
                                              "move or cut one of them",
                                              b.name, a.name, boxes ? fmt::format(" by {:.6g} m", depth) : ""),
                                  a.name});
        }
    Survey all{std::move(issues), {}};
    for (auto& p : pieces) all.points.push_back(std::move(p.points));
    return all;
}

Issues Filling::problems(const Scene& scene) { return survey(scene).issues; }

std::optional<Filling> Filling::of(const Scene& scene, Issues& problems)
{
    Survey found = survey(scene);
    problems = std::move(found.issues);
    if (!problems.empty()) return {};
    return Filling(scene, std::move(found));
}

Filling::Filling(const Scene& scene) : Filling(scene, survey(scene)) {}

Filling::Filling(const Scene& scene, Survey found) : n_bodies_(scene.bodies.size())
{
    std::string errors;
    for (const auto& issue : found.issues) errors += (errors.empty() ? "" : "\n") + in_words(issue);
    if (!errors.empty()) throw BadInput(errors);

    first_id_ = {0};
    for (auto& points : found.points) {
        points_.push_back(std::move(*points));
        first_id_.push_back(first_id_.back() + points_.back().size());
        const Box& box = points_.back().bounds();
        bounds_ = points_.size() == 1 ? box : united(bounds_, box);
        if (points_.size() == n_bodies_) soil_bounds_ = bounds_;
    }
    const bool draped =
        std::any_of(points_.begin(), points_.begin() + std::ptrdiff_t(n_bodies_), [](const Points& p) { return p.draped(); });
    if (!draped) soil_height_ = soil_bounds_.high.z - soil_bounds_.low.z + scene.space.spacing;
    else
        for (std::size_t b = 0; b < n_bodies_; ++b) {
            const Box& box = points_[b].bounds();
            soil_height_ = std::max(soil_height_,
                                    points_[b].draped() ? points_[b].draped()->thickest() : box.high.z - box.low.z + scene.space.spacing);
        }
}

std::int64_t Filling::soil_count_in(const Box& region) const
{
    std::int64_t sum = 0;
    for (std::size_t b = 0; b < n_bodies_; ++b) sum += points_[b].count_in(region);
    return sum;
}
std::int64_t Filling::wall_count_in(const Box& region) const
{
    std::int64_t sum = 0;
    for (std::size_t w = n_bodies_; w < points_.size(); ++w) sum += points_[w].count_in(region);
    return sum;
}

std::optional<std::vector<GridPart>> Filling::grids_in(const Box& region) const
{
    std::vector<GridPart> parts;
    for (std::size_t k = 0; k < points_.size(); ++k) {
        auto part = points_[k].grid_in(region);
        if (!part) {
            if (points_[k].count_in(region) > 0) return std::nullopt;
            continue;
        }
        if (part->n[0] * part->n[1] * part->n[2] == 0) continue;
        part->soil = k < n_bodies_;
        parts.push_back(*part);
    }
    return parts;
}

std::size_t Filling::owner(std::int64_t id) const
{
    ensure(id >= 0 && id < first_id_.back(), "a particle is asked for whose id does not exist");
    return std::size_t(std::upper_bound(first_id_.begin(), first_id_.end(), id) - first_id_.begin() - 1);
}
Vector Filling::soil_position(std::int64_t id) const
{
    ensure(id < soil_count(), "a wall's id is used as soil");
    const std::size_t b = owner(id);
    return points_[b].position(id - first_id_[b]);
}
int Filling::body_of(std::int64_t id) const
{
    ensure(id < soil_count(), "a wall's id is used as soil");
    return int(owner(id));
}
Vector Filling::wall_position(std::int64_t id) const
{
    ensure(id >= soil_count(), "a soil particle's id is used as a wall");
    const std::size_t w = owner(id);
    return points_[w].position(id - first_id_[w]);
}
int Filling::wall_of(std::int64_t id) const
{
    ensure(id >= soil_count(), "a soil particle's id is used as a wall");
    return int(owner(id) - n_bodies_);
}

} // namespace kuzure::scene
