// Every key of a document against the table of keys: what its value must be, defaults, unknown and misspelt keys.
#include "io/document.hpp"
#include "io/quote.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unordered_map>

namespace kuzure::io {
namespace {

std::string join(std::string_view head, std::string_view leaf)
{
    return head.empty() ? std::string(leaf) : fmt::format("{}.{}", head, leaf);
}

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
    const std::string meant = nearest(s->get(), key.choices);
    return Mismatch{described(node), meant.empty() ? "choose one of these" : fmt::format("did you mean \"{}\"?", meant)};
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

std::optional<Mismatch> wrong_texts(const toml::node& node)
{
    if (!node.is_array()) return Mismatch{described(node), {}};
    for (const auto& element : *node.as_array())
        if (!element.is_string() || !not_one_line(element.as_string()->get()).empty())
            return Mismatch{described(element) + " among them", {}};
    return {};
}

std::optional<Mismatch> mismatch(const Key& key, const toml::node& node)
{
    const auto unless = [&](bool right) { return right ? std::nullopt : std::optional(Mismatch{described(node), {}}); };
    switch (key.kind) {
    case Kind::Text:
        if (node.is_string())
            if (const auto wrong = not_one_line(node.as_string()->get()); !wrong.empty())
                return Mismatch{wrong.substr(0, wrong.find(';')), wrong.substr(wrong.find(';') + 2)};
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
    case Kind::Window:
        return wrong_numbers(key, node, 4);
    case Kind::Points:
        if (!node.is_array()) return unless(false);
        for (const auto& point : *node.as_array())
            if (auto wrong = wrong_numbers(key, point, 2)) return Mismatch{wrong->found + " as a corner", {}};
        return {};
    case Kind::Numbers:
        if (!node.is_array()) return unless(false);
        for (const auto& element : *node.as_array())
            if (auto wrong = wrong_number(key, element)) return Mismatch{wrong->found + " among them", wrong->remedy};
        return {};
    case Kind::Choice:
        return wrong_choice(key, node);
    case Kind::Choices:
        return wrong_choices(key, node);
    case Kind::ChoiceOrTable:
        return node.is_table() ? std::nullopt : wrong_choice(key, node);
    case Kind::Table:
    case Kind::Settings:
        return unless(node.is_table());
    case Kind::TextOrTrue:
        return unless(node.is_string() || node.value_or(false));
    case Kind::Named:
        return unless(node.is_table() && !node.as_table()->empty());
    case Kind::TextOrTexts:
        if (node.is_string()) return unless(not_one_line(node.as_string()->get()).empty());
        return node.is_array() && node.as_array()->empty() ? unless(false) : wrong_texts(node);
    case Kind::Texts:
        return wrong_texts(node);
    case Kind::Tables:
        if (!node.is_array() || (node.as_array()->empty() && key.need == Need::Required)) return unless(false);
        for (const auto& element : *node.as_array())
            if (!element.is_table()) return Mismatch{described(element) + " among them", {}};
        return {};
    }
    return {};
}

} // namespace

void Document::check()
{
    check_table(root, "");
    throw_if_any();
}

void Document::complain_unknown(const std::string& path, std::string_view leaf, std::string_view pattern)
{
    std::vector<std::string> siblings;
    for (const Key* k : keys_.inside(pattern)) siblings.emplace_back(k->leaf());
    // Beyond what is shown, only the count matters.
    const std::string meant = has_enough() ? siblings.front() : nearest(leaf, siblings);
    std::string remedy = meant.empty() ? "." : fmt::format("; did you mean \"{}\"?", meant);
    if (!has_enough() && (meant.empty() || edit_distance(meant, leaf.substr(0, 100)) > 0)) {
        const auto same = std::find_if(keys_.begin(), keys_.end(), [&](const Key& k) { return k.leaf() == leaf; });
        const auto absent = keys_.file() == "a scene" ? not_simulated(leaf) : std::string();
        if (same != keys_.end()) remedy = fmt::format("; did you mean \"{}\"?", same->path); // in another table
        else if (!absent.empty()) remedy = ". " + absent;
    }
    complain(path, fmt::format("expected a known key, found \"{}\"{} Known here: {}", leaf, remedy, fmt::join(siblings, ", ")));
}

namespace {
/// The default of a key that has one; every text is parsed once.
const toml::node& fallback(const Key& key)
{
    thread_local std::unordered_map<std::string, toml::table> parsed;
    auto found = parsed.find(key.fallback);
    if (found == parsed.end()) found = parsed.emplace(key.fallback, toml::parse("v = " + key.fallback)).first;
    return *found->second.get("v");
}
} // namespace

/// A table [soil.caly] that only a --set speaks of and that lacks what it needs: the name is misspelt. Says so and gives true.
bool Document::complain_misspelt_name(const toml::node& value, const std::string& path, const std::string& named)
{
    const auto by_set = [&](const std::string& name) {
        return std::any_of(made_.begin(), made_.end(), [&](const auto& made) { return made.first == name; });
    };
    if (!value.is_table() || !by_set(named)) return false;
    const auto& needed = keys_.inside(keys_.pattern_of(named));
    if (std::all_of(needed.begin(), needed.end(),
                    [&](const Key* k) { return k->need != Need::Required || value.as_table()->contains(k->leaf()); }))
        return false; // a whole one
    std::vector<std::string> names;
    for (const auto& name : this->names(path))
        if (!by_set(join(path, name))) names.push_back(name);
    const std::string name = named.substr(path.size() + 1);
    complain(named, fmt::format("expected a {} of the file, found none called \"{}\"{} The file has: {}", path, name,
                                did_you_mean(name, names), names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
    return true;
}

/// Checks a table against the rows of its pattern and fills in defaults.
void Document::check_table(toml::table& table, const std::string& path)
{
    const std::string pattern = keys_.pattern_of(path);
    const Key* self = path.empty() ? nullptr : keys_.find(path);
    for (const auto& [key, node] : table)
        if (self && self->kind == Kind::Settings) break;
        else if (!keys_.find(join(path, key.str())) || key.str().find('.') != std::string_view::npos)
            complain_unknown(join(path, key.str()), key.str(), pattern);

    for (const Key* key : keys_.inside(pattern)) {
        const std::string here = join(path, key->leaf());
        const std::string remedy = key->kind == Kind::Tables || key->kind == Kind::Named
                                       ? "write, for example, " + key->example
                                       : fmt::format("write, for example, {} = {}", key->leaf(), key->example);
        if (!table.contains(key->leaf())) {
            if (key->need == Need::Required) complain(here, fmt::format("expected {}, found nothing; {}", key->expected(), remedy));
            if (key->need != Need::Default) continue;
            table.insert(key->leaf(), fallback(*key));
        }
        toml::node& node = *table.get(key->leaf());
        if (const auto wrong = mismatch(*key, node)) {
            complain(here, fmt::format("expected {}, found {}; {}", key->expected(), wrong->found,
                                       wrong->remedy.empty() ? remedy : wrong->remedy));
            continue;
        }
        if (key->kind == Kind::Named) {
            for (auto&& [name, value] : *node.as_table()) {
                const std::string named = join(here, name.str());
                if (complain_misspelt_name(value, here, named)) continue;
                const bool plain = name.str().find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
                                   std::string_view::npos;
                if (!plain || name.str().empty())
                    complain(named, fmt::format("expected a name of letters, digits, - and _, found another; rename the {}", key->leaf()));
                else if (auto* inside = value.as_table()) check_table(*inside, named);
                else complain(named, fmt::format("expected a {}'s table, found {}; {}", key->leaf(), described(value), remedy));
            }
        } else if (key->kind == Kind::Tables) {
            std::size_t k = 0;
            for (auto& element : *node.as_array()) check_table(*element.as_table(), join(here, std::to_string(k++)));
        } else if (auto* inside = node.as_table()) {
            check_table(*inside, here);
        }
    }
    check_alternatives(table, path, pattern);
}

/// Of keys that exclude one another, one is there.
void Document::check_alternatives(const toml::table& table, const std::string& path, const std::string& pattern)
{
    std::vector<std::string_view> known, found;
    const Key* first = nullptr;
    for (const Key* key : keys_.inside(pattern)) {
        if (key->need != Need::OneOf) continue;
        if (!first) first = key;
        known.push_back(key->leaf());
        if (table.contains(key->leaf())) found.push_back(key->leaf());
    }
    if (!first || found.size() == 1) return;
    const std::string remedy = found.empty()             ? fmt::format("write, for example, {} = {}", first->leaf(), first->example)
                               : pattern.ends_with(".*") ? fmt::format("give each its own [[{}]]", pattern.substr(0, pattern.size() - 2))
                                                         : "leave one";
    complain(path, fmt::format("expected exactly one of {}, found {}; {}", fmt::join(known, ", "),
                               found.empty() ? "none" : fmt::format("{}", fmt::join(found, " and ")), remedy));
}

} // namespace kuzure::io
