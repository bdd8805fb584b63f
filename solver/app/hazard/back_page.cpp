// What a back-analysis leaves: fit.json, the curve, the page.
#include "io/ground/crs.hpp"
#include "solver/app/hazard/back_analysis.hpp"
#include "solver/app/report/chart.hpp"
#include "solver/app/report/page.hpp"
#include "solver/app/report/values.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

using Json = nlohmann::ordered_json;
using report::card, report::escaped, report::section, report::shown;

constexpr std::uint64_t largest_picture = std::uint64_t(64) << 20; // bytes
constexpr double still_moving = 0.01, little_overlap = 0.5;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(); }

std::string unit_of(const Axis& a) { return a.unit.empty() || a.unit == "1" ? "" : " " + a.unit; }
std::vector<Tried> in_order(std::vector<Tried> all)
{
    std::sort(all.begin(), all.end(), [](const Tried& a, const Tried& b) { return a.at < b.at; });
    return all;
}
std::string values_text(const BackState& s, const std::vector<int>& at)
{
    std::vector<std::string> parts;
    for (std::size_t k = 0; k < s.axes.size(); ++k)
        parts.push_back(fmt::format("{} {:.4g}{}", s.axes[k].name, s.axes[k].value(at[k]), unit_of(s.axes[k])));
    return fmt::format("{}", fmt::join(parts, ", "));
}

/// The page in one language.
class Page {
public:
    Page(bool japanese, const BackState& s, const io::Path& directory) : ja_(japanese), s_(s), directory_(directory) {}

    std::string content() const
    {
        std::string s = fmt::format("<article lang=\"{0}\" id=\"{0}\">\n", ja_ ? "ja" : "en");
        s += verdict() + cards();
        s += section(id("curve").c_str(), t("The misfit", "不適合度"), curves());
        s += section(id("map").c_str(), t("The best run and the event", "最良の計算と実際の範囲"), map());
        s += section(id("rests").c_str(), t("What it rests on", "この結果の前提"), basis());
        s += section(id("runs").c_str(), t("The runs", "計算の一覧"), runs());
        return s + "</article>\n";
    }

private:
    const char* t(const char* en, const char* ja) const { return ja_ ? ja : en; }
    std::string id(const char* name) const { return (ja_ ? "ja-" : "en-") + std::string(name); }

    std::string verdict() const
    {
        std::string lines;
        for (const auto& w : meaning(s_)) lines += "<p>" + escaped(ja_ ? w.ja : w.en) + "</p>";
        if (!s_.final)
            lines += fmt::format("<p>{}</p>",
                                 t("The search goes on, and this page will be replaced.", "探索は続いており、このページは更新されます。"));
        for (const auto& w : s_.not_done) lines += fmt::format("<p>{} {}</p>", t("Not done:", "未実施:"), escaped(ja_ ? w.ja : w.en));
        const bool good = s_.final && !s_.verdict->at_end && s_.not_done.empty() && s_.best().compared.overlap >= little_overlap;
        return fmt::format("<div class=\"verdict {}\"><strong>{}</strong>{}</div>\n", good ? "good" : "warn",
                           escaped(values_text(s_, s_.verdict->best)), lines);
    }

    std::string cards() const
    {
        const auto& c = s_.best().compared;
        std::string s = "<dl class=\"cards\">";
        s += card(t("overlap", "重なり"), fmt::format("{:.1f} %", 100 * c.overlap), t("common area over both together", "共通部分÷和集合"));
        s += card(t("reach", "到達距離"), fmt::format("{} m", shown(c.reach)), fmt::format("{:+.3g} m", c.reach_error));
        s += card(t("area", "面積"), fmt::format("{} m²", report::grouped(std::round(c.area))),
                  fmt::format("{:+.1f} %", 100 * (c.area / s_.observed.area - 1)));
        if (s_.observed.deposit)
            s += card(t("thickness off by", "厚さの誤差"), fmt::format("{} m", shown(c.rms)), t("root mean square", "二乗平均平方根"));
        s += card(t("runs", "計算"), fmt::format("{}", s_.tried.size() + s_.repeats.size()));
        s += card(t("layers of particles", "粒子の層数"), fmt::format("{:.3g}", s_.layers), t("over the mean thickness", "平均厚さあたり"));
        return s + "</dl>\n";
    }

