#include "io/map_picture.hpp"
#include "io/picture_frame.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

constexpr Rgb ink{33, 37, 41}, plain{236, 236, 232}, height_line{128, 92, 56};
constexpr std::array<Rgb, 5> outline_colors{{{20, 20, 20}, {0, 77, 168}, {112, 48, 160}, {0, 110, 80}, {140, 70, 0}}};
constexpr int color_steps = 28, left = 110, top = 70, right = 210, bottom = 80; // pixels, around the map
constexpr std::array lights{0.55, 0.7, 0.85, 1.0, 1.1};

Rgb lit(Rgb c, double light)
{
    const auto part = [&](std::uint8_t x) { return std::uint8_t(std::clamp(std::lround(x * light), 0l, 255l)); };
    return {part(c.r), part(c.g), part(c.b)};
}

Palette palette(bool signs)
{
    std::vector<Rgb> all;
    for (int k = 0; k < 12; ++k) all.push_back(lit({255, 255, 255}, k / 11.0));
    for (const auto c : outline_colors) all.push_back(c);
    all.push_back(ink);
    for (int k = 0; k < 4; ++k) all.push_back(lit(height_line, 1 + 0.25 * k));
    for (int k = 0; k < 40; ++k) all.push_back(lit(plain, 0.3 + 0.78 * k / 39));
    for (int k = 0; k < color_steps; ++k)
        for (const double light : lights) all.push_back(lit(map_color(k / double(color_steps - 1), signs), light));
    return Palette(std::move(all));
}

/// The part of the map that is shown, and where on the picture.
struct View {
    double low_x, low_y, high_x, high_y; // m
    double scale;                        // pixels a metre
    int width, height;                   // pixels, of the map alone
    double px(double x) const { return left + (x - low_x) * scale; }
    double py(double y) const { return top + (high_y - y) * scale; }
    double x(int column) const { return low_x + (column + 0.5) / scale; }
    double y(int row) const { return high_y - (row + 0.5) / scale; }
};

View view_of(const MapPicture& m)
{
    const auto& g = m.values;
    double low_x = HUGE_VAL, low_y = HUGE_VAL, high_x = -HUGE_VAL, high_y = -HUGE_VAL;
    for (int row = 0; row < g.rows; ++row)
        for (int column = 0; column < g.columns; ++column) {
            if (std::isnan(g.at(column, row))) continue;
            const double x = g.x + column * g.cell, y = g.y + row * g.cell, half = 0.5 * g.cell;
            low_x = std::min(low_x, x - half), high_x = std::max(high_x, x + half);
            low_y = std::min(low_y, y - half), high_y = std::max(high_y, y + half);
        }
    if (m.whole_outlines)
        for (const auto& outline : m.outlines)
            for (const auto& area : outline.areas)
                for (const auto& ring : area)
                    for (const auto& p : ring)
                        low_x = std::min(low_x, p[0]), high_x = std::max(high_x, p[0]), low_y = std::min(low_y, p[1]),
                        high_y = std::max(high_y, p[1]);
    if (low_x > high_x)
        low_x = g.x, low_y = g.y, high_x = g.x + std::max(1, g.columns) * g.cell, high_y = g.y + std::max(1, g.rows) * g.cell;
    // A house that is just missed belongs to the picture.
    const double size = std::max(high_x - low_x, high_y - low_y), x0 = low_x, x1 = high_x, y0 = low_y, y1 = high_y;
    for (const auto& p : m.points) {
        if (std::max({x0 - p.x, p.x - x1, y0 - p.y, p.y - y1}) > 0.5 * size) continue;
        low_x = std::min(low_x, p.x), high_x = std::max(high_x, p.x), low_y = std::min(low_y, p.y), high_y = std::max(high_y, p.y);
    }
    // Some of what is around; no map is a strip.
    const double margin = 0.12 * std::max(high_x - low_x, high_y - low_y) + g.cell;
    low_x -= margin, low_y -= margin, high_x += margin, high_y += margin;
    const auto widen = [](double& low, double& high, double least) {
        const double more = 0.5 * std::max(0.0, least - (high - low));
        low -= more, high += more;
    };
    widen(low_x, high_x, 0.6 * (high_y - low_y)), widen(low_y, high_y, 0.45 * (high_x - low_x));
    View v{low_x, low_y, high_x, high_y, std::min(900 / (high_x - low_x), 760 / (high_y - low_y)), 0, 0};
    v.width = int((high_x - low_x) * v.scale), v.height = int((high_y - low_y) * v.scale);
    return v;
}

