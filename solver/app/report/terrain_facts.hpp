#pragma once
// What an elevation model is: what its file says, what its heights are like, and what is doubtful about it.
#include "io/ground/raster.hpp"
#include "io/ground/relief.hpp"
#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace kuzure {

struct TerrainFacts {
    std::string file;
    io::RasterInfo info;
    io::Raster raster;
    io::Relief relief;
    std::array<double, 2> metres; // of a cell
    std::vector<std::string> warnings;
};

/// Of the whole file, or of a window (x and y from, x and y to). `crs`: its system where it names none, or empty. Throws BadInput.
TerrainFacts terrain_facts(const std::string& file, const std::string& crs, const std::vector<double>& window);
nlohmann::ordered_json to_json(const TerrainFacts&);
std::string to_text(const TerrainFacts&);

} // namespace kuzure
