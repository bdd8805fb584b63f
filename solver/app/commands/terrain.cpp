// kuzure terrain: what an elevation model says of itself and is like.
#include "io/ground/relief.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/cli/help.hpp"
#include "solver/app/report/terrain_facts.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {
namespace {

struct Arguments {
    std::string file, crs, output;
    std::vector<double> window;
    bool json = false;
};

Exit describe_file(const Comm& comm, const Arguments& a)
{
    if (!a.output.empty() && io::Path(a.output).extension() != ".png")
        throw BadInput(fmt::format("-o: expected a name that ends in .png, found \"{}\"", a.output));
    io::on_root(comm, [&] {
        const TerrainFacts f = terrain_facts(a.file, a.crs, a.window);
        if (!a.output.empty()) io::write_atomically(a.output, io::hillshade(f.raster.grid, f.metres[0], f.metres[1]));
        for (const auto& w : f.warnings)
            if (!a.json) complain("warning: " + w);
        fmt::print("{}", a.json ? to_json(f).dump(2) + "\n" : to_text(f));
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
