#pragma once
// What the store of particles takes.
#include "solver/scene/fill.hpp"

namespace kuzure::scene {

/// Bytes of the columns of all soil particles of a run: the fields of the store, without records and lists.
double column_bytes(const Scene&, const Filling&);

} // namespace kuzure::scene
