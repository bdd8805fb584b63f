#pragma once
// Ground as heights over a plan: a grid of numbers, and the smooth surface through it.
#include "solver/core/tensor.hpp"
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace kuzure::scene {

/// Numbers at the points of a square grid: x to the east, y to the north, row 0 in the south, column 0 in the west. NaN: no number there.
struct Grid {
    double x = 0, y = 0; // m, of the point in column 0, row 0 (the centre of its cell)
    double cell = 1;     // m
    int columns = 0, rows = 0;
    std::vector<double> values; // row by row from the south
    double& at(int column, int row) { return values[std::size_t(row) * std::size_t(columns) + std::size_t(column)]; }
    double at(int column, int row) const { return values[std::size_t(row) * std::size_t(columns) + std::size_t(column)]; }
    double x_of(int column) const { return x + column * cell; } // m
    double y_of(int row) const { return y + row * cell; }
    /// Calls visit(column, row, index in `values`) for every point.
    template <class Visit> void for_each(Visit visit) const
    {
        for (int j = 0; j < rows; ++j)
            for (int i = 0; i < columns; ++i) visit(i, j, std::size_t(j) * std::size_t(columns) + std::size_t(i));
    }
    bool operator==(const Grid&) const = default;
};

/// The mean of blocks of n x n values, for grids finer than what stands on them; NaN where one of a block is. Rows and columns that fill
/// no block are left out.
Grid averaged(const Grid&, int n);
/// Bilinear between the points; NaN beyond them, and where one of the four has no number.
double bilinear(const Grid&, double x, double y);

/// A surface with continuous slopes through a grid of heights: quadratic B-splines about the points with the coefficients
/// c = f - (second differences of f)/8 (Sablonniere's quasi-interpolant), which reproduce every quadratic polynomial.
class HeightField {
public:
    /// At least 3 x 3 heights.
    explicit HeightField(Grid heights);
    const Grid& grid() const { return grid_; }
    /// Height (m) and slopes (1) above a point in plan; NaN where heights are missing around it or beyond the grid.
    struct Point {
        double z, dz_dx, dz_dy;
        /// Area of the surface over its area in plan.
        double steepness() const { return std::sqrt(1 + dz_dx * dz_dx + dz_dy * dz_dy); }
        /// Unit vector, upwards.
        Vector normal() const
        {
            const double l = steepness();
            return {-dz_dx / l, -dz_dy / l, 1 / l};
        }
    };
    Point at(double x, double y) const;
    /// The area (m) on which there is a surface: to the edges of the outermost cells but one.
    double low_x() const { return grid_.x + 0.5 * grid_.cell; }
    double low_y() const { return grid_.y + 0.5 * grid_.cell; }
    double high_x() const { return grid_.x + (grid_.columns - 1.5) * grid_.cell; }
    double high_y() const { return grid_.y + (grid_.rows - 1.5) * grid_.cell; }
    /// Least and greatest of the heights, m.
    double lowest() const { return lowest_; }
    double highest() const { return highest_; }
    /// Signed distance (m, negative below) and normal of the surface at its point closest to x. NaN where there is no surface.
    struct Nearest {
        double distance;
        Vector normal, point;
    };
    Nearest nearest(Vector x) const;

private:
    double coefficient(int column, int row) const
    {
        return coefficients_[std::size_t(row) * std::size_t(grid_.columns) + std::size_t(column)];
    }
    Grid grid_;
    std::vector<double> coefficients_;
    double lowest_ = std::numeric_limits<double>::infinity(), highest_ = -std::numeric_limits<double>::infinity();
};

} // namespace kuzure::scene
