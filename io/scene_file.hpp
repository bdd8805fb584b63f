#pragma once
// The scene file: TOML to a scene and back. What a scene may say stands in io/scene_description.hpp alone.
#include "solver/scene/check.hpp"
#include "solver/scene/scene.hpp"
#include "solver/scene/uncertain.hpp"
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace kuzure::io {

/// The file's bytes. Throws BadInput if it cannot be read or is larger than 1 MiB.
std::string read_scene_text(const std::filesystem::path&);

/// A checked and resolved scene from the text of a scene file; `name` is what messages call the file, and
/// every set is "key.path=value" and overrides the file. Throws BadInput with up to 20 lines `file:line: key:
/// expected, found, remedy`.
Scene parse_scene(std::string_view text, const std::string& name, std::span<const std::string> sets = {},
                  scene::StepLimit = scene::StepLimit::Enforce);

/// The same, with its warnings and the particles it starts with.
scene::CheckedScene parse_checked_scene(std::string_view text, const std::string& name, std::span<const std::string> sets,
                                        scene::StepLimit);

/// What the text of a scene file says under [uncertain]; nothing where it has none. Throws BadInput as parse_scene() does.
std::optional<scene::Uncertain> parse_uncertain(std::string_view text, const std::string& name, std::span<const std::string> sets = {});

/// parse_scene of read_scene_text. Throws BadInput.
Scene read_scene(const std::filesystem::path&, std::span<const std::string> sets = {}, scene::StepLimit = scene::StepLimit::Enforce);

/// The scene as TOML with every default written out; it reads back to the same scene bit for bit. [uncertain] is no part of it.
std::string write_scene(const Scene&);

/// 16 hexadecimal digits of all that changes the physics: everything but title, time.end, soil names and [output].
std::string scene_hash(const Scene&);
/// The first keys in which the physics of two scenes differ, with both values; empty where scene_hash is the same.
std::string physics_difference(const Scene& was, const Scene& is);

/// Every key with type, unit, default, range and meaning, as Markdown.
std::string scene_reference();

/// A JSON Schema (draft 2020-12) of scene files, by which editors complete and check them. It knows each key's type, range and
/// default; what ties several keys together only the reader checks.
std::string scene_schema();

} // namespace kuzure::io
