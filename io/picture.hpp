#pragma once
// A picture of the soil without any other program: shaded spheres in parallel projection, walls brown, a
// colour bar, a scale and the time. Every rank draws its own particles; the nearest one wins at each sample,
// so that the picture is the same for any number of ranks.
#include "io/file.hpp"
#include "io/wall_points.hpp"
#include "solver/core/particles.hpp"
#include "solver/scene/scene.hpp"
#include <optional>

namespace kuzure::io {

struct PictureLabel {
    scene::Picture look;
    int dimensions = 3; // 2: always seen from the side
    Vector low, high;   // m, box to frame: where the soil stands, over all ranks
    double spacing = 0; // m, diameter of a particle
    std::string title;
    double time = 0;                 // s
    double middle_y = 0;             // m, where View::Cut cuts
    int width = 1600, height = 900;  // pixels
    std::optional<Vector> mark = {}; // m, what a red ring is drawn around, if the picture shows it; the same on all ranks
};

/// The box around the soil of all ranks. Collective. A point at the origin where there is none.
struct Extent {
    Vector low, high; // m
};
Extent soil_extent(const Team&, const Particles&);

/// Collective; rank 0 writes a PNG file. Needs the columns of what colours it: origin, velocity or stress; a
/// plastic strain nobody carries is zero, a value that is no number red. What lies far outside the frame is left out.
/// Memory: 8 bytes x 4
/// samples x a tenth of the picture, on every rank. Throws IoFailed.
void write_picture(const Team&, const Place& file, const Particles&, const WallPoints&, const PictureLabel&);

} // namespace kuzure::io
