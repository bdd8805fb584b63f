// hazard.json, what was not done, and what no run has in it.
#include "io/ground/crs.hpp"
#include "solver/app/hazard/runner.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(); }

/// "1 to 4, 7"
std::string ranges_of(std::vector<int> numbers)
{
    std::sort(numbers.begin(), numbers.end());
    std::vector<std::string> parts;
    for (std::size_t k = 0; k < numbers.size();) {
        std::size_t end = k + 1;
        while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
        parts.push_back(
            end - k > 2 ? fmt::format("{} to {}", numbers[k], numbers[end - 1])
                        : fmt::format("{}", fmt::join(numbers.begin() + std::ptrdiff_t(k), numbers.begin() + std::ptrdiff_t(end), ", ")));
        k = end;
    }
    return fmt::format("{}", fmt::join(parts, ", "));
}

} // namespace

std::vector<Words> not_done(const std::vector<Run>& runs, int extra_from, bool varied, const Words& no_finer)
{
    std::vector<Words> all;
    std::vector<int> waiting, failed;
    std::vector<std::string> why;
    for (const auto& r : runs) {
        const bool waits = r.status == Status::NotRun || r.status == Status::Stopped;
        if (r.part == Part::Member) {
            const bool extra = extra_from > 0 && r.member.number >= extra_from;
            if (waits && !extra) waiting.push_back(r.member.number);
            if (r.status == Status::Failed || r.status == Status::Refused) {
                failed.push_back(r.member.number);
                if (std::ranges::find(why, r.message) == why.end() && why.size() < 3) why.push_back(r.message);
            }
        } else if (!r.finished()) {
            const std::string more = r.message.empty() ? "" : ": " + r.message;
            all.push_back({fmt::format("the run {} of {:.3g} layers: {}{}", r.directory.string(), r.layers,
                                       waits ? "no time was left" : word(r.status), more),
                           fmt::format("計算 {}({:.3g}層): {}{}", r.directory.string(), r.layers, waits ? "時間切れ" : "失敗", more)});
        }
    }
    const auto some = [](const std::vector<int>& n) { return n.size() == 1 ? "member" : "members"; };
    if (!failed.empty())
        all.push_back({fmt::format("{} {} failed and {} not counted ({})", some(failed), ranges_of(failed),
                                   failed.size() == 1 ? "is" : "are", fmt::join(why, "; ")),
                       fmt::format("メンバー {} は失敗し、確率に数えていません({})", ranges_of(failed), fmt::join(why, "; "))});
    if (!waiting.empty())
        all.push_back({fmt::format("{} {}: no time was left", some(waiting), ranges_of(waiting)),
                       fmt::format("メンバー {}: 時間切れ", ranges_of(waiting))});
    if (!varied)
        all.push_back({"no ensemble: the scene has no [uncertain], so the input's part in the uncertainty is unknown",
                       "アンサンブルなし: シーンに [uncertain] がないため、入力の不確かさは含まれていません"});
    if (!no_finer.en.empty() && std::ranges::none_of(runs, [](const Run& r) { return r.part == Part::Finer; }))
        all.push_back({"no finer run: " + no_finer.en, "より細かい計算なし: " + no_finer.ja});
    return all;
}

std::vector<Words> not_modelled(const Base& base)
{
    const auto& s = base.scene;
    const auto& u = base.uncertain;
    std::vector<Words> all{
        {"entrainment of soil on the way", "流下中の土砂の取り込み(侵食)"},
        {"trees, houses and other obstacles that are not in the elevation model", "標高モデルにない樹木・家屋などの障害物"},
        {"the time from the trigger to the start of motion", "発生のきっかけから動き出すまでの時間"}};
    if (!s.effects.pore_pressure) all.push_back({"water in the soil", "土中の水"});
    else all.push_back({"pore water that flows or is pressed by the motion", "間隙水の流れと過剰間隙水圧"});
    if (!u.friction && !u.bed_friction) all.push_back({"uncertainty of friction", "摩擦の不確かさ"});
    if (!u.thickness) all.push_back({"uncertainty of the volume", "崩壊土量の不確かさ"});
    if (s.terrain && !u.dem_error) all.push_back({"errors of the elevation model", "標高モデルの誤差"});
    return all;
}

