#include "io/summary.hpp"
#include <nlohmann/json.hpp>

namespace kuzure::io {
using nlohmann::ordered_json;

ordered_json effects_json(const std::vector<scene::EffectNote>& notes)
{
    ordered_json effects = {{"on", ordered_json::array()}, {"off", ordered_json::array()}};
    for (const auto& note : notes) effects[note.on ? "on" : "off"].push_back({{"name", note.name}, {"why", note.why}});
    return effects;
}

ordered_json to_json(const Summary& s)
{
    ordered_json energy = ordered_json::object();
    for (const auto& [name, value] : s.energy) energy[name] = value;
    ordered_json all = {
        {"status", s.status},
        {"exit_code", s.exit_code},
        {"scene_hash", s.scene_hash},
        {"version", s.version},
        {"ranks", s.ranks},
        {"threads", s.threads},
        {"precision", s.precision},
        {"soil_particles", s.soil_particles},
        {"wall_particles", s.wall_particles},
        {"steps", s.steps},
        {"time", s.time},
        {"wall_seconds", s.wall_seconds},
        {"pairs", s.pairs},
        {"seconds_per_step", s.seconds_per_step},
        {"particle_steps_per_second", s.particle_steps_per_second},
        {"energy", energy},
        {"effects", effects_json(s.effects)},
        {"state_hash", s.state_hash},
        {"host", s.host},
        {"hosts", s.hosts},
        {"predicted_seconds", s.predicted_seconds},
        {"predicted_interval", {s.predicted_low, s.predicted_high}},
        {"warnings", s.warnings},
    };
    if (!s.message.empty()) all["message"] = s.message;
    return all;
}

void write_summary(const Team& team, const Place& file, const Summary& summary) { write_json(team, file, to_json(summary)); }

void write_json(const Team& team, const Place& file, const ordered_json& value)
{
    // A message may carry bytes that are not UTF-8 (a file name): replaced, never a reason to lose the summary.
    on_root(team, [&] { write_atomically(file, value.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n"); });
}

} // namespace kuzure::io
