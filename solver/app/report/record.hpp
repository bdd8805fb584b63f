#pragma once
// What a run left in its directory, as far as it can be read.
#include "io/file.hpp"
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace kuzure::report {

/// Columns of a table of rows by name; cells that are no numbers are NaN.
using Table = std::map<std::string, std::vector<double>>;
/// The table of a text: a line of names, a line of units, rows. Rows with other than a cell for each name, such as a torn last one, are
/// left out. Empty where the first line names more than 1000 columns.
Table read_table(const std::string& text);
/// A number that a figure or a sentence can hold: finite and at most 1e100 either way, else NaN.
double usable(double);

struct Record {
    io::Path directory;
    nlohmann::json summary = nlohmann::json::object(), timers = nlohmann::json::object(); // empty where missing or damaged
    Table history, progress;
    std::vector<std::vector<std::string>> events;      // cells of events.csv, without its first two lines
    std::vector<std::pair<std::string, Table>> forces; // of each wall that has a name
    std::vector<io::Path> pictures;                    // in order of time
    std::vector<double> picture_times;
    io::Path movie;                 // empty: none
    std::string scene, title;       // text of scene.toml
    std::optional<double> end_time; // s, of the scene
    bool flat = false;              // 2-D
    std::vector<std::string> gaps;  // what could not be read, in sentences

    double number(const char* key) const; // of the summary; NaN where absent
    std::string text(const char* key) const;
};

/// Throws BadInput where there is neither a scene nor a summary of a run; whatever else is missing or damaged is a gap.
Record read_record(const io::Path& directory);

} // namespace kuzure::report
