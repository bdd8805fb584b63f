#pragma once
// A run's clock as the header of a checkpoint.
#include "io/file.hpp"
#include "solver/run/simulation.hpp"

namespace kuzure {

/// Collective: the clock, names of its members as keys.
std::string clock_text(const Simulation&);
/// And back. Throws IoFailed, naming the file.
Clock clock_from_text(const std::string& header, const io::Place& file);

} // namespace kuzure
