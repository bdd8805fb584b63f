#include "solver/app/report/record.hpp"
#include "io/scene_file.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::report {

Table read_table(const std::string& text)
{
    Table t;
    std::vector<std::string> names;
    std::size_t at = 0;
    for (int line = 0; at < text.size(); ++line) {
        const std::size_t end = text.find('\n', at);
        if (end == std::string::npos) break; // a torn last row
        const std::string_view row(text.data() + at, end - at);
        at = end + 1;
        if (line == 1) continue; // units
        std::size_t column = 0;
        for (std::size_t from = 0; from <= row.size(); ++column) {
            const std::size_t to = std::min(row.find(',', from), row.size());
            const auto cell = row.substr(from, to - from);
            if (line == 0) names.emplace_back(cell);
            else if (column < names.size()) {
                double v = 0;
                const bool read = std::from_chars(cell.data(), cell.data() + cell.size(), v).ec == std::errc{};
                t[names[column]].push_back(read ? v : std::nan(""));
            }
            from = to + 1;
        }
        if (line > 0)
            for (; column < names.size(); ++column) t[names[column]].push_back(std::nan(""));
    }
    return t;
}

double Record::number(const char* key) const
{
    return summary.contains(key) && summary[key].is_number() ? summary[key].get<double>() : std::nan("");
}
std::string Record::text(const char* key) const
{
    return summary.contains(key) && summary[key].is_string() ? summary[key].get<std::string>() : std::string();
}

Record read_record(const io::Path& directory)
{
    // Held: nothing is read through links, which in a directory from somebody else may lead to anything of ours.
    io::Place held;
    try {
        held = io::hold(directory);
    } catch (const IoFailed&) { // not there, or no directory: said below
    }
    const auto place = [&](const std::string& name) {
        const auto slash = name.find('/');
        return slash == name.npos ? held / name : io::hold(held / name.substr(0, slash)) / name.substr(slash + 1);
    };
    const auto there = [&](const char* name) {
        try {
            return held.held() && io::exists(place(name));
        } catch (const IoFailed&) {
            return false;
        }
    };
    if (!there("summary.json") && !there("scene.toml"))
        throw BadInput(
            fmt::format("{}: neither summary.json nor scene.toml here. Expected: the result directory of a run", directory.string()));
    Record r;
    r.directory = directory;
    const auto text = [&](const char* name, const char* meaning) -> std::string {
        try {
            if (there(name)) return io::read_text(place(name));
            r.gaps.push_back(fmt::format("{} is missing: {}.", name, meaning));
        } catch (const IoFailed& e) {
            r.gaps.push_back(e.what());
        }
        return {};
    };
    const auto object = [&](const char* name, const char* meaning) {
        const std::string t = text(name, meaning);
        auto j = nlohmann::json::parse(t, nullptr, false);
        if (j.is_object()) return j;
        if (!t.empty()) r.gaps.push_back(fmt::format("{} is damaged: {}.", name, meaning));
        return nlohmann::json::object();
    };
    r.summary = object("summary.json", "the run goes on, or was killed before it could write its end");
    r.timers = object("timers.json", "no times by phase");
    r.history = read_table(text("history.csv", "no curves"));
    if (there("progress.csv")) r.progress = read_table(text("progress.csv", ""));
    r.scene = text("scene.toml", "the scene is unknown");
    r.title = directory.filename().empty() ? directory.parent_path().filename().string() : directory.filename().string();
    if (!r.scene.empty()) {
        try {
            const Scene s = io::parse_scene(r.scene, "scene.toml", {}, scene::StepLimit::Force);
            if (!s.title.empty()) r.title = s.title;
            r.end_time = s.time.end;
            r.flat = s.dimensions == 2;
        } catch (const BadInput&) {
            r.gaps.push_back("scene.toml is not a scene of this version of kuzure.");
        }
    }
    std::error_code error;
    for (const auto& e : std::filesystem::directory_iterator(directory, error)) {
        const auto name = e.path().filename().string();
        if (name.starts_with("picture_") && name.ends_with(".png") && !e.is_symlink(error) && e.file_size(error) > 0)
            r.pictures.push_back(e.path());
    }
    std::sort(r.pictures.begin(), r.pictures.end());
    // Pictures carry the number of their snapshot, whose time the series tells.
    std::map<std::string, double> times;
    if (there("snapshots/state.hdf.series")) {
        const auto series = nlohmann::json::parse(text("snapshots/state.hdf.series", ""), nullptr, false);
        if (series.is_object() && series.contains("files") && series["files"].is_array())
            for (const auto& file : series["files"])
                if (file.is_object() && file.contains("name") && file["name"].is_string() && file.contains("time") &&
                    file["time"].is_number())
                    times[file["name"].get<std::string>()] = file["time"].get<double>();
    }
    for (const auto& p : r.pictures) {
        const auto at = times.find("state_" + p.stem().string().substr(8) + ".hdf");
        r.picture_times.push_back(at == times.end() ? std::nan("") : at->second);
    }
    for (const char* name : {"movie.mp4", "movie.webm", "movie.gif"})
        if (r.movie.empty() && there(name) && !std::filesystem::is_symlink(directory / name, error)) r.movie = directory / name;
    return r;
}

} // namespace kuzure::report
