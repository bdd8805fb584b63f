#include "solver/app/report/movie.hpp"
#include "io/picture_series.hpp"
#include "solver/app/cli/program.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <vector>

namespace kuzure::report {

namespace {
/// Exit code of ffmpeg; throws where there is no such program.
int ffmpeg(std::vector<std::string> words, const io::Path& directory)
{
    const auto code = run_program(std::move(words), directory);
    if (!code)
        throw IoFailed(
            "no film: ffmpeg is not installed. Remedy: apt-get install ffmpeg, then kuzure report --movie; the pictures are there");
    return *code;
}
/// A path as a pattern that only it fits.
std::string literal(const io::Path& path)
{
    std::string out;
    for (const char c : path.string()) {
        if (std::strchr("*?[]{}~\\", c)) out += '\\';
        out += c;
    }
    return out;
}
} // namespace

io::Path write_movie(const io::Path& where)
{
    const io::Path directory = std::filesystem::absolute(where);
    int pictures = 0;
    for (const auto& e : std::filesystem::directory_iterator(directory)) pictures += io::picture_number(e.path()).has_value();
    if (pictures < 2)
        throw IoFailed(fmt::format("{}: a film needs two pictures or more, found {}. Remedy: [output] picture and a shorter every",
                                   directory.string(), pictures));
    const std::string rate = std::to_string(std::clamp(pictures / 10, 4, 25));
    const std::vector<std::pair<const char*, std::vector<std::string>>> ways{
        {"movie.mp4", {"-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"}},
        {"movie.webm", {"-c:v", "libvpx-vp9", "-crf", "30", "-b:v", "0"}},
        {"movie.gif", {"-vf", "scale=960:-1"}},
    };
    for (const auto& [name, coding] : ways) {
        const std::string part = std::string("part_") + name;
        std::vector<std::string> words{
            "ffmpeg", "-y", "-nostdin", "-framerate", rate, "-pattern_type", "glob", "-i", literal(directory) + "/picture_[0-9]*.png"};
        words.insert(words.end(), coding.begin(), coding.end());
        words.push_back((directory / part).string());
        std::error_code ignored;
        std::filesystem::remove(directory / part, ignored); // what lies there may be a link
        const int code = ffmpeg(words, directory);
        if (code == 0) {
            for (const auto& way : ways) std::filesystem::remove(directory / way.first, ignored);
            std::filesystem::rename(directory / part, directory / name);
            return where / name;
        }
        std::filesystem::remove(directory / part, ignored);
    }
    throw IoFailed(
        fmt::format("{}: ffmpeg could make no film of the pictures. Remedy: try it by hand, ffmpeg -framerate {} -pattern_type glob "
                    "-i 'picture_[0-9]*.png' movie.mp4",
                    directory.string(), rate));
}

} // namespace kuzure::report
