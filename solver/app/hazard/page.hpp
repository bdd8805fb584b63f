#pragma once
// The answer as one page for a person under pressure, in English and Japanese.
#include "solver/app/hazard/runner.hpp"

namespace kuzure::hazard {

/// The page; pictures are read from DIR/maps.
std::string html(const State&, const Answer&, const io::Path& directory);

} // namespace kuzure::hazard
