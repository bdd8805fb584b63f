#include "solver/scene/events.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/strength.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

namespace kuzure::scene {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// How much of an event has happened at a time, 0 .. 1.
double share_of(const Event& e, double time)
{
    if (e.at || !e.from || !e.to) return 1;
    return std::clamp((time - *e.from) / (*e.to - *e.from), 0.0, 1.0);
}
double between(double a, double b, double share) { return share == 1 ? b : a + share * (b - a); }
void move(double& a, const std::optional<double>& b, double share)
{
    if (b) a = between(a, *b, share);
}
void change(Soil& soil, const SoilChange& c, double share)
{
    move(soil.young, c.young, share), move(soil.poisson, c.poisson, share), move(soil.cohesion, c.cohesion, share);
    move(soil.friction_angle, c.friction_angle, share), move(soil.dilation_angle, c.dilation_angle, share);
    if (c.tension_cutoff) soil.tension_cutoff = between(soil.tension_cutoff.value_or(*c.tension_cutoff), *c.tension_cutoff, share);
    if (c.cone) soil.cone = *c.cone;
    if (c.stiffness) soil.young *= between(1, *c.stiffness, share);
    if (!c.strength) return;
    scale_strength(soil, between(1, *c.strength, share));
    soil.dilation_angle = std::min(soil.dilation_angle, soil.friction_angle);
}

/// Acceleration (m/s^2) of the ground at a time of its record (s); none before and after it.
Vector acceleration(const Record& shaking, double time)
{
    const auto& rows = *shaking.rows;
    return time < rows.front()[0] || time > rows.back()[0] ? Vector{} : value_at(shaking, time);
}

/// Index of what has a name; -1 where nothing has.
template <class Parts> int named(const Parts& parts, const std::string& name)
{
    const auto found = std::ranges::find(parts, name, [](const auto& part) { return part.name; });
    return name.empty() || found == parts.end() ? -1 : int(found - parts.begin());
}
double degrees(double angle) { return angle * 180 / std::numbers::pi; }

} // namespace

int body_named(const Scene& s, const std::string& name) { return named(s.bodies, name); }
int wall_named(const Scene& s, const std::string& name) { return named(s.walls, name); }
int load_named(const Scene& s, const std::string& name) { return named(s.loads, name); }
void set_present(Scene& s, const std::string& name, bool there)
{
    if (const int b = body_named(s, name); b >= 0) s.bodies[std::size_t(b)].present = there;
    if (const int w = wall_named(s, name); w >= 0) s.walls[std::size_t(w)].present = there;
    if (const int l = load_named(s, name); l >= 0) s.loads[std::size_t(l)].present = there;
}

bool Record::operator==(const Record& o) const { return rows == o.rows || (rows && o.rows && *rows == *o.rows); }
Vector value_at(const Record& record, double time)
{
    const auto& rows = *record.rows;
    const auto value = [](const std::array<double, 4>& row) { return Vector{row[1], row[2], row[3]}; };
    const auto after = std::upper_bound(rows.begin(), rows.end(), time, [](double t, const auto& row) { return t < row[0]; });
    if (after == rows.begin()) return value(rows.front());
    if (after == rows.end()) return value(rows.back());
    const auto &a = *(after - 1), &b = *after;
    return value(a) + ((time - a[0]) / (b[0] - a[0])) * (value(b) - value(a));
}

double begin_of(const Event& e) { return e.at ? *e.at : e.from.value_or(0); }
double end_of(const Event& e)
{
    double end = e.at ? *e.at : e.to.value_or(0);
    if (e.shaking.rows) end = std::max(end, begin_of(e) + e.shaking.rows->back()[0]);
    if (e.move && e.move->path.rows) end = std::max(end, begin_of(e) + e.move->path.rows->back()[0]);
    return end;
}
bool lasting(const Event& e) { return end_of(e) > begin_of(e); }

