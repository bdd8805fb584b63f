#include "io/picture.hpp"
#include "io/canvas.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace kuzure::io {
namespace {

constexpr int fine = 2;               // samples per pixel along each axis
constexpr int shadow_reach = 8;       // samples over which nearer ground darkens
constexpr double floor_margin = 0.12; // of the soil's extent, shown around it

// ---- colours
// ---------------------------------------------------------------------------------------------------------
using Map = std::array<Rgb, 9>;
/// Light to dark blue: the further, the darker. Equal steps are equally far apart in CIELAB (10.1 +-0.2).
constexpr Map blues = {{{196, 222, 245},
                        {162, 202, 235},
                        {124, 182, 222},
                        {88, 159, 205},
                        {62, 138, 194},
                        {40, 116, 180},
                        {22, 93, 160},
                        {11, 70, 135},
                        {8, 48, 107}}};
/// Viridis (Smith and van der Walt 2015): equal steps look equal, also in grey.
constexpr Map viridis = {{{68, 1, 84},
                          {71, 45, 123},
                          {59, 82, 139},
                          {44, 114, 142},
                          {33, 145, 140},
                          {40, 174, 128},
                          {94, 201, 98},
                          {173, 220, 48},
                          {253, 231, 37}}};
constexpr Rgb wall_brown = {176, 141, 104}, ink = {38, 42, 48}, broken_red = {222, 30, 38};

/// Values that can be compared with others: of a state whose numbers failed, not all can.
bool usable(double v) { return std::isless(std::fabs(v), 1e100); } // quietly, of not-a-number too

Rgb pick(const Map& map, double t)
{
    const double s = std::clamp(t, 0.0, 1.0) * double(map.size() - 1);
    const auto k = std::min(std::size_t(s), map.size() - 2);
    const double f = s - double(k);
    const auto mixed = [&](std::uint8_t a, std::uint8_t b) { return std::uint8_t(std::lround(a + f * (b - a))); };
    return {mixed(map[k].r, map[k + 1].r), mixed(map[k].g, map[k + 1].g), mixed(map[k].b, map[k + 1].b)};
}

struct Quantity {
    const char* name;
    const char* unit;
    const Map& map;
};
Quantity quantity(scene::Color c)
{
    switch (c) {
    case scene::Color::Displacement:
        return {"displacement", "m", blues};
    case scene::Color::Speed:
        return {"speed", "m/s", viridis};
    case scene::Color::PlasticStrain:
        return {"plastic strain", "", viridis};
    case scene::Color::Pressure:
        return {"pressure", "Pa", viridis};
    }
    throw Broken("a picture colour without a quantity");
}

double value(const Particles& p, scene::Color c, Index i)
{
    switch (c) {
    case scene::Color::Displacement:
        return length(p[field::position][i] - p[field::origin][i]);
    case scene::Color::Speed:
        return length(p[field::velocity][i]);
    case scene::Color::PlasticStrain:
        return p.has(field::plastic_strain) ? p[field::plastic_strain][i] : 0;
    case scene::Color::Pressure:
        return trace(p[field::stress][i]) * (-1.0 / 3);
    }
    throw Broken("a picture colour without a quantity");
}

/// Least and largest value to tell apart, and whether larger ones exist.
struct Range {
    double low, high;
    bool below = false, above = false;
};

/// From the least to the largest value; where a few particles stand far out (less than 1 in 1000), up to the
/// others. A displacement counts from one spacing on: less is not worth a colour.
Range natural_range(const Team& team, const std::vector<double>& values, scene::Color color, double spacing)
{
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const double v : values)
        if (usable(v)) low = std::min(low, v), high = std::max(high, v);
    low = team.min(low), high = team.max(high);
    if (low > high) return {0, 1};
    const bool from_zero = color != scene::Color::Pressure;
    if (from_zero) low = std::min(low, 0.0);
    Range r{low, high};
    if (high - low > 0) {
        std::vector<std::int64_t> count(2048);
        const double bins = double(count.size()), bin = (high - low) / bins;
        for (const double v : values)
            if (usable(v)) ++count[std::min(std::size_t((v - low) / (high - low) * bins), count.size() - 1)];
        team.sum(std::span<std::int64_t>(count));
        std::int64_t all = 0, seen = 0;
        for (const auto c : count) all += c;
        const auto cut = [&](auto first, auto last) {
            seen = 0;
            auto at = first;
            while (at != last && (seen += *at) * 1000 < all) ++at;
            return at;
        };
        const double top = high - double(cut(count.rbegin(), count.rend()) - count.rbegin()) * bin;
        const double bottom = low + double(cut(count.begin(), count.end()) - count.begin()) * bin;
        if (top < low + 0.8 * (high - low)) r.high = top, r.above = true;
        if (!from_zero && bottom > low + 0.2 * (high - low)) r.low = bottom, r.below = true;
    } else {
        r.high = r.low + 1;
    }
    if (color == scene::Color::Displacement && (r.high < spacing || high == low)) r = {0, spacing, false, high > spacing};
    return r;
}

