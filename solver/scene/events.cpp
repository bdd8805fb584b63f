#include "solver/scene/events.hpp"
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
/// tan of an angle times a factor.
double weaker(double angle, double factor) { return std::atan(factor * std::tan(angle)); }

void change(Soil& soil, const SoilChange& c, double share)
{
    move(soil.young, c.young, share), move(soil.poisson, c.poisson, share), move(soil.cohesion, c.cohesion, share);
    move(soil.friction_angle, c.friction_angle, share), move(soil.dilation_angle, c.dilation_angle, share);
    if (c.tension_cutoff) soil.tension_cutoff = between(soil.tension_cutoff.value_or(*c.tension_cutoff), *c.tension_cutoff, share);
    if (c.cone) soil.cone = *c.cone;
    if (c.stiffness) soil.young *= between(1, *c.stiffness, share);
    if (!c.strength) return;
    const double f = between(1, *c.strength, share);
    soil.cohesion *= f, soil.friction_angle = weaker(soil.friction_angle, f);
    soil.dilation_angle = std::min(soil.dilation_angle, soil.friction_angle);
    if (soil.tension_cutoff) *soil.tension_cutoff *= f;
    if (auto& s = soil.softening) s->cohesion *= f, s->friction_angle = weaker(s->friction_angle, f);
    if (auto& r = soil.rate_friction) r->friction_angle = weaker(r->friction_angle, f);
}

/// Acceleration (m/s^2) of the ground at a time of its record (s); none before and after it.
Vector acceleration(const std::vector<std::array<double, 4>>& rows, double time)
{
    const auto after = std::upper_bound(rows.begin(), rows.end(), time, [](double t, const auto& row) { return t < row[0]; });
    if (after == rows.begin() || (after == rows.end() && time > rows.back()[0])) return {};
    if (after == rows.end()) return {rows.back()[1], rows.back()[2], rows.back()[3]};
    const auto &a = *(after - 1), &b = *after;
    const double share = (time - a[0]) / (b[0] - a[0]);
    return {between(a[1], b[1], share), between(a[2], b[2], share), between(a[3], b[3], share)};
}

/// Index of what has a name; -1 where nothing has.
template <class Parts> int named(const Parts& parts, const std::string& name)
{
    const auto found = std::ranges::find(parts, name, [](const auto& part) { return part.name; });
    return name.empty() || found == parts.end() ? -1 : int(found - parts.begin());
}
void set_present(Scene& s, const std::string& name, bool there)
{
    if (const int b = named(s.bodies, name); b >= 0) s.bodies[std::size_t(b)].present = there;
    if (const int w = named(s.walls, name); w >= 0) s.walls[std::size_t(w)].present = there;
}

double degrees(double angle) { return angle * 180 / std::numbers::pi; }

/// What an event changes, as keys: two that share one at a time contradict each other.
std::set<std::string> touched(const Event& e)
{
    std::set<std::string> keys;
    for (const auto& name : e.add) keys.insert("\"" + name + "\"");
    for (const auto& name : e.remove) keys.insert("\"" + name + "\"");
    if (e.gravity) keys.insert("gravity");
    if (e.shaking.rows) keys.insert("shaking");
    if (!e.water.empty()) keys.insert("water");
    if (e.damping) keys.insert("damping");
    for (const auto& c : e.soils) {
        const auto add = [&](bool there, const char* key) {
            if (there) keys.insert(fmt::format("soil {}.{}", c.soil, key));
        };
        add(c.young || c.stiffness, "young"), add(c.poisson.has_value(), "poisson"), add(c.cohesion || c.strength, "cohesion");
        add(c.friction_angle || c.strength, "friction_angle"), add(c.dilation_angle || c.strength, "dilation_angle");
        add(c.tension_cutoff || c.strength, "tension_cutoff"), add(c.cone.has_value(), "cone");
    }
    return keys;
}

} // namespace

bool GroundMotion::operator==(const GroundMotion& o) const { return rows == o.rows || (rows && o.rows && *rows == *o.rows); }

double begin_of(const Event& e) { return e.at ? *e.at : e.from.value_or(0); }
double end_of(const Event& e)
{
    const double end = e.at ? *e.at : e.to.value_or(0);
    return e.shaking.rows ? std::max(end, begin_of(e) + e.shaking.rows->back()[0]) : end;
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
        if (e.shaking.rows) shaken = shaken + acceleration(*e.shaking.rows, time - begin_of(e));
    }
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

std::string time_in_words(const Event& e)
{
    if (!lasting(e)) return fmt::format("at t = {:.6g} s", begin_of(e));
    return fmt::format("from t = {:.6g} s to {:.6g} s", begin_of(e), end_of(e));
}

