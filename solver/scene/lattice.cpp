#include "solver/scene/lattice.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/box.hpp"
#include <fmt/format.h>

namespace kuzure::scene {
namespace {

/// A lattice point this close to a face, in spacings, lies on it; where coordinates are so large that rounding moves them by more,
/// one within that.
const double on_the_face = 1e-9;
/// Where rounding moves coordinates by more than this share of a spacing, it is undefined which shape holds a point.
const double most_rounding = 0.01;
/// More points than this mean a spacing that is not meant.
const double most_points = 1e11;

} // namespace

/// Splits indices along x into runs that lie all inside or all outside: single points within the zones and at
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
    if (points > most_points || lines(shape, spacing, dimensions) > most_lines)
        return fmt::format("expected a shape that a computer can hold, found {:.3g} particles at a spacing of {} m; "
                           "is space.spacing in metres?",
                           points, spacing);
    if (const auto* p = std::get_if<Polygon>(&shape); p && edge_tests(*p, spacing) > most_edge_tests)
        return fmt::format("expected a polygon that can be filled in a minute, found {} corners and {:.3g} particles next to its edges at "
                           "a spacing of {} m; leave out corners, or is space.spacing in metres?",
                           p->points.size(), edge_tests(*p, spacing) / double(p->points.size()), spacing);
    return {};
}

double Lattice::lines(const Shape& shape, double spacing, int dimensions)
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
    if (const auto* box = std::get_if<Box>(&shape)) lay_box(*box);
    else lay_lines(shape);
    x_.least = least.x, y_.least = least.y, z_.least = least.z;
    size_ = stride_z_ ? layer_id_.back() : count(z_.range) > 0 ? count(z_.range) * layer_id_[1] : 0;
    if (size_ > 0) bounds_ = box_around_points();
}

void Lattice::lay_box(const Box& box)
{
    const auto side = [&](double low, double high) { return Axis{low, {0, std::int64_t(std::llround((high - low) / spacing_)) - 1}}; };
    x_ = side(box.low.x, box.high.x), z_ = side(box.low.z, box.high.z);
    if (dimensions_ == 3) y_ = side(box.low.y, box.high.y);
    is_box_ = true;
    line_start_ = {0, 1};
    intervals_ = {{0, x_.range.last, 0}};
    layer_id_ = {0, count(y_.range) * count(x_.range)};
}

bool Lattice::inside(const Shape& shape, std::int64_t kx, std::int64_t ky, std::int64_t kz) const
{
    return holds(shape, {coordinate(x_, kx), y_of(ky), coordinate(z_, kz)}, dimensions_, on_face_);
}

/// The line through a round shape is one interval. Its ends are estimated, then put right by what lies inside; the distance itself is taken
/// only where the squares do not tell.
Lattice::Range Lattice::round_line(const Shape& shape, const Passage& p, std::int64_t ky, std::int64_t kz) const
{
    const double inner = p.radius - near_, outer = p.radius + near_;
    if (p.across2 > outer * outer) return Range{0, -1};
    const auto in = [&](std::int64_t kx) {
        const double dx = coordinate(x_, kx) - p.centre, d2 = dx * dx + p.across2;
        if (d2 > outer * outer) return false;
        return (inner > 0 && d2 < inner * inner) || inside(shape, kx, ky, kz);
    };
    const double half = std::sqrt(std::max(p.radius * p.radius - p.across2, 0.0));
    const double least = double(x_.range.first), most = double(x_.range.last);
    Range r{std::int64_t(std::clamp(std::ceil((p.centre - half) / spacing_ - 0.5), least, most)),
            std::int64_t(std::clamp(std::floor((p.centre + half) / spacing_ - 0.5), least, most))};
    while (r.first > x_.range.first && in(r.first - 1)) --r.first;
    while (r.last < x_.range.last && in(r.last + 1)) ++r.last;
    while (r.first <= r.last && !in(r.first)) ++r.first;
    while (r.first <= r.last && !in(r.last)) --r.last;
    return r;
}

void Lattice::find_repetition(const Shape& shape)
{
    const auto trim = [&](Axis& axis, auto any) {
        while (axis.range.first <= axis.range.last && !any(axis.range.first)) ++axis.range.first;
        while (axis.range.first <= axis.range.last && !any(axis.range.last)) --axis.range.last;
    };
    if (const auto* c = std::get_if<Cylinder>(&shape)) {
        trim(z_, [&](auto k) { return between(coordinate(z_, k), c->base.z, c->base.z + c->height, on_face_); });
        stride_y_ = 1;
    } else if (const auto* p = std::get_if<Polygon>(&shape)) {
        if (dimensions_ == 3) trim(y_, [&](auto k) { return between(y_of(k), p->y[0], p->y[1], on_face_); });
        stride_z_ = 1;
    } else {
        stride_z_ = count(y_.range), stride_y_ = 1;
    }
}

