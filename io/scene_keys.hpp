#pragma once
// Everything there is to know about the keys of a scene file, in one table: the reader checks by it, the
// writer gets its comments from it, and the reference that users read is printed from it.
#include "io/keys.hpp"
#include <utility>

namespace kuzure::io {

/// The keys of a scene file.
const KeyTable& scene_keys();

/// A named point of the trade of time for error: the keys it sets where a scene does not write them.
struct Preset {
    std::string name, doc;
    std::vector<std::pair<std::string, std::string>> settings; // path, value as TOML
};
/// "seed", "fast", "standard", "accurate" (docs/accuracy.md has what each was measured to cost). The defaults of their keys are
/// those of default_preset.
const std::vector<Preset>& presets();
inline constexpr std::string_view default_preset = "standard";

} // namespace kuzure::io
