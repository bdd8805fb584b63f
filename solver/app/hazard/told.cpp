// hazard.json, and what no run has in it.
#include "io/ground/crs.hpp"
#include "solver/app/hazard/runner.hpp"
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(); }

} // namespace

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
    const auto maps = maps_for(st.base.scene, st.base.coarsest);
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
            {{"half_width", number(a.discretisation.half_width)},
             {"how", a.discretisation.how},
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
