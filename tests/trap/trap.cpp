// Linked into the program and into the unit and MPI tests by KUZURE_TRAP_FPE (preset debug): the first invalid operation, division by
// zero or overflow ends them by SIGFPE, with a core or in a debugger at the very line. Set before main, so that every thread has it.
#include <cfenv>

namespace {

[[gnu::constructor]] void trap() { feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW); }

} // namespace
