#pragma once
// What a test under mpirun gets from main.cpp: every rank runs every test, and all of them are world().
#include "decomposition/comm.hpp"

namespace kuzure {

/// All ranks of the test program; also a `const Team&`.
inline const Comm& world() { return Comm::world(); }

} // namespace kuzure
