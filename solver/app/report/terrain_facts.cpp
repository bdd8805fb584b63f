#include "solver/app/report/terrain_facts.hpp"
#include "io/ground/crs.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {

TerrainFacts terrain_facts(const std::string& file, const std::string& crs, const std::vector<double>& corners)
{
    TerrainFacts f;
    f.file = file;
    f.info = io::raster_info(file);
    if (!crs.empty()) {
        const auto said = io::crs_from(crs, "--crs");
        if (!f.info.crs.empty() && !io::same_crs(said, f.info.crs))
            throw BadInput(fmt::format("--crs: the file says itself that it is in {}. Remedy: leave --crs out, or project the file: "
                                       "gdalwarp -t_srs {} in.tif out.tif",
                                       io::crs_name(f.info.crs), crs));
        f.info.crs = said;
    }
    std::optional<io::Window> window;
    if (!corners.empty()) {
        window = io::Window{corners[0], corners[1], corners[2], corners[3]};
        if (!(window->low_x < window->high_x && window->low_y < window->high_y))
            throw BadInput(fmt::format("--window: expected x and y from, then larger x and y to, found {:g} {:g} {:g} {:g}", corners[0],
                                       corners[1], corners[2], corners[3]));
    }
    f.raster = io::read_raster(file, window);
    if (f.raster.grid.values.empty()) {
        const auto e = f.info.extent();
        throw BadInput(fmt::format("--window: it meets no cell of {}, which lies at x {:.10g} to {:.10g}, y {:.10g} to {:.10g}", file,
                                   e.low_x, e.high_x, e.low_y, e.high_y));
    }
    const auto all = f.info.extent();
    const bool degrees = !f.info.crs.empty() && io::is_geographic(f.info.crs);
    const bool mistaken = degrees && (all.low_x < -360.01 || all.high_x > 360.01 || all.low_y < -90.01 || all.high_y > 90.01);
    f.metres = io::metres_of_cell(f.raster.grid, mistaken ? "" : f.info.crs);
    f.relief = io::relief(f.raster.grid, f.metres[0], f.metres[1]);
    const auto& r = f.relief;
    if (f.info.crs.empty()) f.warnings.push_back("it names no system of coordinates: a scene needs terrain.crs");
    else if (mistaken)
        f.warnings.push_back("it says it is in degrees, and lies where only metres can be: a scene refuses it. Remedy: its true system, "
                             "gdal_translate -a_srs EPSG:N in.tif out.tif");
    else if (degrees) {
        f.warnings.push_back(fmt::format("it is in degrees: a scene projects it to terrain.crs, for instance \"{}\"",
                                         io::utm_zone(0.5 * (all.low_x + all.high_x), 0.5 * (all.low_y + all.high_y))));
    }
    if (r.missing < r.cells && r.lowest == r.highest) f.warnings.push_back("all heights are the same");
    else if (r.whole_numbers) f.warnings.push_back("all heights are whole metres: slopes become stairs");
    if (r.lowest < -11000 || r.highest > 9000) f.warnings.push_back("some heights are on no place on Earth: are they meant as no data?");
    return f;
}

nlohmann::ordered_json to_json(const TerrainFacts& f)
{
    const auto& g = f.raster.grid;
    const auto e = io::extent_of(g);
    const auto& r = f.relief;
    const auto number = [](double x) { return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr); };
    nlohmann::ordered_json j;
    j["file"] = f.file, j["format"] = f.info.format, j["numbers"] = f.info.numbers;
    j["crs"] = f.info.crs.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(io::crs_name(f.info.crs));
    j["epsg"] =
        !f.info.crs.empty() && io::epsg_of(f.info.crs) ? nlohmann::ordered_json(io::epsg_of(f.info.crs)) : nlohmann::ordered_json(nullptr);
    j["columns"] = g.columns, j["rows"] = g.rows, j["cell"] = g.cell, j["cell_metres"] = {f.metres[0], f.metres[1]};
    j["extent"] = {e.low_x, e.low_y, e.high_x, e.high_y};
    j["nodata"] = f.info.nodata ? number(*f.info.nodata) : nlohmann::ordered_json(nullptr);
    j["nodata_share"] = double(r.missing) / double(r.cells);
    j["lowest"] = number(r.lowest), j["highest"] = number(r.highest), j["mean"] = number(r.mean);
    j["slope_class_degrees"] = io::Relief::slope_class, j["slope_cells"] = r.slopes;
    j["steepest"] = r.steepest, j["steepest_at"] = {r.steepest_x, r.steepest_y};
    j["warnings"] = f.warnings;
    return j;
}

std::string to_text(const TerrainFacts& f)
{
    const auto& g = f.raster.grid;
    const auto e = io::extent_of(g);
    const auto& r = f.relief;
    const bool degrees = f.metres[0] != g.cell;
    std::string out = fmt::format("{}: {}, {}\n", f.file, f.info.format, f.info.numbers);
    const auto row = [&](const char* name, const std::string& text) { out += fmt::format("  {:<12} {}\n", name, text); };
    row("system", f.info.crs.empty() ? "none named" : io::crs_name(f.info.crs));
    row("cells", fmt::format("{} x {} = {}", g.columns, g.rows, r.cells));
    row("cell",
        degrees ? fmt::format("{:.10g} degrees, {:.3g} x {:.3g} m", g.cell, f.metres[0], f.metres[1]) : fmt::format("{:.10g} m", g.cell));
    row("extent", fmt::format("x {:.10g} to {:.10g}, y {:.10g} to {:.10g}", e.low_x, e.high_x, e.low_y, e.high_y));
    row("no data", fmt::format("{:.3g} %{}", 100 * double(r.missing) / double(r.cells),
                               f.info.nodata ? fmt::format(" (marked by {:g})", *f.info.nodata) : ""));
    if (r.missing < r.cells) {
        row("heights", fmt::format("{:.2f} to {:.2f} m, mean {:.2f} m", r.lowest, r.highest, r.mean));
        const double all = double(std::max<std::size_t>(r.with_slope(), 1));
        row("slopes", fmt::format("up to {:.1f} degrees, at ({:.10g}, {:.10g})", r.steepest, r.steepest_x, r.steepest_y));
        for (std::size_t k = 0; k < r.slopes.size(); ++k)
            if (r.slopes[k] > 0)
                row("", fmt::format("{:>2.0f}-{:<2.0f} {:>6.2f} % {}", double(k) * io::Relief::slope_class,
                                    double(k + 1) * io::Relief::slope_class, 100 * double(r.slopes[k]) / all,
                                    std::string(std::size_t(std::lround(50 * double(r.slopes[k]) / all)), '#')));
    }
    return out;
}

} // namespace kuzure
