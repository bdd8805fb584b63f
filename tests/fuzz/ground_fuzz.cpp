// Any bytes are a file of a map or a refusal in words. The first byte of the input chooses which:
//   0  outlines, 1  points in GeoJSON; 2  an ESRI ASCII grid with, after a zero byte, its .prj; 3  a GeoTIFF; 4  GSI's JPGIS;
//   5  outlines, 6  points of a shapefile: two bytes each for the lengths of .shp and .shx, then these and the .dbf.
#include "io/ground/raster.hpp"
#include "io/ground/vectors.hpp"
#include "solver/core/ensure.hpp"
#include "tests/fuzz/fuzz.hpp"
#include <cmath>

using namespace kuzure;
using namespace kuzure::fuzz;

namespace {

void inspect(const io::Outlines& o)
{
    if (o.features.empty()) found("outlines of nothing");
    for (const auto& f : o.features) {
        if (f.thickness && !(*f.thickness >= 0)) found("a thickness below zero");
        if (f.rings.empty()) found("an outline without rings");
        for (const auto& ring : f.rings) {
            if (ring.size() < 3) found("a ring that encloses nothing");
            for (const auto& p : ring)
                if (!std::isfinite(p[0]) || !std::isfinite(p[1])) found("a corner that is nowhere");
        }
        if (std::isnan(io::area(f.rings))) found("an area that is no number");
    }
}
void inspect(const io::NamedPoints& all)
{
    for (const auto& p : all.points)
        if (p.name.empty() || !std::isfinite(p.x) || !std::isfinite(p.y)) found("a point without a name or a place");
}
void inspect(const io::Raster& r)
{
    if (r.grid.values.size() != std::size_t(r.grid.columns) * std::size_t(r.grid.rows)) found("a raster of another size than it says");
    if (!(r.grid.cell > 0) || !std::isfinite(r.grid.x) || !std::isfinite(r.grid.y)) found("a raster that is nowhere");
    for (const double h : r.grid.values)
        if (std::isinf(h)) found("a height without bounds");
}

/// The length in the next two bytes, of what there is.
std::string_view counted(std::string_view& all, std::size_t length)
{
    const auto piece = all.substr(0, length);
    all.remove_prefix(piece.size());
    return piece;
}
io::Path shapefile(const io::Path& scratch, std::string_view all)
{
    std::size_t length[2] = {};
    for (auto& n : length)
        for (const char c : counted(all, 2)) n = 256 * n + static_cast<unsigned char>(c);
    write(scratch / "fuzz.shp", counted(all, length[0]));
    write(scratch / "fuzz.shx", counted(all, length[1]));
    write(scratch / "fuzz.dbf", all);
    return scratch / "fuzz.shp";
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    static const Scratch scratch;
    if (size == 0 || size > (1 << 20)) return 0;
    std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
    const auto file = [&](const char* name) {
        write(scratch.path / name, rest);
        return scratch.path / name;
    };
    try {
        switch (data[0] % 7) {
        case 0:
            inspect(io::read_outlines(file("fuzz.geojson")));
            break;
        case 1:
            inspect(io::read_points(file("fuzz.geojson")));
            break;
        case 2: {
            const auto grid = scratch.path / "grid.asc";
            write(grid, take(rest)), write(scratch.path / "grid.prj", rest);
            inspect(io::read_raster(grid));
            break;
        }
        case 3:
            inspect(io::read_raster(file("fuzz.tif"), io::Window{-10, -10, 1000, 1000}));
            break;
        case 4:
            inspect(io::read_raster(file("fuzz.xml")));
            break;
        case 5:
            inspect(io::read_outlines(shapefile(scratch.path, rest)));
            break;
        default:
            inspect(io::read_points(shapefile(scratch.path, rest)));
        }
    } catch (const BadInput& e) {
        judge_refusal(e.what());
    } catch (const IoFailed& e) {
        judge_refusal(e.what());
    }
    return 0;
}