    std::string curves() const
    {
        std::string s = "<div class=\"pair\">";
        const auto all = in_order(s_.tried);
        const auto& axis = s_.axes[0];
        const std::string unit = axis.unit.empty() ? "-" : axis.unit;
        std::vector<double> x, misfit, reach, limit;
        if (s_.axes.size() == 1) {
            for (const auto& one : all) {
                if (!one.run->finished()) continue;
                x.push_back(axis.value(one.at[0])), misfit.push_back(one.compared.misfit), reach.push_back(one.compared.reach_error);
                limit.push_back(s_.verdict->misfit + s_.alike);
            }
            s += report::chart(t("misfit: 1 - overlap", "不適合度: 1 - 重なり"), axis.name, unit, x, "1",
                               {{t("misfit", "不適合度"), misfit}, {t("cannot be told apart below", "これ以下は区別できない"), limit}});
            s += report::chart(t("reach, run less event", "到達距離の差(計算 - 実際)"), axis.name, unit, x, "m",
                               {{t("reach", "到達距離"), reach}});
            return s + "</div>\n";
        }
        // Two inputs: a curve of the scan for each value of the second.
        const auto& other = s_.axes[1];
        const int step = axis.parts / (axis.scan - 1), over = other.parts / (other.scan - 1);
        for (int k = 0; k < axis.scan; ++k) x.push_back(axis.value(k * step));
        std::vector<std::vector<double>> columns;
        for (int k = 0; k < other.scan; ++k) {
            auto& column = columns.emplace_back(x.size(), std::nan(""));
            for (const auto& one : all)
                if (one.run->finished() && one.at[1] == k * over && one.at[0] % step == 0)
                    column[std::size_t(one.at[0] / step)] = one.compared.misfit;
        }
        for (int first = 0; first < other.scan; first += 5) {
            std::vector<report::Curve> some;
            for (int k = first; k < std::min(first + 5, other.scan); ++k)
                some.push_back({fmt::format("{} {:.4g}{}", other.name, other.value(k * over), unit_of(other)), columns[std::size_t(k)]});
            s += report::chart(t("misfit of the even scan", "等間隔走査の不適合度"), axis.name, unit, x, "1", some);
        }
        return s + "</div>\n";
    }

    std::string map() const
    {
        std::string s;
        const char* caption = s_.observed.deposit ? t("deposit of the best run, with its outline and that of the event",
                                                      "最良の計算の堆積と、計算・実際の範囲")
                                                  : t("greatest thickness of the best run, with its outline and that of the event",
                                                      "最良の計算の最大厚さと、計算・実際の範囲");
        try {
            const auto file = io::hold(directory_) / "best.png";
            if (io::exists(file))
                s += fmt::format("<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>\n", caption,
                                 report::data_uri("image/png", io::read_text(file, largest_picture)));
        } catch (const IoFailed&) { // a page without its picture still says all
        }
        return s;
    }

