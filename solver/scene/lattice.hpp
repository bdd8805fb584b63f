#pragma once
// The lattice points of one shape, computed and never stored. Every rank and every region gets the same bits, because one function
// computes every coordinate.
#include "solver/scene/draped.hpp"
#include "solver/scene/lines_of_shape.hpp"
#include "solver/scene/shape.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kuzure::scene {

/// Coordinate (m) of lattice point k along one axis: computed here and nowhere else.
inline double lattice_coordinate(double origin, std::int64_t k, double spacing) { return origin + (double(k) + 0.5) * spacing; }

/// Points of a regular grid: lattice points first .. first + n - 1 along each axis.
struct GridPart {
    std::array<double, 3> origin;
    std::array<std::int64_t, 3> first, n;
    double spacing;
    bool soil; // or wall
    double at(int axis, std::int64_t k) const { return lattice_coordinate(origin[axis], first[axis] + k, spacing); }
};

/// More lines to be stored than this, of all shapes together, mean a spacing that is not meant: each takes 40 bytes, and 0.1 microseconds
/// to be found.
inline constexpr double most_lines = 2e7;

/// The lattice points that belong to one shape: n a side of a box from its lower corner; of other shapes those of the one lattice at
/// (k + 1/2) spacings that holds() gives them, so that a division or a shift by whole spacings neither loses nor moves a point. Order of
/// local ids: z slowest, then y, then x. Boxes keep three numbers; other shapes keep, for every line along x, the intervals inside.
class Lattice {
public:
    /// Throws Broken if the shape cannot be filled: ask problem() first. No coordinate (m) is below `least`, where a shape ends: a point
    /// on that face may be so by rounding.
    Lattice(const Shape&, double spacing, int dimensions, Vector least = nowhere);
    static constexpr Vector nowhere{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                                    -std::numeric_limits<double>::infinity()};
    /// Why the shape cannot be filled with whole lattice points, or empty.
    static std::string problem(const Shape&, double spacing, int dimensions);
    /// At most so many lines along x are kept for a shape.
    static double lines(const Shape&, double spacing, int dimensions);

    std::int64_t size() const { return size_; }
    Vector position(std::int64_t local) const;
    /// The smallest box around the points (m); empty lattices have none.
    const Box& bounds() const { return bounds_; }
    /// Points in a closed region; in 2-D its y does not count.
    std::int64_t count_in(const Box& region) const;
    /// Calls visit(local id, position) for every point in a closed region, by rising id; in 2-D its y does not count.
    template <class Visit> void for_each_in(const Box& region, Visit visit) const;
    /// Calls visit(Stack) for the stacks of the points in a closed region; in 2-D its y does not count.
    template <class Visit> void for_each_stack_in(const Box& region, Visit visit) const;
    /// The points in a closed region where the shape is a box, else nothing.
    std::optional<GridPart> grid_in(const Box& region) const;
    /// True if a lattice point lies strictly inside another shape.
    bool reaches_into(const Shape& other) const;

private:
    struct Interval {
        std::int64_t first, last; // indices along x, inclusive
        std::int64_t before;      // points of the same line in front of it
    };
    struct Line {
        std::span<const Interval> intervals;
        std::int64_t size;
    };
    struct Range {
        std::int64_t first, last; // inclusive; empty if last < first
    };
    struct Axis {
        double origin = 0;
        Range range{0, 0};
        double least = -std::numeric_limits<double>::infinity(); // m
    };
    double coordinate(const Axis& a, std::int64_t k) const { return std::max(lattice_coordinate(a.origin, k, spacing_), a.least); }
    double y_of(std::int64_t k) const { return dimensions_ == 2 ? 0.0 : coordinate(y_, k); }
    /// Indices of an axis whose coordinates lie in the closed interval low .. high.
    Range within(const Axis&, double low, double high) const;
    template <class Zones, class Visit> void for_each_run(Range, const Zones&, Visit) const;
    void lay_box(const Box&);
    void lay_lines(const Shape&);
    /// Drops the layers that lie outside along the axis of extrusion and tells along which axes lines repeat.
    void find_repetition(const Shape&);
    /// Appends the intervals of a line; points in it.
    std::int64_t add_line(const Shape&, std::int64_t ky, std::int64_t kz);
    Range round_line(const Shape&, const Passage&, std::int64_t ky, std::int64_t kz) const;
    bool inside(const Shape&, std::int64_t kx, std::int64_t ky, std::int64_t kz) const;
    Box box_around_points() const;
    /// Lines repeat along an axis on which the shape does not change: the stride there is 0.
    std::size_t line_index(std::int64_t kz, std::int64_t ky) const
    {
        return std::size_t((kz - z_.range.first) * stride_z_ + (ky - y_.range.first) * stride_y_);
    }
    Line line(std::int64_t kz, std::int64_t ky) const
    {
        const std::size_t r = line_index(kz, ky), a = line_start_[r], b = line_start_[r + 1];
        const std::span<const Interval> in(intervals_.data() + a, b - a);
        return {in, in.empty() ? 0 : in.back().before + in.back().last - in.back().first + 1};
    }
    /// Local id of the first point of a line.
    std::int64_t line_id(std::int64_t kz, std::int64_t ky) const
    {
        const std::int64_t iz = kz - z_.range.first, iy = ky - y_.range.first;
        const std::int64_t layers = stride_z_ ? layer_id_[std::size_t(iz)] : iz * layer_id_[1];
        if (stride_y_ == 0) return layers + iy * line(kz, ky).size;
        const std::size_t layer = stride_z_ ? std::size_t(iz) : 0, n_y = std::size_t(count(y_.range));
        return layers + line_id_[layer * n_y + std::size_t(iy)];
    }
    static std::int64_t count(const Range& r) { return r.last - r.first + 1; }

