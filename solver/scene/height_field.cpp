#include "solver/scene/height_field.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>

namespace kuzure::scene {

double bilinear(const Grid& g, double x, double y)
{
    const double u = (x - g.x) / g.cell, v = (y - g.y) / g.cell;
    if (!(u >= 0 && v >= 0 && u <= g.columns - 1 && v <= g.rows - 1)) return std::numeric_limits<double>::quiet_NaN();
    const int i = std::min(int(u), g.columns - 2), j = std::min(int(v), g.rows - 2);
    const double a = u - i, b = v - j;
    return (1 - b) * ((1 - a) * g.at(i, j) + a * g.at(i + 1, j)) + b * ((1 - a) * g.at(i, j + 1) + a * g.at(i + 1, j + 1));
}

Grid averaged(const Grid& g, int n)
{
    ensure(n >= 1, "a grid is averaged over no points");
    if (n == 1) return g;
    Grid to{g.x + 0.5 * (n - 1) * g.cell, g.y + 0.5 * (n - 1) * g.cell, n * g.cell, g.columns / n, g.rows / n, {}};
    to.values.resize(std::size_t(to.columns) * std::size_t(to.rows));
    for (int j = 0; j < to.rows; ++j)
        for (int i = 0; i < to.columns; ++i) {
            double sum = 0;
            for (int b = 0; b < n; ++b)
                for (int a = 0; a < n; ++a) sum += g.at(n * i + a, n * j + b);
            to.at(i, j) = sum / (double(n) * double(n));
        }
    return to;
}

HeightField::HeightField(Grid heights) : grid_(std::move(heights))
{
    const int m = grid_.columns, n = grid_.rows;
    ensure(m >= 3 && n >= 3 && grid_.values.size() == std::size_t(m) * std::size_t(n), "a height field has fewer than 3 x 3 heights");
    for (const double h : grid_.values)
        if (std::isfinite(h)) lowest_ = std::min(lowest_, h), highest_ = std::max(highest_, h);
    // c = f - f''/8 along x, then along y; at the rim the second difference of the neighbour counts, so that a parabola stays one.
    const auto sharpened = [](double a, double b, double c, double f) { return f - 0.125 * ((a - b) + (c - b)); };
    std::vector<double> along_x(grid_.values.size());
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < m; ++i) {
            const int k = std::clamp(i, 1, m - 2);
            along_x[std::size_t(j) * std::size_t(m) + std::size_t(i)] =
                sharpened(grid_.at(k - 1, j), grid_.at(k, j), grid_.at(k + 1, j), grid_.at(i, j));
        }
    coefficients_.resize(grid_.values.size());
    const auto x = [&](int i, int j) { return along_x[std::size_t(j) * std::size_t(m) + std::size_t(i)]; };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < m; ++i) {
            const int k = std::clamp(j, 1, n - 2);
            coefficients_[std::size_t(j) * std::size_t(m) + std::size_t(i)] = sharpened(x(i, k - 1), x(i, k), x(i, k + 1), x(i, j));
        }
}

HeightField::Point HeightField::at(double px, double py) const
{
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const double u = (px - grid_.x) / grid_.cell, v = (py - grid_.y) / grid_.cell;
    if (!(u >= 0.5 && v >= 0.5 && u <= grid_.columns - 1.5 && v <= grid_.rows - 1.5)) return {none, none, none};
    const int i = std::min(int(std::floor(u + 0.5)), grid_.columns - 2), j = std::min(int(std::floor(v + 0.5)), grid_.rows - 2);
    // Quadratic B-spline of three points, t in -1/2 .. 1/2 from the middle one: (t - 1/2)^2/2, 3/4 - t^2, (t + 1/2)^2/2.
    struct Weights {
        double w[3], d[3];
    };
    const auto weights = [](double t) {
        return Weights{{0.5 * (t - 0.5) * (t - 0.5), 0.75 - t * t, 0.5 * (t + 0.5) * (t + 0.5)}, {t - 0.5, -2 * t, t + 0.5}};
    };
    const Weights a = weights(u - i), b = weights(v - j);
    Point p{0, 0, 0};
    for (int q = 0; q < 3; ++q) {
        double row = 0, slope = 0;
        for (int r = 0; r < 3; ++r) {
            const double c = coefficient(i - 1 + r, j - 1 + q);
            row += a.w[r] * c, slope += a.d[r] * c;
        }
        p.z += b.w[q] * row, p.dz_dx += b.w[q] * slope, p.dz_dy += b.d[q] * row;
    }
    p.dz_dx /= grid_.cell, p.dz_dy /= grid_.cell;
    return p;
}

HeightField::Nearest HeightField::nearest(Vector x) const
{
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const Point above = at(x.x, x.y);
    const bool below = x.z < above.z;
    // Foot of the perpendicular: from the tangent plane at a point to the next point, until they agree; half the way where it turns.
    Vector at_surface{x.x, x.y, above.z}, normal{};
    Point p = above;
    double shortest = std::numeric_limits<double>::infinity();
    Nearest best{none, {none, none, none}, {none, none, none}};
    double u = x.x, v = x.y;
    for (int k = 0; k < 24; ++k) {
        if (!std::isfinite(p.z)) break;
        normal = p.normal();
        at_surface = {u, v, p.z};
        const Vector way = x - at_surface;
        const double away = length(way);
        if (away < shortest) {
            shortest = away;
            best = {below ? -away : away, normal, at_surface};
        }
        const double along = dot(way, normal);
        const Vector across = way - along * normal; // to the perpendicular, in the tangent plane
        const double miss = length(across);
        if (miss <= 1e-12 * grid_.cell + 1e-10 * away) break;
        const double part = k < 4 ? 1 : 0.5;
        u += part * across.x, v += part * across.y;
        p = at(u, v);
    }
    return best;
}

} // namespace kuzure::scene
