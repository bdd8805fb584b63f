#include "io/scene_file.hpp"
#include "io/scene_keys.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>
#include <map>
#include <numbers>
// Compiled into us, toml++ 3.3 asserts what a file like "[[[" breaks, although the code behind the assertion
// reports it.
#define TOML_ASSERT(expression) static_assert(true)
#include <toml++/toml.h>

namespace kuzure::io {
namespace {

const std::size_t largest_file = std::size_t(1) << 20;
const std::size_t most_problems = 20;
const double radians_per_degree = std::numbers::pi / 180;

std::vector<std::string> split(std::string_view path)
{
    std::vector<std::string> parts;
    for (std::size_t at = 0; at <= path.size();) {
        const auto end = std::min(path.find('.', at), path.size());
        parts.emplace_back(path.substr(at, end - at));
        at = end + 1;
    }
    return parts;
}
std::string join(std::string_view head, std::string_view leaf)
{
    return head.empty() ? std::string(leaf) : fmt::format("{}.{}", head, leaf);
}
std::optional<std::size_t> as_index(std::string_view text)
{
    if (text.empty() || text.size() > 9 || text.find_first_not_of("0123456789") != text.npos) return {};
    return std::stoul(std::string(text));
}

// ---- bytes ----

/// Position of the first byte that is not well-formed UTF-8, or npos.
std::size_t malformed(std::string_view s)
{
    for (std::size_t i = 0; i < s.size();) {
        const auto byte = [&](std::size_t k) { return k < s.size() ? (unsigned char)(s[k]) : 0u; };
        const unsigned b = byte(i);
        const int more = b < 0x80 ? 0 : b >= 0xC2 && b < 0xE0 ? 1 : b >= 0xE0 && b < 0xF0 ? 2 : b >= 0xF0 && b < 0xF5 ? 3 : -1;
        if (more < 0) return i;
        for (int k = 1; k <= more; ++k)
            if ((byte(i + std::size_t(k)) & 0xC0) != 0x80) return i;
        const unsigned second = byte(i + 1);
        if ((b == 0xE0 && second < 0xA0) || (b == 0xED && second > 0x9F) || (b == 0xF0 && second < 0x90) || (b == 0xF4 && second > 0x8F))
            return i;
        i += std::size_t(more) + 1;
    }
    return s.npos;
}
std::size_t line_at(std::string_view text, std::size_t position)
{
    return 1 + std::size_t(std::count(text.begin(), text.begin() + std::ptrdiff_t(std::min(position, text.size())), '\n'));
}
/// Refuses what the TOML library must not see; `where` names line n of the source.
template <class Where> void refuse_bad_bytes(std::string_view text, Where where)
{
    if (const auto at = malformed(text); at != text.npos)
        throw BadInput(fmt::format("{}: expected UTF-8, found the byte 0x{:02x} that is none; save it as UTF-8", where(line_at(text, at)),
                                   (unsigned char)(text[at])));
    // toml++ 3.3 takes these two for parts of a byte order mark and runs into undefined behaviour.
    for (const char* bad : {"\xEF\xB9\xBF", "\xEF\xBB\xBD"})
        if (const auto at = text.find(bad); at != text.npos)
            throw BadInput(fmt::format("{}: expected text, found the character U+{}; remove it", where(line_at(text, at)),
                                       bad[1] == '\xB9' ? "FE7F" : "FEFD"));
}

// ---- the file as a tree, with the place of every key ----

struct Problem {
    std::size_t line; // 0: from a --set
    std::string text; // with place and key
};

class Document {
public:
    Document(std::string_view text, std::string name, std::span<const std::string> sets) : name_(std::move(name))
    {
        if (text.size() > largest_file)
            throw BadInput(fmt::format("{}: expected a scene of at most 1 MiB, found {} bytes; is this a scene file?", name_, text.size()));
        refuse_bad_bytes(text, [&](std::size_t line) { return fmt::format("{}:{}", name_, line); });
        try {
            root = toml::parse(text);
        } catch (const toml::parse_error& e) {
            throw BadInput(fmt::format("{}:{}: expected TOML, found an error in column {}: {}; correct this line", name_,
                                       e.source().begin.line, e.source().begin.column, e.description()));
        }
        for (const auto& set : sets) override_with(set);
    }

    toml::table root;

