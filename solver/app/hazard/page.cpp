#include "solver/app/hazard/page.hpp"
#include "io/ground/crs.hpp"
#include "solver/app/report/chart.hpp"
#include "solver/app/report/page.hpp"
#include "solver/app/report/values.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

using report::card, report::escaped, report::section, report::shown;

constexpr std::uint64_t largest_picture = std::uint64_t(64) << 20; // bytes

/// The page in one language.
class Page {
public:
    Page(bool japanese, const State& s, const Answer& a, const io::Path& directory) : ja_(japanese), s_(s), a_(a), directory_(directory) {}

    std::string content() const
    {
        std::string s = fmt::format("<article lang=\"{}\" id=\"{}\">\n", ja_ ? "ja" : "en", ja_ ? "ja" : "en");
        s += verdict() + cards();
        s += section(id("map").c_str(), t("Where it can reach", "どこまで届くか"), map());
        s += section(id("when").c_str(), t("By when", "いつ届くか"), when());
        s += section(id("sure").c_str(), t("How sure", "どのくらい確かか"), sure());
        s += section(id("decides").c_str(), t("What decides", "何が結果を左右するか"), decides());
        s += section(id("rests").c_str(), t("What the answer rests on", "この答えの前提"), basis());
        s += section(id("not").c_str(), t("What is not in it", "含まれていないもの"), missing());
        s += section(id("runs").c_str(), t("The runs", "計算の一覧"), runs());
        return s + "</article>\n";
    }

private:
    const char* t(const char* en, const char* ja) const { return ja_ ? ja : en; }
    /// Names of parts differ between the languages.
    std::string id(const char* name) const { return (ja_ ? "ja-" : "en-") + std::string(name); }
    /// Three digits: more would say more than is known.
    static std::string rounded(double x)
    {
        const int digits = x > 0 ? 2 - int(std::floor(std::log10(x))) : 0; // behind the point
        const double unit = std::pow(10, -digits);
        return digits < 0 ? report::grouped(std::round(x / unit) * unit) : fmt::format("{:.{}f}", x, std::min(digits, 9));
    }
    static std::string metres(double x) { return rounded(x) + " m"; }
    static std::string percent(double p) { return fmt::format("{:.0f} %", 100 * p); }

    std::string verdict() const
    {
        const bool interval = a_.high > a_.low;
        std::string words =
            ja_ ? fmt::format("崩土は崩壊部の中心から約 {} に達します{}", metres(a_.likely),
                              interval ? fmt::format("(範囲 {} ~ {})。", metres(a_.low), metres(a_.high)) : std::string("。"))
                : fmt::format("The soil reaches about {} from the middle of the mass{}", metres(a_.likely),
                              interval ? fmt::format(", between {} and {}.", metres(a_.low), metres(a_.high)) : std::string("."));
        std::string state;
        if (!s_.final)
            state =
                t("Preliminary: finer runs go on, and this page will be replaced.", "速報: 計算は続いており、このページは更新されます。");
        else if (a_.preliminary)
            state = t("Preliminary: too few members of the ensemble were finished for probabilities.",
                      "速報: 確率を出すのに十分なメンバーの計算が終わっていません。");
        else
            state = ja_ ? fmt::format("{} 通りの計算から求めた確率です。", a_.counted.size())
                        : fmt::format("Probabilities are shares of {} runs.", a_.counted.size());
        return fmt::format("<div class=\"verdict {}\"><strong>{}</strong><p>{}</p></div>\n", !s_.final || a_.preliminary ? "warn" : "good",
                           escaped(words), escaped(state));
    }

