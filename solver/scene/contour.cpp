#include "solver/scene/contour.hpp"
#include "solver/scene/ring.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace kuzure::scene {
namespace {

/// Marching squares: a crossing is known by the edge of the grid on which it lies.
class Tracer {
public:
    Tracer(const Grid& grid, double level) : grid_(grid), level_(level) {}

    std::vector<Ring> rings()
    {
        for (int row = -1; row < grid_.rows; ++row)
            for (int column = -1; column < grid_.columns; ++column) square(column, row);
        std::vector<Ring> all;
        for (const auto start : order_) {
            auto at = next_.find(start);
            if (at == next_.end()) continue; // on a ring before
            Ring& ring = all.emplace_back();
            while (at != next_.end()) {
                ring.push_back(point_on(at->first));
                const auto to = at->second;
                next_.erase(at);
                at = next_.find(to);
            }
        }
        return all;
    }

private:
    enum Side { Bottom, Right, Top, Left };

    double value(int column, int row) const
    {
        if (column < 0 || row < 0 || column >= grid_.columns || row >= grid_.rows) return below();
        const double v = grid_.at(column, row);
        return std::isnan(v) ? below() : v;
    }
    double below() const { return std::min(0.0, level_ - std::abs(level_)); }
    std::int64_t node(int column, int row) const { return std::int64_t(row + 1) * (grid_.columns + 2) + column + 1; }
    /// Of a side of the square whose lower left node this is: twice the node from which it runs east, or that and one where it runs north.
    std::int64_t edge(int column, int row, Side side) const
    {
        switch (side) {
        case Bottom:
            return 2 * node(column, row);
        case Left:
            return 2 * node(column, row) + 1;
        case Top:
            return 2 * node(column, row + 1);
        case Right:
            break;
        }
        return 2 * node(column + 1, row) + 1;
    }
    std::array<double, 2> point_on(std::int64_t edge) const
    {
        const int column = int(edge / 2 % (grid_.columns + 2)) - 1, row = int(edge / 2 / (grid_.columns + 2)) - 1;
        const bool north = edge % 2;
        const double a = value(column, row), b = north ? value(column, row + 1) : value(column + 1, row);
        // Not quite at the nodes, where rings would touch.
        const double part = std::clamp((level_ - a) / (b - a), 1e-6, 1 - 1e-6);
        return {grid_.x + (column + (north ? 0 : part)) * grid_.cell, grid_.y + (row + (north ? part : 0)) * grid_.cell};
    }
    /// The segments of a square, what is above on their left.
    void square(int column, int row)
    {
        const std::array corners{value(column, row), value(column + 1, row), value(column + 1, row + 1), value(column, row + 1)};
        int above = 0;
        for (int k = 0; k < 4; ++k) above |= int(corners[std::size_t(k)] >= level_) << k;
        const bool middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]) >= level_;
        const auto segment = [&](Side from, Side to) {
            const auto start = edge(column, row, from);
            next_.emplace(start, edge(column, row, to)), order_.push_back(start);
        };
        switch (above) {
        case 1:
            return segment(Bottom, Left);
        case 2:
            return segment(Right, Bottom);
        case 3:
            return segment(Right, Left);
        case 4:
            return segment(Top, Right);
        case 5:
            return middle ? (segment(Bottom, Right), segment(Top, Left)) : (segment(Bottom, Left), segment(Top, Right));
        case 6:
            return segment(Top, Bottom);
        case 7:
            return segment(Top, Left);
        case 8:
            return segment(Left, Top);
        case 9:
            return segment(Bottom, Top);
        case 10:
            return middle ? (segment(Left, Bottom), segment(Right, Top)) : (segment(Right, Bottom), segment(Left, Top));
        case 11:
            return segment(Right, Top);
        case 12:
            return segment(Left, Right);
        case 13:
            return segment(Bottom, Right);
        case 14:
            return segment(Left, Bottom);
        default: // all above, or none
            return;
        }
    }

    const Grid& grid_;
    double level_;
    std::unordered_map<std::int64_t, std::int64_t> next_;
    std::vector<std::int64_t> order_;
};

} // namespace

std::vector<Area> areas_above(const Grid& grid, double level)
{
    std::vector<Area> areas;
    std::vector<Ring> holes;
    for (auto& ring : Tracer(grid, level).rings()) {
        if (signed_area(ring) > 0) areas.push_back({std::move(ring)});
        else holes.push_back(std::move(ring));
    }
    for (auto& hole : holes) {
        // Of the areas around it the smallest.
        Area* around = nullptr;
        for (auto& area : areas)
            if (encloses(area[0], hole[0][0], hole[0][1]) && (!around || signed_area(area[0]) < signed_area((*around)[0]))) around = &area;
        if (around) around->push_back(std::move(hole));
    }
    return areas;
}

} // namespace kuzure::scene
