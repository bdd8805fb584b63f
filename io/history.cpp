#include "io/history.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

/// Shortest digits that read back to the same number. What is not there is written here: fmt compares it, which traps.
std::string cell(double x, fmt::format_string<double&> digits = "{}") { return std::isnan(x) ? "nan" : fmt::format(digits, x); }
std::string cells(const Vector& v) { return cell(v.x) + ',' + cell(v.y) + ',' + cell(v.z); }
std::string per_metre(const char* unit, int dimensions) { return std::string(unit) + (dimensions == 3 ? "" : "/m"); }

/// The names of a table's columns and their units.
struct Head {
    std::string names, units;
};

Head head(const HistoryRow*, int dimensions)
{
    return {"time,step,dt,kinetic,potential,elastic,plastic,viscous,wall,damping,residual,max_speed,height,"
            "front_min_x,front_max_x,front_min_y,front_max_y,stabilising,moved_wall,events,loads",
            fmt::format("# s,1,s,{0},{0},{0},{0},{0},{0},{0},1,m/s,m,m,m,m,m,{0},{0},{0},{0}", per_metre("J", dimensions))};
}
std::string text(const HistoryRow& r)
{
    std::string line = fmt::format("{},{}", cell(r.time), r.step);
    for (double x : {r.dt, r.kinetic, r.potential, r.elastic, r.plastic, r.viscous, r.wall, r.damping, r.residual, r.max_speed, r.height,
                     r.front_min_x, r.front_max_x, r.front_min_y, r.front_max_y, r.stabilising, r.moved_wall, r.events, r.loads})
        line += ',' + cell(x);
    return line;
}

Head head(const EventRow*, int dimensions) { return {"time,step,event,what,taken", "# s,1,1,," + per_metre("J", dimensions)}; }
std::string text(const EventRow& r) { return fmt::format("{},{},{},{},{}", cell(r.time), r.step, r.event, r.what, cell(r.taken)); }

Head head(const ForceRow*, int dimensions)
{
    return {"time,wall,force_x,force_y,force_z,moment_x,moment_y,moment_z,impulse_x,impulse_y,impulse_z",
            fmt::format("# s,,{0},{0},{0},{1},{1},{1},{2},{2},{2}", per_metre("N", dimensions), per_metre("N m", dimensions),
                        per_metre("N s", dimensions))};
}
std::string text(const ForceRow& r)
{
    return fmt::format("{},{},{},{},{}", cell(r.time), r.wall, cells(r.force), cells(r.moment), cells(r.impulse));
}

Head head(const ProbeRow*, int)
{
    return {"time,probe,particles,x,y,z,velocity_x,velocity_y,velocity_z,density,stress_xx,stress_yy,stress_zz,stress_xy,stress_yz,"
            "stress_xz,plastic_strain",
            "# s,,1,m,m,m,m/s,m/s,m/s,kg/m^3,Pa,Pa,Pa,Pa,Pa,Pa,1"};
}
std::string text(const ProbeRow& r)
{
    const Stress& s = r.stress;
    return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}", cell(r.time), r.probe, r.particles, cells(r.position), cells(r.velocity),
                       cell(r.density), cell(s.xx), cell(s.yy), cell(s.zz), cell(s.xy), cell(s.yz), cell(s.xz), cell(r.plastic_strain));
}

Head head(const ProgressRow*, int) { return {"time,step,dt,wall,steps_per_second,balance", "# s,1,s,s,1/s,1"}; }
std::string text(const ProgressRow& r)
{
    return fmt::format("{},{},{},{:.3f},{},{}", cell(r.time), r.step, cell(r.dt), r.wall, cell(r.steps_per_second, "{:.4g}"),
                       cell(r.balance, "{:.4g}"));
}

} // namespace

template <class Row>
Log<Row>::Log(const Team& team, const Place& file, int dimensions, std::optional<double> restart_time)
    : Rows(team, file, head(static_cast<Row*>(nullptr), dimensions).names, head(static_cast<Row*>(nullptr), dimensions).units, restart_time)
{
}
template <class Row> void Log<Row>::append(const Row& row) { Rows::append(row.time, text(row)); }
template <class Row> void Log<Row>::append(std::span<const Row> rows)
{
    if (rows.empty()) return;
    std::string all; // as one piece
    for (const auto& row : rows) all += (all.empty() ? "" : "\n") + text(row);
    Rows::append(rows.front().time, all);
}

template class Log<HistoryRow>;
template class Log<EventRow>;
template class Log<ForceRow>;
template class Log<ProbeRow>;
template class Log<ProgressRow>;

} // namespace kuzure::io
