#pragma once
// A picture of the soil without any other program: shaded spheres in parallel projection, walls brown, axes, a colour bar and the time.
// A painter draws all pictures of a run: what does not change is drawn once.
#include "io/canvas.hpp"
#include "io/picture_frame.hpp"
#include <cstdint>

namespace kuzure::io {

/// What the colours mean.
struct Quantity {
    std::string title; // "plastic strain"
    std::string unit;  // as in files: "1" has none
    enum class Map { Blues, Viridis, Diverging } map = Map::Viridis;
};

/// One state of the soil.
struct Moment {
    std::span<const Vector> positions; // m
    std::span<const double> values;    // one a position
    std::string time;                  // as it is written
    std::optional<Vector> mark = {};   // m, what a red ring is drawn around, if it is in the frame
};

class Painter {
public:
    /// Walls: one point each, m, those to be shown. Throws BadInput where can_draw() is false.
    Painter(const Stage&, const ColorRange&, const Quantity&, const std::string& title, double spacing, std::span<const Vector> walls,
            bool flat);
    /// The bytes of a PNG file. A value that is no number shows red; what lies outside the frame is left out and counted in words. The
    /// order of the positions makes no difference. Any number of threads may draw at the same time. Throws IoFailed.
    std::string draw(const Moment&) const;
    /// Letters of the title for which no font is here; empty if all is well.
    const std::string& missing() const { return missing_; }

private:
    struct Stamps; // discs of a ball, at fractions of a sample
    struct Scratch;
    struct Desks;
    struct Band;
    struct WallPixels;
    struct Part;
    std::shared_ptr<Scratch> borrow() const;
    void draw_walls(std::span<const Vector> walls);
    void take_wall_row(const Band&, int from, int y, WallPixels& to);
    void shade_walls(const WallPixels&);
    void stamp(const Moment&, const Part&, Scratch&) const;
    void hide_behind_walls(const Part&, Scratch&) const;
    void find_depths(const Part&, Scratch&) const;
    void shade(const Part&, Scratch&) const;
    void write_on(const Moment&, std::size_t outside, Scratch&) const;
    void draw_axes(bool flat);
    void draw_color_bar(const Quantity&);

    Stage stage_;
    ColorRange range_;
    double spacing_;
    std::string missing_;
    std::vector<Rgb> colors_; // of the values, from the lowest
    std::shared_ptr<const Stamps> stamps_;
    std::shared_ptr<Desks> desks_;            // for the threads that draw
    std::vector<float> wall_near_, wall_far_; // of the pixels' samples, m towards the eye; very low where one has no wall
    std::vector<float> wall_open_;            // of the pixels: the light that other walls leave them
    Canvas ground_;                           // all that does not change
    std::unique_ptr<const Palette> palette_;
    Reduced reduced_; // ground_
};

} // namespace kuzure::io
