#include "io/canvas.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <png.h>

namespace kuzure::io {
namespace {

// ---- the letters
// ----------------------------------------------------------------------------------------------------- Drawn
// with a round pen. A point is two hexadecimal digits x y; the base line is y = 3, small letters reach 9,
// capitals c. A stroke is straight from point to point; after '~' it is a smooth curve along them, after '@'
// a closed one. Order: ASCII 32 to 126.
constexpr const char* glyphs[95] = {
    "",                              // space
    "0c06 03",                       // !
    "0c0a 2c2a",                     // "
    "132c 435c 0666 0969",           // #
    "~6a6c0c0867630305 3e31",        // $
    "037c @0c3c3909 @46767343",      // %
    "~631a2d5b06025266",             // &
    "0c0a",                          // '
    "~2e0b0421",                     // (
    "~0e2b2401",                     // )
    "3b35 0a56 065a",                // *
    "0767 3a34",                     // +
    "2402",                          // ,
    "0747",                          // -
    "1314",                          // .
    "025d",                          // /
    "@0c6c696663030609",             // 0
    "1a3c33",                        // 1
    "~0a0c6c6803 0363",              // 2
    "~0b0c6c6838 ~3868630304",       // 3
    "535c0676",                      // 4
    "6c0c08 ~0869630304",            // 5
    "@08686303 ~5c0c0805",           // 6
    "0c6c23",                        // 7
    "@1c5c5818 @08686303",           // 8
    "@0c6c6707 ~6a676313",           // 9
    "13 19",                         // :
    "2402 29",                       // ;
    "590755",                        // <
    "0868 0565",                     // =
    "095705",                        // >
    "~0a0c6c683836 33",              // ?
    "~75530307090c9c9666566a2a2666", // @
    "033c63 1656",                   // A
    "0c03 ~0c6c6808 ~08787303",      // B
    "~6a6c0c0906036365",             // C
    "030c ~0c7c79767303",            // D
    "6c0c0363 0858",                 // E
    "6c0c03 0858",                   // F
    "~6a6c0c0906036367 6737",        // G
    "0c03 6c63 0868",                // H
    "0c03",                          // I
    "~5c5653030305",                 // J
    "0c03 6c06 2863",                // K
    "0c0363",                        // L
    "030c468c83",                    // M
    "030c737c",                      // N
    "@0c8c898683030609",             // O
    "030c ~0c7c7707",                // P
    "@0c8c898683030609 5682",        // Q
    "030c ~0c7c7707 3773",           // R
    "~6a6c0c0867630305",             // S
    "0c6c 3c33",                     // T
    "~0c060363666c",                 // U
    "0c336c",                        // V
    "0c234b638c",                    // W
    "0c63 6c03",                     // X
    "0c376c 3733",                   // Y
    "0c6c0363",                      // Z
    "2e0e0121",                      // [
    "0d52",                          // backslash
    "0e2e2101",                      // ]
    "0a2c4a",                        // ^
    "0262",                          // _
    "0c1a",                          // `
    "@09595303 5953",                // a
    "0c03 @09595303",                // b
    "~585909035354",                 // c
    "5c53 @09595303",                // d
    "0656 ~565909035354",            // e
    "~4c1c1913 0939",                // f
    "@09595303 ~5953500001",         // g
    "0c03 ~0609595653",              // h
    "0903 0c",                       // i
    "~2923200001 2c",                // j
    "0c03 4905 2643",                // k
    "0c03",                          // l
    "0903 ~0609494643 ~4649898683",  // m
    "0903 ~0609595653",              // n
    "@09595303",                     // o
    "0900 @09595303",                // p
    "5950 @09595303",                // q
    "0903 ~060949",                  // r
    "~5859090656530304",             // s
    "~1c151343 0939",                // t
    "~0906035356 5953",              // u
    "093359",                        // v
    "0923486389",                    // w
    "0953 5903",                     // x
    "0933 6920",                     // y
    "09590353",                      // z
    "~2e1d1a08 ~07151221",           // {
    "0e01",                          // |
    "~0e1d1a28 ~27151201",           // }
    "~0617486967",                   // ~
};
constexpr const char* unknown_glyph = "0c6c63030c";
constexpr double capital = 9, gap = 2.6, space_width = 4; // in units of the digits

struct Point {
    double x, y;
};
using Stroke = std::vector<Point>;

int digit(char c) { return c <= '9' ? c - '0' : c - 'a' + 10; }

/// Quadratic spline along the corners, by cutting them three times (Chaikin).
Stroke smooth(Stroke s, bool closed)
{
    for (int round = 0; round < 3; ++round) {
        Stroke finer;
        const std::size_t n = s.size();
        if (!closed) finer.push_back(s.front());
        for (std::size_t i = 0; i + (closed ? 0 : 1) < n; ++i) {
            const Point a = s[i], b = s[(i + 1) % n];
            finer.push_back({0.75 * a.x + 0.25 * b.x, 0.75 * a.y + 0.25 * b.y});
            finer.push_back({0.25 * a.x + 0.75 * b.x, 0.25 * a.y + 0.75 * b.y});
        }
        if (!closed) finer.push_back(s.back());
        s = std::move(finer);
    }
    if (closed) s.push_back(s.front());
    return s;
}

std::vector<Stroke> strokes_of(std::string_view glyph)
{
    std::vector<Stroke> all;
    for (std::size_t i = 0; i < glyph.size();) {
        const auto end = std::min(glyph.find(' ', i), glyph.size());
        const char kind = glyph[i];
        if (kind == '~' || kind == '@') ++i;
        Stroke s;
        for (; i + 1 < end; i += 2) s.push_back({double(digit(glyph[i])), double(digit(glyph[i + 1]) - 3)});
        if (kind == '~' || kind == '@') s = smooth(s, kind == '@');
        all.push_back(std::move(s));
        i = end + 1;
    }
    return all;
}

double advance(const char* glyph)
{
    double width = -1;
    for (const auto& s : strokes_of(glyph))
        for (const Point p : s) width = std::max(width, p.x);
    return (width < 0 ? space_width : width) + gap;
}

template <class F> void for_each_glyph(std::string_view text, F f)
{
    for (const char c : text) {
        const auto u = static_cast<unsigned char>(c);
        if ((u & 0xc0) == 0x80) continue; // the rest of a letter in several bytes
        f(u >= 32 && u < 127 ? glyphs[u - 32] : unknown_glyph);
    }
}

} // namespace

Canvas::Canvas(int width, int height, Rgb background)
    : width_(width), height_(height), pixels_(std::size_t(width) * std::size_t(height), background)
{
}

void Canvas::blend(int x, int y, double cover, Rgb c)
{
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    Rgb& p = at(x, y);
    const auto mixed = [&](std::uint8_t a, std::uint8_t b) { return std::uint8_t(std::lround(a + (b - a) * cover)); };
    p = {mixed(p.r, c.r), mixed(p.g, c.g), mixed(p.b, c.b)};
}

void Canvas::rectangle(int x, int y, int width, int height, Rgb c)
{
    for (int b = y; b < y + height; ++b)
        for (int a = x; a < x + width; ++a) blend(a, b, 1, c);
}

void Canvas::line(double x0, double y0, double x1, double y1, double thickness, Rgb c)
{
    const double reach = 0.5 * thickness + 1, dx = x1 - x0, dy = y1 - y0, l2 = dx * dx + dy * dy;
    for (int y = int(std::floor(std::min(y0, y1) - reach)); y <= std::max(y0, y1) + reach; ++y)
        for (int x = int(std::floor(std::min(x0, x1) - reach)); x <= std::max(x0, x1) + reach; ++x) {
            const double px = x + 0.5 - x0, py = y + 0.5 - y0;
            const double s = l2 > 0 ? std::clamp((px * dx + py * dy) / l2, 0.0, 1.0) : 0;
            const double cover = 0.5 * thickness + 0.5 - std::hypot(px - s * dx, py - s * dy);
            if (cover > 0) blend(x, y, std::min(cover, 1.0), c);
        }
}

double Canvas::text_width(double size, std::string_view text)
{
    double width = -gap;
    for_each_glyph(text, [&](const char* g) { width += advance(g); });
    return std::max(width, 0.0) * size / capital;
}

void Canvas::text(double x, double y, double size, std::string_view text, Rgb color, Anchor anchor)
{
    const double unit = size / capital, pen = std::max(0.13 * size, 1.2);
    if (anchor != Anchor::Left) x -= text_width(size, text) * (anchor == Anchor::Middle ? 0.5 : 1.0);
    for (const bool rim : {true, false}) {
        double at = x;
        for_each_glyph(text, [&](const char* g) {
            for (const auto& s : strokes_of(g))
                for (std::size_t i = 0; i == 0 || i + 1 < s.size(); ++i) {
                    const Point a = s[i], b = s[std::min(i + 1, s.size() - 1)];
                    line(at + unit * a.x, y - unit * a.y, at + unit * b.x, y - unit * b.y, rim ? pen + 3 : pen,
                         rim ? Rgb{255, 255, 255} : color);
                }
            at += unit * advance(g);
        });
    }
}

std::string Canvas::png() const
{
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = png_uint_32(width_);
    image.height = png_uint_32(height_);
    image.format = PNG_FORMAT_RGB;
    png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string out(bytes, '\0');
    if (!png_image_write_to_memory(&image, out.data(), &bytes, 0, pixels_.data(), 0, nullptr))
        throw IoFailed(fmt::format("making a PNG picture failed: {}", image.message));
    out.resize(bytes);
    return out;
}

} // namespace kuzure::io
