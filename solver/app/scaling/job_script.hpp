#pragma once
// The batch script of a planned job, from the template of its machine's batch system.
#include "solver/app/scaling/job_plan.hpp"
#include <string>

namespace kuzure {

/// Throws BadInput where the template asks for what there is not, and for words of users that no batch system takes.
std::string job_script(const JobPlan&, const JobArguments&);

} // namespace kuzure
