#pragma once
// Everything there is to know about the keys of a scene file, in one table: the reader checks by it, the
// writer gets its comments from it, and the reference that users read is printed from it.
#include "io/keys.hpp"

namespace kuzure::io {

/// The keys of a scene file.
const KeyTable& scene_keys();

} // namespace kuzure::io