    std::string basis() const
    {
        std::string rows;
        const auto row = [&](const std::string& name, const std::string& value) {
            rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escaped(name), escaped(value));
        };
        row(t("event", "実際の範囲"), fmt::format("{}: {} m², {} m", io::Path(s_.observed.file).filename().string(),
                                                  report::grouped(std::round(s_.observed.area)), shown(s_.observed.reach)));
        for (const auto& a : s_.axes) row(a.name, fmt::format("{:g} – {:g}{}", a.low, a.high, unit_of(a)));
        for (const auto& i : inputs_of(s_.base.uncertain))
            if (std::ranges::find(s_.axes, i.name, &Axis::name) == s_.axes.end())
                row(i.name, fmt::format("{:g}{}", i.range.likely, i.unit == "1" ? " ×" : " " + i.unit));
        row(t("mass", "崩壊土塊"), fmt::format("{} m³, {} m", shown(s_.base.volume), shown(s_.base.thickness)));
        row(t("counts from", "到達とする厚さ"), fmt::format("{:g} m", s_.wet));
        row(t("cell", "格子"), fmt::format("{:g} m", s_.cell));
        row(t("cannot be told apart within", "区別できない不適合度の差"),
            fmt::format("{:.2g} ({} {:.2g}, {} {:.2g}, {} {})", s_.alike, t("cells", "格子"), s_.of_cells,
                        t("scatter of the curve", "曲線のばらつき"), s_.of_curve, t("particles at other places", "粒子配置"),
                        std::isnan(s_.of_repeats) ? "–" : fmt::format("{:.2g}", s_.of_repeats)));
        row(t("program", "プログラム"), version_text());
        return fmt::format("<table class=\"text\"><thead><tr><th>{}</th><th>{}</th></tr></thead><tbody>\n{}</tbody></table>\n",
                           t("what", "項目"), t("value", "値"), rows);
    }

    std::string runs() const
    {
        std::string head, rows;
        for (const auto& a : s_.axes) head += "<th>" + escaped(a.name) + "</th>";
        const auto line = [&](const Tried& one) {
            const auto& c = one.compared;
            rows += fmt::format("<tr><td>{}</td>", escaped(one.run->directory.string()));
            for (std::size_t k = 0; k < s_.axes.size(); ++k) rows += "<td>" + shown(s_.axes[k].value(one.at[k])) + "</td>";
            const bool done = one.run->finished();
            rows += fmt::format("<td>{:.3g}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", one.run->layers,
                                done ? fmt::format("{:.3f}", c.misfit) : "–", done ? fmt::format("{:+.3g}", c.reach_error) : "–",
                                escaped(word(one.run->status)));
        };
        for (const auto& one : in_order(s_.tried)) line(one);
        for (const auto& one : s_.repeats) line(one);
        return fmt::format(
            "<div class=\"scroll\"><table><thead><tr><th>{}</th>{}<th>{}</th><th>{}</th><th>{}</th><th>{}</th></tr></thead><tbody>\n{}"
            "</tbody></table></div>\n",
            t("run", "計算"), head, t("layers", "層数"), t("misfit", "不適合度"), t("reach, m", "到達距離の差 m"), t("status", "状態"),
            rows);
    }

    bool ja_;
    const BackState& s_;
    const io::Path& directory_;
};

} // namespace

