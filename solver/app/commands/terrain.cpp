// kuzure terrain: what an elevation model says of itself and is like.
#include "io/ground/crs.hpp"
#include "io/ground/relief.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/cli/help.hpp"
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {
namespace {

struct Arguments {
    std::string file, crs, output;
    std::vector<double> window;
    bool json = false;
};

struct Facts {
    io::RasterInfo info;
    io::Raster raster;
    io::Relief relief;
    std::array<double, 2> metres;
    std::vector<std::string> warnings;
};

Facts facts_of(const Arguments& a)
{
    Facts f;
    f.info = io::raster_info(a.file);
    if (!a.crs.empty()) {
        const auto crs = io::crs_from(a.crs, "--crs");
        if (!f.info.crs.empty() && !io::same_crs(crs, f.info.crs))
            throw BadInput(fmt::format("--crs: the file says itself that it is in {}. Remedy: leave --crs out, or project the file: "
                                       "gdalwarp -t_srs {} in.tif out.tif",
                                       io::crs_name(f.info.crs), a.crs));
        f.info.crs = crs;
    }
    std::optional<io::Window> window;
    if (!a.window.empty()) {
        window = io::Window{a.window[0], a.window[1], a.window[2], a.window[3]};
        if (!(window->low_x < window->high_x && window->low_y < window->high_y))
            throw BadInput(fmt::format("--window: expected x and y from, then larger x and y to, found {:g} {:g} {:g} {:g}", a.window[0],
                                       a.window[1], a.window[2], a.window[3]));
    }
    f.raster = io::read_raster(a.file, window);
    if (f.raster.grid.values.empty()) {
        const auto e = f.info.extent();
        throw BadInput(fmt::format("--window: it meets no cell of {}, which lies at x {:.10g} to {:.10g}, y {:.10g} to {:.10g}", a.file,
                                   e.low_x, e.high_x, e.low_y, e.high_y));
    }
    f.metres = io::metres_of_cell(f.raster.grid, f.info.crs);
    f.relief = io::relief(f.raster.grid, f.metres[0], f.metres[1]);
    const auto& r = f.relief;
    if (f.info.crs.empty()) f.warnings.push_back("it names no system of coordinates: a scene needs terrain.crs");
    else if (io::is_geographic(f.info.crs)) {
        const auto e = f.info.extent();
        f.warnings.push_back(fmt::format("it is in degrees: a scene projects it to terrain.crs, for instance \"{}\"",
                                         io::utm_zone(0.5 * (e.low_x + e.high_x), 0.5 * (e.low_y + e.high_y))));
    }
    if (r.missing < r.cells && r.lowest == r.highest) f.warnings.push_back("all heights are the same");
    else if (r.whole_numbers) f.warnings.push_back("all heights are whole metres: slopes become stairs");
    if (r.lowest < -11000 || r.highest > 9000) f.warnings.push_back("some heights are on no place on Earth: are they meant as no data?");
    return f;
}

nlohmann::ordered_json to_json(const Arguments& a, const Facts& f)
{
    const auto& g = f.raster.grid;
    const auto e = io::extent_of(g);
    const auto& r = f.relief;
    const auto number = [](double x) { return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr); };
    nlohmann::ordered_json j;
    j["file"] = a.file, j["format"] = f.info.format, j["numbers"] = f.info.numbers;
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

std::string to_text(const Arguments& a, const Facts& f)
{
    const auto& g = f.raster.grid;
    const auto e = io::extent_of(g);
    const auto& r = f.relief;
    const bool degrees = !f.info.crs.empty() && io::is_geographic(f.info.crs);
    std::string out = fmt::format("{}: {}, {}\n", a.file, f.info.format, f.info.numbers);
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

Exit describe_file(const Comm& comm, const Arguments& a)
{
    if (!a.output.empty() && io::Path(a.output).extension() != ".png")
        throw BadInput(fmt::format("-o: expected a name that ends in .png, found \"{}\"", a.output));
    io::on_root(comm, [&] {
        const Facts f = facts_of(a);
        if (!a.output.empty()) io::write_atomically(a.output, io::hillshade(f.raster.grid, f.metres[0], f.metres[1]));
        for (const auto& w : f.warnings)
            if (!a.json) complain("warning: " + w);
        fmt::print("{}", a.json ? to_json(a, f).dump(2) + "\n" : to_text(a, f));
    });
    return Exit::Ok;
}

} // namespace

void add_terrain(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("terrain", "what an elevation model is: system, cells, heights, slopes, a picture");
    auto a = std::make_shared<Arguments>();
    command->add_option("FILE", a->file, "GeoTIFF, ESRI ASCII grid, or GSI's .xml or .zip")->required();
    command->add_option("--crs", a->crs, "its system of coordinates, as EPSG:6670, where the file names none")->type_name("EPSG:N");
    command->add_option("--window", a->window, "only this part of the map")->type_name("X Y X Y")->expected(4);
    command->add_option("-o,--output", a->output, "a picture of it, lit from the north-west (PNG)")->type_name("FILE");
    command->add_flag("--json", a->json, "as JSON");
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return describe_file(comm, *a); }; });
}

} // namespace kuzure