    /// "scene.toml:12", or "--set time.step=1".
    std::string place(const std::string& path) const { return place_and_line(path).first; }
    void complain(const std::string& path, const std::string& text)
    {
        auto [place, line] = place_and_line(path);
        problems_.push_back({line, path.empty() ? fmt::format("{}: {}", place, text) : fmt::format("{}: {}: {}", place, path, text)});
    }
    /// More problems than will be shown.
    bool has_enough() const { return problems_.size() > 50 * most_problems; }
    void throw_if_any()
    {
        if (problems_.empty()) return;
        std::stable_sort(problems_.begin(), problems_.end(), [](const auto& a, const auto& b) { return a.line < b.line; });
        std::string all;
        for (std::size_t i = 0; i < std::min(problems_.size(), most_problems); ++i) all += (i ? "\n" : "") + problems_[i].text;
        if (problems_.size() > most_problems) all += fmt::format("\nand {} more", problems_.size() - most_problems);
        throw BadInput(all);
    }

    /// The node of a path, or nullptr.
    const toml::node* find(const std::string& path) const
    {
        const toml::node* node = &root;
        for (const auto& part : split(path)) {
            if (const auto* table = node->as_table()) node = table->get(part);
            else if (const auto* array = node->as_array()) {
                const auto k = as_index(part);
                node = k ? array->get(*k) : nullptr;
            } else node = nullptr;
            if (!node) return nullptr;
        }
        return node;
    }
    std::size_t line_of(const std::string& path) const
    {
        std::size_t line = 1;
        const toml::node* node = &root;
        if (path.empty()) return line;
        for (const auto& part : split(path)) {
            if (const auto* table = node->as_table()) {
                const auto it = table->find(part);
                if (it == table->end()) break;
                if (it->first.source().begin.line) line = it->first.source().begin.line;
                node = &it->second;
            } else if (const auto* array = node->as_array()) {
                const auto k = as_index(part);
                node = k ? array->get(*k) : nullptr;
                if (!node) break;
                if (node->source().begin.line) line = node->source().begin.line;
            } else break;
        }
        return line;
    }

private:
    std::pair<std::string, std::size_t> place_and_line(const std::string& path) const
    {
        for (auto it = sets_.rbegin(); it != sets_.rend(); ++it)
            if (path == it->first || path.starts_with(it->first + ".")) return {"--set " + it->second, 0};
        const std::size_t line = line_of(path);
        return {fmt::format("{}:{}", name_, line), line};
    }

    void override_with(const std::string& set)
    {
        const auto place = "--set " + set;
        refuse_bad_bytes(set, [&](std::size_t) { return std::string("--set"); });
        const auto equals = set.find('=');
        const auto trim = [](std::string s) {
            const char* blank = " \t\r\n";
            s.erase(0, std::min(s.find_first_not_of(blank), s.size()));
            s.erase(s.find_last_not_of(blank) + 1);
            return s;
        };
        const std::string path = trim(set.substr(0, equals)), value = equals == set.npos ? "" : trim(set.substr(equals + 1));
        const auto parts = split(path);
        if (equals == set.npos || value.empty() || std::any_of(parts.begin(), parts.end(), [](const auto& p) { return p.empty(); }))
            throw BadInput(place + ": expected key.path=value, for example --set space.spacing=0.02");

        const Key* key = find_key(path);
        const bool wants_text = !key || key->kind == Kind::Text || key->kind == Kind::Choice || key->kind == Kind::ChoiceOrTable;
        toml::table parsed;
        try {
            parsed = toml::parse("v = " + value);
        } catch (const toml::parse_error& e) {
            // A shell takes the quotes off strings.
            if (!wants_text)
                throw BadInput(fmt::format("{}: {}: expected {}, found {}; write, for example, {}={}", place, path, key->expected(), value,
                                           path, key->example));
        }
        const bool whole = parsed.size() == 1 && parsed.contains("v");
        if (!whole || (key && key->kind == Kind::Text && !parsed["v"].is_string())) {
            parsed.clear();
            parsed.insert("v", value);
        }

        toml::node* node = &root;
        for (std::size_t k = 0; k + 1 < parts.size(); ++k) {
            if (auto* table = node->as_table()) {
                if (!table->contains(parts[k])) table->insert(parts[k], toml::table{});
                node = table->get(parts[k]);
                // "rough" and "auto" give way to a table that is set key by key.
                const Key* here = find_key(fmt::format("{}", fmt::join(parts.begin(), parts.begin() + std::ptrdiff_t(k) + 1, ".")));
                if (here && here->kind == Kind::ChoiceOrTable && !node->is_table()) {
                    table->insert_or_assign(parts[k], toml::table{});
                    node = table->get(parts[k]);
                }
            } else if (auto* array = node->as_array()) {
                const auto i = as_index(parts[k]);
                node = i ? array->get(*i) : nullptr;
                if (!node)
                    throw BadInput(fmt::format("{}: expected a number from 0 to {} after {}, found {}; the file has {} of them", place,
                                               std::int64_t(array->size()) - 1, parts[k - 1], parts[k], array->size()));
            } else node = nullptr;
            if (!node) break;
        }
        auto* table = node ? node->as_table() : nullptr;
        if (!table)
            throw BadInput(fmt::format("{}: expected a key inside a table, found {}, which is none; see the scene reference", place, path));
        table->insert_or_assign(parts.back(), *parsed.get("v"));
        sets_.emplace_back(path, set);
    }

