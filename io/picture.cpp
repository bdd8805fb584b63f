#include "io/picture.hpp"
#include "io/picture_balls.hpp"
#include "io/picture_colors.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <mutex>

namespace kuzure::io {
namespace {

constexpr float nothing = -1e30f;           // a depth further away than all
constexpr std::uint32_t striped = 1u << 31; // what a wall hides but for stripes: kept for its depth
constexpr std::uint32_t backing = 90;       // the light on what is behind walls' balls
constexpr double ball = 0.56;               // radius over spacing: a little larger than the lattice needs, so that no gaps show

} // namespace

Painter::Painter(const Stage& stage, const ColorRange& range, const Quantity& q, const std::string& title, double spacing,
                 std::span<const Vector> walls, bool flat)
    : stage_(stage), range_(range), spacing_(spacing), ground_(stage.width, stage.height)
{
    ensure(spacing > 0, "a picture needs the particles' spacing");
    ensure(range.high > range.low, "the range of a picture's colours is empty");
    colors_ = value_colors(q.map, range);
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

namespace {

struct OnScreen {
    double x, y; // samples
    float depth; // m
};

} // namespace

/// The samples of the walls, a band of rows at a time, so that those of one stay in the cache.
struct Painter::Band {
    static constexpr int rows = 48;
    std::vector<float> samples;
    std::vector<std::uint32_t> kept;
    explicit Band(int width) : samples(std::size_t(width) * std::size_t(fine * rows)), kept(samples.size()) {}

    /// A dark square behind a ball: seen along the lattice, balls leave gaps.
    void back(const OnScreen& p, double spacing, int half, int width, int top, int high)
    {
        const int x = int(p.x), y = int(std::floor(p.y - top));
        const auto behind = float(p.depth - 0.5 * spacing);
        for (int b = std::max(0, y - half); b < std::min(high, y + half); ++b)
            for (int a = std::max(0, x - half); a < std::min(width, x + half); ++a) {
                const auto at = std::size_t(b) * std::size_t(width) + std::size_t(a);
                if (behind > samples[at]) samples[at] = behind, kept[at] = backing;
            }
    }
};

/// What the pixels of walls are made of: light 0 .. 1, the share that is covered; and their depths (m) with a rim.
struct Painter::WallPixels {
    int stride;
    std::vector<float> depth, light, covered;
};

void Painter::draw_walls(std::span<const Vector> walls)
{
    const Camera& c = stage_.camera;
    const int pad = shadow_reach, stride = stage_.width + 2 * pad;
    const auto pixels = std::size_t(stage_.width) * std::size_t(stage_.height);
    wall_far_.assign(pixels, nothing), wall_open_.assign(pixels, 1);
    wall_near_.assign(pixels, nothing);
    std::vector<OnScreen> corners;
    for (const Vector& w : walls)
        if (stage_.frame.holds(w, 1e-6 * spacing_)) corners.push_back({fine * c.x(w), fine * c.y(w), float(c.depth(w))});
    if (corners.empty()) return;

    const std::vector<float> rim(std::size_t(stride) * std::size_t(stage_.height + 2 * pad), nothing), none(pixels, 0);
    WallPixels to{stride, rim, none, none};
    const int width = fine * stage_.width, half = int(std::ceil(0.5 * spacing_ * c.scale * fine));
    const bool backed = c.view != scene::View::Oblique;
    const int bands = (stage_.height + Band::rows - 1) / Band::rows;
#pragma omp parallel
    {
        Band band(width);
#pragma omp for schedule(dynamic, 1)
        for (int k = 0; k < bands; ++k) {
            const int first = k * Band::rows, top = fine * first, high = fine * std::min(Band::rows, stage_.height - first);
            std::fill(band.samples.begin(), band.samples.end(), nothing);
            for (const OnScreen& p : corners) {
                const double py = p.y - top;
                if (py < -stamps_->size || py > high + stamps_->size) continue;
                stamps_->put(band.samples.data(), band.kept.data(), width, high, p.x, py, p.depth, 0);
                if (backed) band.back(p, spacing_, half, width, top, high);
            }
            for (int y = 0; y < high / fine; ++y) take_wall_row(band, y, first + y, to);
        }
    }
    shade_walls(to);
}

/// Row `from` of a band's pixels becomes row `y` of the picture.
void Painter::take_wall_row(const Band& band, int from, int y, WallPixels& to)
{
    const int width = fine * stage_.width, pad = shadow_reach;
    const auto row = std::size_t(y) * std::size_t(stage_.width);
    nearest_of_row(&band.samples[std::size_t(fine * from) * std::size_t(width)], width, stage_.width, &wall_near_[row]);
    std::copy_n(&wall_near_[row], stage_.width, &to.depth[std::size_t(y + pad) * std::size_t(to.stride) + std::size_t(pad)]);
    for (int x = 0; x < stage_.width; ++x) {
        if (wall_near_[row + std::size_t(x)] == nothing) continue;
        float least = HUGE_VALF, lit = 0;
        int n = 0;
        for (int k = 0; k < fine * fine; ++k) {
            const auto at = std::size_t(fine * from + k / fine) * std::size_t(width) + std::size_t(fine * x + k % fine);
            least = std::min(least, band.samples[at]);
            if (band.samples[at] != nothing) lit += float(band.kept[at]), ++n;
        }
        wall_far_[row + std::size_t(x)] = least;
        to.light[row + std::size_t(x)] = lit * float(1 / (full_light * fine * fine));
        to.covered[row + std::size_t(x)] = float(n) / (fine * fine);
    }
}

void Painter::shade_walls(const WallPixels& from)
{
    const auto per_metre = float(1 / (3 * spacing_));
    const int pad = shadow_reach;
#pragma omp parallel for schedule(static)
    for (int y = 0; y < stage_.height; ++y) {
        const auto row = std::size_t(y) * std::size_t(stage_.width);
        open_row(&from.depth[std::size_t(y + pad) * std::size_t(from.stride) + std::size_t(pad)], from.stride, stage_.width, per_metre,
                 &wall_open_[row]);
        for (int x = 0; x < stage_.width; ++x) {
            const auto at = row + std::size_t(x);
            if (wall_near_[at] == nothing) {
                wall_open_[at] = 1;
                continue;
            }
            const Rgb under = ground_.at(x, y);
            const float wall = from.light[at] * wall_open_[at], through = 1 - from.covered[at];
            const float color[3] = {wall * wall_brown.r + through * under.r, wall * wall_brown.g + through * under.g,
                                    wall * wall_brown.b + through * under.b};
            std::uint32_t pixel = 0xff;
            for (const float v : color) pixel = pixel << 8 | std::uint32_t(std::min(v, 255.0f));
            ground_.row(y)[x] = pixel;
        }
    }
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

/// A part of the picture, in pixels.
struct Painter::Part {
    int x0, y0, width, height;
    int samples() const { return fine * width; }
    int stride() const { return width + 2 * shadow_reach; } // of depths with a rim
};

std::string Painter::draw(const Moment& moment) const
{
    ensure(moment.positions.size() == moment.values.size(), "a picture needs one value a position");
    const Camera& c = stage_.camera;

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
    scratch->canvas = ground_, scratch->picture = reduced_;
    if (low[0] <= high[0]) {
        const double spare = (stamps_->radius + 2) / fine + 1;
        const int x0 = std::clamp(int(low[0] - spare), 0, stage_.width), x1 = std::clamp(int(high[0] + spare) + 1, 0, stage_.width);
        const int y0 = std::clamp(int(low[1] - spare), 0, stage_.height), y1 = std::clamp(int(high[1] + spare) + 1, 0, stage_.height);
        const Part part{x0, y0, x1 - x0, y1 - y0};
        stamp(moment, part, *scratch);
        hide_behind_walls(part, *scratch);
        find_depths(part, *scratch);
        shade(part, *scratch);
        scratch->picture.take(scratch->canvas, *palette_, {x0, y0, part.width, part.height});
    }
    write_on(moment, outside, *scratch);
    return png(scratch->picture, *palette_);
}

/// The balls of the soil, into the samples of a part.
void Painter::stamp(const Moment& moment, const Part& part, Scratch& scratch) const
{
    const Camera& c = stage_.camera;
    const auto [x0, y0, width, height] = part;
    const int samples = part.samples();
    auto& [depth, near, kept] = scratch.samples;
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
}

/// What a wall hides: close to it, for good; a wall that stands well in front shows as stripes over what it hides.
void Painter::hide_behind_walls(const Part& part, Scratch& scratch) const
{
    const auto [x0, y0, width, height] = part;
    const int samples = part.samples();
    auto& [depth, near, kept] = scratch.samples;
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
}

/// Depth of the pixels, walls included, with a rim.
void Painter::find_depths(const Part& part, Scratch& scratch) const
{
    const auto [x0, y0, width, height] = part;
    const int samples = part.samples();
    auto& [depth, near, kept] = scratch.samples;
    const int pad = shadow_reach, stride = part.stride();
    near.assign(std::size_t(stride) * std::size_t(height + 2 * pad), nothing);
    for (int y = std::max(-pad, -y0); y < std::min(height + pad, stage_.height - y0); ++y) {
        const int a = std::max(-pad, -x0), b = std::min(width + pad, stage_.width - x0);
        const float* wall = &wall_near_[std::size_t(y0 + y) * std::size_t(stage_.width) + std::size_t(x0)];
        std::copy(wall + a, wall + b, &near[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad + a)]);
    }
    std::vector<float> soil(static_cast<std::size_t>(width));
    for (int y = 0; y < height; ++y) {
        float* to = &near[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad)];
        nearest_of_row(&depth[std::size_t(fine * y) * std::size_t(samples)], samples, width, soil.data());
        for (int x = 0; x < width; ++x) to[x] = soil[std::size_t(x)] != nothing ? soil[std::size_t(x)] : to[x];
    }
}

/// Colours and light of the pixels.
void Painter::shade(const Part& part, Scratch& scratch) const
{
    const auto [x0, y0, width, height] = part;
    const int samples = part.samples(), pad = shadow_reach, stride = part.stride();
    auto& [depth, near, kept] = scratch.samples;
    std::vector<float> soil(static_cast<std::size_t>(width)), open(soil.size());
    const auto per_metre = float(1 / (3 * spacing_));
    for (int y = 0; y < height; ++y) {
        const float* d = &near[std::size_t(y + pad) * std::size_t(stride) + std::size_t(pad)];
        open_row(d, stride, width, per_metre, open.data());
        nearest_of_row(&depth[std::size_t(fine * y) * std::size_t(samples)], samples, width, soil.data());
        std::uint32_t* row = scratch.canvas.row(y0 + y) + x0;
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
}

/// The time, what is outside, and the mark.
void Painter::write_on(const Moment& moment, std::size_t outside, Scratch& scratch) const
{
    const Camera& c = stage_.camera;
    Canvas& canvas = scratch.canvas;
    Reduced& picture = scratch.picture;
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
}

} // namespace kuzure::io