/// 1 on level ground, less away from a sun in the north-west, 45 deg high.
double light_at(const MapPicture& m, const View& v, double x, double y)
{
    if (!m.ground) return 1;
    const double d = std::max(1.5 / v.scale, 0.25 * m.values.cell);
    const double dx = (m.ground(x + d, y) - m.ground(x - d, y)) / (2 * d), dy = (m.ground(x, y + d) - m.ground(x, y - d)) / (2 * d);
    if (std::isnan(dx) || std::isnan(dy)) return 1;
    const double toward = (1 + (dx - dy) * std::sqrt(0.5)) / std::sqrt(1 + dx * dx + dy * dy);
    return std::clamp(0.3 + 0.65 * toward, 0.3, 1.08); // slopes towards the sun keep their relief
}

struct Scale {
    double low = 0, high = 1;
    double share(double v) const { return (v - low) / (high - low); }
};
Scale scale_of(const MapPicture& m)
{
    Scale s{0, 0};
    for (const double v : m.values.values)
        if (!std::isnan(v)) s.low = std::min(s.low, v), s.high = std::max(s.high, v);
    if (!(s.high > s.low)) s.high = s.low + 1;
    const double most = round_up(std::max(s.high, -s.low) / 10) * 10;
    const Ticks marks = ticks(s.low, s.high, 5);
    s.high = std::min(most, std::ceil(s.high / marks.step - 1e-9) * marks.step);
    s.low = has_signs(m.kind) ? -s.high : std::floor(s.low / marks.step + 1e-9) * marks.step;
    return s;
}

void draw_cells(Canvas& canvas, const MapPicture& m, const View& v, const Scale& scale)
{
    const auto& g = m.values;
    for (int row = 0; row < v.height; ++row) {
        std::uint32_t* to = canvas.row(top + row) + left;
        for (int column = 0; column < v.width; ++column) {
            const double x = v.x(column), y = v.y(row), light = light_at(m, v, x, y);
            const int i = int(std::floor((x - g.x) / g.cell + 0.5)), j = int(std::floor((y - g.y) / g.cell + 0.5));
            const bool on = i >= 0 && j >= 0 && i < g.columns && j < g.rows && !std::isnan(g.at(i, j));
            const Rgb c = lit(on ? map_color(scale.share(g.at(i, j)), has_signs(m.kind)) : plain, on ? 0.7 + 0.3 * light : light);
            to[column] = 0xff000000u | std::uint32_t(c.r) << 16 | std::uint32_t(c.g) << 8 | c.b;
        }
    }
}

struct Pixel {
    double x, y;
};
/// visit(a, b) for each piece of the line on which the samples, linear between them, reach a level; in samples from the first.
template <class Visit> void for_each_piece(const scene::Grid& z, double level, Visit visit)
{
    constexpr int dx[5] = {0, 1, 1, 0, 0}, dy[5] = {0, 0, 1, 1, 0}; // around a cell
    for (int j = 0; j + 1 < z.rows; ++j)
        for (int i = 0; i + 1 < z.columns; ++i) {
            Pixel crossing[4];
            int n = 0;
            for (int s = 0; s < 4; ++s) {
                const double here = z.at(i + dx[s], j + dy[s]), there = z.at(i + dx[s + 1], j + dy[s + 1]);
                if ((here < level) == (there < level) || std::isnan(here + there)) continue;
                const double t = (level - here) / (there - here);
                crossing[n++] = {i + dx[s] + t * (dx[s + 1] - dx[s]), j + dy[s] + t * (dy[s + 1] - dy[s])};
            }
            for (int k = 0; k + 1 < n; k += 2) visit(crossing[k], crossing[k + 1]);
        }
}

