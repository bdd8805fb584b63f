#include "io/scene_file.hpp"
#include "io/document.hpp"
#include "io/ground/ground.hpp"
#include "io/scene_description.hpp"
#include "io/time_record.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/effects_list.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <initializer_list>

namespace kuzure::io {
namespace {

/// Writes what the scene's preset sets, and the scene does not, into the document. What is wrong is left to check_table().
void apply_preset(toml::table& root)
{
    const auto name = root["accuracy"]["preset"].value<std::string>();
    // Bui's one pass is stable to a third of the staggered step only.
    if (auto* accuracy = root["accuracy"].as_table();
        accuracy && !accuracy->contains("cfl") && (*accuracy)["scheme"].value<std::string>() == "leap-frog" && name != "seed")
        accuracy->insert("cfl", name == "fast" ? 0.3 : 0.2);
    for (const Preset& preset : presets()) {
        if (!name || preset.name != *name) continue;
        for (const auto& [path, value] : preset.settings) {
            const auto dot = path.find('.');
            auto* table = root[path.substr(0, dot)].as_table();
            const auto leaf = path.substr(dot + 1);
            if (table && !table->contains(leaf)) table->insert(leaf, *toml::parse("v = " + value).get("v"));
        }
    }
}

/// Fills a scene from a document that check() has approved.
class Reader {
public:
    explicit Reader(Document& file) : file_(file) {}
    void section(const char*, const KeyInfo&) {}
    void text(const std::string& path, std::string& to, const KeyInfo& k)
    {
        if (!k.optional || file_.find(path)) to = file_.text(path);
    }
    void integer(const std::string& path, int& to, const KeyInfo&) { to = file_.integer(path); }
    void integer(const std::string& path, std::optional<int>& to, const KeyInfo& k)
    {
        optionally(path, to, [&](int& n) { integer(path, n, k); });
    }
    void flag(const std::string& path, bool& to, const KeyInfo&) { to = file_.at(path).as_boolean()->get(); }
    void number(const std::string& path, double& to, const KeyInfo& k)
    {
        if (!k.optional || file_.find(path)) to = file_.number(path);
    }
    void number(const std::string& path, std::optional<double>& to, const KeyInfo& k)
    {
        optionally(path, to, [&](double& x) { number(path, x, k); });
    }
    void angle(const std::string& path, double& to, const KeyInfo& k)
    {
        if (!k.optional || file_.find(path)) to = file_.number(path) * radians_per_degree;
    }
    void angle(const std::string& path, std::optional<double>& to, const KeyInfo& k)
    {
        optionally(path, to, [&](double& x) { angle(path, x, k); });
    }
    void vector(const std::string& path, Vector& to, const KeyInfo&)
    {
        const auto& array = *file_.at(path).as_array();
        to = {number_of(*array.get(0)), number_of(*array.get(1)), number_of(*array.get(2))};
    }
    void vector(const std::string& path, std::optional<Vector>& to, const KeyInfo& k)
    {
        optionally(path, to, [&](Vector& x) { vector(path, x, k); });
    }
    void pair(const std::string& path, std::array<double, 2>& to, const KeyInfo&)
    {
        if (const auto* n = file_.find(path)) to = {number_of(*n->as_array()->get(0)), number_of(*n->as_array()->get(1))};
    }
    void numbers(const std::string& path, std::vector<double>& to, const KeyInfo&)
    {
        for (const auto& x : *file_.at(path).as_array()) to.push_back(number_of(x));
    }
    void files(const std::string& path, std::vector<std::string>& to, const KeyInfo&)
    {
        to = file_.at(path).is_string() ? std::vector{file_.text(path)} : file_.texts(path);
    }
    void some_names(const std::string& path, std::vector<std::string>& to, const KeyInfo& k)
    {
        if (file_.find(path)) files(path, to, k);
    }
    void window(const std::string& path, std::optional<std::array<double, 4>>& to, const KeyInfo&)
    {
        optionally(path, to, [&](std::array<double, 4>& w) {
            for (std::size_t k = 0; k < 4; ++k) w[k] = number_of(*file_.at(path).as_array()->get(k));
        });
    }
    void points(const std::string& path, std::vector<std::array<double, 2>>& to, const KeyInfo& k)
    {
        if (k.optional && !file_.find(path)) return;
        for (const auto& p : *file_.at(path).as_array()) to.push_back({number_of(*p.as_array()->get(0)), number_of(*p.as_array()->get(1))});
    }
    void axes(const std::string& path, std::array<bool, 3>& to, const KeyInfo&)
    {
        if (const auto* n = file_.find(path))
            for (const auto& axis : *n->as_array()) to[std::size_t(axis.as_string()->get()[0] - 'x')] = true;
    }
    void choices(const std::string& path, std::vector<std::string>& to, std::initializer_list<const char*>, const KeyInfo&)
    {
        to = file_.texts(path);
    }
    template <class Enum> void choice(const std::string& path, Enum& to, const std::type_identity_t<Words<Enum>>& words, const KeyInfo&)
    {
        to = file_.choice(path, words);
    }
    template <class Enum>
    void choice(const std::string& path, std::optional<Enum>& to, const std::type_identity_t<Words<Enum>>& words, const KeyInfo& k)
    {
        optionally(path, to, [&](Enum& value) { choice(path, value, words, k); });
    }
    template <class Enum, class Describe>
    void choice_or_table(const std::string& path, Enum& to, const std::type_identity_t<Words<Enum>>& words, Enum table, const KeyInfo&,
                         Describe describe)
    {
        if (file_.at(path).is_table()) to = table, describe(path);
        else to = file_.choice(path, words);
    }
    template <class T, class Describe> void table(const std::string& path, std::optional<T>& to, const KeyInfo&, Describe describe)
    {
        optionally(path, to, [&](T& value) { describe(path, value); });
    }
    template <class T, class Describe> void part(const std::string& path, std::optional<T>& to, const KeyInfo& k, Describe describe)
    {
        table(path, to, k, describe);
    }
    template <class T, class Describe>
    void automatic(const std::string& path, std::optional<T>& to, scene::Decision& decision, const KeyInfo& k, Describe describe)
    {
        const auto* n = file_.find(path);
        if (n && n->is_string()) decision = scene::Decision::Auto;
        else table(path, to, k, describe);
    }
    template <class T, class Describe> void tables(const std::string& path, std::vector<T>& to, const KeyInfo&, Describe describe)
    {
        const auto* array = file_.find(path);
        to.resize(array ? array->as_array()->size() : 0);
        for (std::size_t k = 0; k < to.size(); ++k) describe(fmt::format("{}.{}", path, k), to[k]);
    }
    template <class Describe> void soils(const std::string& path, std::vector<scene::Soil>& to, const KeyInfo&, Describe describe)
    {
        for (auto& name : file_.names(path)) to.emplace_back().name = std::move(name);
        for (auto& soil : to) describe(path + "." + soil.name, soil);
    }
    template <class Describe>
    void soil_changes(const std::string& path, std::vector<scene::SoilChange>& to, const std::vector<scene::Soil>& soils, const KeyInfo&,
                      Describe describe)
    {
        for (const auto& name : file_.names(path)) {
            auto& change = to.emplace_back();
            find_soil(path + "." + name, name, change.soil, soils);
            describe(path + "." + name, change);
        }
    }
    void soil_of(const std::string& path, int& to, const std::vector<scene::Soil>& soils, const KeyInfo&)
    {
        find_soil(path, file_.text(path), to, soils);
    }
    template <class T, class Describe> void alternative(const std::string& path, scene::Shape& shape, const KeyInfo&, Describe describe)
    {
        if (file_.find(path)) describe(path, shape.emplace<T>());
    }

private:
    void find_soil(const std::string& path, const std::string& name, int& to, const std::vector<scene::Soil>& soils)
    {
        std::vector<std::string> names;
        for (const auto& soil : soils) names.push_back(soil.name);
        const auto found = std::find(names.begin(), names.end(), name);
        to = found == names.end() ? 0 : int(found - names.begin());
        if (found == names.end())
            file_.complain(path, fmt::format("expected the name of a soil, found \"{}\"{} The soils here: {}. Or write [soil.{}]", name,
                                             did_you_mean(name, names), fmt::join(names, ", "), name));
    }
    template <class T, class Describe> void optionally(const std::string& path, std::optional<T>& to, Describe describe)
    {
        if (file_.find(path)) describe(to.emplace());
    }
    Document& file_;
};

/// The rules of [uncertain] that no key has alone.
void check_uncertain(Document& file, const scene::Uncertain& u)
{
    const auto triangle = [&](const std::string& path, const scene::Triangle& t) {
        if (!(t.low <= t.likely && t.likely <= t.high))
            file.complain(path, fmt::format("expected low <= likely <= high, found {:g}, {:g}, {:g}. Remedy: exchange them", t.low,
                                            t.likely, t.high));
        else if (t.low == t.high)
            file.complain(path, fmt::format("expected low < high, found {:g} for both: nothing varies. Remedy: write what is certain "
                                            "where it belongs, and leave it out here",
                                            t.low));
    };
    if (u.friction) triangle("uncertain.friction", *u.friction);
    if (u.bed_friction) triangle("uncertain.bed_friction", *u.bed_friction);
    if (u.thickness) triangle("uncertain.thickness", *u.thickness);
    if (u.dem_error && !file.find("terrain"))
        file.complain("uncertain.dem_error", "expected [terrain] beside it, found none. Remedy: leave it out");
    for (std::size_t k = 0; k < u.keys.size(); ++k) {
        const auto& [key, value] = u.keys[k];
        const auto path = fmt::format("uncertain.key.{}", k);
        triangle(path, value);
        const Key* row = key.starts_with("uncertain") ? nullptr : scene_keys().find(key);
        if (!row || row->kind != Kind::Number || row->role != Role::Physics) {
            file.complain(path + ".key", fmt::format("expected the path of a number that changes the physics, such as "
                                                     "\"soil.sand.cohesion\" or \"body.0.release.thickness\", found \"{}\"",
                                                     key));
            continue;
        }
        if (!file.find(key.substr(0, key.rfind('.'))))
            file.complain(path + ".key",
                          fmt::format("this scene has no {}. Remedy: write it, or another path", key.substr(0, key.rfind('.'))));
        for (const auto& [leaf, x] : {std::pair{".low", value.low}, std::pair{".high", value.high}})
            if (!row->range.holds(x))
                file.complain(path + leaf, fmt::format("expected a number with {} for {}, found {:g}", row->range.text(), key, x));
    }
    if (!u.friction && !u.bed_friction && !u.thickness && !u.dem_error && u.keys.empty())
        file.complain("uncertain",
                      "expected something that is uncertain: friction, bed_friction, thickness, dem_error or [[uncertain.key]]; "
                      "found none. Remedy: bed_friction = { low = 16.0, likely = 20.0, high = 28.0 }, or leave the section out");
}

std::optional<scene::Uncertain> uncertain_of(Document& file)
{
    std::optional<scene::Uncertain> u;
    Reader reader(file);
    describe_uncertain(reader, u);
    if (u) check_uncertain(file, *u);
    file.throw_if_any();
    return u;
}

} // namespace

std::optional<scene::Uncertain> parse_uncertain(std::string_view text, const std::string& name, std::span<const std::string> sets)
{
    Document file(text, name, scene_keys(), sets);
    apply_preset(file.root);
    file.check();
    return uncertain_of(file);
}

std::string read_scene_text(const std::filesystem::path& path) { return read_document_text(path, scene_keys().file()); }

Scene parse_scene(std::string_view text, const std::string& name, std::span<const std::string> sets, scene::StepLimit limit)
{
    return parse_checked_scene(text, name, sets, limit).scene;
}

scene::CheckedScene parse_checked_scene(std::string_view text, const std::string& name, std::span<const std::string> sets,
                                        scene::StepLimit limit)
{
    Document file(text, name, scene_keys(), sets);
    apply_preset(file.root);
    file.check();

    Scene scene;
    Reader reader(file);
    describe(reader, scene);
    file.throw_if_any();
    uncertain_of(file); // a run does without it, but not with a wrong one
    // Paths count from the scene file's directory.
    const auto absolute = [&](std::string& path) {
        if (!path.empty()) path = std::filesystem::absolute(std::filesystem::path(name).parent_path() / path).lexically_normal().string();
    };
    absolute(scene.start.from);
    const auto load_record = [&](scene::Record& record, const std::string& key, const RecordOf& what) {
        if (record.file.empty()) return;
        absolute(record.file);
        try {
            record.rows = std::make_shared<const std::vector<std::array<double, 4>>>(read_time_record(record.file, what));
        } catch (const BadInput& e) {
            file.complain(key, e.what());
        }
    };
    for (std::size_t k = 0; k < scene.events.size(); ++k) {
        load_record(scene.events[k].shaking, fmt::format("event.{}.shaking", k), {"ground motion", "m/s^2"});
        if (auto& move = scene.events[k].move) load_record(move->path, fmt::format("event.{}.move.path", k), {"a wall's way", "m"});
    }
    file.throw_if_any();
    if (scene.maps) absolute(scene.maps->points);
    if (scene.terrain) {
        for (auto& dem : scene.terrain->dem) absolute(dem);
        absolute(scene.terrain->friction_map);
    }
    for (auto& body : scene.bodies)
        if (auto* r = std::get_if<scene::Release>(&body.shape))
            for (auto* path : {&r->outline, &r->thickness_map, &r->surface, &r->before, &r->after}) absolute(*path);

    auto doubtful = load_ground(scene);
    for (const auto& issue : doubtful)
        if (issue.severity == scene::Severity::Error) file.complain(issue.key, issue.text);
    file.throw_if_any();
    scene::resolve(scene);
    scene::Issues issues;
    auto checked = scene::check_and_fill(std::move(scene), limit, issues);
    for (const auto& issue : issues)
        if (issue.severity == scene::Severity::Error)
            file.complain(issue.key, issue.other.empty()
                                         ? issue.text
                                         : fmt::format("{} ({} is at {})", issue.text, issue.other, file.location(issue.other)));
    file.throw_if_any();
    checked->warnings.insert(checked->warnings.begin(), doubtful.begin(), doubtful.end());
    return std::move(*checked);
}

Scene read_scene(const std::filesystem::path& path, std::span<const std::string> sets, scene::StepLimit limit)
{
    return parse_scene(read_scene_text(path), path.string(), sets, limit);
}

} // namespace kuzure::io
