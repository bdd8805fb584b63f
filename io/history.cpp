#include "io/history.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

constexpr const char* names = "time,step,dt,kinetic,potential,elastic,plastic,viscous,wall,damping,residual,max_speed,height,"
                              "front_min_x,front_max_x,front_min_y,front_max_y,stabilising,moved_wall";

std::string units(int dimensions)
{
    const char* energy = dimensions == 3 ? "J" : "J/m";
    return fmt::format("# s,1,s,{0},{0},{0},{0},{0},{0},{0},1,m/s,m,m,m,m,m,{0},{0}", energy);
}

/// Shortest digits that read back to the same number. What is not there is written here: fmt compares it, which traps.
std::string cell(double x, fmt::format_string<double&> digits = "{}") { return std::isnan(x) ? "nan" : fmt::format(digits, x); }

std::string text(const HistoryRow& r)
{
    std::string line = fmt::format("{},{}", cell(r.time), r.step);
    for (double x : {r.dt, r.kinetic, r.potential, r.elastic, r.plastic, r.viscous, r.wall, r.damping, r.residual, r.max_speed, r.height,
                     r.front_min_x, r.front_max_x, r.front_min_y, r.front_max_y, r.stabilising, r.moved_wall})
        line += ',' + cell(x);
    return line;
}

std::string text(const ProgressRow& r)
{
    return fmt::format("{},{},{},{:.3f},{},{}", cell(r.time), r.step, cell(r.dt), r.wall, cell(r.steps_per_second, "{:.4g}"),
                       cell(r.balance, "{:.4g}"));
}

} // namespace

History::History(const Team& team, const Place& file, int dimensions, std::optional<double> restart_time)
    : Rows(team, file, names, units(dimensions), restart_time)
{
}
void History::append(const HistoryRow& row) { Rows::append(row.time, text(row)); }

ProgressLog::ProgressLog(const Team& team, const Place& file, std::optional<double> restart_time)
    : Rows(team, file, "time,step,dt,wall,steps_per_second,balance", "# s,1,s,s,1/s,1", restart_time)
{
}
void ProgressLog::append(const ProgressRow& row) { Rows::append(row.time, text(row)); }

} // namespace kuzure::io
