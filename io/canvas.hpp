#pragma once
// A picture to draw lines and write words on (Cairo and Pango), and its way into a small PNG file of at most 256 colours.
#include "io/file.hpp"
#include <array>
#include <memory>
#include <vector>

namespace kuzure::io {

struct Rgb {
    std::uint8_t r, g, b;
    bool operator==(const Rgb&) const = default;
};

/// Where a text is held.
enum class Anchor { Left, Middle, Right };

/// False where this program was built without Cairo and Pango: no canvas can be made then.
bool can_draw();

/// A part of a canvas, in pixels; y runs down.
struct Area {
    int x = 0, y = 0, width = 0, height = 0;
};

class Canvas {
public:
    /// Throws BadInput where can_draw() is false.
    Canvas(int width, int height, Rgb background = {255, 255, 255});
    int width() const { return width_; }
    int height() const { return height_; }
    Rgb at(int x, int y) const
    {
        const auto p = row(y)[x];
        return {std::uint8_t(p >> 16), std::uint8_t(p >> 8), std::uint8_t(p)};
    }
    /// A row's pixels, 0xffRRGGBB.
    std::uint32_t* row(int y) { return &pixels_[std::size_t(y) * std::size_t(width_)]; }
    const std::uint32_t* row(int y) const { return &pixels_[std::size_t(y) * std::size_t(width_)]; }

    /// Pixels; parts outside the canvas are clipped.
    void rectangle(double x, double y, double width, double height, Rgb);
    void line(double x0, double y0, double x1, double y1, double thickness, Rgb);
    void ring(double x, double y, double radius, double thickness, Rgb);
    void triangle(std::array<std::array<double, 2>, 3> corners, Rgb);
    /// One line of text in any script for which a font is here; its middle is at height y, `size` is the height of a letter's box. What
    /// is wider than `most` ends in an ellipsis (0: no limit). Upright: it runs upwards along x, held in y. Letters without a font show
    /// as boxes. A white rim keeps it legible on any ground. Any thread may call it.
    void text(double x, double y, double size, const std::string& text, Rgb, Anchor = Anchor::Left, double most = 0, bool upright = false);
    static double text_width(double size, const std::string& text);
    /// The letters of a text for which no font is here, each once; empty if all is well.
    static std::string letters_missing(const std::string& text);

private:
    int width_, height_;
    std::vector<std::uint32_t> pixels_;
};

/// Up to 256 colours, and which of them is next to any other.
class Palette {
public:
    explicit Palette(std::vector<Rgb> colors);
    const std::vector<Rgb>& colors() const { return colors_; }
    std::uint8_t nearest(std::uint32_t pixel) const { return nearest_[(pixel >> 9 & 0x7c00) | (pixel >> 6 & 0x3e0) | (pixel >> 3 & 0x1f)]; }

private:
    std::vector<Rgb> colors_;
    std::vector<std::uint8_t> nearest_; // by the upper five bits of red, green and blue
};

/// A canvas in the colours of a palette: a third of the bytes, and a PNG file in a quarter of the time.
struct Reduced {
    int width = 0, height = 0;
    std::vector<std::uint8_t> index;
    /// Take over what a canvas of the same size shows in an area.
    void take(const Canvas&, const Palette&, Area);
};
Reduced reduce(const Canvas&, const Palette&);

/// The bytes of a PNG file. Throws IoFailed.
std::string png(const Reduced&, const Palette&);

} // namespace kuzure::io