    std::string cards() const
    {
        std::string s = "<dl class=\"cards\">";
        s += card(t("reach", "到達距離"), metres(a_.likely), fmt::format("{} – {}", metres(a_.low), metres(a_.high)));
        s += card(t("runs counted", "数えた計算"), fmt::format("{}", a_.counted.size()),
                  ja_ ? "うち失敗は含まず" : "failed ones are not among them");
        double least = HUGE_VAL, most = 0;
        for (const auto& r : s_.runs)
            if (r.finished()) least = std::min(least, r.layers), most = std::max(most, r.layers);
        s += card(t("layers of particles", "粒子の層数"),
                  most > least * 1.01 ? fmt::format("{:.3g} – {:.3g}", least, most) : fmt::format("{:.3g}", most),
                  t("over the mean thickness", "平均厚さあたり"));
        s += card(t("volume", "土量"), fmt::format("{} m³", rounded(a_.volume[1])),
                  a_.volume[2] > a_.volume[0] * 1.001 ? fmt::format("{} – {} m³", rounded(a_.volume[0]), rounded(a_.volume[2])) : "");
        s += card(t("reached by 5 % or more", "5 %以上の確率で到達"), fmt::format("{} m²", rounded(a_.area_05)));
        s += card(t("reached by 95 % or more", "95 %以上の確率で到達"), fmt::format("{} m²", rounded(a_.area_95)));
        if (s_.deadline > 0)
            s += card(t("answered after", "計算時間"), report::duration(s_.ended),
                      ja_ ? fmt::format("期限 {}", report::duration(s_.deadline)) : fmt::format("of {}", report::duration(s_.deadline)));
        return s + "</dl>\n";
    }

    std::string picture(const char* name, const char* caption) const
    {
        try {
            const auto file = io::hold(directory_ / "maps") / (std::string(name) + ".png");
            if (!io::exists(file)) return {};
            return fmt::format("<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>\n", escaped(caption),
                               report::data_uri("image/png", io::read_text(file, largest_picture)));
        } catch (const IoFailed&) {
            return {};
        }
    }

    std::string map() const
    {
        const auto& crs = s_.base.scene.map_frame.crs;
        const auto maps = maps_of_runs(s_.base);
        std::string s = picture("p_reach", t("probability of reach, with the outlines of 5, 50 and 95 %", "到達確率と 5・50・95 % の範囲"));
        s += fmt::format("<p class=\"soft small\">{}</p>\n",
                         escaped(ja_ ? fmt::format("厚さ {} m 以上を到達とします。格子 {} m。座標系: {}。", shown(maps.wet),
                                                   shown(maps.cell), crs.empty() ? std::string("シーンの座標") : io::crs_name(crs))
                                     : fmt::format("Reached means at least {} m thick; cells of {} m; coordinates: {}.", shown(maps.wet),
                                                   shown(maps.cell), crs.empty() ? std::string("those of the scene") : io::crs_name(crs))));
        return s;
    }

    std::string when() const
    {
        std::string s;
        if (!a_.points.empty()) {
            s += fmt::format(
                "<div class=\"scroll\"><table><thead><tr><th>{}</th><th>{}</th><th>{}</th><th>{}</th><th>{}</th></tr></thead><tbody>\n",
                t("place", "地点"), t("probability", "到達確率"), t("arrival, s (10 – 90 %)", "到達時刻 s (10 – 90 %)"),
                t("thickness, m (50, 90 %)", "厚さ m (50, 90 %)"), t("greatest pressure, kPa", "最大動圧 kPa"));
            for (const auto& p : a_.points) {
                const bool comes = p.probability > 0;
                s += fmt::format(
                    "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(p.at.name), percent(p.probability),
                    comes ? fmt::format("{} ({} – {})", shown(p.arrival[1]), shown(p.arrival[0]), shown(p.arrival[2])) : "–",
                    comes ? fmt::format("{}, {}", shown(p.thickness[1]), shown(p.thickness[2])) : "–", comes ? shown(p.pressure) : "–");
            }
            s += "</tbody></table></div>\n";
        }
        s += picture("arrival_median",
                     t("median arrival of the runs that come, seconds after the start of motion", "到達時刻の中央値(動き始めからの秒)"));
        return s;
    }

