// What stands around a picture: axes with their numbers, and the bar of its colours.
#include "io/picture_colors.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {

void Painter::draw_axes(bool flat)
{
    const Camera& c = stage_.camera;
    const Extent& f = stage_.frame;
    struct Axis {
        const char* name;
        Vector from, to; // m
        double out[2];   // where the numbers stand, seen from the axis, pixels to the right and down
        Anchor anchor;
    };
    std::vector<Axis> axes;
    const bool oblique = c.view == scene::View::Oblique && !flat, top = c.view == scene::View::Top && !flat;
    const Vector corner{f.low.x, f.low.y, f.low.z};
    if (oblique) {
        axes = {{"x", corner, {f.high.x, f.low.y, f.low.z}, {-0.55, 0.83}, Anchor::Middle},
                {"y", {f.high.x, f.low.y, f.low.z}, {f.high.x, f.high.y, f.low.z}, {0.9, 0.43}, Anchor::Left},
                {"z", corner, {f.low.x, f.low.y, f.high.z}, {-1, 0}, Anchor::Right}};
    } else {
        axes = {{"x", corner, {f.high.x, f.low.y, f.low.z}, {0, 1}, Anchor::Middle},
                {top ? "y" : "z", corner, {f.low.x, top ? f.high.y : f.low.y, top ? f.low.z : f.high.z}, {-1, 0}, Anchor::Right}};
    }
    for (const Axis& a : axes) {
        const double x0 = c.x(a.from), y0 = c.y(a.from), x1 = c.x(a.to), y1 = c.y(a.to), length = std::hypot(x1 - x0, y1 - y0);
        const char which = *a.name;
        const double low = which == 'x' ? a.from.x : which == 'y' ? a.from.y : a.from.z;
        const double high = which == 'x' ? a.to.x : which == 'y' ? a.to.y : a.to.z;
        if (!(high > low)) continue;
        const Ticks marks = ticks(low, high, std::clamp(length / (which == 'x' ? 85.0 : 55.0), 1.0, 10.0));
        double widest = 0;
        for (const double v : marks.at) {
            const double s = (v - low) / (high - low), x = x0 + s * (x1 - x0), y = y0 + s * (y1 - y0);
            if (!oblique && which == 'x') ground_.line(x, stage_.top, x, stage_.bottom, 1, faint);
            if (!oblique && which != 'x') ground_.line(stage_.left, y, stage_.right, y, 1, faint);
            ground_.line(x, y, x + 7 * a.out[0], y + 7 * a.out[1], 1.4, ink);
            const std::string text = marks.text(v);
            widest = std::max(widest, Canvas::text_width(16, text));
            ground_.text(x + (a.anchor == Anchor::Middle ? 20 : 12) * a.out[0], y + 20 * a.out[1], 16, text, ink, a.anchor);
        }
        ground_.line(x0, y0, x1, y1, 1.4, ink);
        const double x = 0.5 * (x0 + x1), y = 0.5 * (y0 + y1);
        const std::string name = fmt::format("{} [m]", a.name);
        if (a.anchor == Anchor::Right) ground_.text(x - 30 - widest, y, 18, name, ink, Anchor::Middle, 0, true);
        else if (a.anchor == Anchor::Left) ground_.text(x + 30 + widest, y + 34, 18, name, ink, Anchor::Left);
        else ground_.text(x + (oblique ? 50 * a.out[0] : 0), y + (oblique ? 52 * a.out[1] : 50), 18, name, ink, Anchor::Middle);
    }
    if (!oblique) { // the frame's other sides
        ground_.line(stage_.left, stage_.top, stage_.right, stage_.top, 1, faint);
        ground_.line(stage_.right, stage_.top, stage_.right, stage_.bottom, 1, faint);
    }
}

void Painter::draw_color_bar(const Quantity& q)
{
    const int width = 26, height = ground_.height() / 2, left = ground_.width() - 150, top = (ground_.height() - height) / 2 + 18;
    // Thousands and millions of a unit, and thousandths, go into its name.
    const double largest = std::max(std::fabs(range_.low), std::fabs(range_.high));
    int power = 0;
    if (q.unit == "Pa") power = largest < 1e4 ? 0 : largest < 1e7 ? 3 : 6;
    if (q.unit == "m" || q.unit == "m/s") power = largest < 0.05 ? -3 : 0;
    const char* prefix = power == 3 ? "k" : power == 6 ? "M" : power == -3 ? "m" : "";
    const std::string unit = q.unit.empty() || q.unit == "1" ? "" : fmt::format(" [{}{}]", prefix, q.unit);
    const double factor = std::pow(10.0, -power);
    ground_.text(left + 0.5 * width + 10, top - 30, 17, q.title + unit, ink, Anchor::Middle, 210);
    ground_.rectangle(left - 1, top - 1, width + 2, height + 2, ink);
    for (int y = 0; y < height; ++y) {
        const double t = 1 - (y + 0.5) / height;
        ground_.rectangle(left, top + y, width, 1, colors_[std::min(std::size_t(t * color_steps), std::size_t(color_steps - 1))]);
    }
    const Ticks marks = ticks(range_.low, range_.high, 7);
    for (const double v : marks.at) {
        const double y = top + height * (1 - (v - range_.low) / (range_.high - range_.low));
        ground_.line(left + width, y, left + width + 6, y, 1.4, ink);
        ground_.text(left + width + 12, y, 16, marks.text(v, factor), ink);
    }
    // Values beyond an end have its colour: an arrow says that there are some.
    const double middle = left + 0.5 * width, half = 0.5 * width;
    if (range_.above)
        ground_.triangle({{{middle - half, top - 2.0}, {middle + half, top - 2.0}, {middle, top - 16.0}}}, colors_[color_steps - 1]);
    const double end = top + height + 2.0;
    if (range_.below) ground_.triangle({{{middle - half, end}, {middle + half, end}, {middle, end + 14}}}, colors_[0]);
}

} // namespace kuzure::io
