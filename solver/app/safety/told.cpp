// What is told of a factor of safety: safety.json, safety.csv, notes.
#include "solver/app/safety/kept.hpp"
#include "solver/app/safety/runner.hpp"
#include "solver/scene/material.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <numbers>

namespace kuzure::safety {

using Json = nlohmann::ordered_json;

std::vector<std::string> notes_of(const Scene& s)
{
    std::vector<std::string> notes;
    const auto degrees = [](double angle) { return angle * 180 / std::numbers::pi; };
    for (const auto& soil : s.soils) {
        const Material m = Material::from(soil);
        const bool of_triaxial = soil.cone == scene::Cone::Compression || soil.cone == scene::Cone::Extension;
        if (s.dimensions == 2 && of_triaxial && soil.friction_angle > 0)
            notes.push_back(fmt::format("soil {}: this cone acts in plane strain like a friction angle of {:.1f} deg where {:.1f} deg is "
                                        "written; for Mohr's and Coulomb's take cone = \"plane strain\" with dilation_angle = "
                                        "friction_angle, or \"plane strain, no dilation\"",
                                        soil.name, degrees(m.angle_of_the_stress_circle()), degrees(soil.friction_angle)));
        else if (soil.friction_angle > 0 && soil.dilation_angle < soil.friction_angle)
            notes.push_back(fmt::format("soil {}: with less dilation than friction the factor lies between {:.3f} and 1 of that of "
                                        "associated flow, which stability charts give (Davis 1968)",
                                        soil.name, std::cos(m.angle_of_the_stress_circle())));
        if (soil.softening)
            notes.push_back(fmt::format("soil {}: it softens; first and residual strength are both over F, and what softens on the way to "
                                        "rest counts",
                                        soil.name));
    }
    if (std::ranges::any_of(s.walls, [](const scene::Wall& w) { return w.surface == scene::Surface::Coulomb; }))
        notes.push_back("tan of the friction angle of Coulomb walls and ground is over F as well");
    return notes;
}

Json to_json(const Told& t)
{
    const auto number = [](const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); };
    Json j;
    j["scene"] = t.scene_file, j["version"] = version_text();
    j["factor"] = number(t.answer.factor()), j["stands"] = number(t.answer.holds), j["fails"] = number(t.answer.fails);
    j["answer"] = t.answer.words();
    if (t.at) j["at"] = *t.at;
    j["criterion"] = {{"words", criterion(t.setting)}, {"unbalanced_at_rest", at_rest}, {"displacement_limit", t.setting.limit},
                      {"time_unit", t.setting.unit},   {"damping", t.setting.damping},  {"height", t.setting.height}};
    j["notes"] = t.notes;
    if (!t.picture.empty()) j["picture"] = t.picture;
    j["trials"] = Json::array();
    for (const auto& trial : t.trials) {
        j["trials"].push_back({{"factor", trial.factor},
                               {"outcome", word(trial.outcome)},
                               {"run", "runs/" + trial.name},
                               {"displacement", trial.seen.back().displacement},
                               {"unbalanced", trial.seen.back().unbalanced},
                               {"seconds", trial.seconds},
                               {"legs", legs_of(trial.seen)}});
    }
    return j;
}

std::string to_csv(const Told& t)
{
    std::string csv = "factor,outcome,time,displacement,creep,unbalanced\n# 1,,s,m,m/s,1\n";
    for (const auto& trial : t.trials)
        for (const auto& s : trial.seen)
            csv += fmt::format("{:.10g},{},{:.9g},{:.9g},{:.9g},{:.9g}\n", trial.factor, word(trial.outcome), s.time, s.displacement,
                               s.creep, s.unbalanced);
    return csv;
}

} // namespace kuzure::safety
