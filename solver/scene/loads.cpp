#include "solver/scene/loads.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/shape.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <unordered_map>

namespace kuzure::scene {

bool pushes(const Scene& s, const Load& l, int body, Vector x)
{
    if (!l.body.empty() && s.bodies[std::size_t(body)].name != l.body) return false;
    // What lies on a face of the box lies in it, however that is rounded.
    return !l.box || signed_distance(*l.box, x, s.dimensions) <= 1e-6 * s.space.spacing;
}

bool loaded_at_start(const Scene& s)
{
    return std::ranges::any_of(s.loads, [](const Load& l) { return l.present && l.factor != 0; });
}

double largest_load(const Scene& s)
{
    double most = 0;
    for (const Load& l : s.loads) {
        double factor = l.factor;
        for (const Event& e : s.events)
            if (e.load && !l.name.empty() && e.load->name == l.name) factor = std::max(factor, e.load->factor);
        most = std::max(most, factor * std::max(l.pressure.value_or(0), length(l.traction.value_or(Vector{}))));
    }
    return most;
}

bool load_changes(const Event& e, double time) { return e.load && time >= begin_of(e) && time < end_of(e); }

std::string in_words(const Scene& s, int load)
{
    const Load& l = s.loads[std::size_t(load)];
    const auto vector = [](Vector a) { return fmt::format("[{:.6g} {:.6g} {:.6g}]", a.x, a.y, a.z); };
    std::string text = name_of_load(s, load) + ": ";
    text += l.pressure ? fmt::format("pressure {:.6g} Pa", *l.pressure) : "traction " + vector(l.traction.value_or(Vector{})) + " Pa";
    text += l.normal ? " on faces seen along " + vector(*l.normal) : std::string(" on free faces");
    if (!l.body.empty()) text += " of body " + l.body;
    if (l.box) text += " in " + vector(l.box->low) + " to " + vector(l.box->high) + " m";
    if (l.follow) text += ", as they are at each time";
    if (l.plate) text += ", under a plate";
    if (l.factor != 1) text += fmt::format(", with a factor of {:.6g}", l.factor);
    return text;
}

void check_loads(const Scene& s, Issues& issues)
{
    for (std::size_t k = 0; k < s.loads.size(); ++k) {
        const Load& l = s.loads[k];
        const std::string key = fmt::format("load.{}", k);
        const auto error = [&](const char* where, std::string text) {
            issues.push_back({Severity::Error, key + where, std::move(text), {}});
        };
        if (l.pressure.has_value() == l.traction.has_value())
            error("", fmt::format("expected pressure or traction, found {}; write, for example, pressure = 2.0e4",
                                  l.pressure ? "both" : "neither"));
        if (l.traction && !l.normal)
            error("", "expected a normal with a traction, which acts on the area that is seen along it, found none; for a level surface "
                      "write normal = [0.0, 0.0, 1.0]");
        if (l.normal && !(length(*l.normal) > 1e-100)) // its square must not vanish
            error(".normal", "expected a direction, found one without length; upward: [0.0, 0.0, 1.0]");
        if (l.follow && (l.traction || l.normal))
            error(".follow", "expected follow with a pressure alone, which keeps to the faces as they turn, found traction or normal; "
                             "leave one out");
        if (l.plate && !l.normal)
            error(".plate",
                  "expected a normal with a plate, along which it moves, found none; for a level one write normal = [0.0, 0.0, 1.0]");
        if (l.plate && s.accuracy.sleep_below > 0)
            error(".plate",
                  "expected accuracy.sleep_below = 0 with a plate, whose soil cannot sleep apart, found more; leave sleep_below out");
        if (s.dimensions == 2 && ((l.traction && l.traction->y != 0) || (l.normal && l.normal->y != 0)))
            error("", "expected no traction and no normal along y in two dimensions, found some; write 0.0");
        if (!l.body.empty() && body_named(s, l.body) < 0)
            error(".body", fmt::format("expected the name of a body, found \"{}\"; give that [[body]] a name", l.body));
        if (l.box && !(l.box->low.x < l.box->high.x && l.box->low.z < l.box->high.z && (s.dimensions == 2 || l.box->low.y < l.box->high.y)))
            error(".box", "expected low below high in every direction, found a box without volume; exchange them");
        if (s.accuracy.scheme != Scheme::Staggered)
            error("", "expected accuracy.scheme = \"staggered\" where there are loads, found \"leap-frog\"; leave accuracy.scheme out");
    }
}

void check_loaded_soil(const Scene& s, const Filling& filling, Issues& issues)
{
    if (!s.start.from.empty()) return; // soil lies where the other run left it
    const bool several = std::ranges::count_if(s.loads, &Load::present) > 1;
    std::unordered_map<std::int64_t, std::size_t> loads; // by particle, where more than one may push it
    for (std::size_t k = 0; k < s.loads.size(); ++k) {
        const Load& l = s.loads[k];
        if (!l.present) continue;
        const std::string key = fmt::format("load.{}", k);
        bool found = false;
        std::size_t other = k;
        filling.for_each_soil_in(filling.soil_bounds(), [&](std::int64_t id, Vector x, int body) {
            if (!s.bodies[std::size_t(body)].present || !pushes(s, l, body, x)) return;
            found = true;
            if (!several) return;
            if (const auto [entry, fresh] = loads.emplace(id, k); !fresh && other == k) other = entry->second;
        });
        if (!found)
            issues.push_back({Severity::Error,
                              key,
                              "expected soil that it pushes, found none; let its box hold the face and the two layers of soil below it",
                              {}});
        if (other != k)
            issues.push_back({Severity::Error, key,
                              fmt::format("expected soil that no other load pushes, found some of {}; let their boxes not overlap",
                                          name_of_load(s, int(other))),
                              fmt::format("load.{}", other)});
    }
}

} // namespace kuzure::scene