/// 1, 2 or 5 times a power of ten, not below x.
double round_up(double x)
{
    const double power = std::pow(10.0, std::floor(std::log10(x)));
    for (const double m : {1.0, 2.0, 5.0, 10.0})
        if (m * power >= x * (1 - 1e-9)) return m * power;
    return 10 * power;
}

std::string number(double v, double step)
{
    if (std::fabs(v) < 1e-9 * step) v = 0;
    const int digits = std::clamp(int(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
    if (step >= 1e5 || step < 1e-4) return fmt::format("{:.3g}", v);
    return fmt::format("{:.{}f}", v, digits);
}

// ---- projection
// ------------------------------------------------------------------------------------------------------
/// Looks along -toward; x right and y down in samples of the full picture, depth towards the eye in m.
struct Camera {
    Vector right, up, toward;
    double scale = 1, x0 = 0, y0 = 0;

    explicit Camera(scene::View view)
    {
        double azimuth = -90, elevation = 0; // deg, where the eye stands
        if (view == scene::View::Oblique) azimuth = -60, elevation = 24;
        if (view == scene::View::Top) elevation = 90; // Side and Cut: from the front
        const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
        right = {-std::sin(a), std::cos(a), 0};
        up = {-std::sin(e) * std::cos(a), -std::sin(e) * std::sin(a), std::cos(e)};
        toward = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
    }
    double x(Vector p) const { return x0 + scale * dot(right, p); }
    double y(Vector p) const { return y0 - scale * dot(up, p); }
    double depth(Vector p) const { return dot(toward, p); }

    /// Fit a box into a part of the picture (samples).
    void fit(const Extent& box, double left, double top, double width, double height)
    {
        double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
        for (int k = 0; k < 8; ++k) {
            const Vector corner{k & 1 ? box.high.x : box.low.x, k & 2 ? box.high.y : box.low.y, k & 4 ? box.high.z : box.low.z};
            const double at[2] = {dot(right, corner), dot(up, corner)};
            for (int c = 0; c < 2; ++c) lo[c] = std::min(lo[c], at[c]), hi[c] = std::max(hi[c], at[c]);
        }
        scale = std::min(width / (hi[0] - lo[0]), height / (hi[1] - lo[1]));
        x0 = left + 0.5 * width - scale * 0.5 * (lo[0] + hi[0]);
        y0 = top + 0.5 * height + scale * 0.5 * (lo[1] + hi[1]);
    }
};

struct Splat {
    float x, y, depth; // samples, samples, m
    Rgb color;
};

// ---- samples
// ---------------------------------------------------------------------------------------------------------
// A sample is one number: depth above, colour below. The larger is the nearer, so that the largest over the
// ranks is what the eye sees; equal depths are decided by colour, never by rank.
using Sample = std::int64_t;
constexpr Sample nothing = -1;

struct Depths {
    double low, per_metre;
    Sample pack(double depth, Rgb c) const
    {
        const auto d = Sample(std::clamp((depth - low) * per_metre, 0.0, 2147483647.0));
        return d << 24 | Sample(c.r) << 16 | Sample(c.g) << 8 | Sample(c.b);
    }
    double depth(Sample s) const { return low + double(s >> 24) / per_metre; }
    static Rgb color(Sample s) { return {std::uint8_t(s >> 16), std::uint8_t(s >> 8), std::uint8_t(s)}; }
};

/// Rows [first, first + rows) of the samples.
struct Strip {
    int width, first, rows;
    std::vector<Sample> sample;
    Sample& at(int x, int y) { return sample[std::size_t(y - first) * std::size_t(width) + std::size_t(x)]; }
    Sample at(int x, int y) const { return sample[std::size_t(y - first) * std::size_t(width) + std::size_t(x)]; }
    bool holds(int x, int y) const { return x >= 0 && x < width && y >= first && y < first + rows; }
};

/// Brightness of a ball over its disc, and how far its surface stands out, at a distance (dx, dy) of at
/// most 1.
struct Ball {
    double light, height;
};
Ball ball(double dx, double dy)
{
    const double nz = std::sqrt(std::max(0.0, 1 - dx * dx - dy * dy));
    const double diffuse = std::max(0.0, -0.42 * dx - 0.60 * dy + 0.68 * nz); // light from the upper left, behind the eye
    return {0.42 + 0.66 * diffuse, nz};
}

void draw(Strip& strip, const std::vector<Splat>& splats, double radius, double sphere, const Depths& depths)
{
    // Bands of rows belong to one thread each: no two write the same sample.
    const int bands = 8, rows = (strip.rows + bands - 1) / bands;
#pragma omp parallel for schedule(dynamic, 1)
    for (int band = 0; band < bands; ++band) {
        const int top = strip.first + band * rows, bottom = std::min(strip.first + strip.rows, top + rows);
        for (const Splat& s : splats) {
            if (s.y + radius < top || s.y - radius >= bottom || s.x + radius < 0 || s.x - radius >= strip.width) continue;
            const int y0 = std::max(top, int(std::floor(s.y - radius))), y1 = std::min(bottom - 1, int(s.y + radius));
            const int x0 = std::max(0, int(std::floor(s.x - radius))), x1 = std::min(strip.width - 1, int(s.x + radius));
            for (int y = y0; y <= y1; ++y)
                for (int x = x0; x <= x1; ++x) {
                    const double dx = (x + 0.5 - s.x) / radius, dy = (y + 0.5 - s.y) / radius;
                    if (dx * dx + dy * dy > 1) continue;
                    const Ball b = ball(dx, dy);
                    const auto shade = [&](std::uint8_t c) { return std::uint8_t(std::min(255.0, c * b.light)); };
                    const Rgb lit{shade(s.color.r), shade(s.color.g), shade(s.color.b)};
                    auto& sample = strip.at(x, y);
                    sample = std::max(sample, depths.pack(s.depth + sphere * b.height, lit));
                }
        }
    }
}

/// What stands nearer around a sample takes light from it (eye-dome lighting): outlines and hollows show.
double openness(const Strip& strip, int x, int y, const Depths& depths, double spacing)
{
    const double here = depths.depth(strip.at(x, y));
    double blocked = 0;
    for (const int reach : {2, shadow_reach})
        for (int k = 0; k < 8; ++k) {
            const int dx[] = {1, 1, 0, -1, -1, -1, 0, 1}, dy[] = {0, 1, 1, 1, 0, -1, -1, -1};
            const int a = x + reach * dx[k], b = y + reach * dy[k];
            if (!strip.holds(a, b) || strip.at(a, b) == nothing) continue;
            blocked += std::clamp((depths.depth(strip.at(a, b)) - here) / (3 * spacing) - 0.1, 0.0, 1.0) / 16;
        }
    return std::exp(-1.1 * blocked);
}

// ---- around the picture
// ----------------------------------------------------------------------------------------------
void color_bar(Canvas& canvas, const Quantity& q, const Range& range)
{
    const int width = 26, height = canvas.height() / 2, left = canvas.width() - 190, top = (canvas.height() - height) / 2 + 10;
    canvas.rectangle(left - 1, top - 1, width + 2, height + 2, ink);
    for (int y = 0; y < height; ++y) canvas.rectangle(left, top + y, width, 1, pick(q.map, 1 - (y + 0.5) / height));
    // Thousands and millions of a unit go into its name.
    const double largest = std::max(std::fabs(range.low), std::fabs(range.high));
    const bool scaled = std::string_view(q.unit) == "Pa";
    const int power = !scaled || largest < 1e4 ? 0 : largest < 1e7 ? 3 : 6;
    const std::string unit = *q.unit ? fmt::format(" [{}{}]", power == 3 ? "k" : power == 6 ? "M" : "", q.unit) : "";
    const double factor = std::pow(10.0, -power);
    canvas.text(left + 65, top - 28, 15, q.name + unit, ink, Anchor::Middle);
    const double step = round_up((range.high - range.low) / 7);
    for (double v = std::ceil(range.low / step - 1e-9) * step; v <= range.high + 1e-9 * step; v += step) {
        const double y = top + height * (1 - (v - range.low) / (range.high - range.low));
        canvas.line(left + width, y, left + width + 7, y, 1.5, ink);
        canvas.text(left + width + 14, y + 6.5, 13, number(v * factor, step * factor), ink);
    }
    if (range.above) canvas.text(left + width / 2.0, top - 7, 11, "^", ink, Anchor::Middle);
    if (range.below) canvas.text(left + width / 2.0, top + height + 16, 11, "v", ink, Anchor::Middle);
}

void scale_bar(Canvas& canvas, double pixels_per_metre)
{
    const double most = 0.2 * canvas.width() / pixels_per_metre;
    double metres = round_up(most);
    while (metres > most) metres = round_up(0.39 * metres); // 10 -> 5 -> 2 -> 1
    const double length = metres * pixels_per_metre, x = 60, y = canvas.height() - 42;
    canvas.line(x, y, x + length, y, 2.5, ink);
    for (const double end : {x, x + length}) canvas.line(end, y - 7, end, y + 7, 2.5, ink);
    canvas.text(x + 0.5 * length, y - 14, 15, metres < 0.01 ? fmt::format("{:g} mm", metres * 1000) : fmt::format("{:g} m", metres), ink,
                Anchor::Middle);
}

void ring(Canvas& canvas, double x, double y, double radius)
{
    const int sides = 48;
    const auto corner = [&](int k) {
        const double a = 2 * std::numbers::pi * k / sides;
        return std::pair{x + radius * std::cos(a), y + radius * std::sin(a)};
    };
    for (int k = 0; k < sides; ++k) {
        const auto [x0, y0] = corner(k);
        const auto [x1, y1] = corner(k + 1);
        canvas.line(x0, y0, x1, y1, 3, broken_red);
    }
}

std::string cut_to_width(std::string title, double size, double width)
{
    if (Canvas::text_width(size, title) <= width) return title;
    while (!title.empty() && Canvas::text_width(size, title + "...") > width) title.pop_back();
    return title + "...";
}

} // namespace

Extent soil_extent(const Team& team, const Particles& p)
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    const auto x = p[field::position];
    for (int c = 0; c < 3; ++c)
        for (Index i = 0; i < p.size(); ++i) {
            if (!std::isfinite(x.column[c][i])) continue;
            low[c] = std::min(low[c], x.column[c][i]);
            high[c] = std::max(high[c], x.column[c][i]);
        }
    team.min(std::span<double>(low));
    team.max(std::span<double>(high));
    if (!(low[0] <= high[0] && low[1] <= high[1] && low[2] <= high[2])) return {};
    return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

void write_picture(const Team& team, const Place& file, const Particles& p, const WallPoints& walls, const PictureLabel& label)
{
    ensure(label.spacing > 0, "a picture needs the particles' spacing");
    const bool flat = label.dimensions == 2;
    Camera camera(flat ? scene::View::Side : label.look.view);
    const bool cut = !flat && label.look.view == scene::View::Cut;
    const bool side = flat || cut || label.look.view == scene::View::Side;
    const Quantity q = quantity(label.look.color);
    const double d = label.spacing;

    // The soil, a margin of floor around it, and a little of the floor's thickness.
    const double margin = std::max({floor_margin * (label.high.x - label.low.x), floor_margin * (label.high.y - label.low.y), 4 * d});
    const Extent shown{{label.low.x - margin, flat ? -d : label.low.y - margin, label.low.z - 3.1 * d},
                       {label.high.x + margin, flat ? d : label.high.y + margin, label.high.z + std::max(margin, 4 * d)}};
    Extent framed = shown;
    framed.high.z = label.high.z + d;
    camera.fit(framed, fine * 60.0, fine * 90.0, fine * (label.width - 300.0), fine * (label.height - 190.0));

    // What each particle of this rank looks like.
    const auto n = p.size();
    const auto x = p[field::position];
    const auto in_slice = [&](double y) { return !cut || std::fabs(y - label.middle_y) <= d; };
    std::vector<Index> shown_soil;
    std::vector<double> values;
    for (Index i = 0; i < n; ++i)
        if (in_slice(x.column[1][i])) shown_soil.push_back(i), values.push_back(value(p, label.look.color, i));
    Range range = natural_range(team, values, label.look.color, d);
    if (const auto& fixed = label.look.range; fixed != std::array<double, 2>{})
        range = {fixed[0], fixed[1], range.low<fixed[0], range.high> fixed[1]};
    ensure(range.high > range.low, "the range of a picture's colours is empty");

    std::vector<Splat> splats;
    splats.reserve(shown_soil.size() + walls.size());
    const double around = std::max({shown.high.x - shown.low.x, shown.high.y - shown.low.y, shown.high.z - shown.low.z});
    const auto near = [&](double v, double low, double high) { return v > low - around && v < high + around; };
    const auto add = [&](Vector at, Rgb color) {
        if (flat) at.y = 0;
        if (near(at.x, shown.low.x, shown.high.x) && near(at.y, shown.low.y, shown.high.y) && near(at.z, shown.low.z, shown.high.z))
            splats.push_back({float(camera.x(at)), float(camera.y(at)), float(camera.depth(at)), color});
    };
    for (std::size_t k = 0; k < values.size(); ++k)
        add(x[shown_soil[k]], usable(values[k]) ? pick(q.map, (values[k] - range.low) / (range.high - range.low)) : broken_red);
    for (const Vector& w : walls.position) {
        bool seen = w.x > shown.low.x && w.x < shown.high.x && (flat || (w.y > shown.low.y && w.y < shown.high.y)) && w.z > shown.low.z &&
                    w.z < shown.high.z && in_slice(w.y);
        // A wall between the soil and the eye would hide what the picture is for.
        const bool above_floor = w.z > label.low.z - 0.25 * d;
        if (!flat && above_floor && w.y < label.low.y) seen = false;
        if (!flat && !side && above_floor && w.x > label.high.x) seen = false;
        // Nor may a high wall stand behind the title.
        if (seen && camera.y(w) > fine * 75.0) add(w, wall_brown);
    }
    double near_far[2] = {HUGE_VAL, HUGE_VAL}; // least depth, least of -depth
    for (const Splat& s : splats) {
        near_far[0] = std::min(near_far[0], double(s.depth));
        near_far[1] = std::min(near_far[1], -double(s.depth));
    }
    team.min(std::span<double>(near_far));
    if (near_far[0] > -near_far[1]) near_far[0] = near_far[1] = 0;
    const Depths depths{near_far[0], 2147483647.0 / (-near_far[1] - near_far[0] + d)};

    // A little larger than the lattice needs, so that no gaps show; never so small that samples are missed.
    const double radius = std::max(0.56 * d * camera.scale, 1.0);
    Canvas canvas(team.rank() == 0 ? label.width : 1, team.rank() == 0 ? label.height : 1);
    const int strip_rows = (label.height + 9) / 10;
    for (int top = 0; top < label.height; top += strip_rows) {
        const int bottom = std::min(label.height, top + strip_rows);
        // Reaches a little over its neighbours, for the shadows.
        Strip strip{fine * label.width, std::max(0, fine * top - shadow_reach), 0, {}};
        strip.rows = std::min(fine * label.height, fine * bottom + shadow_reach) - strip.first;
        strip.sample.assign(std::size_t(strip.width) * std::size_t(strip.rows), nothing);
        draw(strip, splats, radius, 0.56 * d, depths);
        team.max(std::span<std::int64_t>(strip.sample));
        if (team.rank() != 0) continue;
#pragma omp parallel for schedule(static)
        for (int y = top; y < bottom; ++y)
            for (int px = 0; px < label.width; ++px) {
                double sum[3] = {0, 0, 0};
                for (int k = 0; k < fine * fine; ++k) {
                    const int a = fine * px + k % fine, b = fine * y + k / fine;
                    const Sample s = strip.at(a, b);
                    const double light = s == nothing ? 1 : openness(strip, a, b, depths, d);
                    const Rgb c = s == nothing ? Rgb{255, 255, 255} : Depths::color(s);
                    sum[0] += light * c.r, sum[1] += light * c.g, sum[2] += light * c.b;
                }
                const auto mean = [](double v) { return std::uint8_t(std::lround(v / (fine * fine))); };
                canvas.at(px, y) = {mean(sum[0]), mean(sum[1]), mean(sum[2])};
            }
    }
    on_root(team, [&] {
        const std::string time = fmt::format("t = {:.3f} s", label.time);
        canvas.text(label.width - 60, 52, 20, time, ink, Anchor::Right);
        canvas.text(60, 52, 18, cut_to_width(label.title, 18, label.width - 200 - Canvas::text_width(20, time)), ink);
        if (label.mark) {
            const Vector at{label.mark->x, flat ? 0 : label.mark->y, label.mark->z};
            if (near(at.x, shown.low.x, shown.high.x) && near(at.y, shown.low.y, shown.high.y) && near(at.z, shown.low.z, shown.high.z))
                ring(canvas, camera.x(at) / fine, camera.y(at) / fine, std::max(1.7 * radius / fine, 14.0));
        }
        color_bar(canvas, q, range);
        scale_bar(canvas, camera.scale / fine);
        write_atomically(file, canvas.png());
    });
}

} // namespace kuzure::io
