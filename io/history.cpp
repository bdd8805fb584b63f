#include "io/history.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

constexpr const char* names = "time,step,dt,kinetic,potential,elastic,plastic,viscous,wall,damping,residual,max_speed,height,"
                              "front_min_x,front_max_x,front_min_y,front_max_y,stabilising,moved_wall,events";

std::string units(int dimensions)
{
    const char* energy = dimensions == 3 ? "J" : "J/m";
    return fmt::format("# s,1,s,{0},{0},{0},{0},{0},{0},{0},1,m/s,m,m,m,m,m,{0},{0},{0}", energy);
}

/// Shortest digits that read back to the same number. What is not there is written here: fmt compares it, which traps.
std::string cell(double x, fmt::format_string<double&> digits = "{}") { return std::isnan(x) ? "nan" : fmt::format(digits, x); }

std::string text(const HistoryRow& r)
{
    std::string line = fmt::format("{},{}", cell(r.time), r.step);
    for (double x : {r.dt, r.kinetic, r.potential, r.elastic, r.plastic, r.viscous, r.wall, r.damping, r.residual, r.max_speed, r.height,
                     r.front_min_x, r.front_max_x, r.front_min_y, r.front_max_y, r.stabilising, r.moved_wall, r.events})
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

namespace {
/// Rows of one time, as one piece.
template <class Row, class Text> std::string lines(const std::vector<Row>& rows, Text text)
{
    std::string all;
    for (const auto& row : rows) all += (all.empty() ? "" : "\n") + text(row);
    return all;
}
std::string cells(const Vector& v) { return cell(v.x) + ',' + cell(v.y) + ',' + cell(v.z); }
std::string per_metre(const char* unit, int dimensions) { return std::string(unit) + (dimensions == 3 ? "" : "/m"); }
} // namespace

EventLog::EventLog(const Team& team, const Place& file, int dimensions, std::optional<double> restart_time)
    : Rows(team, file, "time,step,event,what,taken", "# s,1,1,," + per_metre("J", dimensions), restart_time)
{
}
void EventLog::append(const std::vector<EventRow>& rows)
{
    if (rows.empty()) return;
    Rows::append(rows.front().time, lines(rows, [](const EventRow& r) {
                     return fmt::format("{},{},{},{},{}", cell(r.time), r.step, r.event, r.what, cell(r.taken));
                 }));
}

ForceLog::ForceLog(const Team& team, const Place& file, int dimensions, std::optional<double> restart_time)
    : Rows(team, file, "time,wall,force_x,force_y,force_z,moment_x,moment_y,moment_z,impulse_x,impulse_y,impulse_z",
           fmt::format("# s,,{0},{0},{0},{1},{1},{1},{2},{2},{2}", per_metre("N", dimensions), per_metre("N m", dimensions),
                       per_metre("N s", dimensions)),
           restart_time)
{
}
void ForceLog::append(const std::vector<ForceRow>& rows)
{
    if (rows.empty()) return;
    Rows::append(rows.front().time, lines(rows, [](const ForceRow& r) {
                     return fmt::format("{},{},{},{},{}", cell(r.time), r.wall, cells(r.force), cells(r.moment), cells(r.impulse));
                 }));
}

ProbeLog::ProbeLog(const Team& team, const Place& file, std::optional<double> restart_time)
    : Rows(team, file,
           "time,probe,particles,x,y,z,velocity_x,velocity_y,velocity_z,density,stress_xx,stress_yy,stress_zz,stress_xy,stress_yz,"
           "stress_xz,plastic_strain",
           "# s,,1,m,m,m,m/s,m/s,m/s,kg/m^3,Pa,Pa,Pa,Pa,Pa,Pa,1", restart_time)
{
}
void ProbeLog::append(const std::vector<ProbeRow>& rows)
{
    if (rows.empty()) return;
    Rows::append(rows.front().time, lines(rows, [](const ProbeRow& r) {
                     const Stress& s = r.stress;
                     return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}", cell(r.time), r.probe, r.particles, cells(r.position),
                                        cells(r.velocity), cell(r.density), cell(s.xx), cell(s.yy), cell(s.zz), cell(s.xy), cell(s.yz),
                                        cell(s.xz), cell(r.plastic_strain));
                 }));
}

ProgressLog::ProgressLog(const Team& team, const Place& file, std::optional<double> restart_time)
    : Rows(team, file, "time,step,dt,wall,steps_per_second,balance", "# s,1,s,s,1/s,1", restart_time)
{
}
void ProgressLog::append(const ProgressRow& row) { Rows::append(row.time, text(row)); }

} // namespace kuzure::io