std::int64_t Lattice::add_line(const Shape& shape, std::int64_t ky, std::int64_t kz)
{
    std::int64_t in_line = 0;
    const auto add = [&](std::int64_t first, std::int64_t last) {
        if (in_line > 0 && intervals_.back().last == first - 1) intervals_.back().last = last;
        else intervals_.push_back({first, last, in_line});
        in_line += last - first + 1;
    };
    if (const auto p = passage(shape, y_of(ky), coordinate(z_, kz), dimensions_)) {
        if (const Range r = round_line(shape, *p, ky, kz); r.first <= r.last) add(r.first, r.last);
    } else {
        const auto zones = zones_near_surface(shape, y_of(ky), coordinate(z_, kz), near_, dimensions_);
        for_each_run(x_.range, zones, [&](std::int64_t first, std::int64_t last) {
            if (inside(shape, first, ky, kz)) add(first, last);
        });
    }
    line_start_.push_back(intervals_.size());
    return in_line;
}

void Lattice::lay_lines(const Shape& shape)
{
    const Box outer = scene::bounds(shape);
    const auto side = [&](double low, double high) {
        return Axis{0, {std::int64_t(std::floor(low / spacing_ - 0.5)), std::int64_t(std::ceil(high / spacing_ - 0.5))}};
    };
    x_ = side(outer.low.x, outer.high.x), z_ = side(outer.low.z, outer.high.z);
    if (dimensions_ == 3) y_ = side(outer.low.y, outer.high.y);
    find_repetition(shape);
    if (count(z_.range) <= 0 || count(y_.range) <= 0) z_.range.last = z_.range.first - 1;

    const std::int64_t stored_z = stride_z_ ? count(z_.range) : std::min<std::int64_t>(count(z_.range), 1);
    const std::int64_t stored_y = stride_y_ ? count(y_.range) : 1;
    line_start_.reserve(std::size_t(stored_z * stored_y) + 1);
    intervals_.reserve(std::size_t(stored_z * stored_y));
    if (stride_y_) line_id_.reserve(std::size_t(stored_z * stored_y));
    line_start_ = {0};
    layer_id_ = {0};
    for (std::int64_t iz = 0; iz < stored_z; ++iz) {
        std::int64_t in_layer = 0;
        for (std::int64_t iy = 0; iy < stored_y; ++iy) {
            if (stride_y_) line_id_.push_back(in_layer);
            const std::int64_t in_line = add_line(shape, y_.range.first + iy, z_.range.first + iz);
            in_layer += stride_y_ ? in_line : in_line * count(y_.range);
        }
        layer_id_.push_back(layer_id_.back() + in_layer);
    }
}

Box Lattice::box_around_points() const
{
    const double far = std::numeric_limits<double>::infinity();
    Box around{{far, far, far}, {-far, -far, -far}};
    const std::int64_t stored_z = std::int64_t(layer_id_.size()) - 1, stored_y = stride_y_ ? count(y_.range) : 1;
    for (std::int64_t iz = 0; iz < stored_z; ++iz)
        for (std::int64_t iy = 0; iy < stored_y; ++iy) {
            const std::int64_t kz = z_.range.first + iz, ky = y_.range.first + iy;
            const auto in = line(kz, ky).intervals;
            if (in.empty()) continue;
            const std::int64_t top = stride_z_ ? kz : z_.range.last, back = stride_y_ ? ky : y_.range.last;
            around = united(around, {{coordinate(x_, in.front().first), y_of(ky), coordinate(z_, kz)},
                                     {coordinate(x_, in.back().last), y_of(back), coordinate(z_, top)}});
        }
    return around;
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
        const auto begin = line_id_.begin() + (stride_z_ ? iz * count(y_.range) : 0), end = begin + count(y_.range);
        iy = std::upper_bound(begin, end, index) - begin - 1;
        index -= begin[iy];
    } else {
        const std::int64_t n = line(kz, y_.range.first).size;
        iy = index / n;
        index %= n;
    }
    const std::int64_t ky = y_.range.first + iy;
    const auto in = line(kz, ky).intervals;
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
            for (const Interval& in : line(kz, ky).intervals)
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
            const auto in = line(kz, ky).intervals;
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

} // namespace kuzure::scene
