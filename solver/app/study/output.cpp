// What is written of a study: study.json, study.csv and the table on the terminal.
#include "solver/app/study/dial.hpp"
#include "solver/app/study/study.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::study {

namespace {

using Json = nlohmann::ordered_json;
const std::string& name_of(io::Measure m) { return io::measure_names()[std::size_t(m)]; }

/// In the dial's own units: its table of measured curves is made of this.
Json about(const Scene& scene, double spacing)
{
    const Likeness l = likeness(scene);
    return {{"dimensions", l.dimensions},
            {"height", l.layers * spacing},
            {"slenderness", l.slenderness},
            {"friction_angle", l.friction_angle},
            {"cohesion", l.cohesion}};
}

Json json_of(const Study& study, const Point& p)
{
    const Point* base = study.base();
    Json row{{"curve", p.asked.curve}, {"choice", p.asked.choice}, {"settings", p.asked.sets},
             {"folder", p.folder},     {"scene_hash", p.hash},     {"exit_code", p.exit_code}};
    if (!p.message.empty()) row["message"] = p.message;
    if (p.scene) {
        Json scene{{"spacing", p.spacing}, {"base_strain", p.base_strain}, {"mach", p.mach}};
        row.update(scene);
    }
    if (p.finished()) {
        row.update(Json{{"particles", p.particles},
                        {"steps", p.steps},
                        {"pairs", p.pairs},
                        {"work", p.work},
                        {"core_seconds", p.core_seconds},
                        {"wall_seconds", p.wall_seconds}});
        row["values"] = Json::object(), row["errors"] = Json::object();
        for (const auto m : study.sweep.measures) {
            row["values"][name_of(m)] = p.value[std::size_t(m)];
            row["errors"][name_of(m)] = p.error[std::size_t(m)];
        }
        if (base && p.asked.choice && &p != base) {
            row["against_base"] = {{"core_seconds", p.core_seconds / base->core_seconds}, {"work", p.work / base->work}};
            for (const auto m : study.sweep.measures)
                row["against_base"][name_of(m)] = p.error[std::size_t(m)] - base->error[std::size_t(m)];
        }
    }
    return row;
}

/// What a curve costs for an error of 5 and 1 %, and how it converges.
Json json_of(const Study& study, const std::string& curve)
{
    Json c{{"curve", curve}};
    for (const auto m : study.sweep.measures) {
        Json entry;
        for (const auto& [percent, label] : {std::pair{0.05, "core_seconds_to_5_percent"}, std::pair{0.01, "core_seconds_to_1_percent"}}) {
            const auto t = cost_at(study.prices(curve, m, false), percent);
            entry[label] = t ? Json(*t) : Json();
        }
        for (const auto& conv : study.convergence)
            if (conv.curve == curve && conv.measure == m) {
                entry["order"] = conv.result.order ? Json(*conv.result.order) : Json();
                if (conv.result.order) entry["limit"] = conv.result.limit, entry["half_width"] = conv.result.half_width;
                else entry["no_extrapolation"] = conv.result.why_not;
            }
        c[name_of(m)] = entry;
    }
    return c;
}

/// The points that no other beats in cost and error.
Json front_of(const Study& study, io::Measure m)
{
    std::vector<Price> all;
    std::vector<const Point*> who;
    for (const auto& p : study.points)
        if (p.finished() && study.tells(p, m)) all.push_back({p.core_seconds, p.error[std::size_t(m)]}), who.push_back(&p);
    Json front = Json::array();
    for (const auto i : pareto_front(all))
        front.push_back(
            {{"curve", who[i]->asked.curve}, {"spacing", who[i]->spacing}, {"core_seconds", all[i].cost}, {"error", all[i].error}});
    return front;
}

Json json_of(const ErrorBar& b)
{
    Json row{{"curve", b.curve}, {"measure", name_of(b.measure)}, {"spacing", b.spacing}, {"value", b.value}, {"truth", b.truth}};
    if (b.why_not.empty())
        row["half_width"] = b.half_width, row["covers"] = b.covers(),
        row["half_width_over_error"] = b.half_width / std::fabs(b.value - b.truth);
    else row["no_interval"] = b.why_not;
    return row;
}

} // namespace

