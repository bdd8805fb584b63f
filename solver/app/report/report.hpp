#pragma once
// report.html: what a run did, on one self-contained page.
#include "perf/machine.hpp"
#include "solver/app/report/record.hpp"

namespace kuzure::report {

/// The page.
std::string html(const Record&);

/// Where timers.json of a run of this host names no roofs, measure them (or take those kept from before) and write them there.
void add_roofs(const io::Path& directory);

/// Reads the directory and writes its report.html; gives that file. Throws BadInput, IoFailed.
io::Path write_report(const io::Path& directory);

} // namespace kuzure::report
