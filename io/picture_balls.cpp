#include "io/picture_balls.hpp"
#include <algorithm>
#include <cmath>

namespace kuzure::io {
namespace {

constexpr int lanes = 8;

template <int n> void cover(float* to, std::uint32_t* into, const float* h, const std::uint32_t* l, float z, std::uint32_t code)
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

float darkness(double blocked) { return float(std::exp(-1.1 * blocked)); }

const std::array<float, 257>& darkness_table()
{
    static const auto table = [] {
        std::array<float, 257> t{};
        for (int k = 0; k < 257; ++k) t[std::size_t(k)] = darkness(k / 256.0);
        return t;
    }();
    return table;
}

} // namespace

Painter::Stamps::Stamps(double r, double metres)
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

void Painter::Stamps::put(float* depth, std::uint32_t* kept, int width, int rows, double x, double y, float z, std::uint32_t code) const
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

void nearest_of_row(const float* samples, std::ptrdiff_t stride, int n, float* to)
{
    static_assert(fine == 2);
    for (int x = 0; x < n; ++x)
        to[x] = std::max(std::max(samples[2 * x], samples[2 * x + 1]), std::max(samples[stride + 2 * x], samples[stride + 2 * x + 1]));
}

} // namespace kuzure::io