    std::string name_;
    std::vector<std::pair<std::string, std::string>> sets_;
    std::vector<Problem> problems_;
};

// ---- every key against the table of keys ----

std::string described(const toml::node& node)
{
    const auto quoted = [](std::string_view s) {
        return s.size() > 60 ? fmt::format("\"{}...\"", s.substr(0, 60)) : fmt::format("\"{}\"", s);
    };
    switch (node.type()) {
    case toml::node_type::string:
        return quoted(node.as_string()->get());
    case toml::node_type::integer:
        return fmt::format("{}", node.as_integer()->get());
    case toml::node_type::floating_point:
        return fmt::format("{}", node.as_floating_point()->get());
    case toml::node_type::boolean:
        return node.as_boolean()->get() ? "true" : "false";
    case toml::node_type::array:
        return fmt::format("an array of {}", node.as_array()->size());
    case toml::node_type::table:
        return "a table";
    default:
        return "a date or time";
    }
}
bool is_number(const toml::node* node) { return node && (node->is_integer() || node->is_floating_point()); }
double number_of(const toml::node& node) { return node.is_integer() ? double(node.as_integer()->get()) : node.as_floating_point()->get(); }

/// What was found instead of the value a key expects, and a remedy if there is a better one than an example.
struct Mismatch {
    std::string found, remedy;
};

std::optional<Mismatch> wrong_number(const Key& key, const toml::node& node)
{
    if (is_number(&node) && std::isfinite(number_of(node)) && key.range.holds(number_of(node))) return {};
    return Mismatch{described(node), {}};
}
std::optional<Mismatch> wrong_numbers(const Key& key, const toml::node& node, std::size_t count)
{
    const auto* array = node.as_array();
    if (!array || array->size() != count) return Mismatch{described(node), {}};
    for (const auto& x : *array)
        if (wrong_number(key, x)) {
            const bool outside = is_number(&x) && std::isfinite(number_of(x));
            return Mismatch{described(x) + " among them" + (outside ? ", outside " + key.range.text() : ""), {}};
        }
    return {};
}
std::optional<Mismatch> wrong_choice(const Key& key, const toml::node& node)
{
    const auto* s = node.as_string();
    if (!s) return Mismatch{described(node), {}};
    if (std::find(key.choices.begin(), key.choices.end(), s->get()) != key.choices.end()) return {};
    return Mismatch{described(node), fmt::format("did you mean \"{}\"?", nearest(s->get(), key.choices))};
}
std::optional<Mismatch> wrong_choices(const Key& key, const toml::node& node)
{
    const auto* array = node.as_array();
    if (!array) return Mismatch{described(node), {}};
    if (array->empty()) return Mismatch{"an empty one", "name at least one or leave the key out"};
    std::vector<std::string> seen;
    for (const auto& element : *array) {
        if (auto wrong = wrong_choice(key, element)) return wrong;
        const std::string& word = element.as_string()->get();
        if (std::find(seen.begin(), seen.end(), word) != seen.end()) return Mismatch{described(element) + " twice", "name it once"};
        seen.push_back(word);
    }
    return {};
}

std::optional<Mismatch> mismatch(const Key& key, const toml::node& node)
{
    const auto unless = [&](bool right) { return right ? std::nullopt : std::optional(Mismatch{described(node), {}}); };
    switch (key.kind) {
    case Kind::Text:
        return unless(node.is_string());
    case Kind::Number:
        return wrong_number(key, node);
    case Kind::Integer:
        return node.is_integer() ? wrong_number(key, node) : unless(false);
    case Kind::Flag:
        return unless(node.is_boolean());
    case Kind::Vector:
        return wrong_numbers(key, node, 3);
    case Kind::Pair:
        return wrong_numbers(key, node, 2);
    case Kind::Points:
        if (!node.is_array()) return unless(false);
        for (const auto& point : *node.as_array())
            if (auto wrong = wrong_numbers(key, point, 2)) return Mismatch{wrong->found + " as a corner", {}};
        return {};
    case Kind::Choice:
        return wrong_choice(key, node);
    case Kind::Choices:
        return wrong_choices(key, node);
    case Kind::ChoiceOrTable:
        return node.is_table() ? std::nullopt : wrong_choice(key, node);
    case Kind::Table:
        return unless(node.is_table());
    case Kind::Named:
        return unless(node.is_table() && !node.as_table()->empty());
    case Kind::Tables:
        if (!node.is_array() || (node.as_array()->empty() && key.need == Need::Required)) return unless(false);
        for (const auto& element : *node.as_array())
            if (!element.is_table()) return Mismatch{described(element) + " among them", {}};
        return {};
    }
    return {};
}

void complain_unknown(Document& file, const std::string& path, std::string_view leaf, std::string_view pattern)
{
    std::vector<std::string> siblings;
    for (const Key* k : keys_in(pattern)) siblings.emplace_back(k->leaf());
    // Beyond what is shown, only the count matters.
    std::string meant = file.has_enough() ? siblings.front() : nearest(leaf, siblings);
    if (!file.has_enough() && edit_distance(meant, leaf.substr(0, 100)) > 0)
        for (const Key& k : scene_keys())
            if (k.leaf() == leaf) {
                meant = k.path;
                break;
            }
    file.complain(path, fmt::format("expected a known key, found \"{}\"; did you mean \"{}\"? Known here: {}", leaf, meant,
                                    fmt::join(siblings, ", ")));
}

/// Checks a table against the rows of its pattern and fills in defaults.
void check_table(Document& file, toml::table& table, const std::string& path)
{
    const std::string pattern = pattern_of(path);
    for (const auto& [key, node] : table)
        if (!find_key(join(path, key.str())) || key.str().find('.') != std::string_view::npos)
            complain_unknown(file, join(path, key.str()), key.str(), pattern);

    for (const Key* key : keys_in(pattern)) {
        const std::string here = join(path, key->leaf());
        const std::string remedy = key->kind == Kind::Tables || key->kind == Kind::Named
                                       ? "write, for example, " + key->example
                                       : fmt::format("write, for example, {} = {}", key->leaf(), key->example);
        if (!table.contains(key->leaf())) {
            if (key->need == Need::Required) file.complain(here, fmt::format("expected {}, found nothing; {}", key->expected(), remedy));
            if (key->need != Need::Default) continue;
            auto fallback = toml::parse("v = " + key->fallback);
            table.insert(key->leaf(), *fallback.get("v"));
        }
        toml::node& node = *table.get(key->leaf());
        if (const auto wrong = mismatch(*key, node)) {
            file.complain(here, fmt::format("expected {}, found {}; {}", key->expected(), wrong->found,
                                            wrong->remedy.empty() ? remedy : wrong->remedy));
            continue;
        }
        if (key->kind == Kind::Named) {
            for (auto&& [name, soil] : *node.as_table()) {
                const std::string named = join(here, name.str());
                const bool plain = name.str().find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
                                   std::string_view::npos;
                if (!plain || name.str().empty())
                    file.complain(named, "expected a name of letters, digits, - and _, found another; rename the soil");
                else if (auto* inside = soil.as_table()) check_table(file, *inside, named);
                else file.complain(named, fmt::format("expected a soil's table, found {}; {}", described(soil), remedy));
            }
        } else if (key->kind == Kind::Tables) {
            std::size_t k = 0;
            for (auto& element : *node.as_array()) check_table(file, *element.as_table(), join(here, std::to_string(k++)));
        } else if (auto* inside = node.as_table()) {
            check_table(file, *inside, here);
        }
    }
    if (pattern == "body.*" || pattern == "wall.*") {
        std::vector<std::string> shapes;
        for (const char* shape : {"box", "cylinder", "sphere", "polygon"})
            if (table.contains(shape)) shapes.emplace_back(shape);
        if (shapes.size() != 1)
            file.complain(path, fmt::format("expected exactly one of box, cylinder, sphere, polygon, found {}; {}",
                                            shapes.empty() ? "none" : fmt::format("{}", fmt::join(shapes, " and ")),
                                            shapes.empty() ? "write, for example, box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }"
                                                           : "give every shape its own table"));
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
    a.choice("accuracy.kernel", s.accuracy.kernel);
    a.number("accuracy.cfl", s.accuracy.cfl);
    a.choice("accuracy.precision", s.accuracy.precision);
    a.choice("accuracy.correction", s.accuracy.correction);
    a.number("accuracy.skin", s.accuracy.skin);

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
    });
}

/// Fills a scene from a document that check_table() has approved.
class Reader {
public:
    explicit Reader(Document& file) : file_(file) {}
    void section(const char*) {}
    void text(const std::string& path, std::string& to) { to = node(path).as_string()->get(); }
    void optional_text(const std::string& path, std::string& to)
    {
        if (file_.find(path)) text(path, to);
    }
    void integer(const std::string& path, int& to) { to = int(node(path).as_integer()->get()); }
    void flag(const std::string& path, bool& to) { to = node(path).as_boolean()->get(); }
    void number(const std::string& path, double& to) { to = number_of(node(path)); }
    void number(const std::string& path, std::optional<double>& to)
    {
        optionally(path, to, [&](double& x) { number(path, x); });
    }
    void angle(const std::string& path, double& to) { to = number_of(node(path)) * radians_per_degree; }
    void vector(const std::string& path, Vector& to)
    {
        const auto& array = *node(path).as_array();
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
        for (const auto& p : *node(path).as_array()) to.push_back({number_of(*p.as_array()->get(0)), number_of(*p.as_array()->get(1))});
    }
    void axes(const std::string& path, std::array<bool, 3>& to)
    {
        if (const auto* n = file_.find(path))
            for (const auto& axis : *n->as_array()) to[std::size_t(axis.as_string()->get()[0] - 'x')] = true;
    }
    void words(const std::string& path, std::vector<std::string>& to)
    {
        to.clear();
        for (const auto& word : *node(path).as_array()) to.push_back(word.as_string()->get());
    }
    template <class Enum> void choice(const std::string& path, Enum& to)
    {
        const auto& choices = find_key(path)->choices;
        to = Enum(std::find(choices.begin(), choices.end(), node(path).as_string()->get()) - choices.begin());
    }
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
        for (const auto& [name, soil] : *node("soil").as_table()) to.emplace_back().name = std::string(name.str());
        // The file's order, which the library's tables do not keep.
        std::stable_sort(to.begin(), to.end(), [&](const auto& a, const auto& b) {
            const auto position = [&](const auto& soil) {
                const auto source = node("soil." + soil.name).source().begin;
                return source.line ? std::pair(source.line, source.column) : std::pair(~decltype(source.line)(0), source.column);
            };
            return position(a) < position(b);
        });
        for (auto& soil : to) describe("soil." + soil.name, soil);
    }
    void soil_of(const std::string& path, int& to, const std::vector<scene::Soil>& soils)
    {
        const std::string& name = node(path).as_string()->get();
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
        if (node(path).is_table()) {
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
    const toml::node& node(const std::string& path) const
    {
        const auto* found = file_.find(path);
        ensure(found, "a key is read that was not checked");
        return *found;
    }
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
        emit(path, toml_string(find_key(path)->choices.at(std::size_t(value))));
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
        const Key& key = *find_key(path);
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
        const Key& key = *find_key(path);
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

std::string read_scene_text(const std::filesystem::path& path)
{
    const auto refuse = [&](const std::string& found) {
        throw BadInput(fmt::format("{}: expected a scene file, found {}; give the path of a .toml file", path.string(), found));
    };
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) refuse("a directory");
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in) refuse(errno ? std::strerror(errno) : "a file that cannot be opened");
    std::string text(largest_file + 1, '\0');
    in.read(text.data(), std::streamsize(text.size()));
    if (in.bad()) refuse("a file that cannot be read");
    text.resize(std::size_t(in.gcount()));
    if (text.size() > largest_file) refuse("more than 1 MiB");
    return text;
}

Scene parse_scene(std::string_view text, const std::string& name, std::span<const std::string> sets, scene::StepLimit limit)
{
    Document file(text, name, sets);
    check_table(file, file.root, "");
    file.throw_if_any();

    Scene scene;
    Reader reader(file);
    describe(reader, scene);
    file.throw_if_any();

    scene::resolve(scene);
    for (const auto& issue : scene::check(scene, limit))
        if (issue.severity == scene::Severity::Error)
            file.complain(issue.key, issue.other.empty()
                                         ? issue.text
                                         : fmt::format("{} ({} is at {})", issue.text, issue.other, file.place(issue.other)));
    file.throw_if_any();
    return scene;
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
            const Key* parent = here.empty() ? nullptr : find_key(here);
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
        const char* names[] = {"string", "number", "integer", "true or false", "[x, y, z]", "[from, to]", "[[x, z], ...]", "", "", "",
                               "table",  "",       ""};
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