std::vector<int> order_of_events(const Scene& s)
{
    std::vector<int> order(s.events.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](int k) { return begin_of(s.events[std::size_t(k)]); });
    return order;
}

double next_event_after(const Scene& s, double time)
{
    double next = infinite;
    for (const auto& e : s.events)
        for (const double t : {begin_of(e), end_of(e)})
            if (t > time) next = std::min(next, t);
    return next;
}

Scene stage_of(const Scene& start, int begun, double time)
{
    Scene now = start;
    const auto order = order_of_events(start);
    Vector shaken{};
    for (int k = 0; k < begun; ++k) {
        const Event& e = start.events[std::size_t(order[std::size_t(k)])];
        const double share = share_of(e, time);
        for (const auto& name : e.remove) set_present(now, name, false);
        for (const auto& name : e.add) set_present(now, name, true);
        for (const auto& c : e.soils)
            if (c.soil >= 0 && std::size_t(c.soil) < now.soils.size()) change(now.soils[std::size_t(c.soil)], c, share);
        if (e.gravity) {
            const Vector g = now.effects.gravity.value_or(Vector{});
            now.effects.gravity =
                Vector{between(g.x, e.gravity->x, share), between(g.y, e.gravity->y, share), between(g.z, e.gravity->z, share)};
        }
        if (e.damping) {
            now.effects.damping.reset();
            if (*e.damping > 0) now.effects.damping = Damping{*e.damping, infinite};
        }
        if (auto& water = now.effects.pore_pressure; water && !e.water.empty()) {
            if (share == 1 || water->table.size() != e.water.size()) water->table = e.water;
            else
                for (std::size_t c = 0; c < e.water.size(); ++c)
                    for (const std::size_t a : {0u, 1u}) water->table[c][a] = between(water->table[c][a], e.water[c][a], share);
        }
        if (const int l = e.load ? load_named(now, e.load->name) : -1; l >= 0)
            move(now.loads[std::size_t(l)].factor, e.load->factor, share);
        if (e.shaking.rows) shaken = shaken + acceleration(e.shaking, time - begin_of(e));
    }
    for (const int w : moving_walls(start)) now.walls[std::size_t(w)].pose = pose_at(start, w, begun, time);
    // Seen from ground that moves, soil feels its acceleration the other way.
    if (shaken != Vector{}) now.effects.gravity = now.effects.gravity.value_or(Vector{}) - shaken;
    return now;
}

void resolve_presence(Scene& s)
{
    std::set<std::string> met;
    for (const int k : order_of_events(s)) {
        const Event& e = s.events[std::size_t(k)];
        for (const auto& name : e.remove) met.insert(name);
        for (const auto& name : e.add)
            if (met.insert(name).second) set_present(s, name, false);
    }
}

std::vector<std::array<double, 2>> presence(const Scene& s, const std::string& name)
{
    std::vector<std::array<double, 2>> times;
    bool there = true, first = true;
    double since = 0;
    if (!name.empty())
        for (const int k : order_of_events(s)) {
            const Event& e = s.events[std::size_t(k)];
            const bool adds = std::ranges::count(e.add, name) > 0, removes = std::ranges::count(e.remove, name) > 0;
            if (!adds && !removes) continue;
            if (std::exchange(first, false) && adds) there = false;
            if (removes && there) times.push_back({since, begin_of(e)}), there = false;
            else if (adds && !there) since = begin_of(e), there = true;
        }
    if (there) times.push_back({since, infinite});
    return times;
}

std::int64_t soil_present(const Scene& s, const Filling& f)
{
    std::int64_t n = 0;
    for (std::size_t b = 0; b < s.bodies.size(); ++b)
        if (s.bodies[b].present) n += f.body_count(int(b));
    return n;
}

