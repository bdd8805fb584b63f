#pragma once
// All pictures of a run from its snapshots, with one camera and one range of colours: when the run ends, and whenever someone asks
// for other colours or another view.
#include "io/file.hpp"
#include "io/picture_frame.hpp"
#include <functional>

namespace kuzure::io {

/// DIR/picture_000012.png: the picture of snapshot 12 as [output] picture asks for it.
Place picture_file(const Place& results, int number);
/// The number in such a name; nothing for other files, also for pictures that were asked for afterwards.
std::optional<int> picture_number(const Path& file);

/// Collective. Removes the run's own pictures, to be drawn anew. Throws BadInput, and leaves them, where this program draws none; IoFailed.
void remove_pictures(const Team&, const Place& results);

struct PictureTask {
    Place results; // directory of the run; held: nothing is read or written through links
    std::string color = "displacement";
    scene::View view = scene::View::Oblique; // 2-D: always from the side
    std::array<double, 2> range{};           // of the colours; 0, 0: that of the run
    int dimensions = 3;
    double spacing = 0; // m
    std::string title;
    std::optional<double> at = {};              // s: only the snapshot next to it; infinite: the last
    std::function<Place(int number)> file = {}; // where a picture goes; absent: picture_file()
    bool tolerant = false;                      // a damaged snapshot is left out with a warning; otherwise it is an IoFailed
};
struct Drawn {
    std::vector<Path> files;
    std::vector<std::string> warnings; // rank 0
};

/// Collective: the ranks share the pictures, a rank's threads its pictures; the bytes are the same for any number of both. Memory: 16
/// bytes x 4 samples a pixel on ranks that draw, as much again a thread, and the soil of a snapshot. Throws BadInput where nothing is
/// drawn because of what was asked for, IoFailed.
Drawn draw_pictures(const Team&, const PictureTask&);

} // namespace kuzure::io
