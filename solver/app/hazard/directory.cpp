#include "solver/app/hazard/directory.hpp"
#include <fmt/format.h>

namespace kuzure::hazard {

io::Path directory_for(const std::string& asked, const Scene& s, const std::string& scene_file, const std::string& what)
{
    if (!asked.empty()) return asked;
    if (!s.output.directory.empty()) return s.output.directory + "-" + what;
    return io::Path("results") / (io::Path(scene_file).stem().string() + "-" + what);
}

void make_directories(const io::Path& directory, const std::string& runs)
{
    std::error_code error; // writing says why, where it fails
    for (const auto& name : {std::string(), std::string("scenes"), std::string("inputs"), std::string("logs"), runs})
        std::filesystem::create_directories(name.empty() ? directory : directory / name, error);
}

} // namespace kuzure::hazard
