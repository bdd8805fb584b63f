#pragma once
// What a scene's events, loads and named walls have done: a part of the report.
#include "solver/app/report/record.hpp"

namespace kuzure::report {

/// Events with their energies, loads with their forces, force on each named wall over time; nothing where the scene has none of them.
std::string stages(const Record&);

} // namespace kuzure::report
