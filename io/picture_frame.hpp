#pragma once
// What pictures of one run share, so that they can be compared: the box they show, the camera on it, the range of the colours, and
// the marks of axes. Plain geometry: nothing is drawn or read here.
#include "solver/core/tensor.hpp"
#include "solver/scene/scene.hpp"
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kuzure::io {

/// A box, m. Empty until something was added.
struct Extent {
    Vector low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    bool empty() const { return !(low.x <= high.x && low.y <= high.y && low.z <= high.z); }
    Vector size() const { return high - low; }
    bool holds(Vector p, double margin) const;
    bool operator==(const Extent&) const = default;
};
/// The smallest box around both.
Extent joined(const Extent&, const Extent&);

/// What one state shows, or (joined) a whole run.
struct Reach {
    Extent all;                                          // of the soil
    Extent core;                                         // without the outermost 1 % of it along each axis
    double least = HUGE_VAL, most = -HUGE_VAL;           // of the values that colour it
    double percent_1 = HUGE_VAL, percent_99 = -HUGE_VAL; // of them, of each state
};
/// Values and positions that are no numbers do not count.
Reach reach_of(std::span<const Vector> positions, std::span<const double> values);
Reach joined(const Reach&, const Reach&);

/// The box to show: where soil comes to in the run, and the walls around it as far as they belong to it. Grains that fly out of all
/// proportion (beyond 1 % of the soil, and twice as far as all others) stay outside.
Extent frame_of(const Reach&, const Extent& walls, int dimensions, double spacing);

/// Values between which colours differ, and whether there are others beyond.
struct ColorRange {
    double low = 0, high = 1;
    bool below = false, above = false;
    bool operator==(const ColorRange&) const = default;
};
/// From the least to the largest value of a run, out to the next mark of the scale; from 1 to 99 % where single grains stand far out. A
/// signed quantity has zero in the middle. `given`: that range, if it is not 0, 0.
ColorRange color_range(const Reach&, bool has_signs, std::array<double, 2> given);

/// 1, 2 or 5 times a power of ten, not below x > 0.
double round_up(double x);
/// The multiples of a round step in [low, high], about `count` of them, at least one step apart; their common text form.
struct Ticks {
    double step = 1;
    std::vector<double> at;
    std::string text(double v, double factor = 1) const;
};
Ticks ticks(double low, double high, double count);

/// Parallel projection: x right and y down in pixels, depth towards the eye in m.
struct Camera {
    scene::View view = scene::View::Oblique;
    Vector right, up, toward;
    double scale = 1, x0 = 0, y0 = 0; // pixels a metre, and where the origin is
    double x(Vector p) const { return x0 + scale * dot(right, p); }
    double y(Vector p) const { return y0 - scale * dot(up, p); }
    double depth(Vector p) const { return dot(toward, p); }
};
/// A picture's size, and where in it what is shown.
struct Stage {
    int width = 0, height = 0;                       // pixels, even: films want that
    double left = 0, top = 0, right = 0, bottom = 0; // of the frame, pixels
    Extent frame;
    Camera camera;
};
/// The frame as large as 1,600 x 900 pixels allow, with room for title, axes and colour bar; smaller where its shape needs less.
Stage stage_of(const Extent& frame, scene::View);

} // namespace kuzure::io
