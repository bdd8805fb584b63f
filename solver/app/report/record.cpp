#include "solver/app/report/record.hpp"
#include "io/json.hpp"
#include "io/picture_series.hpp"
#include "io/scene_file.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::report {

double usable(double x) { return std::fabs(x) <= 1e100 ? x : std::nan(""); }

Table read_table(const std::string& text)
{
    const std::size_t most_columns = 1000;
    Table t;
    std::vector<std::vector<double>*> columns;
    std::vector<double> row;
    std::size_t at = 0;
    for (int line = 0; at < text.size(); ++line) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view cells(text.data() + at, end - at);
        at = end + 1;
        if (line == 1) continue; // units
        const auto count = std::size_t(std::count(cells.begin(), cells.end(), ',')) + 1;
        if (line == 0 ? count > most_columns : count != columns.size()) {
            if (line == 0) return {};
            continue;
        }
        row.clear();
        for (std::size_t from = 0; from <= cells.size();) {
            const std::size_t to = std::min(cells.find(',', from), cells.size());
            const auto cell = cells.substr(from, to - from);
            if (line == 0) columns.push_back(&t[std::string(cell)]); // two of one name are one column, which no name finds twice
            else {
                double v = 0;
                const bool read = std::from_chars(cell.data(), cell.data() + cell.size(), v).ec == std::errc{};
                row.push_back(read ? usable(v) : std::nan(""));
            }
            from = to + 1;
        }
        if (line == 0 && t.size() != columns.size()) return {};
        for (std::size_t k = 0; k < row.size(); ++k) columns[k]->push_back(row[k]);
    }
    return t;
}

namespace {

constexpr std::uint64_t MiB = std::uint64_t(1) << 20;

} // namespace

double Record::number(const char* key) const
{
    return summary.contains(key) && summary[key].is_number() ? usable(summary[key].get<double>()) : std::nan("");
}
std::string Record::text(const char* key) const
{
    return summary.contains(key) && summary[key].is_string() ? summary[key].get<std::string>() : std::string();
}

