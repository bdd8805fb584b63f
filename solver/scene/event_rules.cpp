// What events may say: of themselves, of each other, of names.
#include "solver/scene/events.hpp"
#include "solver/scene/loads.hpp"
#include "solver/scene/motion.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <map>
#include <set>

namespace kuzure::scene {

namespace {

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
    if (e.move) keys.insert("the motion of \"" + e.move->wall + "\"");
    if (e.load) keys.insert("the factor of \"" + e.load->name + "\"");
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
                              fmt::format("expected a name that no other wall, body or load has, found \"{}\" again; rename one", name),
                              first->second + ".name"});
    };
    for (std::size_t b = 0; b < s.bodies.size(); ++b) meet(s.bodies[b].name, fmt::format("body.{}", b));
    for (std::size_t w = 0; w < s.walls.size(); ++w) meet(s.walls[w].name, fmt::format("wall.{}", w));
    for (std::size_t l = 0; l < s.loads.size(); ++l) meet(s.loads[l].name, fmt::format("load.{}", l));

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
        if (!p.body.empty() && body_named(s, p.body) < 0)
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

void check_soil_changes(const Scene& s, const Event& e, const std::string& key, Issues& issues)
{
    const auto error = [&](const std::string& where, std::string text) {
        issues.push_back({Severity::Error, key + "." + where, std::move(text), {}});
    };
    const bool slowly = e.from.has_value();
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

bool is_named(const Scene& s, const std::string& name)
{
    return body_named(s, name) >= 0 || wall_named(s, name) >= 0 || load_named(s, name) >= 0;
}
std::string all_names(const Scene& s)
{
    std::vector<std::string> all;
    const auto take = [&](const auto& parts) {
        for (const auto& part : parts)
            if (!part.name.empty()) all.push_back(part.name);
    };
    take(s.bodies), take(s.walls), take(s.loads);
    return all.empty() ? std::string("none; give that wall a name = \"...\"") : fmt::format("{}", fmt::join(all, ", "));
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
        for (const auto& name : *names)
            if (!is_named(s, name))
                error(names == &e.add ? "add" : "remove",
                      fmt::format("expected the name of a wall, body or load, found \"{}\"; the names here: {}", name, all_names(s)));
    if (e.load && load_named(s, e.load->name) < 0)
        error("load.name", fmt::format("expected the name of a load, found \"{}\"; the names here: {}", e.load->name, all_names(s)));
    for (const auto& name : e.add)
        if (const int b = body_named(s, name); b >= 0 && s.bodies[std::size_t(b)].stress == InitialStress::AtRest)
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
    check_move(s, e, key, issues);
    if (e.shaking.rows && s.effects.pore_pressure)
        error("shaking", "expected no pore water where the ground shakes: water that does not flow has no answer to it; leave one out");
    check_soil_changes(s, e, key, issues);
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
        if (const int b = body_named(now, name); b >= 0) return now.bodies[std::size_t(b)].present;
        if (const int l = load_named(now, name); l >= 0) return now.loads[std::size_t(l)].present;
        const int w = wall_named(now, name);
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
                if (!is_named(s, name)) continue;
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

bool has_course(const Event& e) { return lasting(e) && touched(e).size() > std::size_t(e.move.has_value()); }

void check_names_and_events(const Scene& s, Issues& issues)
{
    check_names(s, issues);
    check_loads(s, issues);
    const auto before = issues.size();
    for (std::size_t k = 0; k < s.events.size(); ++k) check_event(s, s.events[k], fmt::format("event.{}", k), issues);
    const bool sound =
        std::all_of(issues.begin() + std::ptrdiff_t(before), issues.end(), [](const Issue& i) { return i.severity != Severity::Error; });
    if (sound) check_order(s, issues);
}

} // namespace kuzure::scene
