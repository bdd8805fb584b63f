#include "solver/app/hazard/directory.hpp"
#include <fmt/format.h>

namespace kuzure::hazard {

io::Path directory_for(const std::string& asked, const Scene& s, const std::string& scene_file, const std::string& what)
{
    if (!asked.empty()) return asked;
    if (!s.output.directory.empty()) return s.output.directory + "-" + what;
    return io::Path("results") / (io::Path(scene_file).stem().string() + "-" + what);
}

void require_ours(const io::Path& directory, const std::string& mark, const std::string& what)
{
    std::error_code error;
    if (std::filesystem::exists(directory, error) && !std::filesystem::is_directory(directory, error))
        throw BadInput(fmt::format("{}: expected a directory, found a file; choose another with -o DIR", directory.string()));
    if (std::filesystem::is_directory(directory, error) && !std::filesystem::is_empty(directory, error) &&
        !std::filesystem::exists(directory / mark, error))
        throw BadInput(fmt::format("{}: expected a new directory or that of a {}, found one with other things in it; choose another "
                                   "with -o DIR",
                                   directory.string(), what));
}

void make_directories(const io::Path& directory, const std::string& runs)
{
    std::error_code error; // writing says why, where it fails
    for (const auto& name : {std::string(), std::string("scenes"), std::string("inputs"), std::string("logs"), runs})
        std::filesystem::create_directories(name.empty() ? directory : directory / name, error);
}

} // namespace kuzure::hazard