std::string name_of_wall(const Scene& s, int wall)
{
    const auto& name = s.walls[std::size_t(wall)].name;
    return fmt::format("wall {}", name.empty() ? std::to_string(wall) : name);
}
std::string name_of_body(const Scene& s, int body)
{
    const auto& name = s.bodies[std::size_t(body)].name;
    return fmt::format("body {}", name.empty() ? std::to_string(body) : name);
}

std::string name_of_load(const Scene& s, int load)
{
    const auto& name = s.loads[std::size_t(load)].name;
    return fmt::format("load {}", name.empty() ? std::to_string(load) : name);
}

std::string time_in_words(const Event& e)
{
    if (!lasting(e)) return fmt::format("at t = {:.6g} s", begin_of(e));
    return fmt::format("from t = {:.6g} s to {:.6g} s", begin_of(e), end_of(e));
}

std::string in_words(const Scene& s, const Event& e)
{
    std::vector<std::string> parts;
    const auto piece = [&](const std::string& name) {
        return (body_named(s, name) >= 0 ? "body " : load_named(s, name) >= 0 ? "load " : "wall ") + name;
    };
    for (const auto& name : e.remove) parts.push_back(piece(name) + " is removed");
    for (const auto& name : e.add) parts.push_back(piece(name) + " is added");
    for (const auto& c : e.soils) {
        std::vector<std::string> changes;
        const auto tell = [&](const char* what, const std::optional<double>& x, const char* unit, double scale = 1) {
            if (x) changes.push_back(fmt::format("{} {:.6g}{}", what, *x * scale, unit));
        };
        tell("young", c.young, " Pa"), tell("poisson", c.poisson, ""), tell("cohesion", c.cohesion, " Pa");
        tell("friction_angle", c.friction_angle, " deg", degrees(1)), tell("dilation_angle", c.dilation_angle, " deg", degrees(1));
        tell("tension_cutoff", c.tension_cutoff, " Pa");
        if (c.cone) changes.push_back("another cone");
        tell("strength times", c.strength, ""), tell("stiffness times", c.stiffness, "");
        const bool known = c.soil >= 0 && std::size_t(c.soil) < s.soils.size();
        parts.push_back(fmt::format("soil {}: {}", known ? s.soils[std::size_t(c.soil)].name : "?", fmt::join(changes, " and ")));
    }
    if (e.gravity) parts.push_back(fmt::format("gravity [{:.6g} {:.6g} {:.6g}] m/s^2", e.gravity->x, e.gravity->y, e.gravity->z));
    if (e.shaking.rows) parts.push_back(fmt::format("the ground shakes ({} rows of {})", e.shaking.rows->size(), e.shaking.file));
    if (!e.water.empty()) parts.push_back(fmt::format("a water table of {} corners", e.water.size()));
    if (e.move) {
        const WallMove& m = *e.move;
        std::string how;
        if (m.velocity != Vector{}) how = fmt::format(" by [{:.6g} {:.6g} {:.6g}] m/s", m.velocity.x, m.velocity.y, m.velocity.z);
        if (m.turn)
            how += fmt::format("{} turning by {:.6g} deg/s about [{:.6g} {:.6g} {:.6g}]", how.empty() ? "" : " and", degrees(m.turn->rate),
                               m.turn->center.x, m.turn->center.y, m.turn->center.z);
        if (m.path.rows) how = fmt::format(" along {} rows of {}", m.path.rows->size(), m.path.file);
        if (m.ramp > 0) how += fmt::format(", coming to that and to rest in {:.6g} s each", m.ramp);
        parts.push_back(fmt::format("wall {} moves{}", m.wall, how));
    }
    if (e.load) parts.push_back(fmt::format("load {} with a factor of {:.6g}", e.load->name, e.load->factor));
    if (e.damping) parts.push_back(*e.damping > 0 ? fmt::format("damping {:.6g} of critical", *e.damping) : std::string("no damping"));
    return fmt::format("{}", fmt::join(parts, "; "));
}

} // namespace kuzure::scene