    std::string sure() const
    {
        const auto& d = a_.discretisation;
        std::string how = fmt::format("± {}: {}.", metres(d.half_width), d.how);
        if (ja_) {
            const bool front = d.half_width == d.front;
            how = "± " + metres(d.half_width) + (front ? ": 粒子一層分の厚さの増減で先端はこれだけ動きます。" : ": ");
            if (d.kind == Discretisation::Unknown) how += "ひとつの解像度でしか計算していません。";
            else if (d.kind == Discretisation::Difference)
                how += "二つの解像度の差" + std::string(front ? "はこれより小さい" : "") + "(収束次数は不明)。";
            else if (d.kind == Discretisation::Spread)
                how += "三つの解像度のばらつき" + std::string(front ? "はこれより小さい" : "") + "(単調でないため外挿できません)。";
            else
                how += fmt::format("三つの解像度からのリチャードソン外挿{}(次数 {:.2g}、安全率 3)。", front ? "はこれより小さい" : "",
                                   d.order);
        }
        std::string rows;
        for (const auto& [layers, reach] : d.samples) rows += fmt::format("<tr><td>{:.3g}</td><td>{}</td></tr>", layers, metres(reach));
        std::string s = fmt::format("<p><strong>{}</strong> {}</p>\n", t("Resolution:", "解像度:"), escaped(how));
        s += fmt::format("<table><thead><tr><th>{}</th><th>{}</th></tr></thead><tbody>{}</tbody></table>\n",
                         t("layers, likely values", "層数(最確値)"), t("reach", "到達距離"), rows);
        if (!d.finest_two.empty())
            s += fmt::format("<p><strong>{}</strong> {}</p>\n", t("Thickness:", "厚さ:"),
                             ja_ ? fmt::format("± {}(最も細かい二つの計算の差の二乗平均平方根。場所ごとの差は maps/h_resolution.tif)。",
                                               metres(d.thickness))
                                 : fmt::format("± {}: root mean square of the difference between the two finest runs of the likely values; "
                                               "place by place in maps/h_resolution.tif.",
                                               metres(d.thickness)));
        const auto n = a_.counted.size();
        s += fmt::format(
            "<p><strong>{}</strong> {}</p>\n", t("Probabilities:", "確率:"),
            escaped(
                ja_ ? fmt::format("{} 通りの計算の割合なので、刻みは {:.2g} % です。どこでも 0 % や 100 % は保証ではありません。", n,
                                  100.0 / double(n))
                    : fmt::format("shares of {} runs, in steps of {:.2g} %; 0 or 100 % is no guarantee anywhere.", n, 100.0 / double(n))));
        s += picture("h_90", t("greatest thickness that 90 % of the runs do not exceed", "計算の 90 % が超えない最大厚さ"));
        return s;
    }

