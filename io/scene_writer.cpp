// A scene as text: with every default written out, and as the lines of which its hash is taken.
#include "io/ground/ground.hpp"
#include "io/scene_description.hpp"
#include "io/scene_file.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <map>
#include <sstream>
#include <utility>

namespace kuzure::io {
namespace {

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

/// Writes a scene as TOML. For a hash: whole paths, soils by number, decisions instead of "auto", no bookkeeping.
class Writer {
public:
    explicit Writer(Purpose purpose) : purpose_(purpose) {}
    std::string out;

    void section(const std::string& path, const KeyInfo&) { header("[" + path + "]"); }
    void text(const std::string& path, const std::string& s, const KeyInfo& k)
    {
        if (k.optional && s.empty()) absent(path);
        else emit(path, toml_string(s));
    }
    void integer(const std::string& path, int n, const KeyInfo&) { emit(path, std::to_string(n)); }
    void integer(const std::string& path, const std::optional<int>& n, const KeyInfo& k) { n ? integer(path, *n, k) : absent(path); }
    void flag(const std::string& path, bool on, const KeyInfo&)
    {
        if (on || purpose_ == Purpose::File) emit(path, on ? "true" : "false");
    }
    void number(const std::string& path, double x, const KeyInfo& k) { k.optional&& x == 0 ? absent(path) : emit(path, digits(x)); }
    void number(const std::string& path, const std::optional<double>& x, const KeyInfo& k) { x ? number(path, *x, k) : absent(path); }
    void angle(const std::string& path, double x, const KeyInfo& k)
    {
        if (k.optional && x == 0) absent(path);
        else emit(path, purpose_ == Purpose::Hash ? digits(x) : toml_degrees(x));
    }
    void angle(const std::string& path, const std::optional<double>& x, const KeyInfo& k) { x ? angle(path, *x, k) : absent(path); }
    void vector(const std::string& path, const Vector& v, const KeyInfo&)
    {
        emit(path, fmt::format("[{}, {}, {}]", digits(v.x), digits(v.y), digits(v.z)));
    }
    void vector(const std::string& path, const std::optional<Vector>& v, const KeyInfo& k) { v ? vector(path, *v, k) : absent(path); }
    void pair(const std::string& path, const std::array<double, 2>& p, const KeyInfo&)
    {
        if (p[0] != 0 || p[1] != 0) emit(path, fmt::format("[{}, {}]", digits(p[0]), digits(p[1])));
    }
    void numbers(const std::string& path, const std::vector<double>& xs, const KeyInfo&)
    {
        std::vector<std::string> texts;
        for (const double x : xs) texts.push_back(digits(x));
        emit(path, fmt::format("[{}]", fmt::join(texts, ", ")));
    }
    void files(const std::string& path, const std::vector<std::string>& names, const KeyInfo&)
    {
        std::vector<std::string> texts;
        for (const auto& name : names) texts.push_back(toml_string(name));
        emit(path, texts.size() == 1 ? texts[0] : fmt::format("[{}]", fmt::join(texts, ", ")));
    }
    void some_names(const std::string& path, const std::vector<std::string>& names, const KeyInfo& k)
    {
        names.empty() ? absent(path) : files(path, names, k);
    }
    void window(const std::string& path, const std::optional<std::array<double, 4>>& w, const KeyInfo&)
    {
        if (w) emit(path, fmt::format("[{}, {}, {}, {}]", digits((*w)[0]), digits((*w)[1]), digits((*w)[2]), digits((*w)[3])));
        else absent(path);
    }
    void points(const std::string& path, const std::vector<std::array<double, 2>>& ps, const KeyInfo& k)
    {
        if (k.optional && ps.empty()) return absent(path);
        std::vector<std::string> texts;
        for (const auto& p : ps) texts.push_back(fmt::format("[{}, {}]", digits(p[0]), digits(p[1])));
        emit(path, fmt::format("[{}]", fmt::join(texts, ", ")));
    }
    void axes(const std::string& path, const std::array<bool, 3>& on, const KeyInfo&)
    {
        std::vector<std::string> names;
        for (int k = 0; k < 3; ++k)
            if (on[std::size_t(k)]) names.emplace_back(1, "xyz"[k]);
        names.empty() ? absent(path) : emit(path, array_of(names));
    }
    void choices(const std::string& path, const std::vector<std::string>& words, std::initializer_list<const char*>, const KeyInfo&)
    {
        emit(path, array_of(words));
    }
    template <class Enum> void choice(const std::string& path, Enum value, const std::type_identity_t<Words<Enum>>& words, const KeyInfo&)
    {
        const auto found = std::find_if(words.begin(), words.end(), [&](const auto& w) { return w.value == value; });
        ensure(found != words.end(), "a choice without a word");
        emit(path, toml_string(found->word));
    }
    template <class Enum>
    void choice(const std::string& path, std::optional<Enum> value, const std::type_identity_t<Words<Enum>>& words, const KeyInfo& k)
    {
        value ? choice(path, *value, words, k) : absent(path);
    }
    template <class Enum, class Describe>
    void choice_or_table(const std::string& path, Enum value, const std::type_identity_t<Words<Enum>>& words, Enum table, const KeyInfo& k,
                         Describe describe)
    {
        if (value == table) inlined(path, [&] { describe(path); });
        else choice(path, value, words, k);
    }
    template <class T, class Describe> void table(const std::string& path, std::optional<T>& value, const KeyInfo&, Describe describe)
    {
        if (value) inlined(path, [&] { describe(path, *value); });
        else absent(path);
    }
    template <class T, class Describe> void part(const std::string& path, std::optional<T>& value, const KeyInfo& k, Describe describe)
    {
        if (!value) {
            if (purpose_ == Purpose::File) out += fmt::format("\n# no [{}]: {}\n", path, k.doc);
            return;
        }
        header("[" + path + "]");
        describe(path, *value);
    }
    template <class T, class Describe>
    void automatic(const std::string& path, std::optional<T>& value, scene::Decision decision, const KeyInfo& k, Describe describe)
    {
        if (decision == scene::Decision::Auto && purpose_ == Purpose::File) emit(path, "\"auto\"");
        else table(path, value, k, describe);
    }
    template <class T, class Describe> void tables(const std::string& path, std::vector<T>& elements, const KeyInfo&, Describe describe)
    {
        for (std::size_t k = 0; k < elements.size(); ++k) {
            header("[[" + path + "]]");
            describe(fmt::format("{}.{}", path, k), elements[k]);
        }
    }
    template <class Describe> void soils(const std::string& path, std::vector<scene::Soil>& soils, const KeyInfo&, Describe describe)
    {
        for (std::size_t k = 0; k < soils.size(); ++k) {
            header("[" + path + "." + soils[k].name + "]");
            describe(path + "." + (purpose_ == Purpose::Hash ? std::to_string(k) : soils[k].name), soils[k]);
        }
    }
    template <class Describe>
    void soil_changes(const std::string& path, std::vector<scene::SoilChange>& changes, const std::vector<scene::Soil>& soils,
                      const KeyInfo&, Describe describe)
    {
        for (auto& c : changes) {
            const auto& name = soils.at(std::size_t(c.soil)).name;
            header("[event.soil." + name + "]");
            describe(path + "." + (purpose_ == Purpose::Hash ? std::to_string(c.soil) : name), c);
        }
    }
    void soil_of(const std::string& path, int soil, const std::vector<scene::Soil>& soils, const KeyInfo&)
    {
        emit(path, purpose_ == Purpose::Hash ? std::to_string(soil) : toml_string(soils.at(std::size_t(soil)).name));
    }
    template <class T, class Describe> void alternative(const std::string& path, scene::Shape& shape, const KeyInfo&, Describe describe)
    {
        if (auto* s = std::get_if<T>(&shape)) inlined(path, [&] { describe(path, *s); });
    }

private:
    static std::string array_of(const std::vector<std::string>& words) { return fmt::format("[\"{}\"]", fmt::join(words, "\", \"")); }
    std::string digits(double x) const { return toml_number(purpose_ == Purpose::Hash ? x + 0.0 : x); }
    void header(const std::string& text)
    {
        if (purpose_ == Purpose::File) out += "\n" + text + "\n";
    }
    void emit(const std::string& path, const std::string& value)
    {
        const Key& key = *scene_keys().find(path);
        if (purpose_ == Purpose::Hash && key.role != Role::Physics) return;
        if (inline_) {
            *inline_ += fmt::format("{}{} = {}", inline_->empty() ? "" : ", ", key.leaf(), value);
        } else if (purpose_ == Purpose::Hash) {
            out += fmt::format("{} = {}\n", path, value);
        } else {
            const auto line = fmt::format("{} = {}", key.leaf(), value);
            out += key.unit.empty() || key.unit == "1" ? line + "\n" : fmt::format("{:<40} # {}\n", line, key.unit);
        }
    }
    /// What is not there is named, so that a written scene shows all it could say.
    void absent(const std::string& path)
    {
        if (inline_ || purpose_ == Purpose::Hash) return;
        if (path.starts_with("event.") || path.starts_with("probe.")) return; // most of what they could say is absent
        const Key& key = *scene_keys().find(path);
        out += fmt::format("# no {}: {}\n", key.leaf(), key.doc);
    }
    template <class Body> void inlined(const std::string& path, Body body)
    {
        std::string inside;
        std::string* const outer = std::exchange(inline_, &inside);
        body();
        inline_ = outer;
        emit(path, "{ " + inside + " }");
    }
    Purpose purpose_;
    std::string* inline_ = nullptr;
};

/// What files of maps have given: their content counts, not where they lie.
void write_ground(const Scene& scene, std::string& out)
{
    for (const auto& wall : scene.walls)
        if (const auto* g = std::get_if<scene::Ground>(&wall.shape)) {
            out += fmt::format("terrain.heights = {}\n", digest(g->field->grid()));
            if (g->friction) out += fmt::format("terrain.frictions = {}\n", digest(*g->friction));
        }
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const auto* r = std::get_if<scene::Release>(&scene.bodies[b].shape);
        if (!r) continue;
        scene::Grid corners;
        for (const auto& ring : r->rings) {
            for (const auto& p : ring) corners.values.insert(corners.values.end(), {p[0], p[1]});
            corners.values.push_back(std::numeric_limits<double>::quiet_NaN());
        }
        out += fmt::format("body.{}.release.rings = {}\n", b, digest(corners));
        if (r->thicknesses) out += fmt::format("body.{}.release.thicknesses = {}\n", b, digest(*r->thicknesses));
    }
}

/// What files of ground motion and of walls' ways have given.
void write_records(const Scene& scene, std::string& out)
{
    const auto write = [&](std::size_t event, const char* key, const scene::Record& record) {
        if (!record.rows) return;
        for (const auto& r : *record.rows)
            out += fmt::format("event.{}.{} = [{}, {}, {}, {}]\n", event, key, r[0], r[1] + 0.0, r[2] + 0.0, r[3] + 0.0);
    };
    for (std::size_t k = 0; k < scene.events.size(); ++k) {
        write(k, "shaking", scene.events[k].shaking);
        if (const auto& move = scene.events[k].move) write(k, "move.path", move->path);
    }
}

std::string written(const Scene& scene, Purpose purpose)
{
    Writer writer(purpose);
    Scene copy = scene;
    // The ground is said by [terrain].
    std::erase_if(copy.walls, [](const scene::Wall& wall) { return std::holds_alternative<scene::Ground>(wall.shape); });
    describe(writer, copy);
    if (purpose == Purpose::Hash) write_ground(scene, writer.out), write_records(scene, writer.out);
    return writer.out;
}

} // namespace

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

} // namespace kuzure::io
