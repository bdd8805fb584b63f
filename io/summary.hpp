#pragma once
// summary.json: what a run did, in one object that programs read.
#include "io/file.hpp"
#include "solver/scene/scene.hpp"
#include <nlohmann/json_fwd.hpp>

namespace kuzure::io {

/// The content of summary.json; names as in the file.
struct Summary {
    std::string status; // "finished", "stopped", "numbers failed", "io failed"
    int exit_code = 0;
    std::string scene_hash, version;
    int ranks = 1, threads = 1;
    std::string precision; // "double" | "mixed"
    std::int64_t soil_particles = 0, wall_particles = 0, steps = 0;
    double time = 0;         // s, simulated
    double wall_seconds = 0; // s
    std::int64_t pairs = 0;  // directed, summed over steps
    double seconds_per_step = 0, particle_steps_per_second = 0;
    std::vector<std::pair<std::string, double>> energy; // name, J
    std::vector<scene::EffectNote> effects;
    std::string state_hash;
    std::string host; // of rank 0
    int hosts = 1;
    std::vector<std::string> warnings;
    double predicted_seconds = 0, predicted_low = 0, predicted_high = 0; // s, said at the start, of this start of the program
    std::string message;                                                 // why it ended, where that is not plain; left out when empty
};

/// {"on": [{name, why}], "off": [{name, why}]}, as summary.json and `kuzure check --json` show it.
nlohmann::ordered_json effects_json(const std::vector<scene::EffectNote>&);

/// The object that summary.json holds. Numbers that are not finite become null.
nlohmann::ordered_json to_json(const Summary&);

/// Collective: rank 0 writes, atomically. Throws IoFailed on all ranks.
void write_summary(const Team&, const Place& file, const Summary&);

/// Collective: rank 0 writes any JSON value, indented, atomically. Throws IoFailed on all ranks.
void write_json(const Team&, const Place& file, const nlohmann::ordered_json&);

} // namespace kuzure::io
