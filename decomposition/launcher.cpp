#include "decomposition/launcher.hpp"
#include <cstdlib>

namespace kuzure {

bool several_command_lines()
{
    const char* text = std::getenv("OMPI_NUM_APP_CTX");
    return text && std::atoi(text) > 1;
}

} // namespace kuzure
