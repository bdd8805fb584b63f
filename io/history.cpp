#include "io/history.hpp"
#include <cerrno>
#include <charconv>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace kuzure::io {
namespace {

constexpr std::string_view names = "time,step,dt,kinetic,potential,elastic,plastic,viscous,wall,damping,residual,max_speed,height,"
                                   "front_min_x,front_max_x,front_min_y,front_max_y\n";

std::string units(int dimensions)
{
    const char* energy = dimensions == 3 ? "J" : "J/m";
    return fmt::format("# s,1,s,{0},{0},{0},{0},{0},{0},{0},1,m/s,m,m,m,m,m\n", energy);
}

/// Shortest digits that read back to the same number.
std::string text(const HistoryRow& r)
{
    return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", r.time, r.step, r.dt, r.kinetic, r.potential, r.elastic,
                       r.plastic, r.viscous, r.wall, r.damping, r.residual, r.max_speed, r.height, r.front_min_x, r.front_max_x,
                       r.front_min_y, r.front_max_y);
}

/// Length of the part of a history up to and with the last whole row not later than `time`.
struct Kept {
    std::size_t bytes;
    std::optional<double> last_time;
};
Kept up_to(const std::string& all, double time, const Path& file)
{
    if (all.compare(0, names.size(), names) != 0)
        throw IoFailed(fmt::format("{}: this is not a history of this version of kuzure (its first line differs): move it "
                                   "away and restart again",
                                   file.string()));
    const auto second = all.find('\n', names.size());
    if (second == std::string::npos) return {names.size(), {}};
    Kept kept{second + 1, {}};
    for (auto line = kept.bytes; line < all.size();) {
        const auto end = all.find('\n', line);
        double t;
        if (end == std::string::npos) break;
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

History::History(const Team& team, const Path& file, int dimensions, std::optional<double> restart_time) : team_(team), file_(file)
{
    on_root(team, [&] {
        std::string start = std::string(names) + units(dimensions);
        bool write = true;
        if (restart_time && std::filesystem::exists(file)) {
            std::string all = read_text(file);
            const Kept kept = up_to(all, *restart_time, file);
            last_time_ = kept.last_time;
            if (kept.bytes > names.size()) { // else the crash came before the line of units: start anew
                write = kept.bytes != all.size();
                all.resize(kept.bytes);
                start = std::move(all);
            }
        }
        if (write) write_atomically(file, start);
        fd_ = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
        if (fd_ < 0) throw IoFailed(fmt::format("{}: opening failed: {}", file.string(), cause(file, errno)));
    });
    double t = team.max(last_time_.value_or(-HUGE_VAL));
    if (t != -HUGE_VAL) last_time_ = t;
}

History::~History()
{
    if (fd_ >= 0) ::close(fd_);
}

void History::append(const HistoryRow& row)
{
    on_root(team_, [&] {
        const std::string line = text(row);
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
    last_time_ = row.time;
}

void History::sync()
{
    on_root(team_, [&] {
        if (::fsync(fd_) != 0) throw IoFailed(fmt::format("{}: bringing it to the disk failed: {}", file_.string(), cause(file_, errno)));
    });
}

} // namespace kuzure::io
