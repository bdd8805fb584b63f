#pragma once
// A picture to write words and draw lines on, and its way into a PNG file.
#include "io/file.hpp"
#include <array>
#include <vector>

namespace kuzure::io {

struct Rgb {
    std::uint8_t r, g, b;
};

/// Where a text is held.
enum class Anchor { Left, Middle, Right };

class Canvas {
public:
    Canvas(int width, int height, Rgb background = {255, 255, 255});
    int width() const { return width_; }
    int height() const { return height_; }
    Rgb& at(int x, int y) { return pixels_[std::size_t(y) * std::size_t(width_) + std::size_t(x)]; }
    Rgb at(int x, int y) const { return pixels_[std::size_t(y) * std::size_t(width_) + std::size_t(x)]; }

    /// Pixels; y runs down. Parts outside the canvas are cut off.
    void rectangle(int x, int y, int width, int height, Rgb);
    void line(double x0, double y0, double x1, double y1, double thickness, Rgb);
    /// One line of text on the base line y; `size` is the height of a capital letter. Letters beyond ASCII
    /// show as boxes. A white rim keeps it legible on any ground.
    void text(double x, double y, double size, std::string_view, Rgb, Anchor = Anchor::Left);
    static double text_width(double size, std::string_view);

    /// The canvas as a PNG file's bytes. Throws IoFailed.
    std::string png() const;

private:
    void blend(int x, int y, double cover, Rgb);
    int width_, height_;
    std::vector<Rgb> pixels_;
};

} // namespace kuzure::io
