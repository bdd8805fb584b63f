#pragma once
// Which of many shapes may lie at a point: their boxes in a grid, so that thousands of bodies are not all asked everywhere.
#include "solver/scene/box.hpp"
#include "solver/scene/shape.hpp"
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace kuzure::scene {

class Nearby {
public:
    /// Shapes are called by their indices in `boxes`; in 2-D y does not count.
    Nearby(std::vector<Box> boxes, int dimensions) : boxes_(std::move(boxes)), dimensions_(dimensions)
    {
        const double per_axis = boxes_.empty() ? 1 : std::ceil(std::pow(double(boxes_.size()), 1.0 / dimensions));
        for (int a = 0; a < 3; ++a) {
            double high = -infinite;
            low_[a] = infinite;
            for (const Box& b : boxes_) low_[a] = std::min(low_[a], at(b.low, a)), high = std::max(high, at(b.high, a));
            if ((a == 1 && dimensions_ == 2) || !(high > low_[a])) continue;
            n_[a] = std::int64_t(std::min(per_axis, 256.0));
            scale_[a] = double(n_[a]) / (high - low_[a]);
        }
        cells_.resize(std::size_t(n_[0] * n_[1] * n_[2]));
        for (std::size_t k = 0; k < boxes_.size(); ++k) {
            const auto from = cell(boxes_[k].low), to = cell(boxes_[k].high);
            const std::int64_t covered = (to[0] - from[0] + 1) * (to[1] - from[1] + 1) * (to[2] - from[2] + 1);
            if (covered > 64) {
                large_.push_back(k);
                continue;
            }
            for_cells(from, to, [&](std::vector<std::size_t>& c) { c.push_back(k); });
        }
    }

    /// True if `holds(k)` is for any shape whose box contains the point.
    template <class Holds> bool any(Vector x, Holds holds) const
    {
        const auto try_all = [&](const std::vector<std::size_t>& some) {
            for (const std::size_t k : some)
                if (contact(boxes_[k], x, dimensions_).distance <= 0 && holds(k)) return true;
            return false;
        };
        const auto c = cell(x);
        return try_all(cells_[index(c[0], c[1], c[2])]) || try_all(large_);
    }
    /// The shapes whose boxes may meet this one, in rising order.
    std::vector<std::size_t> meeting(const Box& b) const
    {
        std::vector<std::size_t> found = large_;
        for_cells(cell(b.low), cell(b.high), [&](const std::vector<std::size_t>& c) { found.insert(found.end(), c.begin(), c.end()); });
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        return found;
    }

private:
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    using Cell = std::array<std::int64_t, 3>;
    std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) const { return std::size_t((z * n_[1] + y) * n_[0] + x); }
    /// The cell of a point, the outermost ones for what lies outside; it never falls where a coordinate rises.
    Cell cell(const Vector& x) const
    {
        Cell c{};
        for (int a = 0; a < 3; ++a)
            if (n_[a] > 1) c[a] = std::int64_t(std::clamp(std::floor((at(x, a) - low_[a]) * scale_[a]), 0.0, double(n_[a] - 1)));
        return c;
    }
    template <class Do> void for_cells(const Cell& from, const Cell& to, Do each)
    {
        for (auto z = from[2]; z <= to[2]; ++z)
            for (auto y = from[1]; y <= to[1]; ++y)
                for (auto x = from[0]; x <= to[0]; ++x) each(cells_[index(x, y, z)]);
    }
    template <class Do> void for_cells(const Cell& from, const Cell& to, Do each) const
    {
        const_cast<Nearby*>(this)->for_cells(from, to, [&](const std::vector<std::size_t>& c) { each(c); });
    }

    std::vector<Box> boxes_;
    int dimensions_;
    std::array<double, 3> low_{}, scale_{};
    std::array<std::int64_t, 3> n_{1, 1, 1};
    std::vector<std::vector<std::size_t>> cells_;
    std::vector<std::size_t> large_; // those that cover many cells
};

/// The shapes of bodies or walls by their boxes.
template <class Parts> Nearby nearby(const Parts& parts, int dimensions)
{
    std::vector<Box> boxes;
    for (const auto& part : parts) boxes.push_back(bounds(part.shape));
    return Nearby(std::move(boxes), dimensions);
}

} // namespace kuzure::scene
