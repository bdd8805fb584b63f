#include "io/ground/relief.hpp"
#include "io/ground/crs.hpp"
#include <algorithm>
#include <cmath>
#include <numbers>

namespace kuzure::io {

std::size_t Relief::with_slope() const
{
    std::size_t n = 0;
    for (const auto s : slopes) n += s;
    return n;
}

Relief relief(const scene::Grid& g, double dx, double dy)
{
    Relief r;
    r.cells = g.values.size();
    r.lowest = std::numeric_limits<double>::infinity(), r.highest = -r.lowest, r.whole_numbers = true;
    double sum = 0;
    for (const double z : g.values) {
        if (std::isnan(z)) {
            ++r.missing;
            continue;
        }
        sum += z, r.lowest = std::min(r.lowest, z), r.highest = std::max(r.highest, z);
        r.whole_numbers = r.whole_numbers && z == std::floor(z);
    }
    if (r.missing == r.cells) {
        r.lowest = r.highest = r.mean = std::numeric_limits<double>::quiet_NaN(), r.whole_numbers = false;
        return r;
    }
    r.mean = sum / double(r.cells - r.missing);
    for (int j = 1; j + 1 < g.rows; ++j)
        for (int i = 1; i + 1 < g.columns; ++i) {
            const double sx = (g.at(i + 1, j) - g.at(i - 1, j)) / (2 * dx), sy = (g.at(i, j + 1) - g.at(i, j - 1)) / (2 * dy);
            if (std::isnan(sx) || std::isnan(sy)) continue;
            const double slope = std::atan(std::hypot(sx, sy)) * 180 / std::numbers::pi;
            ++r.slopes[std::min(std::size_t(slope / Relief::slope_class), r.slopes.size() - 1)];
            if (slope > r.steepest) r.steepest = slope, r.steepest_x = g.x + i * g.cell, r.steepest_y = g.y + j * g.cell;
        }
    return r;
}

std::array<double, 2> metres_of_cell(const scene::Grid& g, const std::string& crs)
{
    if (crs.empty() || !is_geographic(crs)) {
        const double unit = crs.empty() ? 1 : metres_per_unit(crs);
        return {g.cell * (unit > 0 ? unit : 1), g.cell * (unit > 0 ? unit : 1)};
    }
    const double latitude = (g.y + 0.5 * g.rows * g.cell) * std::numbers::pi / 180;
    // Radii of curvature of the ellipsoid GRS 80.
    const double a = 6378137, e2 = 0.00669438, w = std::sqrt(1 - e2 * std::sin(latitude) * std::sin(latitude)),
                 degree = std::numbers::pi / 180;
    return {g.cell * degree * a / w * std::cos(latitude), g.cell * degree * a * (1 - e2) / (w * w * w)};
}

std::string hillshade(const scene::Grid& whole, double dx, double dy, int most)
{
    const int n = std::max(1, (std::max(whole.columns, whole.rows) + most - 1) / most);
    const scene::Grid g = std::min(whole.columns, whole.rows) >= n ? scene::averaged(whole, n) : whole;
    std::vector<Rgb> greys;
    for (int k = 0; k < 256; ++k) greys.push_back({std::uint8_t(k), std::uint8_t(k), std::uint8_t(k)});
    Reduced picture{g.columns, g.rows, std::vector<std::uint8_t>(g.values.size(), 255)};
    for (int j = 0; j < g.rows; ++j)
        for (int i = 0; i < g.columns; ++i) {
            if (std::isnan(g.at(i, j))) continue;
            const auto height = [&](int a, int b) {
                const double z = g.at(std::clamp(a, 0, g.columns - 1), std::clamp(b, 0, g.rows - 1));
                return std::isnan(z) ? g.at(i, j) : z;
            };
            const double sx = (height(i + 1, j) - height(i - 1, j)) / (2 * dx * n),
                         sy = (height(i, j + 1) - height(i, j - 1)) / (2 * dy * n);
            // Light from (-1, 1, sqrt 2)/2.
            const double light = (sx - sy + std::numbers::sqrt2) / (2 * std::sqrt(1 + sx * sx + sy * sy));
            picture.index[std::size_t(g.rows - 1 - j) * std::size_t(g.columns) + std::size_t(i)] =
                std::uint8_t(std::lround(std::clamp(250 * light, 0.0, 250.0)));
        }
    return png(picture, Palette(greys));
}

} // namespace kuzure::io
