// report.html of a factor of safety.
#include "solver/app/report/page.hpp"
#include "solver/app/report/chart.hpp"
#include "solver/app/report/values.hpp"
#include "solver/app/safety/runner.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::safety {
namespace {

using report::card, report::escaped, report::section, report::shown;

constexpr std::uint64_t largest_picture = std::uint64_t(64) << 20; // bytes
constexpr int compared_leg = 3;                                    // at whose end displacements are drawn
constexpr double beyond = 1.5;                                     // factors up to so many times the one found are drawn

std::string verdict(const Told& t)
{
    const auto& a = t.answer;
    const std::string head = a.factor() ? fmt::format("Factor of safety {:.4g}", *a.factor())
                             : a.fails  ? fmt::format("Factor of safety below {:g}", *a.fails)
                                        : fmt::format("Factor of safety above {:g}", a.holds.value_or(0));
    return fmt::format("<div class=\"verdict {}\"><strong>{}</strong><p>{}</p></div>\n", a.holds.value_or(0) >= 1 ? "good" : "warn",
                       escaped(head), escaped(a.words() + (t.at ? fmt::format(" (state at t = {:g} s)", *t.at) : "") + "."));
}

/// Displacement at one time of all trials, or where a trial ended before: over F.
std::string curve(const Told& t)
{
    std::vector<double> x, moved, force;
    const double last = beyond * t.answer.fails.value_or(HUGE_VAL);
    for (const auto& trial : t.trials) {
        if (trial.name == "settled" || trial.factor > last) continue;
        const auto& s = trial.seen[std::min(trial.seen.size(), std::size_t(compared_leg + 1)) - 1];
        x.push_back(trial.factor), moved.push_back(s.displacement), force.push_back(100 * s.unbalanced);
    }
    const double time = end_of_leg(t.setting, compared_leg);
    return report::chart(fmt::format("Displacement after {:.3g} s, or where the trial was decided before", time), "F", "1", x, "m",
                         {{"displacement", moved}}) +
           report::chart("Unbalanced force then", "F", "1", x, "% of gravity", {{"unbalanced", force}});
}

std::string table(const Told& t)
{
    std::string s = "<div class=\"scroll\"><table><thead><tr><th>F</th><th>outcome</th><th>looked at until, s</th><th>moved, m</th>"
                    "<th>unbalanced, of gravity</th><th>run</th></tr></thead><tbody>\n";
    for (const auto& trial : t.trials) {
        const auto& last = trial.seen.back();
        s += fmt::format("<tr><td>{:g}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>runs/{}</td></tr>\n", trial.factor,
                         word(trial.outcome), shown(last.time), shown(last.displacement), shown(last.unbalanced), escaped(trial.name));
    }
    return s + "</tbody></table></div>\n";
}

std::string picture(const Told& t, const io::Path& directory)
{
    if (t.picture.empty()) return {};
    const auto file = io::hold(directory) / t.picture;
    const auto& shows = t.answer.fails;
    return fmt::format("<figure><img alt=\"slip surface\" src=\"{}\"><figcaption>plastic strain of the trial at F = {:g}: where it is "
                       "largest, the soil slides</figcaption></figure>\n",
                       report::data_uri("image/png", io::read_text(file, largest_picture)), shows.value_or(0));
}

std::string list(const std::vector<std::string>& lines)
{
    std::string s;
    for (const auto& line : lines) s += "<li>" + escaped(line) + "</li>";
    return s.empty() ? s : "<ul>" + s + "</ul>\n";
}

} // namespace

std::string html(const Told& t, const io::Path& directory)
{
    const auto range = [](const std::optional<double>& x) { return x ? fmt::format("{:g}", *x) : std::string("-"); };
    double seconds = 0;
    for (const auto& trial : t.trials) seconds += trial.seconds;
    std::string s = "<header><h1>" + escaped(t.setting.base.title) + "</h1>\n" + verdict(t) + "<dl class=\"cards\">";
    s += card("holds at", range(t.answer.holds)) + card("fails at", range(t.answer.fails));
    s += card("trials", fmt::format("{}", t.trials.size()), report::duration(seconds) + " of runs");
    s += card("height", shown(t.setting.height) + " m", "of the soil") + "</dl>\n</header>\n";
    s += section("slip", "Slip surface", picture(t, directory));
    s += section("curve", "Displacement against the factor", curve(t));
    s += section("read", "How to read it", list(t.notes));
    s += section("criterion", "When a trial has failed", list(criterion(t.setting)));
    s += section("trials", "The trials", table(t));
    return report::page("Factor of safety: " + t.setting.base.title, s);
}

} // namespace kuzure::safety
