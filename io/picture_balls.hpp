#pragma once
// How particles become balls in a picture: discs of samples with the height and light of a ball, and the light that what stands nearer
// leaves to each pixel.
#include "io/picture.hpp"

namespace kuzure::io {

inline constexpr int fine = 2;            // samples per pixel along each axis
inline constexpr int shadow_reach = 4;    // pixels over which nearer ground darkens
inline constexpr double full_light = 200; // of 255: what shows a colour as it is

/// Balls as discs of samples: how far the surface stands out (spacings' multiples in m), and its light. Drawn at sixteen offsets
/// within a sample where balls are small.
struct Painter::Stamps {
    int steps, size, middle;
    double radius; // samples
    std::vector<float> height;
    std::vector<std::uint32_t> light;

    /// Of a radius in samples and in m.
    Stamps(double r, double metres);
    /// A ball with its middle at (x, y) samples; `code` above the light in what is kept. Of two equally near ones the larger code wins:
    /// the order in which they come makes no difference.
    void put(float* depth, std::uint32_t* kept, int width, int rows, double x, double y, float z, std::uint32_t code) const;

private:
    int row; // of a stamp: whole registers
};

/// What stands nearer around a pixel takes light from it (eye-dome lighting): outlines and hollows show. The light left to the n pixels
/// of a row of depths that has shadow_reach pixels around it on all sides.
void open_row(const float* depth, std::ptrdiff_t stride, int n, float per_metre, float* left);
/// The nearest of the samples of each pixel of a row.
void nearest_of_row(const float* samples, std::ptrdiff_t stride, int n, float* to);

} // namespace kuzure::io
