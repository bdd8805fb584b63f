#pragma once
// A scene's real ground: elevation models and releases become grids in local metres, walls and bodies of the scene.
#include "io/ground/raster.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::io {

/// Elevation models as one grid in a projected system. Later files fill what earlier ones leave open; geographic ones are projected onto a
/// north-up grid (bilinear) whose cell is their own size in metres, to one digit, with edges at its multiples.
class Mosaic {
public:
    /// Reads what the files say of themselves. `crs`: WKT of the map, empty: that of the files. Throws BadInput.
    Mosaic(std::vector<Path> files, std::string crs);
    const std::string& crs() const { return crs_; }
    double cell() const { return cell_; }
    /// Of all files.
    Window extent() const { return extent_; }
    /// The cells of the files that meet a window, map coordinates. Throws BadInput where there are none.
    scene::Grid read(const std::optional<Window>&) const;

private:
    std::vector<Path> files_;
    std::vector<RasterInfo> infos_;
    std::string crs_;
    double cell_ = 0;
    Window extent_;
};

/// A raster's values at the points of a grid in another part of the map or another system: its own where the grids coincide, else
/// bilinear, of means of its cells where those are much smaller; NaN where it has none. Both without a system lie where they say.
std::vector<double> onto(const Path&, const scene::Grid& target, const std::string& crs);

/// The system of a file that names none, or its own; throws BadInput where neither is there, or where it is another one than the map's.
std::string crs_for(const std::string& own, const std::string& map, const std::string& file);

/// Fills what [terrain] and releases name: scene.map_frame, of every release bed, rings and thicknesses, and a wall that is the ground with
/// the beds in it. Gives what is doubtful; errors come alone. Same files, same bits.
scene::Issues load_ground(Scene&);

/// 16 hexadecimal digits of a grid's position and values.
std::string digest(const scene::Grid&);

} // namespace kuzure::io