std::string in_words(const Scene& s, const Event& e)
{
    std::vector<std::string> parts;
    const auto piece = [&](const std::string& name) { return (named(s.bodies, name) >= 0 ? "body " : "wall ") + name; };
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
    if (e.damping) parts.push_back(*e.damping > 0 ? fmt::format("damping {:.6g} of critical", *e.damping) : std::string("no damping"));
    return fmt::format("{}", fmt::join(parts, "; "));
}

// ---- rules ----

namespace {

void check_names(const Scene& s, Issues& issues)
{
    std::map<std::string, std::string> keys; // by name
    const auto meet = [&](const std::string& name, const std::string& key) {
        if (name.empty()) return;
        if (name.find_first_of(",;\"\\") != name.npos)
            issues.push_back({Severity::Error,
                              key + ".name",
                              fmt::format("expected a name without commas, semicolons, quotes and backslashes, found {}", name),
                              {}});
        const auto [first, fresh] = keys.emplace(name, key);
        if (!fresh)
            issues.push_back({Severity::Error, key + ".name",
                              fmt::format("expected a name that no other wall or body has, found \"{}\" again; rename one", name),
                              first->second + ".name"});
    };
    for (std::size_t b = 0; b < s.bodies.size(); ++b) meet(s.bodies[b].name, fmt::format("body.{}", b));
    for (std::size_t w = 0; w < s.walls.size(); ++w) meet(s.walls[w].name, fmt::format("wall.{}", w));

    std::map<std::string, std::string> probes;
    for (std::size_t k = 0; k < s.probes.size(); ++k) {
        const Probe& p = s.probes[k];
        const std::string key = fmt::format("probe.{}", k);
        const int said = p.point.has_value() + p.particle.has_value() + !p.body.empty();
        if (said != 1)
            issues.push_back({Severity::Error,
                              key,
                              fmt::format("expected exactly one of point, particle, body, found {}; give each its own [[probe]]", said),
                              {}});
        if (!p.body.empty() && named(s.bodies, p.body) < 0)
            issues.push_back({Severity::Error,
                              key + ".body",
                              fmt::format("expected the name of a body, found \"{}\"; give that [[body]] a name", p.body),
                              {}});
        const std::string name = p.name.empty() ? std::to_string(k) : p.name;
        if (name.find_first_of(",;\"\\") != name.npos)
            issues.push_back({Severity::Error,
                              key + ".name",
                              fmt::format("expected a name without commas, semicolons, quotes and backslashes, found {}", name),
                              {}});
        if (!probes.emplace(name, key).second)
            issues.push_back({Severity::Error, key + ".name",
                              fmt::format("expected a name that no other probe has, found \"{}\" again", name), probes[name]});
    }
}

/// What an event says of itself.
void check_event(const Scene& s, const Event& e, const std::string& key, Issues& issues)
{
    const auto error = [&](const std::string& where, std::string text) {
        issues.push_back({Severity::Error, where.empty() ? key : key + "." + where, std::move(text), {}});
    };
    if (e.at.has_value() == (e.from || e.to) || e.from.has_value() != e.to.has_value())
        return error("", "expected either at, or from and to; write, for example, at = 2.0");
    if (e.from && !(*e.from < *e.to)) return error("to", fmt::format("expected from < to, found {} and {}; exchange them", *e.from, *e.to));
    if (touched(e).empty()) error("", "expected something that changes, found nothing; write, for example, remove = \"gate\"");
    if (begin_of(e) >= s.time.end)
        issues.push_back({Severity::Warning,
                          key,
                          fmt::format("it comes at t = {:.6g} s and the run ends at {:.6g} s: it does not happen before time.end is raised",
                                      begin_of(e), s.time.end),
                          {}});
    const bool slowly = e.from.has_value();
    const auto at_once = [&](bool there, const char* what) {
        if (slowly && there) error(what, fmt::format("expected at = ... for {}, which happens at once, found from and to", what));
    };
    at_once(!e.add.empty(), "add"), at_once(!e.remove.empty(), "remove"), at_once(e.damping.has_value(), "damping");
    at_once(bool(e.shaking.rows), "shaking");
    for (const auto* names : {&e.add, &e.remove})
        for (const auto& name : *names) {
            if (named(s.bodies, name) >= 0 || named(s.walls, name) >= 0) continue;
            std::vector<std::string> all;
            for (const auto& b : s.bodies)
                if (!b.name.empty()) all.push_back(b.name);
            for (const auto& w : s.walls)
                if (!w.name.empty()) all.push_back(w.name);
            error(
                names == &e.add ? "add" : "remove",
                fmt::format("expected the name of a wall or body, found \"{}\"; the names here: {}", name,
                            all.empty() ? std::string("none; give that wall a name = \"...\"") : fmt::format("{}", fmt::join(all, ", "))));
        }
    for (const auto& name : e.add)
        if (const int b = named(s.bodies, name); b >= 0 && s.bodies[std::size_t(b)].stress == InitialStress::AtRest)
            error("add", fmt::format("expected a body without stress, found {} \"at rest\": soil that is added carries nothing yet; let "
                                     "its stress be \"none\" and add it in thin lifts",
                                     name));
    if (!e.water.empty()) {
        if (!s.effects.pore_pressure)
            error("water", "expected a scene with still water, found none; write effects.pore_pressure = { table = [[0.0, -1.0]] } below "
                           "the soil to begin without");
        else if (slowly && s.effects.pore_pressure->table.size() != e.water.size())
            error("water", fmt::format("expected as many corners as the table before, {}, to move one by one, found {}",
                                       s.effects.pore_pressure->table.size(), e.water.size()));
    }
    if (e.shaking.rows && s.effects.pore_pressure)
        error("shaking", "expected no pore water where the ground shakes: water that does not flow has no answer to it; leave one out");
    for (const auto& c : e.soils) {
        const bool known = c.soil >= 0 && std::size_t(c.soil) < s.soils.size();
        if (!known) continue; // the reader has said so
        const std::string soil = "soil." + s.soils[std::size_t(c.soil)].name;
        if (c.stiffness && c.young) error(soil, "expected young or stiffness, found both; leave one");
        if (c.strength && (c.cohesion || c.friction_angle || c.tension_cutoff || c.dilation_angle))
            error(soil, "expected strength or its parts, found both; leave one");
        if (slowly && c.cone) error(soil + ".cone", "expected at = ... for a cone, which changes at once, found from and to");
        if (slowly && c.tension_cutoff && !s.soils[std::size_t(c.soil)].tension_cutoff)
            error(soil + ".tension_cutoff", "expected a soil with a tension_cutoff to start from, found none; give it one, or at = ...");
    }
}

/// What events say of each other.
void check_order(const Scene& s, Issues& issues)
{
    const auto key = [](int k) { return fmt::format("event.{}", k); };
    const auto order = order_of_events(s);
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t j = i + 1; j < order.size(); ++j) {
            const Event &a = s.events[std::size_t(order[i])], &b = s.events[std::size_t(order[j])];
            const bool apart = end_of(a) < begin_of(b) || (end_of(a) == begin_of(b) && end_of(a) > begin_of(a));
            if (apart) continue;
            const auto both = touched(a);
            for (const auto& what : touched(b))
                if (both.contains(what)) {
                    issues.push_back({Severity::Error, key(order[j]),
                                      fmt::format("expected one event at a time for {}, found another {} and this one {}; move one of them",
                                                  what, time_in_words(a), time_in_words(b)),
                                      key(order[i])});
                    break;
                }
        }
    Scene now = s;
    const auto present = [&](const std::string& name) {
        if (const int b = named(now.bodies, name); b >= 0) return now.bodies[std::size_t(b)].present;
        const int w = named(now.walls, name);
        return w >= 0 && now.walls[std::size_t(w)].present;
    };
    const auto no_soil = [&] { return std::ranges::none_of(now.bodies, [](const Body& b) { return b.present; }); };
    if (no_soil() && !s.bodies.empty())
        issues.push_back({Severity::Error, "event", "expected soil at the start, found that every body is added later; leave one out", {}});
    for (const int k : order) {
        const Event& e = s.events[std::size_t(k)];
        std::set<std::string> here;
        for (const auto* names : {&e.remove, &e.add})
            for (const auto& name : *names) {
                const bool removes = names == &e.remove;
                if (named(s.bodies, name) < 0 && named(s.walls, name) < 0) continue;
                if (!here.insert(name).second)
                    issues.push_back(
                        {Severity::Error, key(k), fmt::format("expected each name once in an event, found {} again", name), {}});
                else if (present(name) != removes)
                    issues.push_back({Severity::Error,
                                      key(k) + (removes ? ".remove" : ".add"),
                                      fmt::format("expected what {} there then, found {}, which is {}", removes ? "is" : "is not", name,
                                                  removes ? "gone already" : "there already"),
                                      {}});
                set_present(now, name, !removes);
            }
        if (no_soil())
            issues.push_back({Severity::Error, key(k) + ".remove", "expected some soil to be left, found none; leave a body", {}});
    }
}

} // namespace

void check_names_and_events(const Scene& s, Issues& issues)
{
    check_names(s, issues);
    const auto before = issues.size();
    for (std::size_t k = 0; k < s.events.size(); ++k) check_event(s, s.events[k], fmt::format("event.{}", k), issues);
    const bool sound =
        std::all_of(issues.begin() + std::ptrdiff_t(before), issues.end(), [](const Issue& i) { return i.severity != Severity::Error; });
    if (sound) check_order(s, issues);
}

} // namespace kuzure::scene
