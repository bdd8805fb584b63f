#include "io/picture_colors.hpp"
#include <algorithm>
#include <cmath>

namespace kuzure::io {
namespace {

constexpr std::array lights{0.2, 0.32, 0.44, 0.56, 0.67, 0.78, 0.89, 1.0, 1.07}; // on each colour in the palette

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

} // namespace

std::vector<Rgb> value_colors(Quantity::Map wanted, const ColorRange& range)
{
    // Two directions from the middle of the bar mean nothing unless zero is there.
    const bool both = range.low < 0 && range.high > 0;
    const Map& map = map_of(wanted == Quantity::Map::Diverging && !both ? Quantity::Map::Viridis : wanted);
    std::vector<Rgb> colors;
    for (int k = 0; k < color_steps; ++k) colors.push_back(pick(map, k / double(color_steps - 1)));
    return colors;
}

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

} // namespace kuzure::io
