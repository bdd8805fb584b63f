#include "io/picture.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <mutex>

namespace kuzure::io {
namespace {

constexpr int fine = 2;                                                          // samples per pixel along each axis
constexpr int shadow_reach = 4;                                                  // pixels over which nearer ground darkens
constexpr float nothing = -1e30f;                                                // a depth further away than all
constexpr std::array lights{0.2, 0.32, 0.44, 0.56, 0.67, 0.78, 0.89, 1.0, 1.07}; // on each colour in the palette
constexpr double full_light = 200;                                               // of 255: what shows a colour as it is
constexpr std::uint32_t striped = 1u << 31;                                      // what a wall hides but for stripes: kept for its depth
constexpr std::uint32_t backing = 90;                                            // the light on what is behind walls' balls
constexpr double ball = 0.56; // radius over spacing: a little larger than the lattice needs, so that no gaps show

// ---- colours ---------------------------------------------------------------------------------------------------------------
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
/// Blue to red through white (ColorBrewer's RdBu), for quantities with signs.
constexpr Map diverging = {{{33, 102, 172},
                            {67, 147, 195},
                            {146, 197, 222},
                            {209, 229, 240},
                            {247, 247, 247},
                            {253, 219, 199},
                            {244, 165, 130},
                            {214, 96, 77},
                            {178, 24, 43}}};
constexpr Rgb wall_brown = {176, 141, 104}, ink = {38, 42, 48}, faint = {226, 228, 231}, broken_red = {222, 30, 38};
constexpr int color_steps = 24;

Rgb mixed(Rgb a, Rgb b, double f)
{
    const auto one = [&](std::uint8_t p, std::uint8_t q) { return std::uint8_t(std::lround(p + f * (q - p))); };
    return {one(a.r, b.r), one(a.g, b.g), one(a.b, b.b)};
}
Rgb pick(const Map& map, double t)
{
    const double s = std::clamp(t, 0.0, 1.0) * double(map.size() - 1);
    const auto k = std::min(std::size_t(s), map.size() - 2);
    return mixed(map[k], map[k + 1], s - double(k));
}
Rgb lit(Rgb c, double light)
{
    const auto one = [&](std::uint8_t v) { return std::uint8_t(std::min(255.0, v * light)); };
    return {one(c.r), one(c.g), one(c.b)};
}
const Map& map_of(Quantity::Map m) { return m == Quantity::Map::Blues ? blues : m == Quantity::Map::Viridis ? viridis : diverging; }

/// The colours of values, each under several lights; walls likewise; ink on white.
std::vector<Rgb> palette_colors(const std::vector<Rgb>& values)
{
    std::vector<Rgb> all;
    for (int k = 0; k < 14; ++k) all.push_back(mixed(ink, {255, 255, 255}, k / 13.0));
    all.push_back(faint);
    for (const double light : {0.4, 0.6, 0.8, 1.0}) all.push_back(lit(broken_red, light));
    for (int k = 0; k < 20; ++k) all.push_back(lit(wall_brown, 0.18 + 0.9 * k / 19));
    for (const Rgb c : values)
        for (const double light : lights) all.push_back(lit(c, light));
    return all;
}

float darkness(double blocked) { return float(std::exp(-1.1 * blocked)); }

} // namespace

/// Balls as discs of samples: how far the surface stands out (spacings' multiples in m), and its light. Drawn at sixteen places
/// within a sample where balls are small.
struct Painter::Stamps {
    int steps, size, middle;
    double radius; // samples
    std::vector<float> height;
    std::vector<std::uint32_t> light;

    Stamps(double r, double metres)
    {
        radius = std::max(r, 1.0); // never so small that samples are missed
        steps = radius < 10 ? 4 : 1;
        middle = int(std::ceil(radius));
        size = 2 * middle + 2;
        row = (size + lanes - 1) / lanes * lanes;
        height.assign(std::size_t(steps * steps * size * row), -HUGE_VALF);
        light.assign(height.size(), 0);
        for (int offset = 0; offset < steps * steps; ++offset)
            for (int y = 0; y < size; ++y)
                for (int x = 0; x < size; ++x) {
                    const double dx = (x + 0.5 - middle - (offset % steps + 0.5) / steps) / radius;
                    const double dy = (y + 0.5 - middle - (offset / steps + 0.5) / steps) / radius;
                    if (dx * dx + dy * dy > 1) continue;
                    const double nz = std::sqrt(std::max(0.0, 1 - dx * dx - dy * dy));
                    const double diffuse = std::max(0.0, -0.42 * dx - 0.60 * dy + 0.68 * nz); // light from the upper left, behind the eye
                    const auto at = std::size_t((offset * size + y) * row + x);
                    height[at] = float(metres * nz);
                    light[at] = std::uint32_t(std::lround(full_light * (0.42 + 0.66 * diffuse)));
                }
    }

