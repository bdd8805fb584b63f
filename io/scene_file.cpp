#include "io/scene_file.hpp"
#include "io/document.hpp"
#include "io/scene_keys.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <map>
#include <numbers>
#include <sstream>

namespace kuzure::io {
namespace {

const double radians_per_degree = std::numbers::pi / 180;

/// A body or wall has one shape.
void one_shape(Document& file, const toml::table& table, const std::string& path, const std::string& pattern)
{
    if (pattern != "body.*" && pattern != "wall.*") return;
    std::vector<std::string> shapes;
    for (const char* shape : {"box", "cylinder", "sphere", "polygon"})
        if (table.contains(shape)) shapes.emplace_back(shape);
    if (shapes.size() != 1)
        file.complain(path, fmt::format("expected exactly one of box, cylinder, sphere, polygon, found {}; {}",
                                        shapes.empty() ? "none" : fmt::format("{}", fmt::join(shapes, " and ")),
                                        shapes.empty() ? "write, for example, box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }"
                                                       : "give every shape its own table"));
}

/// Writes what the scene's preset sets, and the scene does not, into the document. What is wrong is left to check_table().
void apply_preset(toml::table& root)
{
    const auto name = root["accuracy"]["preset"].value<std::string>();
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

// ---- one description of the scene for reading, writing and hashing ----

template <class A> void describe_shape(A& a, const std::string& path, scene::Shape& shape)
{
    a.template alternative<scene::Box>(path + ".box", shape, [&](const std::string& p, auto& s) {
        a.vector(p + ".low", s.low);
        a.vector(p + ".high", s.high);
    });
    a.template alternative<scene::Cylinder>(path + ".cylinder", shape, [&](const std::string& p, auto& s) {
        a.vector(p + ".base", s.base);
        a.number(p + ".radius", s.radius);
        a.number(p + ".height", s.height);
    });
    a.template alternative<scene::Sphere>(path + ".sphere", shape, [&](const std::string& p, auto& s) {
        a.vector(p + ".center", s.center);
        a.number(p + ".radius", s.radius);
    });
    a.template alternative<scene::Polygon>(path + ".polygon", shape, [&](const std::string& p, auto& s) {
        a.points(p + ".points", s.points);
        a.pair(p + ".y", s.y);
    });
}

template <class A> void describe(A& a, Scene& s)
{
    a.text("title", s.title);
    a.integer("dimensions", s.dimensions);

    a.section("space");
    a.number("space.spacing", s.space.spacing);
    a.number("space.h", s.space.h);
    a.vector("space.low", s.space.low);
    a.vector("space.high", s.space.high);
    a.axes("space.periodic", s.space.periodic);

    a.section("time");
    a.number("time.end", s.time.end);
    a.number("time.step", s.time.step);
    a.flag("time.retry", s.time.retry);

    a.soils(s.soils, [&](const std::string& path, scene::Soil& soil) {
        a.number(path + ".density", soil.density);
        a.number(path + ".young", soil.young);
        a.number(path + ".poisson", soil.poisson);
        a.number(path + ".cohesion", soil.cohesion);
        a.angle(path + ".friction_angle", soil.friction_angle);
        a.angle(path + ".dilation_angle", soil.dilation_angle);
        a.choice(path + ".cone", soil.cone);
        a.number(path + ".tension_cutoff", soil.tension_cutoff);
        a.number(path + ".dilation_decay", soil.dilation_decay);
        a.table(path + ".softening", soil.softening, [&](auto& v) {
            a.number(path + ".softening.cohesion", v.cohesion);
            a.angle(path + ".softening.friction_angle", v.friction_angle);
            a.number(path + ".softening.slip", v.slip);
        });
        a.table(path + ".rate_friction", soil.rate_friction, [&](auto& v) {
            a.angle(path + ".rate_friction.friction_angle", v.friction_angle);
            a.number(path + ".rate_friction.inertial_number", v.inertial_number);
            a.number(path + ".rate_friction.grain", v.grain);
            a.number(path + ".rate_friction.grain_density", v.grain_density);
        });
    });
    a.tables("body", s.bodies, [&](const std::string& path, scene::Body& body) {
        a.soil_of(path + ".soil", body.soil, s.soils);
        describe_shape(a, path, body.shape);
        a.vector(path + ".velocity", body.velocity);
        a.choice(path + ".stress", body.stress);
    });
    a.tables("wall", s.walls, [&](const std::string& path, scene::Wall& wall) {
        describe_shape(a, path, wall.shape);
        a.surface(path + ".surface", wall);
    });

    a.section("effects");
    a.vector("effects.gravity", s.effects.gravity);
    a.table("effects.viscosity", s.effects.viscosity, [&](auto& v) {
        a.number("effects.viscosity.alpha", v.alpha);
        a.number("effects.viscosity.beta", v.beta);
    });
    a.automatic("effects.artificial_stress", s.effects.artificial_stress, s.effects.artificial_stress_decision, [&](auto& v) {
        a.number("effects.artificial_stress.epsilon", v.epsilon);
        a.number("effects.artificial_stress.exponent", v.exponent);
    });
    a.automatic("effects.stress_diffusion", s.effects.stress_diffusion, s.effects.stress_diffusion_decision,
                [&](auto& v) { a.number("effects.stress_diffusion.zeta", v.zeta); });
    a.table("effects.pore_pressure", s.effects.pore_pressure, [&](auto& v) {
        a.points("effects.pore_pressure.table", v.table);
        a.number("effects.pore_pressure.density", v.density);
    });
    a.table("effects.damping", s.effects.damping, [&](auto& v) {
        a.number("effects.damping.ratio", v.ratio);
        a.number("effects.damping.until", v.until);
    });

    a.section("accuracy");
    a.choice("accuracy.preset", s.accuracy.preset);
    a.choice("accuracy.kernel", s.accuracy.kernel);
    a.number("accuracy.cfl", s.accuracy.cfl);
    a.choice("accuracy.precision", s.accuracy.precision);
    a.choice("accuracy.correction", s.accuracy.correction);
    a.number("accuracy.skin", s.accuracy.skin);
    a.number("accuracy.sleep_below", s.accuracy.sleep_below);

    a.section("output");
    a.optional_text("output.directory", s.output.directory);
    a.number("output.every", s.output.every);
    a.words("output.fields", s.output.fields);
    a.number("output.history", s.output.history);
    a.number("output.grain", s.output.grain);
    a.number("output.checkpoint_minutes", s.output.checkpoint_minutes);
    a.table("output.picture", s.output.picture, [&](auto& v) {
        a.choice("output.picture.view", v.view);
        a.choice("output.picture.color", v.color);
        a.pair("output.picture.range", v.range);
    });
    a.flag("output.movie", s.output.movie);
}

/// Fills a scene from a document that check() has approved.
class Reader {
public:
    explicit Reader(Document& file) : file_(file) {}
    void section(const char*) {}
    void text(const std::string& path, std::string& to) { to = file_.text(path); }
    void optional_text(const std::string& path, std::string& to)
    {
        if (file_.find(path)) text(path, to);
    }
    void integer(const std::string& path, int& to) { to = file_.integer(path); }
    void flag(const std::string& path, bool& to) { to = file_.at(path).as_boolean()->get(); }
    void number(const std::string& path, double& to) { to = file_.number(path); }
    void number(const std::string& path, std::optional<double>& to)
    {
        optionally(path, to, [&](double& x) { number(path, x); });
    }
    void angle(const std::string& path, double& to) { to = file_.number(path) * radians_per_degree; }
    void vector(const std::string& path, Vector& to)
    {
        const auto& array = *file_.at(path).as_array();
        to = {number_of(*array.get(0)), number_of(*array.get(1)), number_of(*array.get(2))};
    }
    void vector(const std::string& path, std::optional<Vector>& to)
    {
        optionally(path, to, [&](Vector& x) { vector(path, x); });
    }
    void pair(const std::string& path, std::array<double, 2>& to)
    {
        if (const auto* n = file_.find(path)) to = {number_of(*n->as_array()->get(0)), number_of(*n->as_array()->get(1))};
    }
    void points(const std::string& path, std::vector<std::array<double, 2>>& to)
    {
        for (const auto& p : *file_.at(path).as_array()) to.push_back({number_of(*p.as_array()->get(0)), number_of(*p.as_array()->get(1))});
    }
    void axes(const std::string& path, std::array<bool, 3>& to)
    {
        if (const auto* n = file_.find(path))
            for (const auto& axis : *n->as_array()) to[std::size_t(axis.as_string()->get()[0] - 'x')] = true;
    }
    void words(const std::string& path, std::vector<std::string>& to) { to = file_.texts(path); }
    template <class Enum> void choice(const std::string& path, Enum& to) { to = Enum(file_.choice(path)); }
    template <class T, class Describe> void table(const std::string& path, std::optional<T>& to, Describe describe)
    {
        optionally(path, to, describe);
    }
    template <class T, class Describe>
    void automatic(const std::string& path, std::optional<T>& to, scene::Decision& decision, Describe describe)
    {
        const auto* n = file_.find(path);
        if (n && n->is_string()) decision = scene::Decision::Auto;
        else optionally(path, to, describe);
    }
    template <class T, class Describe> void tables(const std::string& path, std::vector<T>& to, Describe describe)
    {
        const auto* array = file_.find(path);
        to.resize(array ? array->as_array()->size() : 0);
        for (std::size_t k = 0; k < to.size(); ++k) describe(fmt::format("{}.{}", path, k), to[k]);
    }
    template <class Describe> void soils(std::vector<scene::Soil>& to, Describe describe)
    {
        for (auto& name : file_.names("soil")) to.emplace_back().name = std::move(name);
        for (auto& soil : to) describe("soil." + soil.name, soil);
    }
    void soil_of(const std::string& path, int& to, const std::vector<scene::Soil>& soils)
    {
        const std::string& name = file_.text(path);
        std::vector<std::string> names;
        for (const auto& soil : soils) names.push_back(soil.name);
        const auto found = std::find(names.begin(), names.end(), name);
        to = found == names.end() ? 0 : int(found - names.begin());
        if (found == names.end())
            file_.complain(path, fmt::format("expected the name of a soil, found \"{}\"; did you mean \"{}\"? Or write [soil.{}]", name,
                                             nearest(name, names), name));
    }
    void surface(const std::string& path, scene::Wall& wall)
    {
        if (file_.at(path).is_table()) {
            wall.surface = scene::Surface::Coulomb;
            angle(path + ".friction_angle", wall.friction_angle);
        } else {
            choice(path, wall.surface);
        }
    }
    template <class T, class Describe> void alternative(const std::string& path, scene::Shape& shape, Describe describe)
    {
        if (file_.find(path)) describe(path, shape.emplace<T>());
    }

private:
    template <class T, class Describe> void optionally(const std::string& path, std::optional<T>& to, Describe describe)
    {
        if (file_.find(path)) describe(to.emplace());
    }
    Document& file_;
};

/// A number as TOML that reads back to the same bits.
std::string toml_number(double x)
{
    auto text = fmt::format("{}", x);
    if (text.find_first_of(".en") == text.npos) text += ".0";
    return text;
}
/// An angle in degrees that reads back to the same radians, in the fewest digits.
std::string toml_degrees(double radians)
{
    const double near = radians / radians_per_degree;
    std::string best = toml_number(near);
    bool exact = near * radians_per_degree == radians;
    double up = near, down = near;
    for (int k = 0; k < 4; ++k) {
        up = std::nextafter(up, 360.0), down = std::nextafter(down, -360.0);
        for (const double d : {up, down}) {
            if (d * radians_per_degree != radians) continue;
            auto text = toml_number(d);
            if (!exact || text.size() < best.size()) best = std::move(text);
            exact = true;
        }
    }
    return best;
}
std::string toml_string(std::string_view s)
{
    std::string out = "\"";
    for (const char c : s) {
        if (c == '"' || c == '\\') out += '\\', out += c;
        else if ((unsigned char)(c) < 0x20 || c == 0x7F) out += fmt::format("\\u{:04X}", int(c));
        else out += c;
    }
    return out + '"';
}

/// What a Writer is for: a scene file, or the lines of which a hash is taken.
enum class Purpose { File, Hash };

/// Writes a scene as TOML. For a hash: whole paths, soils by number, decisions instead of "auto", no
/// bookkeeping.
class Writer {
public:
    explicit Writer(Purpose purpose) : purpose_(purpose) {}
    std::string out;

    void section(const std::string& path) { header("[" + path + "]"); }
    void text(const std::string& path, const std::string& s) { emit(path, toml_string(s)); }
    void optional_text(const std::string& path, const std::string& s) { s.empty() ? absent(path) : text(path, s); }
    void integer(const std::string& path, int n) { emit(path, std::to_string(n)); }
    void flag(const std::string& path, bool on)
    {
        if (on || purpose_ == Purpose::File) emit(path, on ? "true" : "false");
    }
    void number(const std::string& path, double x) { emit(path, digits(x)); }
    void number(const std::string& path, const std::optional<double>& x) { x ? number(path, *x) : absent(path); }
    void angle(const std::string& path, double x) { emit(path, purpose_ == Purpose::Hash ? digits(x) : toml_degrees(x)); }
    void vector(const std::string& path, const Vector& v)
    {
        emit(path, fmt::format("[{}, {}, {}]", digits(v.x), digits(v.y), digits(v.z)));
    }
    void vector(const std::string& path, const std::optional<Vector>& v) { v ? vector(path, *v) : absent(path); }
    void pair(const std::string& path, const std::array<double, 2>& p)
    {
        if (p[0] != 0 || p[1] != 0) emit(path, fmt::format("[{}, {}]", digits(p[0]), digits(p[1])));
    }
    void points(const std::string& path, const std::vector<std::array<double, 2>>& ps)
    {
        std::vector<std::string> texts;
        for (const auto& p : ps) texts.push_back(fmt::format("[{}, {}]", digits(p[0]), digits(p[1])));
        emit(path, fmt::format("[{}]", fmt::join(texts, ", ")));
    }
    void axes(const std::string& path, const std::array<bool, 3>& on)
    {
        std::vector<std::string> names;
        for (int k = 0; k < 3; ++k)
            if (on[std::size_t(k)]) names.emplace_back(1, "xyz"[k]);
        names.empty() ? absent(path) : words(path, names);
    }
    void words(const std::string& path, const std::vector<std::string>& words)
    {
        emit(path, fmt::format("[\"{}\"]", fmt::join(words, "\", \"")));
    }
    template <class Enum> void choice(const std::string& path, Enum value)
    {
        emit(path, toml_string(scene_keys().find(path)->choices.at(std::size_t(value))));
    }
    template <class T, class Describe> void table(const std::string& path, std::optional<T>& value, Describe describe)
    {
        if (value) inlined(path, [&] { describe(*value); });
        else absent(path);
    }
    template <class T, class Describe>
    void automatic(const std::string& path, std::optional<T>& value, scene::Decision decision, Describe describe)
    {
        if (decision == scene::Decision::Auto && purpose_ == Purpose::File) emit(path, "\"auto\"");
        else table(path, value, describe);
    }
    template <class T, class Describe> void tables(const std::string& path, std::vector<T>& elements, Describe describe)
    {
        for (std::size_t k = 0; k < elements.size(); ++k) {
            header("[[" + path + "]]");
            describe(fmt::format("{}.{}", path, k), elements[k]);
        }
    }
    template <class Describe> void soils(std::vector<scene::Soil>& soils, Describe describe)
    {
        for (std::size_t k = 0; k < soils.size(); ++k) {
            header("[soil." + soils[k].name + "]");
            describe("soil." + (purpose_ == Purpose::Hash ? std::to_string(k) : soils[k].name), soils[k]);
        }
    }
    void soil_of(const std::string& path, int soil, const std::vector<scene::Soil>& soils)
    {
        emit(path, purpose_ == Purpose::Hash ? std::to_string(soil) : toml_string(soils.at(std::size_t(soil)).name));
    }
    void surface(const std::string& path, const scene::Wall& wall)
    {
        if (wall.surface == scene::Surface::Coulomb) inlined(path, [&] { angle(path + ".friction_angle", wall.friction_angle); });
        else choice(path, wall.surface);
    }
    template <class T, class Describe> void alternative(const std::string& path, scene::Shape& shape, Describe describe)
    {
        if (auto* s = std::get_if<T>(&shape)) inlined(path, [&] { describe(path, *s); });
    }

private:
    std::string digits(double x) const { return toml_number(purpose_ == Purpose::Hash ? x + 0.0 : x); }
    void header(const std::string& text)
    {
        if (purpose_ == Purpose::File) out += "\n" + text + "\n";
    }
    void emit(const std::string& path, const std::string& value)
    {
        const Key& key = *scene_keys().find(path);
        if (inline_) {
            *inline_ += fmt::format("{}{} = {}", inline_->empty() ? "" : ", ", key.leaf(), value);
        } else if (purpose_ == Purpose::Hash) {
            if (key.role == Role::Physics) out += fmt::format("{} = {}\n", path, value);
        } else {
            const auto line = fmt::format("{} = {}", key.leaf(), value);
            out += key.unit.empty() || key.unit == "1" ? line + "\n" : fmt::format("{:<40} # {}\n", line, key.unit);
        }
    }
    /// What is not there is named, so that a written scene shows all it could say.
    void absent(const std::string& path)
    {
        if (inline_ || purpose_ == Purpose::Hash) return;
        const Key& key = *scene_keys().find(path);
        out += fmt::format("# no {}: {}\n", key.leaf(), key.doc);
    }
    template <class Body> void inlined(const std::string& path, Body body)
    {
        std::string inside;
        inline_ = &inside;
        body();
        inline_ = nullptr;
        emit(path, "{ " + inside + " }");
    }
    Purpose purpose_;
    std::string* inline_ = nullptr;
};

std::string written(const Scene& scene, Purpose purpose)
{
    Writer writer(purpose);
    Scene copy = scene;
    describe(writer, copy);
    return writer.out;
}

} // namespace

std::string read_scene_text(const std::filesystem::path& path) { return read_document_text(path, scene_keys().file()); }

Scene parse_scene(std::string_view text, const std::string& name, std::span<const std::string> sets, scene::StepLimit limit)
{
    return parse_ready_scene(text, name, sets, limit).scene;
}

scene::Ready parse_ready_scene(std::string_view text, const std::string& name, std::span<const std::string> sets, scene::StepLimit limit)
{
    Document file(text, name, scene_keys(), sets);
    apply_preset(file.root);
    file.check(one_shape);

    Scene scene;
    Reader reader(file);
    describe(reader, scene);
    file.throw_if_any();

    scene::resolve(scene);
    scene::Issues issues;
    auto ready = scene::ready(std::move(scene), limit, issues);
    for (const auto& issue : issues)
        if (issue.severity == scene::Severity::Error)
            file.complain(issue.key, issue.other.empty()
                                         ? issue.text
                                         : fmt::format("{} ({} is at {})", issue.text, issue.other, file.place(issue.other)));
    file.throw_if_any();
    return std::move(*ready);
}

Scene read_scene(const std::filesystem::path& path, std::span<const std::string> sets, scene::StepLimit limit)
{
    return parse_scene(read_scene_text(path), path.string(), sets, limit);
}

std::string write_scene(const Scene& scene) { return written(scene, Purpose::File); }

std::string scene_hash(const Scene& scene)
{
    // FNV-1a, 64 bits.
    std::uint64_t hash = 14695981039346656037ull;
    for (const char c : written(scene, Purpose::Hash)) hash = (hash ^ (unsigned char)(c)) * 1099511628211ull;
    return fmt::format("{:016x}", hash);
}

std::string physics_difference(const Scene& was, const Scene& is)
{
    std::map<std::string, std::array<std::string, 2>> values; // by key; empty where a scene does not have it
    for (const int k : {0, 1}) {
        std::istringstream lines(written(k ? is : was, Purpose::Hash));
        for (std::string line; std::getline(lines, line);) {
            const auto at = line.find(" = ");
            values[line.substr(0, at)][std::size_t(k)] = line.substr(at + 3);
        }
    }
    std::string out;
    int count = 0;
    for (const auto& [key, value] : values) {
        if (value[0] == value[1]) continue;
        if (++count > 5) return out + ", and more";
        const auto shown = [](const std::string& v) { return v.empty() ? "nothing" : v; };
        out += fmt::format("{}{}: {} there, {} here", count > 1 ? "; " : "", key, shown(value[0]), shown(value[1]));
    }
    return out;
}

std::string scene_reference()
{
    std::string out = "# Scene file reference\n\n"
                      "Lengths in m, masses in kg, times in s, stresses in Pa, angles in degrees. Tension is "
                      "positive, z is up.\n"
                      "Presence is the switch: what is not written is not simulated.\n";
    std::string section = "none";
    for (const Key& key : scene_keys()) {
        const bool group =
            key.kind == Kind::Named || key.kind == Kind::Tables || (key.kind == Kind::Table && key.path.find('.') == key.path.npos);
        const std::string head = key.path.find('.') == key.path.npos ? "" : key.path.substr(0, key.path.find('.'));
        const std::string here = group ? key.path : head;
        if (key.path == "soil.*") continue;
        if (here != section) {
            section = here;
            const Key* parent = here.empty() ? nullptr : scene_keys().find(here);
            const std::string title = !parent                        ? "Top level"
                                      : parent->kind == Kind::Tables ? fmt::format("`[[{}]]`", here)
                                      : parent->kind == Kind::Named  ? fmt::format("`[{}.<name>]`", here)
                                                                     : fmt::format("`[{}]`", here);
            out += fmt::format("\n## {}\n\n", title);
            if (parent) out += fmt::format("{}{}.\n\n", parent->doc, parent->need == Need::Required ? "; needed" : "");
            out += "| key | value | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
        }
        if (group) continue;
        std::string name = key.path.substr(here.empty() ? 0 : here.size() + 1);
        if (name.starts_with("*.")) name.erase(0, 2);
        const std::string shown = key.need == Need::Required ? "needed" : key.need == Need::Optional ? "none" : "`" + key.fallback + "`";
        const char* names[] = {"string", "number", "integer", "true or false", "[x, y, z]", "[from, to]", "[[x, z], ...]",
                               "",       "",       "",        "table",         "",          "",           "array of strings"};
        std::string value = names[int(key.kind)];
        if (!key.choices.empty()) {
            value = fmt::format("`\"{}\"`", fmt::join(key.choices, "\"`, `\""));
            if (key.kind == Kind::Choices) value = "array of " + value;
            if (key.kind == Kind::ChoiceOrTable) value += " or table";
        }
        out += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name, value, key.unit, shown, key.range.text(), key.doc);
    }
    return out;
}

} // namespace kuzure::io
