// kuzure report: one self-contained report.html from what a run left: verdict, pictures, curves, phases, effects, scene.
#include "io/file.hpp"
#include "solver/app/command.hpp"
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>

namespace kuzure {

namespace {

using Json = nlohmann::json;
using Table = std::map<std::string, std::vector<double>>;

std::string escaped(std::string_view s)
{
    std::string out;
    for (const char c : s) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
    return out;
}

std::string base64(std::string_view in)
{
    static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < in.size(); i += 3) {
        const std::size_t n = std::min<std::size_t>(3, in.size() - i);
        std::uint32_t v = 0;
        for (std::size_t k = 0; k < 3; ++k) v = v << 8 | (k < n ? std::uint8_t(in[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k) out += k <= n ? digits[v >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

Table read_history(const io::Path& file)
{
    Table t;
    const std::string text = io::read_text(file);
    std::vector<std::string> names;
    std::size_t at = 0;
    for (int line = 0; at < text.size(); ++line) {
        std::size_t end = text.find('\n', at);
        if (end == std::string::npos) break; // a torn last row
        std::string_view row(text.data() + at, end - at);
        at = end + 1;
        if (line == 1) continue; // units
        for (std::size_t column = 0, from = 0; from <= row.size(); ++column) {
            const std::size_t to = std::min(row.find(',', from), row.size());
            const auto cell = row.substr(from, to - from);
            if (line == 0) names.emplace_back(cell);
            else if (column < names.size()) {
                double v = 0;
                std::from_chars(cell.data(), cell.data() + cell.size(), v);
                t[names[column]].push_back(v);
            }
            from = to + 1;
        }
    }
    return t;
}

/// Curves of some columns over time, as SVG.
std::string plot(const Table& t, const std::vector<std::pair<std::string, std::string>>& curves, const std::string& unit)
{
    const auto time = t.find("time");
    if (time == t.end() || time->second.size() < 2) return "<p>too few rows for a curve</p>";
    double lo = 0, hi = 0;
    for (const auto& [column, label] : curves)
        if (const auto c = t.find(column); c != t.end())
            for (const double v : c->second)
                if (std::isfinite(v)) lo = std::min(lo, v), hi = std::max(hi, v);
    if (hi == lo) hi = lo + 1;
    const double t1 = time->second.back(), w = 640, h = 300, left = 70, bottom = 30, top = 10;
    const auto px = [&](double x) { return left + (w - left - 10) * x / std::max(t1, 1e-300); };
    const auto py = [&](double y) { return top + (h - top - bottom) * (hi - y) / (hi - lo); };
    static const char* colours[] = {"#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#888888"};
    std::string s = fmt::format("<figure><svg viewBox='0 0 {} {}' role='img'>", w, h);
    for (int k = 0; k <= 4; ++k) {
        const double y = lo + (hi - lo) * k / 4, x = t1 * k / 4;
        s += fmt::format("<line class='g' x1='{}' x2='{}' y1='{:.1f}' y2='{:.1f}'/><text x='{}' y='{:.1f}' text-anchor='end'>{:.3g}</text>",
                         left, w - 10, py(y), py(y), left - 6, py(y) + 4, y);
        s += fmt::format("<text x='{:.1f}' y='{}' text-anchor='middle'>{:.3g}</text>", px(x), h - 10, x);
    }
    std::string legend;
    int colour = 0;
    for (const auto& [column, label] : curves) {
        const auto c = t.find(column);
        if (c == t.end()) continue;
        const std::size_t n = c->second.size(), every = std::max<std::size_t>(1, n / 600);
        std::string points;
        for (std::size_t k = 0; k < n; k += every) points += fmt::format("{:.1f},{:.1f} ", px(time->second[k]), py(c->second[k]));
        s += fmt::format("<polyline fill='none' stroke='{}' stroke-width='2' points='{}'/>", colours[colour % 7], points);
        legend += fmt::format("<span style='color:{}'>&#9632;</span> {} &nbsp; ", colours[colour++ % 7], label);
    }
    return s + fmt::format("</svg><figcaption>{} ({} over s)</figcaption></figure>", legend, unit);
}

std::string html(const io::Path& dir)
{
    const Json summary = Json::parse(io::read_text(dir / "summary.json"));
    const Table history = read_history(dir / "history.csv");
    std::vector<io::Path> pictures;
    for (const auto& e : std::filesystem::directory_iterator(dir))
        if (const auto name = e.path().filename().string(); name.starts_with("picture_") && name.ends_with(".png"))
            pictures.push_back(e.path());
    std::sort(pictures.begin(), pictures.end());
    const auto number = [&](const char* key) {
        return summary.contains(key) && summary[key].is_number() ? summary[key].get<double>() : 0.0;
    };
    const auto text = [&](const char* key) {
        return summary.contains(key) && summary[key].is_string() ? summary[key].get<std::string>() : std::string();
    };
    const std::string scene = io::read_text(dir / "scene.toml");
    std::string title = dir.filename().string();
    if (const auto at = scene.find("title"); at != std::string::npos) {
        const auto a = scene.find('"', at), b = scene.find('"', a + 1);
        if (a != std::string::npos && b != std::string::npos) title = scene.substr(a + 1, b - a - 1);
    }

    std::string s =
        "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
        "content='width=device-width,initial-scale=1'><title>" +
        escaped(title) +
        "</title><style>:root{color-scheme:light dark}body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:auto;padding:1rem}"
        "img,svg{max-width:100%;height:auto}figure{margin:1rem 0}table{border-collapse:collapse;display:block;overflow-x:auto}"
        "td,th{padding:.15rem .7rem;border-bottom:1px solid #8886;text-align:right}td:first-child,th:first-child{text-align:left}"
        "svg text{font-size:12px;fill:currentColor}.g{stroke:#8884}pre{overflow-x:auto}.bad{color:#c33}@media "
        "print{body{max-width:none}}</style></head><body>";
    const double residual =
        summary.contains("energy") && summary["energy"].contains("residual") && summary["energy"]["residual"].is_number()
            ? summary["energy"]["residual"].get<double>()
            : std::nan("");
    s += fmt::format("<h1>{}</h1><p><strong{}>{}</strong> at t = {:g} s after {:.0f} steps in {:.1f} s of wall time; energy residual "
                     "{:+.2e} of the potential drop{}.</p>",
                     escaped(title), text("status") == "finished" ? "" : " class='bad'", escaped(text("status")), number("time"),
                     number("steps"), number("wall_seconds"), residual,
                     std::fabs(residual) < 0.01 ? " (good: below 1 %)" : " (above 1 %: look at the step and the viscosity)");
    if (const auto m = text("message"); !m.empty()) s += "<p class='bad'>" + escaped(m) + "</p>";
    std::vector<std::size_t> show;
    if (!pictures.empty()) show = {0, pictures.size() / 2, pictures.size() - 1};
    show.erase(std::unique(show.begin(), show.end()), show.end());
    for (const auto k : show)
        s += fmt::format("<figure><img alt='{}' src='data:image/png;base64,{}'></figure>", pictures[k].filename().string(),
                         base64(io::read_text(pictures[k])));
    s += "<h2>Energy</h2>" + plot(history,
                                  {{"kinetic", "kinetic"},
                                   {"potential", "potential"},
                                   {"elastic", "elastic"},
                                   {"plastic", "plastic"},
                                   {"viscous", "viscous"},
                                   {"wall", "wall"},
                                   {"damping", "damping"}},
                                  "J");
    s += "<h2>Heap</h2>" + plot(history, {{"height", "height"}, {"front_min_x", "front, low x"}, {"front_max_x", "front, high x"}}, "m");
    s += "<h2>Work</h2><table>";
    const auto row = [&](const std::string& a, const std::string& b) { s += "<tr><td>" + a + "</td><td>" + b + "</td></tr>"; };
    row("soil, wall particles", fmt::format("{:.0f}, {:.0f}", number("soil_particles"), number("wall_particles")));
    row("ranks x threads", fmt::format("{:.0f} x {:.0f}", number("ranks"), number("threads")));
    row("precision, pair model", escaped(text("precision") + ", " + text("pair_model")));
    row("step", fmt::format("{:.2f} ms", 1e3 * number("seconds_per_step")));
    row("soil-particle steps", fmt::format("{:.3g} /s", number("particle_steps_per_second")));
    row("pairs", fmt::format("{:.4g}", number("pairs")));
    row("state hash", escaped(text("state_hash")));
    row("version", escaped(text("version")));
    s += "</table>";
    if (std::filesystem::exists(dir / "timers.txt")) s += "<h2>Phases</h2><pre>" + escaped(io::read_text(dir / "timers.txt")) + "</pre>";
    s += "<h2>Effects</h2><table>";
    for (const char* which : {"on", "off"})
        if (summary.contains("effects") && summary["effects"].contains(which))
            for (const auto& e : summary["effects"][which])
                row(fmt::format("{}: {}", which, escaped(e.value("name", ""))), escaped(e.value("why", "")));
    s += "</table><h2>Scene</h2><pre>" + escaped(scene) + "</pre></body></html>\n";
    return s;
}

} // namespace

void add_report(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("report", "report.html from what a run left");
    auto dir = std::make_shared<std::string>();
    command->add_option("DIR", *dir, "the result directory")->required();
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            io::on_root(comm, [&] {
                const io::Path path(*dir);
                if (!std::filesystem::exists(path / "summary.json"))
                    throw BadInput(fmt::format("{}: no summary.json here. Expected: the result directory of a run", path.string()));
                try {
                    io::write_atomically(path / "report.html", html(path));
                } catch (const nlohmann::json::exception& e) {
                    throw IoFailed(fmt::format("{}: damaged ({})", (path / "summary.json").string(), e.what()));
                }
                fmt::print("{}\n", (path / "report.html").string());
            });
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