    int dimensions_;
    double spacing_;
    bool is_box_ = false;
    double on_face_, near_; // m: nearer than this a point lies on a face, nearer than that it is looked at by itself
    Axis x_, y_, z_;
    std::int64_t stride_z_ = 0, stride_y_ = 0;
    std::vector<std::size_t> line_start_; // first interval of every stored line, and the end
    std::vector<Interval> intervals_;
    std::vector<std::int64_t> layer_id_; // id of the first point of every stored layer, and the end
    std::vector<std::int64_t> line_id_;  // id of a line's first point within its layer, where lines change along y
    std::int64_t size_ = 0;
    Box bounds_{};
};

template <class Visit> void Lattice::for_each_in(const Box& region, Visit visit) const
{
    const Range zs = within(z_, region.low.z, region.high.z), xs = within(x_, region.low.x, region.high.x);
    const Range ys = dimensions_ == 2 ? y_.range : within(y_, region.low.y, region.high.y);
    for (std::int64_t kz = zs.first; kz <= zs.last; ++kz)
        for (std::int64_t ky = ys.first; ky <= ys.last; ++ky) {
            const double y = y_of(ky), z = coordinate(z_, kz);
            const std::int64_t first = line_id(kz, ky);
            for (const Interval& in : line(kz, ky).intervals) {
                const std::int64_t a = std::max(in.first, xs.first), b = std::min(in.last, xs.last);
                for (std::int64_t k = a; k <= b; ++k) visit(first + in.before + (k - in.first), Vector{coordinate(x_, k), y, z});
            }
        }
}

template <class Visit> void Lattice::for_each_stack_in(const Box& region, Visit visit) const
{
    if (size_ == 0) return;
    const Range zs = within(z_, region.low.z, region.high.z), xs = within(x_, region.low.x, region.high.x);
    const Range ys = dimensions_ == 2 ? y_.range : within(y_, region.low.y, region.high.y);
    if (count(zs) <= 0) return;
    const auto has = [&](std::int64_t kx, std::int64_t ky, std::int64_t kz) {
        const auto in = line(kz, ky).intervals;
        return std::any_of(in.begin(), in.end(), [&](const Interval& i) { return i.first <= kx && kx <= i.last; });
    };
    const auto found = [&](std::int64_t kx, std::int64_t ky, std::int64_t first, std::int64_t last) {
        visit(Stack{coordinate(x_, kx), y_of(ky), coordinate(z_, first) - 0.5 * spacing_, coordinate(z_, last) + 0.5 * spacing_});
    };
    for (std::int64_t ky = ys.first; ky <= ys.last; ++ky)
        for (std::int64_t kx = xs.first; kx <= xs.last; ++kx) {
            if (!stride_z_) { // every layer is like the first
                if (has(kx, ky, zs.first)) found(kx, ky, zs.first, zs.last);
                continue;
            }
            for (std::int64_t first = zs.first, kz = zs.first; kz <= zs.last + 1; ++kz)
                if (kz > zs.last || !has(kx, ky, kz)) {
                    if (kz > first) found(kx, ky, first, kz - 1);
                    first = kz + 1;
                }
        }
}

} // namespace kuzure::scene