/// Lines of equal height of the ground, every fifth with its number.
void draw_heights(Canvas& canvas, const MapPicture& m, const View& v)
{
    if (!m.ground) return;
    constexpr int pixels = 4; // a sample
    scene::Grid z{0, 0, 1, v.width / pixels + 1, v.height / pixels + 1, {}};
    z.values.resize(std::size_t(z.columns) * std::size_t(z.rows));
    double low = HUGE_VAL, high = -HUGE_VAL;
    z.for_each([&](int i, int j, std::size_t k) {
        const double h = z.values[k] = m.ground(v.x(i * pixels), v.y(j * pixels));
        if (h < low) low = h;
        if (h > high) high = h;
    });
    if (!(high > low)) return;
    const double step = round_up((high - low) / 20);
    for (auto level = std::int64_t(std::ceil(low / step)); double(level) * step < high; ++level) {
        const bool numbered = level % 5 == 0;
        Pixel label{};
        double nearest = HUGE_VAL; // of the line to the middle of the picture's left third
        for_each_piece(z, double(level) * step, [&](Pixel a, Pixel b) {
            const double x = left + pixels * a.x, y = top + pixels * a.y;
            canvas.line(x, y, left + pixels * b.x, top + pixels * b.y, numbered ? 1.3 : 0.7, height_line);
            const double far = std::hypot(x - left - 0.3 * v.width, y - top - 0.5 * v.height);
            if (x > left + 40 && y > top + 20 && y < top + v.height - 50 && far < nearest) nearest = far, label = {x, y};
        });
        if (!numbered || nearest == HUGE_VAL) continue;
        const auto text = fmt::format("{:g}", double(level) * step);
        canvas.rectangle(label.x - 4 * double(text.size()), label.y - 7, 8 * double(text.size()), 14, plain);
        canvas.text(label.x, label.y, 12, text, height_line, Anchor::Middle);
    }
}

void draw_outlines(Canvas& canvas, const MapPicture& m, const View& v)
{
    for (std::size_t k = 0; k < m.outlines.size(); ++k)
        for (const auto& area : m.outlines[k].areas)
            for (const auto& ring : area)
                for (std::size_t i = 0; i < ring.size(); ++i) {
                    const auto &a = ring[i], &b = ring[(i + 1) % ring.size()];
                    canvas.line(v.px(a[0]), v.py(a[1]), v.px(b[0]), v.py(b[1]), 1.8, outline_colors[k % outline_colors.size()]);
                }
}

void draw_points(Canvas& canvas, const MapPicture& m, const View& v)
{
    for (const auto& p : m.points) {
        if (p.x < v.low_x || p.x > v.high_x || p.y < v.low_y || p.y > v.high_y) continue;
        const double x = v.px(p.x), y = v.py(p.y), wide = Canvas::text_width(14, p.name);
        // Its name beside it, on the side where there is room.
        const bool after = x + 12 + wide < left + v.width;
        canvas.ring(x, y, 6, 2.5, {255, 255, 255});
        canvas.ring(x, y, 5, 2, ink);
        canvas.rectangle(after ? x + 9 : x - 13 - wide, y - 9, wide + 4, 18, plain);
        canvas.text(after ? x + 11 : x - 11, y, 14, p.name, ink, after ? Anchor::Left : Anchor::Right);
    }
}

/// Round coordinates with the digits that tell them apart.
std::string coordinate(double x, double step)
{
    return fmt::format("{:.{}f}", x + 0.0, std::clamp(int(std::ceil(-std::log10(step) - 1e-9)), 0, 6));
}

void draw_axes(Canvas& canvas, const View& v)
{
    const double low = left, high = left + v.width, floor = top + v.height;
    for (const auto& [x0, y0, x1, y1] : {std::array{low, double(top), high, double(top)},
                                         {high, double(top), high, floor},
                                         {high, floor, low, floor},
                                         {low, floor, low, double(top)}})
        canvas.line(x0, y0, x1, y1, 1.4, ink);
    const Ticks along_x = ticks(v.low_x, v.high_x, std::max(2.0, v.width / 130.0)),
                along_y = ticks(v.low_y, v.high_y, std::max(2.0, v.height / 90.0));
    for (const double x : along_x.at) {
        canvas.line(v.px(x), floor, v.px(x), floor + 6, 1.4, ink);
        canvas.text(v.px(x), floor + 20, 15, coordinate(x, along_x.step), ink, Anchor::Middle);
    }
    for (const double y : along_y.at) {
        canvas.line(left - 6, v.py(y), left, v.py(y), 1.4, ink);
        canvas.text(left - 10, v.py(y), 15, coordinate(y, along_y.step), ink, Anchor::Right);
    }
    canvas.text(left + 0.5 * v.width, floor + 48, 16, "x (east) [m]", ink, Anchor::Middle);
    canvas.text(22, top + 0.5 * v.height, 16, "y (north) [m]", ink, Anchor::Middle, 0, true);
}

