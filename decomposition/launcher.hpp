#pragma once
// What a launcher tells beside rank and size (decomposition/comm.hpp).

namespace kuzure {

/// True where the launcher started several command lines (mpirun ... : ...) and says so, as Open MPI does. By the environment.
bool several_command_lines();

} // namespace kuzure