    std::string decides() const
    {
        if (a_.sensitivity.empty()) return {};
        auto rows = a_.sensitivity;
        std::stable_sort(rows.begin(), rows.end(),
                         [](const auto& x, const auto& y) { return std::fabs(x.correlation) > std::fabs(y.correlation); });
        std::string s = fmt::format("<table><thead><tr><th>{}</th><th>{}</th><th>{}</th></tr></thead><tbody>\n", t("input", "入力"),
                                    t("rank correlation with the reach", "到達距離との順位相関"), t("90 % interval", "90 % 区間"));
        for (const auto& r : rows)
            s += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(r.input),
                             std::isnan(r.correlation) ? "–" : fmt::format("{:+.2f}", r.correlation),
                             std::isnan(r.interval[0]) ? "–" : fmt::format("{:+.2f} – {:+.2f}", r.interval[0], r.interval[1]));
        return s + fmt::format("</tbody></table>\n<p class=\"small soft\">{}</p>\n",
                               t("The first is what to measure next, where its interval does not hold 0.",
                                 "区間が 0 を含まなければ、いちばん上の入力を次に測るべきです。"));
    }

    std::string basis() const
    {
        std::string rows;
        const auto row = [&](const std::string& name, const std::string& value) {
            rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escaped(name), escaped(value));
        };
        for (const auto& i : inputs_of(s_.base.uncertain))
            row(i.name, fmt::format("{:g} – {:g} – {:g} {}", i.range.low, i.range.likely, i.range.high, i.unit == "1" ? "×" : i.unit));
        if (const auto& e = s_.base.uncertain.dem_error)
            row("dem_error", fmt::format("{} {:g} m, {} {:g} m", t("rms", "二乗平均"), e->height, t("alike over", "相関長"), e->length));
        const auto& s = s_.base.scene;
        constexpr double degrees = 180 / 3.14159265358979323846;
        for (const auto& soil : s.soils)
            row(ja_ ? "土 " + soil.name : "soil " + soil.name,
                ja_ ? fmt::format("密度 {:g} kg/m³、摩擦角 {:.3g}°、粘着力 {:g} Pa", soil.density, soil.friction_angle * degrees,
                                  soil.cohesion)
                    : fmt::format("{:g} kg/m³, friction {:.3g} deg, cohesion {:g} Pa", soil.density, soil.friction_angle * degrees,
                                  soil.cohesion));
        if (s.terrain && s.terrain->friction_angle > 0)
            row(t("friction of the ground", "地盤の摩擦角"), fmt::format("{:.3g}°", s.terrain->friction_angle * degrees));
        if (s.terrain)
            for (const auto& dem : s.terrain->dem) row(t("elevation model", "標高モデル"), io::Path(dem).filename().string());
        row(t("mass", "崩壊土塊"), ja_ ? fmt::format("{} m³、平均厚さ {} m", shown(s_.base.volume), shown(s_.base.thickness))
                                       : fmt::format("{} m³, {} m thick on average", shown(s_.base.volume), shown(s_.base.thickness)));
        row(t("simulated time", "計算する時間"), fmt::format("{:g} s", s.time.end));
        row(t("program", "プログラム"), version_text());
        return fmt::format("<table class=\"text\"><thead><tr><th>{}</th><th>{}</th></tr></thead><tbody>\n{}</tbody></table>\n",
                           t("what", "項目"), t("value (low – likely – high)", "値(下限 – 最確 – 上限)"), rows);
    }

    std::string list(const char* title, const std::vector<Words>& lines) const
    {
        if (lines.empty()) return {};
        std::string s = fmt::format("<p><strong>{}</strong></p>\n<ul>", title);
        for (const auto& w : lines) s += "<li>" + escaped(ja_ ? w.ja : w.en) + "</li>";
        return s + "</ul>\n";
    }
    std::string missing() const
    {
        return list(t("Not done in the time given:", "時間内にできなかったこと:"), s_.not_done) +
               list(t("Not modelled:", "モデルにないもの:"), s_.not_modelled);
    }

    std::string runs() const
    {
        const auto inputs = inputs_of(s_.base.uncertain);
        std::string head, rows;
        for (const auto& i : inputs) head += "<th>" + escaped(i.name) + "</th>";
        for (const auto& r : s_.runs) {
            rows += fmt::format("<tr><td>{}</td><td>{:.3g}</td>", escaped(r.directory.string()), r.layers);
            for (const double v : r.member.values) rows += "<td>" + shown(v) + "</td>";
            rows += fmt::format("<td>{}</td><td>{}</td></tr>\n", r.finished() ? shown(r.maps->reach) : "–", escaped(word(r.status)));
        }
        return fmt::format(
            "<details><summary>{}</summary><div class=\"scroll\"><table><thead><tr><th>{}</th><th>{}</th>{}<th>{}</th><th>{}</th></tr>"
            "</thead><tbody>\n{}</tbody></table></div></details>\n",
            t("all runs; kuzure report DIR makes the page of one", "全計算(kuzure report DIR で個別のページ)"), t("run", "計算"),
            t("layers", "層数"), head, t("reach, m", "到達距離 m"), t("status", "状態"), rows);
    }

    bool ja_;
    const State& s_;
    const Answer& a_;
    const io::Path& directory_;
};

} // namespace

std::string html(const State& s, const Answer& a, const io::Path& directory)
{
    const std::string title = s.base.scene.title;
    return report::page(
        title, fmt::format("<header><h1>{}</h1><p><a href=\"#en\">English</a> · <a href=\"#ja\" lang=\"ja\">日本語</a></p></header>\n",
                           escaped(title)) +
                   Page(false, s, a, directory).content() + "<hr>\n" + Page(true, s, a, directory).content());
}

} // namespace kuzure::hazard
