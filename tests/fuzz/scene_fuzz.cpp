// Any bytes are a scene or a refusal in words: never a crash, a hang or a large use of memory. Input: the text of a
// scene file, then, each after a zero byte, what --set gives. Built for libFuzzer (-DKUZURE_FUZZ=ON), and for the
// replay of the corpus in the normal suite (replay_test.cpp).
#include "io/scene_file.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/motion.hpp"
#include "tests/fuzz/fuzz.hpp"
#include <algorithm>
#include <cmath>

using namespace kuzure;
using namespace kuzure::fuzz;

namespace {

bool finite(Vector a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// What an accepted scene's events make of it, at the times at which something happens.
void inspect_stages(const Scene& s)
{
    if (s.events.empty() || s.events.size() > 20) return;
    const auto order = scene::order_of_events(s);
    double before = 0;
    for (int begun = 0; begun <= int(order.size()); ++begun) {
        if (begun > 0) {
            const auto& e = s.events[std::size_t(order[std::size_t(begun - 1)])];
            if (scene::begin_of(e) < before || scene::end_of(e) < scene::begin_of(e)) found("events out of order");
            before = scene::begin_of(e);
            if (scene::in_words(s, e).empty() || scene::time_in_words(e).empty()) found("an event that says nothing");
        }
        const double next = scene::next_event_after(s, before);
        if (!(next > before)) found("the next event is not later");
        for (const double time : {before, std::min(next, s.time.end), s.time.end}) {
            const Scene stage = scene::stage_of(s, begun, time);
            for (const auto& w : stage.walls)
                if (!finite(w.pose.shift) || !finite(w.pose.turn.x) || !finite(w.pose.turn.y) || !finite(w.pose.turn.z))
                    found("a wall stands nowhere");
            for (const auto& soil : stage.soils)
                if (!(soil.young > 0) || !(soil.poisson < 0.5) || !(soil.cohesion >= 0) || !std::isfinite(soil.friction_angle))
                    found("a soil that cannot be");
            if (stage.effects.gravity && !finite(*stage.effects.gravity)) found("gravity that is no number");
        }
    }
    for (const auto& w : s.walls)
        for (const auto& [from, to] : scene::presence(s, w.name))
            if (!(from <= to)) found("a wall that goes before it comes");
}

/// What a scene may name: paths count from its directory.
struct Files : Scratch {
    Files()
    {
        write(path / "record.csv", "time,x,z\n0,0,0\n0.1,2,-1\n0.2,-2,1\n0.3,0,0\n");
        std::string heights;
        for (int row = 0; row < 12; ++row)
            for (int column = 0; column < 12; ++column) heights += std::to_string(column) + (column < 11 ? " " : "\n");
        write(path / "dem.asc", "ncols 12\nnrows 12\nxllcorner 0\nyllcorner 0\ncellsize 1\n" + heights);
        write(path / "release.geojson",
              R"({"type": "Feature", "properties": {"thickness": 2}, "geometry": {"type": "Polygon", "coordinates":
[[[6, 3], [10, 3], [10, 8], [6, 8], [6, 3]]]}, "crs": {"properties": {"name": "EPSG:6670"}}})");
        write(path / "points.csv", "name,x,y\nhouse,2,5\n");
    }
};

void inspect_uncertain(const scene::Uncertain& u)
{
    for (const auto& t : {u.friction, u.bed_friction, u.thickness})
        if (t && !(t->low <= t->likely && t->likely <= t->high)) found("a distribution without order");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    static const Files files;
    static const std::string name = (files.path / "fuzz.toml").string();
    std::string_view all(reinterpret_cast<const char*>(data), size);
    const std::string text(take(all));
    std::vector<std::string> sets;
    while (!all.empty() && sets.size() < 8) sets.emplace_back(take(all));
    bool accepted = false;
    try {
        const Scene scene = io::parse_scene(text, name, sets);
        accepted = true;
        // What is accepted is written, and reads back to the same scene: results keep their scene.toml.
        const std::string written = io::write_scene(scene);
        Scene again;
        try {
            again = io::parse_scene(written, "written.toml");
        } catch (const BadInput& e) {
            std::fprintf(stderr, "%s\n%s\n", written.c_str(), e.what());
            found("a scene that was accepted is refused when read back");
        }
        if (!(again == scene)) found("a scene reads back as another");
        if (io::scene_hash(again) != io::scene_hash(scene)) found("a scene reads back with another hash");
        inspect_stages(scene);
    } catch (const BadInput& e) {
        judge_refusal(e.what());
    }
    try {
        if (const auto u = io::parse_uncertain(text, name, sets)) inspect_uncertain(*u);
    } catch (const BadInput& e) {
        if (accepted) found("what is uncertain of a scene that was accepted is refused");
        judge_refusal(e.what());
    }
    return 0;
}