nlohmann::ordered_json to_json(const Study& study)
{
    Json j;
    j["title"] = study.sweep.title;
    j["scene"] = study.sweep.scene.filename().string();
    j["window"] = study.window, j["grain"] = study.grain;
    for (const auto& p : study.points)
        if (p.scene) {
            j["about"] = about(*p.scene, p.spacing);
            break;
        }
    j["measures"] = Json::object();
    for (const auto m : study.sweep.measures)
        j["measures"][name_of(m)] = {{"reference", study.reference[std::size_t(m)]},
                                     {"from", study.reference_note[std::size_t(m)]},
                                     {"spacing", study.reference_spacing[std::size_t(m)]}};
    j["scatter"] = study.sweep.reference.scatter;
    j["points"] = Json::array(), j["curves"] = Json::array();
    for (const auto& p : study.points) j["points"].push_back(json_of(study, p));
    for (const auto& curve : study.curves()) j["curves"].push_back(json_of(study, curve));
    j["pareto"] = Json::object();
    for (const auto m : study.sweep.measures) j["pareto"][name_of(m)] = front_of(study, m);
    j["error_bars"] = Json::array();
    for (const auto& b : study.bars) j["error_bars"].push_back(json_of(b));
    return j;
}

std::string to_csv(const Study& study)
{
    std::string out = "curve,choice,spacing,particles,steps,pairs,work,core_seconds,wall_seconds,exit_code,base_strain,mach";
    for (const auto m : study.sweep.measures) {
        std::string name = io::measure_names()[std::size_t(m)];
        std::replace(name.begin(), name.end(), ' ', '_'), std::replace(name.begin(), name.end(), '-', '_');
        out += fmt::format(",{0},{0}_error", name);
    }
    out += "\n";
    const auto number = [](double x) { return std::isfinite(x) ? fmt::format("{:.9g}", x) : std::string(); };
    for (const auto& p : study.points) {
        std::string curve;
        for (const char c : p.asked.curve) curve += c == '"' ? std::string("\"\"") : std::string(1, c);
        out += fmt::format("\"{}\",{},{},{},{},{},{},{},{},{},{},{}", curve, int(p.asked.choice), p.scene ? number(p.spacing) : "",
                           p.particles, p.steps, number(p.pairs), number(p.work), number(p.core_seconds), number(p.wall_seconds),
                           p.exit_code, number(p.base_strain), number(p.mach));
        for (const auto m : study.sweep.measures)
            out += p.finished() ? "," + number(p.value[std::size_t(m)]) + "," + number(p.error[std::size_t(m)]) : ",,";
        out += "\n";
    }
    return out;
}

std::string to_text(const Study& study)
{
    const auto& names = io::measure_names();
    std::string out = fmt::format("{}\n\n{:<34} {:>9} {:>9} {:>8} {:>10} {:>9}", study.sweep.title, "curve", "spacing", "particles",
                                  "steps", "pairs", "core-s");
    for (const auto m : study.sweep.measures) out += fmt::format(" {:>12}", names[std::size_t(m)]);
    out += "\n";
    for (const auto& p : study.points) {
        const auto name = p.asked.curve.size() > 34 ? p.asked.curve.substr(0, 31) + "..." : p.asked.curve;
        if (!p.finished()) {
            out += fmt::format("{:<34} {:>9.4g} {}: {}\n", name, p.spacing,
                               p.exit_code < 0 ? std::string("-") : fmt::format("exit {}", p.exit_code),
                               p.message.substr(0, p.message.find('\n')));
            continue;
        }
        out +=
            fmt::format("{:<34} {:>9.4g} {:>9} {:>8} {:>10.3g} {:>9.2f}", name, p.spacing, p.particles, p.steps, p.pairs, p.core_seconds);
        for (const auto m : study.sweep.measures) {
            const double e = p.error[std::size_t(m)];
            out += std::isfinite(e) ? fmt::format(" {:>10.2f} %", 100 * e) : fmt::format(" {:>12}", "-");
        }
        out += "\n";
    }
    out += "\nerrors count from:\n";
    for (const auto m : study.sweep.measures)
        out += fmt::format("  {:<13} {}\n", names[std::size_t(m)], study.reference_note[std::size_t(m)]);
    for (const auto& c : study.convergence)
        if (!c.result.order)
            out += fmt::format("no extrapolation of {} along \"{}\": {}\n", names[std::size_t(c.measure)], c.curve, c.result.why_not);
    return out;
}

} // namespace kuzure::study