void draw_scale_bar(Canvas& canvas, const View& v)
{
    // 1, 2 or 5 times a power of ten, about a fifth of the map.
    const double length = round_up(0.13 * v.width / v.scale), x = left + 18, y = top + v.height - 20;
    canvas.rectangle(x - 8, y - 24, length * v.scale + 16, 34, {255, 255, 255});
    canvas.rectangle(x, y - 3, 0.5 * length * v.scale, 6, ink);
    canvas.rectangle(x + 0.5 * length * v.scale, y - 3, 0.5 * length * v.scale, 6, {150, 150, 150});
    const bool kilometres = length >= 1000;
    canvas.text(x + 0.5 * length * v.scale, y - 14, 15,
                fmt::format("{:g} {}", kilometres ? length / 1000 : length, kilometres ? "km" : "m"), ink, Anchor::Middle);
}

void draw_north(Canvas& canvas, const View& v)
{
    const double x = left + v.width - 26, y = top + 16;
    canvas.rectangle(x - 16, y - 8, 32, 60, {255, 255, 255});
    canvas.triangle({{{x, y - 2}, {x - 9, y + 26}, {x, y + 19}}}, ink);
    canvas.triangle({{{x, y - 2}, {x + 9, y + 26}, {x, y + 19}}}, {150, 150, 150});
    canvas.text(x, y + 39, 17, "N", ink, Anchor::Middle);
}

void draw_legend(Canvas& canvas, const MapPicture& m, const View& v, const Scale& scale)
{
    const int x = left + v.width + 34, width = 24, height = std::clamp(v.height - 60 - 26 * int(m.outlines.size()), 100, 320), y = top + 30;
    canvas.text(x, top + 8, 16, fmt::format("[{}]", m.kind.unit), ink);
    canvas.rectangle(x - 1, y - 1, width + 2, height + 2, ink);
    for (int k = 0; k < height; ++k) canvas.rectangle(x, y + k, width, 1, map_color(1 - (k + 0.5) / height, has_signs(m.kind)));
    const Ticks marks = ticks(scale.low, scale.high, 6);
    for (const double t : marks.at) {
        const double at = y + height * (1 - scale.share(t));
        canvas.line(x + width, at, x + width + 6, at, 1.4, ink);
        canvas.text(x + width + 11, at, 15, marks.text(t), ink);
    }
    for (std::size_t k = 0; k < m.outlines.size(); ++k) {
        const double at = y + height + 30 + 26 * double(k);
        canvas.line(x, at, x + width, at, 2.4, outline_colors[k % outline_colors.size()]);
        const auto& o = m.outlines[k];
        canvas.text(x + width + 11, at, 15, o.label.empty() ? fmt::format("h_max {:g} m", o.limit) : o.label, ink, Anchor::Left,
                    right - 75);
    }
}

} // namespace

std::string map_png(const MapPicture& m)
{
    const View v = view_of(m);
    const Scale scale = scale_of(m);
    Canvas canvas(left + v.width + right, top + v.height + bottom);
    draw_cells(canvas, m, v, scale);
    draw_heights(canvas, m, v);
    draw_outlines(canvas, m, v);
    draw_points(canvas, m, v);
    draw_axes(canvas, v);
    draw_scale_bar(canvas, v);
    draw_north(canvas, v);
    draw_legend(canvas, m, v, scale);
    canvas.text(left, 34, 21, fmt::format("{}: {}", m.kind.title, m.title), ink, Anchor::Left, v.width + right - 20);
    const Palette colors = palette(has_signs(m.kind));
    return png(reduce(canvas, colors), colors);
}

} // namespace kuzure::io
