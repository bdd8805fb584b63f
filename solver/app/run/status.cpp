#include "solver/app/run/status.hpp"
#include "solver/core/wall_clock.hpp"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <string_view>
#include <sys/ioctl.h>
#include <unistd.h>

namespace kuzure {

namespace {
std::string duration(double seconds)
{
    const auto s = std::llround(seconds);
    if (s < 100) return fmt::format("{} s", s);
    if (s < 6000) return fmt::format("{} min", (s + 30) / 60);
    if (s < 172800) return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
    return fmt::format("{} d {} h", s / 86400, s % 86400 / 3600);
}

/// An interactive terminal; TERM=dumb says that it cannot move its cursor.
bool own_terminal()
{
    const char* kind = std::getenv("TERM");
    return isatty(STDOUT_FILENO) != 0 && kind && std::string_view(kind) != "dumb" && !launched();
}
} // namespace

const std::vector<std::string>& progress_names()
{
    static const std::vector<std::string> names{"auto", "bar", "plain", "none"};
    return names;
}

StatusLine::StatusLine(bool prints, Progress how, double end, double begin, std::int64_t step)
    : prints_(prints && how != Progress::None), bar_(how == Progress::Bar || (how == Progress::Auto && own_terminal())), end_(end),
      start_(wall_clock()), last_(start_), time_(begin), step_(step)
{
}

bool StatusLine::due(bool final) const
{
    if (!prints_) return false;
    const double t = wall_clock();
    // A log of a long run stays short: every ten seconds at first, every fiftieth of the time gone by later.
    return final || t - last_ >= (bar_ ? 0.5 : std::max(10.0, (t - start_) / 50));
}

std::string StatusLine::text(const Status& s, double end, double rate, double left)
{
    // What people ask first stands first: a narrow terminal shows no more.
    std::string out = fmt::format("t {:.4f}/{:g} s", s.time, end);
    if (left >= 0) {
        const std::time_t at = std::time(nullptr) + std::llround(left);
        out += fmt::format("  {} left, ends {:%H:%M}", duration(left), fmt::localtime(at));
    }
    if (s.residual) out += fmt::format("  energy {:+.3f} %", 100 * *s.residual);
    out += fmt::format("  {:.3g} steps/s  step {}  dt {:.2e}", rate, s.step, s.dt);
    if (s.fronts) {
        out += fmt::format("  front x {:.2f}..{:.2f}", s.fronts->min_x, s.fronts->max_x);
        if (s.dimensions == 3) out += fmt::format(" y {:.2f}..{:.2f}", s.fronts->min_y, s.fronts->max_y);
        out += " m";
    }
    out += fmt::format("  max {:.2f} m/s", s.max_speed);
    if (s.fronts && s.fronts->off_ground > 0) out += fmt::format("  off the ground {:.2g} %", 100 * s.fronts->off_ground);
    if (s.ranks > 1) out += fmt::format("  balance {:.2f}", s.imbalance);
    return out;
}

void StatusLine::show(const Status& s, bool final)
{
    const double t = wall_clock(), passed = std::max(t - last_, 1e-6);
    // The recent pace, remembered for about half a minute.
    const double weight = rate_ > 0 ? 1 - std::exp(-passed / 30) : 1;
    rate_ += weight * (double(s.step - step_) / passed - rate_);
    pace_ += weight * ((s.time - time_) / passed - pace_);
    const double rate = rate_, left = final || pace_ <= 0 ? -1 : (end_ - s.time) / pace_;
    last_ = t, time_ = s.time, step_ = s.step;
    const double done = std::clamp(s.time / end_, 0.0, 1.0);
    std::string line = text(s, end_, rate, left);
    // Not by fmt's print, which throws: a run goes on when the status cannot be written.
    if (!bar_) std::fputs(fmt::format("{:3.0f} %  {}\n", 100 * done, line).c_str(), stdout);
    else {
        winsize size{};
        const int columns = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
        const int width = columns >= 140 ? 20 : 10, full = int(done * width);
        // Longer than the terminal is wide, it could not renew itself.
        line = shortened(line, std::size_t(std::max(0, columns - width - 4)));
        std::fputs(fmt::format("\r[{}{}] {}\x1b[K{}", std::string(std::size_t(full), '#'), std::string(std::size_t(width - full), '.'),
                               line, final ? "\n" : "")
                       .c_str(),
                   stdout);
        standing_ = !final;
    }
    std::fflush(stdout);
}

std::string StatusLine::shortened(const std::string& text, std::size_t columns)
{
    if (text.size() <= columns) return text;
    const auto end = text.rfind("  ", columns);
    return text.substr(0, end == text.npos ? columns : end);
}

void StatusLine::make_room()
{
    if (!standing_) return;
    std::fputs("\r\x1b[K", stdout);
    std::fflush(stdout);
    standing_ = false;
}

StatusLine::~StatusLine()
{
    // What comes next, an error perhaps, begins on a line of its own.
    if (standing_) std::fputc('\n', stdout), std::fflush(stdout);
}

} // namespace kuzure