std::vector<Words> meaning(const BackState& s)
{
    const auto& v = *s.verdict;
    const auto& c = s.best().compared;
    std::vector<Words> all;
    all.push_back({fmt::format("best: {}: overlap {:.1f} % (misfit {:.3f}), reach {:.4g} m where the event has {:.4g} m ({:+.2g} m)",
                               values_text(s, v.best), 100 * c.overlap, c.misfit, c.reach, s.observed.reach, c.reach_error),
                   fmt::format("最良: {}: 重なり {:.1f} %(不適合度 {:.3f})、到達距離 {:.4g} m(実際 {:.4g} m、差 {:+.2g} m)",
                               values_text(s, v.best), 100 * c.overlap, c.misfit, c.reach, s.observed.reach, c.reach_error)});
    if (v.at_end) {
        std::vector<std::string> ends;
        for (std::size_t k = 0; k < s.axes.size(); ++k)
            if (v.best[k] == 0 || v.best[k] == s.axes[k].parts)
                ends.push_back(fmt::format("{} {:g}{}", s.axes[k].name, s.axes[k].value(v.best[k]), unit_of(s.axes[k])));
        const auto& a = s.axes[0];
        all.push_back(
            {fmt::format(
                 "The best lies at the end of the range ({}): a better one may lie beyond, so there is no interval. Remedy: a wider "
                 "range, --input {}=LOW,HIGH",
                 fmt::join(ends, ", "), a.name),
             fmt::format("最良の値が範囲の端({})にあります。範囲の外により良い値がありうるため、区間は示しません。対処: --input "
                         "{}=LOW,HIGH で範囲を広げる",
                         fmt::join(ends, ", "), a.name)});
    }
    for (std::size_t k = 0; k < v.intervals.size(); ++k) {
        const auto& i = v.intervals[k];
        const auto& a = s.axes[k];
        const std::string open = i.open_low && i.open_high   ? ", which is all of the range: this event does not say"
                                 : i.open_low || i.open_high ? fmt::format(", and it ends there only because the range does at the {} end",
                                                                           i.open_low ? "low" : "high")
                                                             : "";
        all.push_back(
            {fmt::format("values of {} from {:.4g} to {:.4g}{} cannot be told apart by this event (misfits within {:.2g} of the best){}{}",
                         a.name, i.low, i.high, unit_of(a), s.alike, open,
                         v.split ? "; some between them are worse: more than one answer is possible" : ""),
             fmt::format("{} の {:.4g} ~ {:.4g}{} は、この範囲からは区別できません(不適合度の差 {:.2g} 以内){}", a.name, i.low, i.high,
                         unit_of(a), s.alike, i.open_low || i.open_high ? "。区間は走査範囲の端で切れています" : "")});
    }
    if (c.overlap < little_overlap)
        all.push_back({"The best still misses much of the event: not this input decides, but the volume, the ground, what is not modelled, "
                       "or another event",
                       "最良でも重なりが小さい: 土量、地形、モデルにない現象、別の事象の範囲など、この入力以外の原因が考えられます"});
    if (s.moving > still_moving)
        all.push_back(
            {fmt::format(
                 "The soil of the best run still moves at its end ({:.1f} % of its greatest kinetic energy). Remedy: --set time.end={:g}",
                 100 * s.moving, 2 * s.base.scene.time.end),
             fmt::format("最良の計算は終了時にまだ動いています(最大運動エネルギーの {:.1f} %)。対処: --set time.end={:g}", 100 * s.moving,
                         2 * s.base.scene.time.end)});
    all.push_back(
        {"It makes up for what the model leaves out, and belongs to this scene with its volume and layers: good for events like this one",
         "この値はモデルに含まれない効果も肩代わりした、この土量と解像度での値です。似た事象の予測に使えます"});
    return all;
}

std::string curve_csv(const BackState& s)
{
    std::string text = "run", units = "# ";
    for (const auto& a : s.axes) text += "," + a.name, units += "," + (a.unit.empty() ? std::string("-") : a.unit);
    text += ",misfit,overlap,reach,reach_error,area,area_error,rms_thickness\n", units += ",1,1,m,m,m2,1,m\n";
    text += units;
    for (const auto& one : in_order(s.tried)) {
        if (!one.run->finished()) continue;
        const auto& c = one.compared;
        text += one.run->directory.string();
        for (std::size_t k = 0; k < s.axes.size(); ++k) text += fmt::format(",{:.10g}", s.axes[k].value(one.at[k]));
        text += fmt::format(",{:.6f},{:.6f},{:.7g},{:.7g},{:.7g},{:.6f},{}\n", c.misfit, c.overlap, c.reach, c.reach_error, c.area,
                            c.area / s.observed.area - 1, s.observed.deposit ? fmt::format("{:.6g}", c.rms) : "");
    }
    return text;
}

