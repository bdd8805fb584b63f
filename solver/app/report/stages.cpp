#include "solver/app/report/stages.hpp"
#include "io/csv.hpp"
#include "solver/app/report/page.hpp"
#include "solver/app/report/values.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::report {

namespace {

constexpr std::size_t most_rows = 100;

double number(const std::string& cell) { return usable(io::csv_number(cell).value_or(std::nan(""))); }

std::string events(const Record& r)
{
    if (r.events.empty()) return {};
    std::string s = fmt::format("<table class=\"text\"><thead><tr><th>time</th><th>step</th><th>what happens</th><th>energy taken, {}</th>"
                                "</tr></thead><tbody>\n",
                                r.flat ? "J/m" : "J");
    for (std::size_t k = 0; k < std::min(r.events.size(), most_rows); ++k) {
        const auto& cells = r.events[k]; // time, step, event, what, taken
        if (cells.size() < 5) continue;
        s += fmt::format("<tr><td>{} s</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", shown(number(cells[0])), escaped(cells[1]),
                         escaped(cells[3]), shown(number(cells[4])));
    }
    s += "</tbody></table>\n";
    if (r.events.size() > most_rows) s += fmt::format("<p>and {} more in events.csv</p>\n", r.events.size() - most_rows);
    return s;
}

std::string loads(const Record& r)
{
    if (!r.summary.contains("loads") || !r.summary["loads"].is_array()) return {};
    std::string rows;
    const auto& all = r.summary["loads"];
    for (std::size_t k = 0; k < std::min(all.size(), most_rows); ++k) {
        const auto& load = all[k];
        if (!load.is_object()) continue;
        std::string force;
        if (load.contains("force") && load["force"].is_array())
            for (const auto& x : load["force"])
                force += (force.empty() ? "" : ", ") + (x.is_number() ? shown(usable(x)) : std::string("-"));
        rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(word(load, "name")),
                            grouped(at(load, {"particles"})), force, shown(at(load, {"factor"})));
    }
    if (rows.empty()) return {};
    return fmt::format(
        "<table class=\"text\"><thead><tr><th>load</th><th>particles at the end</th><th>all of it (x, y, z), {}</th><th>factor at "
        "the end</th></tr></thead><tbody>\n{}</tbody></table>\n",
        r.flat ? "N/m" : "N", rows);
}

std::string forces(const Record& r)
{
    constexpr std::size_t most_charts = 12;
    if (r.forces.empty()) return {};
    std::string s = "<div class=\"pair\">\n";
    for (std::size_t k = 0; k < std::min(r.forces.size(), most_charts); ++k) {
        const auto& [wall, table] = r.forces[k];
        const auto shares = r.flat ? curves(table, {{"force_x", "x"}, {"force_z", "z"}})
                                   : curves(table, {{"force_x", "x"}, {"force_y", "y"}, {"force_z", "z"}});
        s += chart("Force on wall " + wall, "time", "s", column(table, "time"), r.flat ? "N/m" : "N", shares);
    }
    s += "</div>\n";
    if (r.forces.size() > most_charts) s += fmt::format("<p>and {} more walls in forces.csv</p>\n", r.forces.size() - most_charts);
    return s;
}

} // namespace

std::string stages(const Record& r) { return events(r) + loads(r) + forces(r); }

} // namespace kuzure::report