    /// A ball with its middle at (x, y) samples; `code` above the light in what is kept. Of two equally near ones the larger code wins:
    /// the order in which they come makes no difference.
    void put(float* depth, std::uint32_t* kept, int width, int rows, double x, double y, float z, std::uint32_t code) const
    {
        const double fx = std::floor(x), fy = std::floor(y);
        const int offset = std::min(int((y - fy) * steps), steps - 1) * steps + std::min(int((x - fx) * steps), steps - 1);
        const int left = int(fx) - middle, top = int(fy) - middle;
        const int first = std::max(0, -top), last = std::min(size, rows - top), a = std::max(0, -left), b = std::min(row, width - left);
        const bool whole = a == 0 && b == row; // the usual case: whole registers
        for (int r = first; r < last; ++r) {
            const float* h = &height[std::size_t((offset * size + r) * row)];
            const std::uint32_t* l = &light[std::size_t((offset * size + r) * row)];
            const auto at = std::ptrdiff_t(top + r) * width + left;
            if (whole)
                for (int k = 0; k < row; k += lanes) cover<lanes>(depth + at + k, kept + at + k, h + k, l + k, z, code);
            else
                for (int k = a; k < b; ++k) cover<1>(depth + at + k, kept + at + k, h + k, l + k, z, code);
        }
    }

private:
    static constexpr int lanes = 8;
    int row; // of a stamp: whole registers
    template <int n> static void cover(float* to, std::uint32_t* into, const float* h, const std::uint32_t* l, float z, std::uint32_t code)
    {
#pragma omp simd
        for (int k = 0; k < n; ++k) {
            const float here = z + h[k];
            const std::uint32_t mine = code | l[k];
            const bool nearer = (here > to[k]) | ((here == to[k]) & (mine > into[k]));
            to[k] = nearer ? here : to[k];
            into[k] = nearer ? mine : into[k];
        }
    }
};

namespace {

const std::array<float, 257>& darkness_table()
{
    static const auto table = [] {
        std::array<float, 257> t{};
        for (int k = 0; k < 257; ++k) t[std::size_t(k)] = darkness(k / 256.0);
        return t;
    }();
    return table;
}

/// What stands nearer around a pixel takes light from it (eye-dome lighting): outlines and hollows show. The light left to the n pixels
/// of a row of depths that has shadow_reach pixels around it on all sides.
void open_row(const float* depth, std::ptrdiff_t stride, int n, float per_metre, float* left)
{
    std::fill(left, left + n, 0.0f);
    for (const int reach : {1, shadow_reach})
        for (const auto& [dx, dy] : {std::array{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) {
            const float* other = depth + reach * dx + reach * dy * stride;
#pragma omp simd
            for (int x = 0; x < n; ++x) {
                const float by = (other[x] - depth[x]) * per_metre - 0.1f;
                left[x] += by < 0 ? 0 : by > 1 ? 1 : by;
            }
        }
    const auto& dark = darkness_table();
    for (int x = 0; x < n; ++x) left[x] = dark[std::size_t(16 * left[x])]; // of sixteen neighbours
}

/// The nearest of the samples of each pixel of a row.
void nearest_of_row(const float* samples, std::ptrdiff_t stride, int n, float* to)
{
    static_assert(fine == 2);
    for (int x = 0; x < n; ++x)
        to[x] = std::max(std::max(samples[2 * x], samples[2 * x + 1]), std::max(samples[stride + 2 * x], samples[stride + 2 * x + 1]));
}

} // namespace

Painter::Painter(const Stage& stage, const ColorRange& range, const Quantity& q, const std::string& title, double spacing,
                 std::span<const Vector> walls, bool flat)
    : stage_(stage), range_(range), spacing_(spacing), ground_(stage.width, stage.height)
{
    ensure(spacing > 0, "a picture needs the particles' spacing");
    ensure(range.high > range.low, "the range of a picture's colours is empty");
    // Two directions from the middle of the bar mean nothing unless zero is there.
    const bool both = range.low < 0 && range.high > 0;
    const Map& map = map_of(q.map == Quantity::Map::Diverging && !both ? Quantity::Map::Viridis : q.map);
    for (int k = 0; k < color_steps; ++k) colors_.push_back(pick(map, k / double(color_steps - 1)));
    palette_ = std::make_unique<Palette>(palette_colors(colors_));
    colors_.push_back(broken_red);
    desks_ = std::make_shared<Desks>();
    stamps_ = std::make_shared<Stamps>(ball * spacing * stage.camera.scale * fine, ball * spacing);
    missing_ = Canvas::letters_missing(title + q.title);
    draw_axes(flat);
    draw_walls(walls);
    draw_color_bar(q);
    ground_.text(40, 38, 23, title, ink, Anchor::Left, stage.width - 300);
    reduced_ = reduce(ground_, *palette_);
}

void Painter::draw_walls(std::span<const Vector> walls)
{
    const Camera& c = stage_.camera;
    const int width = fine * stage_.width, pad = shadow_reach, stride = stage_.width + 2 * pad;
    const auto pixels = std::size_t(stage_.width) * std::size_t(stage_.height);
    wall_far_.assign(pixels, nothing), wall_open_.assign(pixels, 1);
    wall_near_.assign(pixels, nothing);
    // Seen along the lattice, balls leave gaps: behind each stands a dark square.
    const bool backed = c.view != scene::View::Oblique;
    const int half = int(std::ceil(0.5 * spacing_ * c.scale * fine));
    struct OnScreen {
        double x, y; // samples
        float depth; // m
    };
    std::vector<OnScreen> corners;
    for (const Vector& w : walls)
        if (stage_.frame.holds(w, 1e-6 * spacing_)) corners.push_back({fine * c.x(w), fine * c.y(w), float(c.depth(w))});
    if (corners.empty()) return;

    // Bands of rows, so that the samples of one stay in the cache.
    const int rows = 48, bands = (stage_.height + rows - 1) / rows;
    std::vector<float> depth(std::size_t(stride) * std::size_t(stage_.height + 2 * pad), nothing); // of the pixels, with a rim
    std::vector<float> light(pixels, 0), covered(pixels, 0);
#pragma omp parallel
    {
        std::vector<float> samples(std::size_t(width) * std::size_t(fine * rows));
        std::vector<std::uint32_t> kept(samples.size());
#pragma omp for schedule(dynamic, 1)
        for (int band = 0; band < bands; ++band) {
            const int top = fine * band * rows, high = fine * std::min(rows, stage_.height - band * rows);
            std::fill(samples.begin(), samples.end(), nothing);
            for (const OnScreen& p : corners) {
                const double py = p.y - top;
                if (py < -stamps_->size || py > high + stamps_->size) continue;
                stamps_->put(samples.data(), kept.data(), width, high, p.x, py, p.depth, 0);
                if (!backed) continue;
                const int x = int(p.x), y = int(std::floor(py));
                const auto behind = float(p.depth - 0.5 * spacing_);
                for (int b = std::max(0, y - half); b < std::min(high, y + half); ++b)
                    for (int a = std::max(0, x - half); a < std::min(width, x + half); ++a) {
                        const auto at = std::size_t(b) * std::size_t(width) + std::size_t(a);
                        if (behind > samples[at]) samples[at] = behind, kept[at] = backing;
                    }
            }
            for (int y = 0; y < high / fine; ++y) {
                const auto row = std::size_t(band * rows + y) * std::size_t(stage_.width);
                const float* from = &samples[std::size_t(fine * y) * std::size_t(width)];
                nearest_of_row(from, width, stage_.width, &wall_near_[row]);
                std::copy_n(&wall_near_[row], stage_.width,
                            &depth[std::size_t(band * rows + y + pad) * std::size_t(stride) + std::size_t(pad)]);
                for (int x = 0; x < stage_.width; ++x) {
                    if (wall_near_[row + std::size_t(x)] == nothing) continue;
                    float least = HUGE_VALF, lit = 0;
                    int n = 0;
                    for (int k = 0; k < fine * fine; ++k) {
                        const auto at = std::size_t(fine * y + k / fine) * std::size_t(width) + std::size_t(fine * x + k % fine);
                        least = std::min(least, samples[at]);
                        if (samples[at] != nothing) lit += float(kept[at]), ++n;
                    }
                    wall_far_[row + std::size_t(x)] = least;
                    light[row + std::size_t(x)] = lit * float(1 / (full_light * fine * fine));
                    covered[row + std::size_t(x)] = float(n) / (fine * fine);
                }
            }
        }
    }
    const auto per_metre = float(1 / (3 * spacing_));
#pragma omp parallel for schedule(static)
    for (int y = 0; y < stage_.height; ++y) {
        const auto row = std::size_t(y) * std::size_t(stage_.width);
        open_row(&depth[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad)], stride, stage_.width, per_metre, &wall_open_[row]);
        for (int x = 0; x < stage_.width; ++x) {
            const auto at = row + std::size_t(x);
            if (wall_near_[at] == nothing) {
                wall_open_[at] = 1;
                continue;
            }
            const Rgb under = ground_.at(x, y);
            const float wall = light[at] * wall_open_[at], rest = 1 - covered[at];
            const float color[3] = {wall * wall_brown.r + rest * under.r, wall * wall_brown.g + rest * under.g,
                                    wall * wall_brown.b + rest * under.b};
            std::uint32_t pixel = 0xff;
            for (const float v : color) pixel = pixel << 8 | std::uint32_t(std::min(v, 255.0f));
            ground_.row(y)[x] = pixel;
        }
    }
}

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

/// What one thread draws on. Kept from picture to picture: fresh memory costs more than drawing on it.
struct Painter::Scratch {
    struct Samples {
        std::vector<float> depth, near;
        std::vector<std::uint32_t> kept;
    } samples;
    Canvas canvas{1, 1};
    Reduced picture;
};
struct Painter::Desks {
    std::mutex mutex;
    std::vector<std::unique_ptr<Scratch>> free;
};

std::shared_ptr<Painter::Scratch> Painter::borrow() const
{
    const auto desks = desks_;
    std::unique_ptr<Scratch> one;
    {
        const std::lock_guard lock(desks->mutex);
        if (!desks->free.empty()) one = std::move(desks->free.back()), desks->free.pop_back();
    }
    if (!one) one = std::make_unique<Scratch>();
    return {one.release(), [desks](Scratch* s) {
                const std::lock_guard lock(desks->mutex);
                desks->free.emplace_back(s);
            }};
}

std::string Painter::draw(const Moment& moment) const
{
    ensure(moment.positions.size() == moment.values.size(), "a picture needs one value a position");
    const Camera& c = stage_.camera;
    const double reach = stamps_->radius + 2;

    // Where soil is in the picture: only there something has to be drawn.
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    std::size_t outside = 0;
    for (const Vector& p : moment.positions) {
        if (!stage_.frame.holds(p, spacing_)) {
            ++outside;
            continue;
        }
        const double x = c.x(p), y = c.y(p);
        low[0] = std::min(low[0], x), high[0] = std::max(high[0], x);
        low[1] = std::min(low[1], y), high[1] = std::max(high[1], y);
    }
    const auto scratch = borrow();
    Canvas& canvas = scratch->canvas;
    Reduced& picture = scratch->picture;
    canvas = ground_, picture = reduced_;
    if (low[0] <= high[0]) {
        const double spare = reach / fine + 1;
        const int x0 = std::clamp(int(low[0] - spare), 0, stage_.width), x1 = std::clamp(int(high[0] + spare) + 1, 0, stage_.width);
        const int y0 = std::clamp(int(low[1] - spare), 0, stage_.height), y1 = std::clamp(int(high[1] + spare) + 1, 0, stage_.height);
        const int width = x1 - x0, height = y1 - y0, samples = fine * width;
        auto& [depth, near, kept] = scratch->samples;
        depth.assign(std::size_t(samples) * std::size_t(fine * height), nothing);
        kept.resize(depth.size());
        const double per_step = color_steps / (range_.high - range_.low);
        for (std::size_t k = 0; k < moment.positions.size(); ++k) {
            const Vector& p = moment.positions[k];
            if (!stage_.frame.holds(p, spacing_)) continue;
            const double t = (moment.values[k] - range_.low) * per_step;
            const bool usable = std::isless(std::fabs(t), 1e100); // quietly, of not-a-number too
            const auto color = usable ? std::uint32_t(std::clamp(t, 0.0, color_steps - 1.0)) : std::uint32_t(color_steps);
            stamps_->put(depth.data(), kept.data(), samples, fine * height, fine * (c.x(p) - x0), fine * (c.y(p) - y0), float(c.depth(p)),
                         color << 8);
        }

        // What a wall hides: close to it, for good; a wall that stands well in front shows as stripes over what it hides.
        const auto close = float(2 * spacing_);
        for (int y = 0; y < fine * height; ++y) {
            float* d = &depth[std::size_t(y) * std::size_t(samples)];
            const int py = y0 + y / fine;
            std::uint32_t* codes = &kept[std::size_t(y) * std::size_t(samples)];
            const float* walls = &wall_far_[std::size_t(py) * std::size_t(stage_.width) + std::size_t(x0)];
            for (int x = 0; x < samples; ++x) {
                const float wall = walls[x / fine];
                if (d[x] == nothing || wall <= d[x]) continue;
                if (wall <= d[x] + close) d[x] = nothing;
                else if ((x0 + x / fine + py) % 6 < 2) codes[x] |= striped;
            }
        }

        // Depth of the pixels, walls included, with a rim.
        const int pad = shadow_reach, stride = width + 2 * pad;
        near.assign(std::size_t(stride) * std::size_t(height + 2 * pad), nothing);
        for (int y = std::max(-pad, -y0); y < std::min(height + pad, stage_.height - y0); ++y) {
            const int a = std::max(-pad, -x0), b = std::min(width + pad, stage_.width - x0);
            const float* wall = &wall_near_[std::size_t(y0 + y) * std::size_t(stage_.width) + std::size_t(x0)];
            std::copy(wall + a, wall + b, &near[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad + a)]);
        }
        std::vector<float> soil(static_cast<std::size_t>(width)), open(soil.size());
        for (int y = 0; y < height; ++y) {
            float* to = &near[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad)];
            nearest_of_row(&depth[std::size_t(fine * y) * std::size_t(samples)], samples, width, soil.data());
            for (int x = 0; x < width; ++x) to[x] = soil[std::size_t(x)] != nothing ? soil[std::size_t(x)] : to[x];
        }

