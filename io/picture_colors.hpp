#pragma once
// The colours of a picture: of values from the lowest to the highest, of walls, of ink.
#include "io/picture.hpp"

namespace kuzure::io {

inline constexpr Rgb wall_brown = {176, 141, 104}, ink = {38, 42, 48}, faint = {226, 228, 231}, broken_red = {222, 30, 38};
/// Steps between the lowest and the highest value.
inline constexpr int color_steps = 24;

/// color_steps colours of values in this range.
std::vector<Rgb> value_colors(Quantity::Map, const ColorRange&);
/// The colours of values, each under several lights; walls likewise; ink on white.
std::vector<Rgb> palette_colors(const std::vector<Rgb>& values);

} // namespace kuzure::io
