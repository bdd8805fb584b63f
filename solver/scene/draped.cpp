#include "solver/scene/draped.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/shape.hpp"
#include <fmt/format.h>

namespace kuzure::scene {
namespace {

/// Columns of a plan; more mean a spacing that is not meant: each takes eight bytes.
const double most_columns = 4e8;

/// Threshold 0 .. 1 of Bayer's ordered 8 x 8 pattern: of any share s of its columns as many as fit s lie below s.
double bayer(std::int64_t i, std::int64_t j)
{
    int value = 0;
    for (int bit = 0; bit < 3; ++bit) {
        const int x = int((i >> bit) & 1), y = int((j >> bit) & 1);
        value = 4 * value + 2 * (x ^ y) + y;
    }
    return (value + 0.5) / 64;
}

} // namespace

std::string Draped::problem(const Shape& shape, double spacing, int dimensions)
{
    if (dimensions != 3) return fmt::format("expected dimensions = 3 on real ground, found {}; let dimensions be 3", dimensions);
    const Box outer = scene::bounds(shape);
    const double x = (outer.high.x - outer.low.x) / spacing, y = (outer.high.y - outer.low.y) / spacing;
    if (!(x > 0 && y > 0)) return "expected an outline on the elevation model, found none of it there";
    if (x * y > most_columns)
        return fmt::format("expected ground that a computer can hold, found {:.3g} columns of particles at a spacing of {} m; let "
                           "terrain.window be smaller, or is space.spacing in metres?",
                           x * y, spacing);
    return {};
}

template <class Count> void Draped::fill(const Box& outer, Count count)
{
    i0_ = index(outer.low.x), j0_ = index(outer.low.y);
    columns_ = index(outer.high.x) - i0_ + 1, rows_ = index(outer.high.y) - j0_ + 1;
    first_.assign(1, 0), first_.reserve(std::size_t(columns_ * rows_) + 1);
    const double far = std::numeric_limits<double>::infinity();
    bounds_ = {{far, far, far}, {-far, -far, -far}};
    for (std::int64_t j = j0_; j < j0_ + rows_; ++j)
        for (std::int64_t i = i0_; i < i0_ + columns_; ++i) {
            const double x = at(i), y = at(j), surface = field_->at(x, y).z;
            const std::int64_t n = std::isfinite(surface) ? count(i, j, x, y) : 0;
            first_.push_back(first_.back() + n);
            if (n == 0) continue;
            most_ = std::max(most_, n);
            const double low = height(surface, 0, n), high = height(surface, n - 1, n);
            bounds_.low = {std::min(bounds_.low.x, x), std::min(bounds_.low.y, y), std::min(bounds_.low.z, low)};
            bounds_.high = {std::max(bounds_.high.x, x), std::max(bounds_.high.y, y), std::max(bounds_.high.z, high)};
        }
}

Draped::Draped(const Ground& ground, double spacing)
    : field_(ground.field), spacing_(spacing), below_(true), plain_(ground.lattice == GroundLattice::Plain)
{
    const auto layers = std::int64_t(std::ceil(ground.depth / spacing - 1e-9));
    fill(scene::bounds(ground), [&](auto, auto, double x, double y) {
        shown_ += std::min(layers, shown_deep(x, y));
        return layers;
    });
}

Draped::Draped(const Release& release, double spacing) : field_(release.bed), spacing_(spacing), below_(false), plain_(false)
{
    fill(scene::bounds(release), [&](std::int64_t i, std::int64_t j, double x, double y) {
        return std::int64_t(std::floor(thickness(release, x, y) / spacing + 1e-9 + bayer(i, j)));
    });
}

Vector Draped::position(std::int64_t local) const
{
    ensure(local >= 0 && local < size(), "a lattice point is asked for that does not exist");
    const auto c = std::int64_t(std::upper_bound(first_.begin(), first_.end(), local) - first_.begin() - 1);
    const double x = at(i0_ + c % columns_), y = at(j0_ + c / columns_);
    const std::int64_t first = first_[std::size_t(c)], n = first_[std::size_t(c) + 1] - first;
    return {x, y, height(field_->at(x, y).z, local - first, n)};
}

std::int64_t Draped::count_in(const Box& region) const
{
    std::int64_t sum = 0;
    for_each_in(region, [&](std::int64_t, Vector) { ++sum; });
    return sum;
}

double ground_depth(const HeightField& field, double reach)
{
    // Along the normal, reach of ground: along z more by the slope.
    const Grid& g = field.grid();
    double steepest = 0;
    for (int j = 0; j + 1 < 2 * g.rows; ++j)
        for (int i = 0; i + 1 < 2 * g.columns; ++i) {
            const auto p = field.at(g.x + 0.5 * i * g.cell, g.y + 0.5 * j * g.cell);
            if (std::isfinite(p.z)) steepest = std::max(steepest, p.dz_dx * p.dz_dx + p.dz_dy * p.dz_dy);
        }
    return reach * std::sqrt(1 + steepest);
}

} // namespace kuzure::scene
