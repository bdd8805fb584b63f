#include "io/picture_frame.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace kuzure::io {
namespace {

constexpr double outside_share = 0.005; // of the soil at either end of an axis: what may stay outside if it flies far
constexpr double flies = 2;             // times the extent of all others
constexpr double stands_out = 1.3;      // times the range of the other 98 %

double& axis(Vector& v, int c) { return c == 0 ? v.x : c == 1 ? v.y : v.z; }
double axis(const Vector& v, int c) { return c == 0 ? v.x : c == 1 ? v.y : v.z; }

/// Values that can be compared with others: of a state whose numbers failed, not all can.
bool usable(double v) { return std::isless(std::fabs(v), 1e100); } // quietly, of not-a-number too

/// The values after the lowest and before the highest such share.
std::array<double, 2> inner(std::vector<double>& v, double share)
{
    const auto skip = std::ptrdiff_t(share * double(v.size())), last = std::ptrdiff_t(v.size()) - 1;
    std::nth_element(v.begin(), v.begin() + skip, v.end());
    const double low = v[std::size_t(skip)];
    std::nth_element(v.begin(), v.begin() + (last - skip), v.end());
    return {low, v[std::size_t(last - skip)]};
}

} // namespace

bool Extent::holds(Vector p, double margin) const
{
    for (int c = 0; c < 3; ++c)
        if (!(axis(p, c) >= axis(low, c) - margin && axis(p, c) <= axis(high, c) + margin)) return false;
    return true;
}

Extent joined(const Extent& a, const Extent& b)
{
    Extent e;
    for (int c = 0; c < 3; ++c) {
        axis(e.low, c) = std::min(axis(a.low, c), axis(b.low, c));
        axis(e.high, c) = std::max(axis(a.high, c), axis(b.high, c));
    }
    return e;
}

Reach reach_of(std::span<const Vector> positions, std::span<const double> values)
{
    Reach r;
    std::vector<double> v;
    v.reserve(positions.size());
    for (int c = 0; c < 3; ++c) {
        v.clear();
        for (const Vector& p : positions)
            if (usable(axis(p, c))) v.push_back(axis(p, c));
        if (v.empty()) break;
        const auto [low, high] = std::minmax_element(v.begin(), v.end());
        axis(r.all.low, c) = *low, axis(r.all.high, c) = *high;
        const auto core = inner(v, outside_share);
        axis(r.core.low, c) = core[0], axis(r.core.high, c) = core[1];
    }
    v.clear();
    for (const double x : values)
        if (usable(x)) v.push_back(x);
    if (v.empty()) return r;
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    r.least = *low, r.most = *high;
    const auto most = inner(v, 0.01);
    r.percent_1 = most[0], r.percent_99 = most[1];
    return r;
}

Reach joined(const Reach& a, const Reach& b)
{
    return {joined(a.all, b.all),
            joined(a.core, b.core),
            std::min(a.least, b.least),
            std::max(a.most, b.most),
            std::min(a.percent_1, b.percent_1),
            std::max(a.percent_99, b.percent_99)};
}

Extent frame_of(const Reach& reach, const Extent& walls, int dimensions, double spacing)
{
    const double d = spacing;
    Extent soil = reach.all;
    if (soil.empty()) soil = walls.empty() ? Extent{{0, 0, 0}, {d, d, d}} : walls;
    for (int c = 0; c < 3 && !reach.core.empty(); ++c) {
        const double low = axis(reach.core.low, c), high = axis(reach.core.high, c), spare = 0.25 * (high - low) + 2 * d;
        if (axis(soil.high, c) - axis(soil.low, c) <= flies * (high - low) + 8 * d) continue;
        axis(soil.low, c) = std::max(axis(soil.low, c), low - spare);
        axis(soil.high, c) = std::min(axis(soil.high, c), high + spare);
    }
    const Vector size = soil.size();
    const double widest = dimensions == 2 ? std::max(size.x, size.z) : std::max({size.x, size.y, size.z});
    Extent frame;
    for (int c = 0; c < 3; ++c) {
        if (c == 1 && dimensions == 2) {
            axis(frame.low, c) = -0.5 * d, axis(frame.high, c) = 0.5 * d;
            continue;
        }
        // Walls that end not far from the soil are shown to their ends, others clipped in some distance.
        const double far = 0.5 * std::max(axis(size, c), 0.5 * widest), margin = std::max(0.12 * widest, 4 * d);
        const double below = walls.empty() ? 0 : axis(soil.low, c) - axis(walls.low, c);
        const double above = walls.empty() ? 0 : axis(walls.high, c) - axis(soil.high, c);
        axis(frame.low, c) = axis(soil.low, c) - 0.5 * d - (below <= 0 ? 0 : below <= far ? below : margin);
        axis(frame.high, c) = axis(soil.high, c) + 0.5 * d + (above <= 0 ? 0 : above <= far ? above : margin);
    }
    return frame;
}

