#include "solver/app/study/runs.hpp"
#include "io/owner.hpp"
#include "solver/app/cli/command.hpp"
#include <chrono>
#include <cstdio>
#include <fmt/format.h>
#include <thread>

namespace kuzure::study {

void say(const std::string& text)
{
    fmt::print("{}\n", text);
    std::fflush(stdout);
}

std::string seconds_text(double s) { return s < 100 ? fmt::format("{:.1f} s", s) : fmt::format("{:.1f} min", s / 60); }

std::string last_words(const io::Path& log)
{
    std::string text;
    try {
        text = io::read_text(log);
    } catch (const IoFailed& e) {
        return e.what();
    }
    while (!text.empty() && text.back() == '\n') text.pop_back();
    text = text.substr(text.rfind('\n') + 1);
    return text.starts_with("kuzure: ") ? text.substr(8) : text;
}

io::Path directory_for(const std::string& asked, const Scene& s, const std::string& scene_file, const std::string& what)
{
    if (!asked.empty()) return asked;
    if (!s.output.directory.empty()) return s.output.directory + "-" + what;
    return io::Path("results") / (io::Path(scene_file).stem().string() + "-" + what);
}

void make_directories(const io::Path& directory, std::initializer_list<const char*> folders)
{
    std::error_code error; // writing says why, where it fails
    std::filesystem::create_directories(directory, error);
    for (const char* name : folders) std::filesystem::create_directories(directory / name, error);
}

void require_own_directory(const io::Path& out, const char* mark, const char* what)
{
    std::error_code error;
    if (std::filesystem::exists(out, error) && !std::filesystem::is_directory(out, error))
        throw BadInput(fmt::format("{}: expected a directory, found a file; choose another with -o DIR", out.string()));
    if (std::filesystem::is_directory(out, error) && !std::filesystem::is_empty(out, error) && !std::filesystem::exists(out / mark, error))
        throw BadInput(
            fmt::format("{}: expected a new directory or that of {}, found one with other things in it; choose another with -o DIR",
                        out.string(), what));
}

void wait_for_the_end_of_a_run(const io::Path& directory)
{
    std::error_code error;
    for (int k = 0; k < 100 && std::filesystem::is_directory(directory, error); ++k) {
        try {
            io::Ownership::refuse_if_owned(io::hold(directory));
            return;
        } catch (const BadInput&) {
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
        }
    }
}

bool waited_for_an_earlier_run(int exit_code, const io::Path& log, const io::Path& directory, int& times)
{
    if (exit_code != int(Exit::BadInput) || times <= 0 || last_words(log).find(io::Ownership::refusal) == std::string::npos) return false;
    --times;
    wait_for_the_end_of_a_run(directory);
    return true;
}

bool has_checkpoint(const io::Path& directory)
{
    std::error_code error;
    return std::filesystem::exists(directory / "checkpoint.h5", error) || std::filesystem::exists(directory / "checkpoint.prev.h5", error);
}

} // namespace kuzure::study
