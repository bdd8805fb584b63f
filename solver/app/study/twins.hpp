#pragma once
// Error bars on a run's answer: the same scene at two and four times the spacing, and what the three say together.
#include "io/file.hpp"
#include "solver/scene/scene.hpp"
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace kuzure::study {

/// Times the spacing, cheapest first.
inline constexpr int twin_factors[] = {4, 2};

/// A coarser twin of a scene.
struct Twin {
    int factor = 1;
    Scene scene;
    double soil_volume = 1;         // over that of the scene: 1 where its bodies hold whole spacings
    std::vector<std::string> notes; // what had to be changed, in words
};
/// The scene at `factor` times the spacing and, where it is fixed, the step: faces of boxes moved to the nearest whole spacing, walls at
/// least a support thick, periods whole. Not checked; `notes` gets what had to be changed, in words.
Scene with_spacing(const Scene&, double factor, std::vector<std::string>& notes);
/// The scene at `factor` times the spacing and, where it is fixed, the step: faces of boxes moved to the nearest whole spacing,
/// walls at least a support thick, periods whole. Throws BadInput where it cannot be filled.
Twin coarsened(const Scene&, int factor);

/// A twin's run: its directory under that of the run, and why it failed, or empty.
struct TwinRun {
    Twin twin;
    io::Path directory;
    std::string failed;
};
/// "error_bars" of summary.json: run-out at grain height, height and peak speed of the run in `directory`, with half-widths where
/// the three converge, and in words why not where they do not. `peak_speed` (m/s): the run's own, as far as its history does not
/// have it. Reads files, on this rank alone. Throws IoFailed.
nlohmann::ordered_json error_bars(const Scene&, const io::Path& directory, double peak_speed, const std::vector<TwinRun>&);
/// The same for the terminal, one line each.
std::vector<std::string> error_bar_lines(const nlohmann::ordered_json&);

} // namespace kuzure::study
