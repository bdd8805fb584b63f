#include "io/rows.hpp"
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace kuzure::io {
namespace {

/// Length of the part of a table up to and with the last whole row not later than `time`.
struct Kept {
    std::size_t bytes;
    std::optional<double> last_time;
};
Kept up_to(const std::string& all, const std::string& names, double time, const Place& file)
{
    if (all.compare(0, names.size(), names) != 0)
        throw IoFailed(fmt::format("{}: this is no table of this version of kuzure (its first line differs): move it "
                                   "away and restart again",
                                   file.string()));
    const auto second = all.find('\n', names.size());
    if (second == std::string::npos) return {names.size(), {}};
    Kept kept{second + 1, {}};
    for (auto line = kept.bytes; line < all.size();) {
        const auto end = all.find('\n', line);
        double t;
        if (end == std::string::npos) {
            // Of a whole row an editor may have taken the line's end; rows up to the checkpoint's time were on the disk before it.
            const auto cells = [](std::string_view row) { return std::count(row.begin(), row.end(), ','); };
            const std::string_view row = std::string_view(all).substr(line);
            const bool number = std::from_chars(row.data(), row.data() + row.size(), t).ec == std::errc{};
            if (number && t <= time && cells(row) == cells(names)) kept = {all.size(), t};
            break;
        }
        if (std::from_chars(all.data() + line, all.data() + end, t).ec != std::errc{})
            throw IoFailed(fmt::format("{}: a row does not begin with a time: '{}': repair or move the file away", file.string(),
                                       all.substr(line, std::min<std::size_t>(end - line, 60))));
        if (t > time) break;
        kept = {end + 1, t};
        line = end + 1;
    }
    return kept;
}

} // namespace

Rows::Rows(const Team& team, const Place& file, std::string names, const std::string& units, std::optional<double> restart_time)
    : team_(team), file_(file)
{
    names += '\n';
    on_root(team, [&] {
        std::string start = names + units + '\n';
        bool write = true;
        if (restart_time && exists(file)) {
            std::string all = read_text(file);
            const Kept kept = up_to(all, names, *restart_time, file);
            last_time_ = kept.last_time;
            if (kept.bytes > names.size()) { // else the crash came before the line of units: start anew
                write = kept.bytes != all.size();
                all.resize(kept.bytes);
                if (all.back() != '\n') all += '\n', write = true;
                start = std::move(all);
            }
        }
        if (write) write_atomically(file, start);
        fd_ = open_file(file, O_WRONLY | O_APPEND);
        if (fd_ < 0) throw IoFailed(fmt::format("{}: opening failed: {}", file.string(), cause(file, errno)));
    });
    double t = team.max(last_time_.value_or(-HUGE_VAL));
    if (t != -HUGE_VAL) last_time_ = t;
}

void Rows::append(double time, const std::string& row)
{
    on_root(team_, [&] {
        const std::string line = row + '\n';
        const auto before = ::lseek(fd_, 0, SEEK_END);
        std::size_t written = 0;
        while (written < line.size()) {
            const auto n = ::write(fd_, line.data() + written, line.size() - written);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) {
                const int error = n < 0 ? errno : ENOSPC;
                // Half a row would be worse than none.
                if (before >= 0 && ::ftruncate(fd_, before) != 0) {}
                throw IoFailed(fmt::format("{}: appending a row failed: {}", file_.string(), cause(file_, error)));
            }
            written += std::size_t(n);
        }
    });
    last_time_ = time;
}

void Rows::sync()
{
    on_root(team_, [&] {
        if (::fsync(fd_) != 0) throw IoFailed(fmt::format("{}: bringing it to the disk failed: {}", file_.string(), cause(file_, errno)));
    });
}

} // namespace kuzure::io
