#pragma once
// Particles on real ground: columns over a square lattice in plan, each standing on the surface. The lattice is that of level ground,
// sheared along z: its density is exact, its layers follow the ground without stairs, and soil starts in contact with what it stands on.
#include "solver/scene/height_field.hpp"
#include "solver/scene/parts.hpp"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

namespace kuzure::scene {

/// Points one above the other without a gap, as a column one spacing wide.
struct Stack {
    double x, y;      // m, its axis
    double foot, top; // m, half a spacing beyond its lowest and highest point
};

/// Points (i + 1/2, j + 1/2) spacings in plan, at heights z_s + (k + 1/2) spacings: k = 0, 1, .. of a release, k = -1, -2, .. of the
/// ground. Local ids: y slowest, then x, then z from below.
class Draped {
public:
    /// The wall particles of the ground, as deep as it says; on its plain lattice at heights (k + 1/2) spacings below the surface.
    Draped(const Ground&, double spacing);
    /// The soil of a release: whole particles in every column, rounded by an ordered pattern (Bayer's, 8 x 8) so that their volume is
    /// that of the thicknesses.
    Draped(const Release&, double spacing);
    /// Why there can be no such particles, or empty.
    static std::string problem(const Shape&, double spacing, int dimensions);

    std::int64_t size() const { return first_.back(); }
    const Box& bounds() const { return bounds_; }
    /// Height of the highest column, m.
    double thickest() const { return double(most_) * spacing_; }
    Vector position(std::int64_t local) const;
    std::int64_t count_in(const Box& region) const;
    /// Calls visit(local id, position) for every point in a closed region, by rising id.
    template <class Visit> void for_each_in(const Box& region, Visit visit) const
    {
        for_each_column_in(region, [&](std::int64_t first, double x, double y, double surface, std::int64_t n) {
            for (std::int64_t k = 0; k < n; ++k)
                if (const double z = height(surface, k, n); z >= region.low.z && z <= region.high.z) visit(first + k, Vector{x, y, z});
        });
    }
    /// Calls visit(Stack) for the columns with points in a closed region.
    template <class Visit> void for_each_stack_in(const Box& region, Visit visit) const
    {
        for_each_column_in(region, [&](std::int64_t, double x, double y, double surface, std::int64_t n) {
            double foot = 0, top = 0;
            std::int64_t in = 0;
            for (std::int64_t k = 0; k < n; ++k)
                if (const double z = height(surface, k, n); z >= region.low.z && z <= region.high.z) {
                    if (in++ == 0) foot = z - 0.5 * spacing_;
                    top = z + 0.5 * spacing_;
                }
            if (in > 0) visit(Stack{x, y, foot, top});
        });
    }
    /// Of the ground, how many points show: its surface, 2.5 spacings deep along its normal so that slopes have no holes.
    std::int64_t shown() const { return shown_; }
    /// Calls visit(local id, position) for the begin-th to the last before the end-th of them, by rising id.
    template <class Visit> void for_each_shown(std::int64_t begin, std::int64_t end, Visit visit) const
    {
        std::int64_t before = 0;
        for_each_column_in(bounds_, [&](std::int64_t first, double x, double y, double surface, std::int64_t n) {
            const std::int64_t here = std::min(n, shown_deep(x, y)), hidden = n - here;
            for (std::int64_t k = std::max<std::int64_t>(0, begin - before); k < std::min(end - before, here); ++k)
                visit(first + hidden + k, Vector{x, y, height(surface, hidden + k, n)});
            before += here;
        });
    }
    bool has_column(std::int64_t i, std::int64_t j) const
    {
        if (i < i0_ || j < j0_ || i >= i0_ + columns_ || j >= j0_ + rows_) return false;
        const std::size_t c = std::size_t((j - j0_) * columns_ + i - i0_);
        return first_[c + 1] > first_[c];
    }
    /// The index of the column in which a coordinate lies.
    std::int64_t index(double x) const { return std::int64_t(std::floor(x / spacing_)); }

private:
    template <class Count> void fill(const Box& outer, Count count);
    /// z of the k-th of n points above or below the surface.
    double height(double surface, std::int64_t k, std::int64_t n) const
    {
        if (plain_) return (std::floor(surface / spacing_ - 0.5) + double(k - n) + 1.5) * spacing_;
        return surface + (double(below_ ? k - n : k) + 0.5) * spacing_;
    }
    /// How many points of a column of the ground lie within 2.5 spacings of its surface.
    std::int64_t shown_deep(double x, double y) const
    {
        return std::int64_t(std::ceil(2.5 * field_->at(x, y).steepness() - 0.5 - 1e-9)) + (plain_ ? 1 : 0);
    }
    double at(std::int64_t i) const { return (double(i) + 0.5) * spacing_; }
    /// Calls visit(first id, x, y, height of the surface, points) for the columns over a region in plan.
    template <class Visit> void for_each_column_in(const Box& region, Visit visit) const
    {
        if (size() == 0) return;
        const auto clamped = [&](double x, std::int64_t low, std::int64_t n) {
            return std::int64_t(std::min(std::max(std::floor(x / spacing_), double(low - 1)), double(low + n)));
        };
        const std::int64_t ia = std::max(i0_, clamped(region.low.x, i0_, columns_) - 1),
                           ib = std::min(i0_ + columns_ - 1, clamped(region.high.x, i0_, columns_) + 1);
        const std::int64_t ja = std::max(j0_, clamped(region.low.y, j0_, rows_) - 1),
                           jb = std::min(j0_ + rows_ - 1, clamped(region.high.y, j0_, rows_) + 1);
        for (std::int64_t j = ja; j <= jb; ++j) {
            const double y = at(j);
            if (y < region.low.y || y > region.high.y) continue;
            for (std::int64_t i = ia; i <= ib; ++i) {
                const double x = at(i);
                if (x < region.low.x || x > region.high.x) continue;
                const std::size_t c = std::size_t((j - j0_) * columns_ + i - i0_);
                if (const std::int64_t n = first_[c + 1] - first_[c]; n > 0) visit(first_[c], x, y, field_->at(x, y).z, n);
            }
        }
    }

    std::shared_ptr<const HeightField> field_;
    double spacing_;
    bool below_, plain_;
    std::int64_t i0_ = 0, j0_ = 0, columns_ = 0, rows_ = 0;
    std::vector<std::int64_t> first_{0}; // id of each column's lowest point, and the end
    std::int64_t most_ = 0;              // points of a column
    std::int64_t shown_ = 0;             // of the ground
    Box bounds_{};
};

/// Depth (m) along z to which ground must be filled for soil to feel all of it within `reach` (m).
double ground_depth(const HeightField&, double reach);

} // namespace kuzure::scene
