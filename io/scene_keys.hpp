#pragma once
// The keys of a scene file as a table, collected from io/scene_description.hpp, and the presets that set some of them.
#include "io/keys.hpp"
#include "solver/scene/scene.hpp"
#include <utility>

namespace kuzure::io {

/// The keys of a scene file.
const KeyTable& scene_keys();

/// A named point of the trade of time for error: the keys it sets where a scene does not write them.
struct Preset {
    scene::Preset value;
    std::string name, doc;
    std::vector<std::pair<std::string, std::string>> settings; // path, value as TOML
};
/// "seed", "fast", "standard", "accurate" (docs/accuracy.md has what each was measured to cost). The defaults of the keys they
/// set are those of the default of accuracy.preset.
const std::vector<Preset>& presets();
/// Their names.
const Words<scene::Preset>& preset_words();

} // namespace kuzure::io