namespace {

Json json_of(const Run& r, const std::vector<Input>& inputs, const Answer& a)
{
    Json settings = Json::object();
    for (std::size_t k = 0; k < inputs.size(); ++k) settings[inputs[k].name] = r.member.values[k];
    Json j{{"directory", r.directory.string()},
           {"part", word(r.part)},
           {"number", r.member.number},
           {"status", word(r.status)},
           {"counted", std::ranges::find_if(a.counted, [&](const Run* c) { return c->directory == r.directory; }) != a.counted.end()},
           {"settings", settings},
           {"layers", r.layers},
           {"spacing", r.spacing},
           {"seconds", r.seconds},
           {"reach", r.finished() ? Json(r.maps->reach) : Json()},
           {"volume", r.finished() ? Json(r.maps->volume) : Json()}};
    if (!r.message.empty()) j["message"] = r.message;
    if (!r.notes.empty()) j["notes"] = r.notes;
    return j;
}

Json json_of(const std::vector<Input>& inputs)
{
    Json list = Json::array();
    for (const auto& i : inputs)
        list.push_back({{"name", i.name}, {"unit", i.unit}, {"low", i.range.low}, {"likely", i.range.likely}, {"high", i.range.high}});
    return list;
}

Json sensitivity_of(const Answer& a)
{
    Json list = Json::array();
    for (const auto& s : a.sensitivity)
        list.push_back({{"input", s.input},
                        {"rank_correlation", number(s.correlation)},
                        {"interval", {number(s.interval[0]), number(s.interval[1])}}});
    return list;
}

Json english(const std::vector<Words>& lines)
{
    Json list = Json::array();
    for (const auto& w : lines) list.push_back(w.en);
    return list;
}

} // namespace

Json to_json(const State& st, const Answer& a)
{
    const auto inputs = inputs_of(st.base.uncertain);
    Json members = Json::array(), likely = Json::array();
    int finished = 0, failed = 0;
    double layers = 0;
    for (const auto& r : st.runs) {
        (r.part == Part::Member ? members : likely).push_back(json_of(r, inputs, a));
        if (r.part == Part::Member) finished += r.finished(), failed += r.status == Status::Failed || r.status == Status::Refused;
        if (r.finished() && r.part != Part::Member) layers = std::max(layers, r.layers);
    }
    for (const auto* r : a.counted) layers = layers > 0 ? layers : r->layers;
    const auto maps = maps_of_runs(st.base);
    Json j{{"title", st.base.scene.title},
           {"version", version_text()},
           {"scene", st.scene_file},
           {"scene_hash", io::scene_hash(st.base.scene)},
           {"final", st.final},
           {"preliminary", a.preliminary},
           {"deadline_seconds", st.deadline},
           {"ended_seconds", st.ended},
           {"layers", layers},
           {"reach", {{"low", a.low}, {"likely", a.likely}, {"high", a.high}}},
           {"discretisation",
            {{"half_width", a.discretisation.half_width},
             {"front", a.discretisation.front},
             {"how", a.discretisation.how},
             {"thickness", a.discretisation.finest_two.empty() ? Json() : Json(a.discretisation.thickness)},
             {"layers_and_reach", a.discretisation.samples}}},
           {"volume", {{"low", a.volume[0]}, {"mean", a.volume[1]}, {"high", a.volume[2]}}},
           {"area", {{"p05", a.area_05}, {"p50", a.area_50}, {"p95", a.area_95}}},
           {"members_finished", finished},
           {"members_failed", failed},
           {"counted", a.counted.size()},
           {"inputs", json_of(inputs)},
           {"seed", st.base.uncertain.seed},
           {"group", st.group},
           {"sensitivity", sensitivity_of(a)},
           {"cell", maps.cell},
           {"wet", maps.wet},
           {"coarsest_spacing", st.base.coarsest},
           {"crs", st.base.scene.map_frame.crs.empty() ? Json() : Json(io::crs_name(st.base.scene.map_frame.crs))},
           {"not_done", english(st.not_done)},
           {"not_modelled", english(st.not_modelled)},
           {"likely_runs", likely},
           {"members", members}};
    if (const auto& e = st.base.uncertain.dem_error) j["dem_error"] = {{"height", e->height}, {"length", e->length}};
    return j;
}

} // namespace kuzure::hazard