Json run_json(const BackState& s, const Tried& one)
{
    const auto& c = one.compared;
    Json settings = Json::object();
    for (std::size_t k = 0; k < s.axes.size(); ++k) settings[s.axes[k].name] = s.axes[k].value(one.at[k]);
    Json j{
        {"directory", one.run->directory.string()}, {"status", word(one.run->status)}, {"settings", settings}, {"layers", one.run->layers}};
    if (one.run->finished()) {
        j["misfit"] = c.misfit, j["overlap"] = c.overlap, j["reach"] = c.reach, j["reach_error"] = c.reach_error, j["area"] = c.area;
        j["area_error"] = c.area / s.observed.area - 1;
        if (s.observed.deposit) j["rms_thickness"] = c.rms;
    }
    if (!one.run->message.empty()) j["message"] = one.run->message;
    return j;
}
/// What is listed in fit.json, by its name there.
Json lists_of(const BackState& s)
{
    Json inputs = Json::array(), misfit = Json::array(), runs = Json::array(), repeats = Json::array(), not_done = Json::array(),
         says = Json::array();
    for (const auto& a : s.axes) inputs.push_back({{"name", a.name}, {"unit", a.unit}, {"low", a.low}, {"high", a.high}});
    for (const auto& one : in_order(s.tried)) {
        runs.push_back(run_json(s, one));
        if (!one.run->finished()) continue;
        Json row = Json::array();
        for (std::size_t k = 0; k < s.axes.size(); ++k) row.push_back(s.axes[k].value(one.at[k]));
        row.push_back(one.compared.misfit);
        misfit.push_back(row);
    }
    for (const auto& one : s.repeats) repeats.push_back(run_json(s, one));
    for (const auto& w : s.not_done) not_done.push_back(w.en);
    for (const auto& w : meaning(s)) says.push_back(w.en);
    return {{"inputs", inputs},     {"misfit", misfit}, {"runs", runs}, {"particles_elsewhere", repeats},
            {"not_done", not_done}, {"says", says}};
}

Json to_json(const BackState& s)
{
    const auto& v = *s.verdict;
    const auto one_or_all = [&](auto value_of) { // of one input a value, of two an object
        if (s.axes.size() == 1) return Json(value_of(0));
        Json j = Json::object();
        for (std::size_t k = 0; k < s.axes.size(); ++k) j[s.axes[k].name] = value_of(k);
        return j;
    };
    Json lists = lists_of(s);
    const auto open = [&](std::size_t k) {
        Json j = Json::array();
        if (v.intervals[k].open_low) j.push_back("low");
        if (v.intervals[k].open_high) j.push_back("high");
        return j;
    };
    return {{"title", s.base.scene.title},
            {"version", version_text()},
            {"scene", s.scene_file},
            {"scene_hash", io::scene_hash(s.base.scene)},
            {"final", s.final},
            {"observed",
             {{"file", s.observed.file},
              {"kind", s.observed.deposit ? "deposit" : "outline"},
              {"area", s.observed.area},
              {"reach", s.observed.reach},
              {"doubts", s.observed.doubts}}},
            {"inputs", lists["inputs"]},
            {"best", one_or_all([&](std::size_t k) { return s.axes[k].value(v.best[k]); })},
            {"interval", v.at_end ? Json() : one_or_all([&](std::size_t k) {
                 return Json{v.intervals[k].low, v.intervals[k].high};
             })},
            {"interval_ends_with_range", v.at_end ? Json() : one_or_all(open)},
            {"at_end_of_range", v.at_end},
            {"more_than_one_answer", v.split},
            {"misfit", lists["misfit"]},
            {"best_run", run_json(s, s.best())},
            {"alike", {{"misfit", s.alike}, {"cells", s.of_cells}, {"curve", s.of_curve}, {"particles", number(s.of_repeats)}}},
            {"moving_at_end", s.moving},
            {"says", lists["says"]},
            {"layers", s.layers},
            {"spacing", s.spacing},
            {"cell", s.cell},
            {"wet", s.wet},
            {"crs", s.base.scene.map_frame.crs.empty() ? Json() : Json(io::crs_name(s.base.scene.map_frame.crs))},
            {"ended_seconds", s.ended},
            {"not_done", lists["not_done"]},
            {"not_modelled",
             [&] {
                 Json list = Json::array();
                 for (const auto& w : not_modelled(s.base)) list.push_back(w.en);
                 return list;
             }()},
            {"runs", lists["runs"]},
            {"particles_elsewhere", lists["particles_elsewhere"]}};
}

std::string html(const BackState& s, const io::Path& directory)
{
    const std::string title = s.base.scene.title;
    return report::page(
        title, fmt::format("<header><h1>{}</h1><p><a href=\"#en\">English</a> · <a href=\"#ja\" lang=\"ja\">日本語</a></p></header>\n",
                           escaped(title)) +
                   Page(false, s, directory).content() + "<hr>\n" + Page(true, s, directory).content());
}

} // namespace kuzure::hazard