namespace {

/// Reads what there is of a directory, and tells what is missing. Held: nothing is read through links, which in a directory of another
/// user may lead to any file of this one.
class Reader {
public:
    Reader(const io::Path& directory, std::vector<std::string>& gaps) : gaps_(gaps)
    {
        try {
            held_ = io::hold(directory);
        } catch (const IoFailed&) { // not there, or no directory: said later
        }
    }
    bool there(const char* name) const
    {
        try {
            return held_.held() && io::exists(place(name));
        } catch (const IoFailed&) {
            return false;
        }
    }
    std::string text(const char* name, const char* meaning, std::uint64_t most = 16 * MiB)
    {
        try {
            if (there(name)) return io::read_text(place(name), most);
            gaps_.push_back(fmt::format("{} is missing: {}.", name, meaning));
        } catch (const IoFailed& e) {
            gaps_.push_back(e.what());
        }
        return {};
    }
    nlohmann::json object(const char* name, const char* meaning)
    {
        const std::string t = text(name, meaning);
        auto j = io::parse_json(t, false);
        if (j.is_object()) return j;
        if (!t.empty()) gaps_.push_back(fmt::format("{} is damaged: {}.", name, meaning));
        return nlohmann::json::object();
    }

private:
    io::Place place(const std::string& name) const
    {
        const auto slash = name.find('/');
        return slash == name.npos ? held_ / name : io::hold(held_ / name.substr(0, slash)) / name.substr(slash + 1);
    }
    io::Place held_;
    std::vector<std::string>& gaps_;
};

void read_scene(Record& r)
{
    try {
        const Scene s = io::parse_scene(r.scene, "scene.toml", {}, scene::StepLimit::Force);
        if (!s.title.empty()) r.title = s.title;
        r.end_time = s.time.end;
        r.flat = s.dimensions == 2;
    } catch (const BadInput&) {
        r.gaps.push_back("scene.toml is not a scene of this version of kuzure.");
    }
}

/// Calls visit(line, cells) for the rows of a table of text that have a cell for each name; rows without end are not there.
template <class Visit> void for_each_row(std::string_view text, Visit visit)
{
    std::size_t names = 0;
    for (int line = 0; !text.empty(); ++line) {
        const std::size_t end = text.find('\n');
        if (end == text.npos) return;
        std::vector<std::string> cells(1);
        const std::string_view row = text.substr(0, end);
        for (const char c : row)
            if (c == ',') cells.emplace_back();
            else cells.back() += c;
        text.remove_prefix(end + 1);
        if (line == 0) names = cells.size();
        else if (line > 1 && cells.size() == names) visit(row, cells);
    }
}

void read_stages(Record& r, Reader& from)
{
    constexpr std::size_t most_walls = 100;
    if (from.there("events.csv"))
        for_each_row(from.text("events.csv", "what happened is unknown"),
                     [&](std::string_view, const auto& cells) { r.events.push_back(cells); });
    if (!from.there("forces.csv")) return;
    const std::string text = from.text("forces.csv", "no forces on walls", 128 * MiB);
    std::map<std::string, std::string> rows; // by wall
    std::vector<std::string> order;
    for_each_row(text, [&](std::string_view row, const auto& cells) {
        if (cells.size() < 3) return;
        const auto found = rows.find(cells[1]);
        if (found == rows.end() && rows.size() == most_walls) return;
        if (found == rows.end()) order.push_back(cells[1]);
        rows[cells[1]].append(row) += '\n';
    });
    const std::size_t head = text.find('\n');
    for (const auto& wall : order) r.forces.emplace_back(wall, read_table(text.substr(0, head) + "\n#\n" + rows[wall]));
}

void find_pictures(Record& r, Reader& from)
{
    std::error_code error;
    for (const auto& e : std::filesystem::directory_iterator(r.directory, error)) {
        if (io::picture_number(e.path()) && !e.is_symlink(error) && e.file_size(error) > 0) r.pictures.push_back(e.path());
    }
    std::sort(r.pictures.begin(), r.pictures.end());
    // Pictures carry the number of their snapshot, whose time the series tells.
    std::map<std::string, double> times;
    if (from.there("snapshots/state.hdf.series")) {
        const auto series = io::parse_json(from.text("snapshots/state.hdf.series", "times of pictures are unknown"), false);
        if (series.is_object() && series.contains("files") && series["files"].is_array())
            for (const auto& file : series["files"])
                if (file.is_object() && file.contains("name") && file["name"].is_string() && file.contains("time") &&
                    file["time"].is_number())
                    times[file["name"].get<std::string>()] = usable(file["time"].get<double>());
    }
    for (const auto& p : r.pictures) {
        const auto at = times.find("state_" + p.stem().string().substr(8) + ".hdf");
        r.picture_times.push_back(at == times.end() ? std::nan("") : at->second);
    }
}

} // namespace

Record read_record(const io::Path& directory)
{
    Record r;
    Reader from(directory, r.gaps);
    if (!from.there("summary.json") && !from.there("scene.toml"))
        throw BadInput(
            fmt::format("{}: neither summary.json nor scene.toml here. Expected: the result directory of a run", directory.string()));
    r.directory = directory;
    r.summary = from.object("summary.json", "the run goes on, or was killed before it could write its end");
    r.timers = from.object("timers.json", "no times by phase");
    r.history = read_table(from.text("history.csv", "no curves", 128 * MiB));
    if (from.there("progress.csv")) r.progress = read_table(from.text("progress.csv", "no speed over time", 128 * MiB));
    if (r.history.empty() && from.there("history.csv")) r.gaps.push_back("history.csv is damaged: no curves.");
    r.scene = from.text("scene.toml", "the scene is unknown", MiB + 4096);
    r.title = directory.filename().empty() ? directory.parent_path().filename().string() : directory.filename().string();
    if (!r.scene.empty()) read_scene(r);
    read_stages(r, from);
    find_pictures(r, from);
    std::error_code error;
    for (const char* name : {"movie.mp4", "movie.webm", "movie.gif"})
        if (r.movie.empty() && from.there(name) && !std::filesystem::is_symlink(directory / name, error)) r.movie = directory / name;
    return r;
}

} // namespace kuzure::report