double round_up(double x)
{
    const double power = std::pow(10.0, std::floor(std::log10(x)));
    for (const double m : {1.0, 2.0, 5.0, 10.0})
        if (m * power >= x * (1 - 1e-9)) return m * power;
    return 10 * power;
}

Ticks ticks(double low, double high, double count)
{
    Ticks t;
    const double span = high - low;
    if (!(span > 0) || !(span > 1e-12 * std::max(std::fabs(low), std::fabs(high)))) return t;
    t.step = round_up(span / std::max(count, 1.0));
    for (double k = std::ceil(low / t.step - 1e-6); k * t.step <= high + 1e-6 * t.step; ++k) t.at.push_back(k * t.step);
    return t;
}

std::string Ticks::text(double v, double factor) const
{
    const double by = step * factor;
    v *= factor;
    if (std::fabs(v) < 1e-9 * by) v = 0;
    if (by < 1e-4 || std::fabs(v) >= 1e6) return fmt::format("{:.4g}", v);
    return fmt::format("{:.{}f}", v, std::clamp(int(std::ceil(-std::log10(by) - 1e-9)), 0, 6));
}

ColorRange color_range(const Reach& reach, bool has_signs, std::array<double, 2> given)
{
    const bool any = reach.least <= reach.most;
    if (given != std::array<double, 2>{}) return {given[0], given[1], any && reach.least < given[0], any && reach.most > given[1]};
    if (!any) return {};
    ColorRange r{reach.least, reach.most};
    const double most = reach.percent_99 - reach.percent_1;
    if (most > 0 && r.high - r.low > stands_out * most) {
        r = {reach.percent_1, reach.percent_99, reach.percent_1 > reach.least, reach.percent_99 < reach.most};
        // What stands out on one side only leaves the other side whole.
        if (reach.percent_1 - reach.least < (stands_out - 1) * most) r.low = reach.least, r.below = false;
        if (reach.most - reach.percent_99 < (stands_out - 1) * most) r.high = reach.most, r.above = false;
    }
    if (has_signs && r.low < 0 && r.high > 0) {
        r.high = std::max(r.high, -r.low), r.low = -r.high;
    } else if (r.low > 0 && r.low < 0.3 * r.high) {
        r.low = 0;
    } else if (r.high < 0 && r.high > 0.3 * r.low) {
        r.high = 0;
    }
    const double size = std::max(std::fabs(r.low), std::fabs(r.high));
    if (!(r.high - r.low > 1e-9 * size)) r.high = r.low + (size > 0 ? 0.1 * size : 1);
    const double step = round_up((r.high - r.low) / 12);
    r.low = std::floor(r.low / step + 1e-6) * step, r.high = std::ceil(r.high / step - 1e-6) * step;
    r.below = reach.least<r.low - 1e-9 * step, r.above = reach.most> r.high + 1e-9 * step;
    return r;
}

Stage stage_of(const Extent& frame, scene::View view)
{
    // Around the frame: title above, the axes' numbers and names to the left and below, the colour bar to the right.
    const bool oblique = view == scene::View::Oblique;
    const double left = 95, top = 85, right = oblique ? 260 : 215, bottom = oblique ? 80 : 80;
    Stage s;
    s.frame = frame;
    Camera& c = s.camera;
    c.view = view;
    double azimuth = -90, elevation = 0; // deg, where the eye stands
    if (oblique) azimuth = -60, elevation = 24;
    if (view == scene::View::Top) elevation = 90; // Side and Slice: from the front
    const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
    c.right = {-std::sin(a), std::cos(a), 0};
    c.up = {-std::sin(e) * std::cos(a), -std::sin(e) * std::sin(a), std::cos(e)};
    c.toward = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int k = 0; k < 8; ++k) {
        const Vector corner{k & 1 ? frame.high.x : frame.low.x, k & 2 ? frame.high.y : frame.low.y, k & 4 ? frame.high.z : frame.low.z};
        const double at[2] = {dot(c.right, corner), dot(c.up, corner)};
        for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], at[i]), high[i] = std::max(high[i], at[i]);
    }
    const double width = high[0] - low[0], height = high[1] - low[1];
    c.scale = std::min((1600 - left - right) / width, (900 - top - bottom) / height);
    const auto even = [](double v) { return 2 * int(std::ceil(0.5 * v - 1e-6)); };
    s.width = std::clamp(even(c.scale * width + left + right), 960, 1600);
    s.height = std::clamp(even(c.scale * height + top + bottom), 480, 900);
    s.left = left + 0.5 * (s.width - left - right - c.scale * width);
    s.top = top + 0.5 * (s.height - top - bottom - c.scale * height);
    s.right = s.left + c.scale * width, s.bottom = s.top + c.scale * height;
    c.x0 = s.left - c.scale * low[0];
    c.y0 = s.bottom + c.scale * low[1];
    return s;
}

} // namespace kuzure::io