        const auto per_metre = float(1 / (3 * spacing_));
        for (int y = 0; y < height; ++y) {
            const float* d = &near[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad)];
            open_row(d, stride, width, per_metre, open.data());
            nearest_of_row(&depth[std::size_t(fine * y) * std::size_t(samples)], samples, width, soil.data());
            std::uint32_t* row = canvas.row(y0 + y) + x0;
            const float* before = &wall_open_[std::size_t(y0 + y) * std::size_t(stage_.width) + std::size_t(x0)];
            for (int x = 0; x < width; ++x) {
                const bool any = soil[std::size_t(x)] != nothing;
                const float light = open[std::size_t(x)], ground = std::min(light / before[x], 1.0f);
                if (!any && (d[x] == nothing || ground > 0.995f)) continue;
                const std::uint32_t under = row[x];
                float sum[3] = {0, 0, 0};
                for (int k = 0; k < fine * fine; ++k) {
                    const auto at = std::size_t(fine * y + k / fine) * std::size_t(samples) + std::size_t(fine * x + k % fine);
                    const bool here = depth[at] != nothing && kept[at] < striped;
                    const float by = here ? light * float((kept[at] & 255) / full_light) : ground;
                    const Rgb color =
                        here ? colors_[kept[at] >> 8] : Rgb{std::uint8_t(under >> 16), std::uint8_t(under >> 8), std::uint8_t(under)};
                    sum[0] += by * color.r, sum[1] += by * color.g, sum[2] += by * color.b;
                }
                std::uint32_t pixel = 0xff;
                for (const float v : sum) pixel = pixel << 8 | std::uint32_t(std::min(v / (fine * fine), 255.0f));
                row[x] = pixel;
            }
        }
        picture.take(canvas, *palette_, {x0, y0, width, height});
    }

    const int right = stage_.width - 40;
    canvas.text(right, 38, 24, moment.time, ink, Anchor::Right);
    picture.take(canvas, *palette_, {right - 240, 14, 280, 48});
    if (outside > 0) {
        canvas.text(40, stage_.height - 16, 15, fmt::format("{} of {} particles are outside", outside, moment.positions.size()),
                    broken_red);
        picture.take(canvas, *palette_, {30, stage_.height - 30, 500, 30});
    }
    if (moment.mark && stage_.frame.holds(*moment.mark, spacing_)) {
        const double x = c.x(*moment.mark), y = c.y(*moment.mark), radius = std::max(1.7 * stamps_->radius / fine, 14.0);
        canvas.ring(x, y, radius, 3, broken_red);
        const int around = int(radius) + 4;
        picture.take(canvas, *palette_, {int(x) - around, int(y) - around, 2 * around, 2 * around});
    }
    return png(picture, *palette_);
}

} // namespace kuzure::io
