#include "io/document.hpp"
#include "io/quote.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>

namespace kuzure::io {
namespace {

const std::size_t largest_file = std::size_t(1) << 20;
const std::size_t most_problems = 20;
const std::size_t most_parts = 64; // of a key; the library goes through them by calling itself

/// The parts of a path between its dots; they point into it.
std::vector<std::string_view> split(std::string_view path)
{
    std::vector<std::string_view> parts;
    for (std::size_t at = 0; at <= path.size();) {
        const auto end = std::min(path.find('.', at), path.size());
        parts.push_back(path.substr(at, end - at));
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

/// Refuses keys of very many parts ("a.a.a..."), before the library takes its own stack for each; strings and comments are passed over.
template <class Where> void refuse_deep_keys(std::string_view text, Where where)
{
    std::size_t dots = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"' || c == '\'') {
            const std::string_view three = text.substr(i, 3);
            const bool lines = three == "\"\"\"" || three == "\'\'\'";
            const std::string_view end = lines ? three : text.substr(i, 1);
            i += end.size();
            while (i < text.size() && text.substr(i, end.size()) != end && (lines || text[i] != '\n'))
                i += c == '"' && text[i] == '\\' ? 2 : 1;
            i += lines ? 2 : 0;
        } else if (c == '#') {
            i = std::min(text.find('\n', i), text.size());
            dots = 0;
        } else if (c == '.') {
            if (++dots >= most_parts)
                throw BadInput(fmt::format("{}: expected keys of at most {} parts, found one of more; shorten it", where(line_at(text, i)),
                                           most_parts));
        } else if (c == '\n' || c == '=' || c == ',' || c == '[' || c == ']' || c == '{' || c == '}') {
            dots = 0;
        }
    }
}

// ---- what a value must be ----

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
    case Kind::Texts:
        if (!node.is_array()) return unless(false);
        for (const auto& element : *node.as_array())
            if (!element.is_string() || !not_one_line(element.as_string()->get()).empty())
                return Mismatch{described(element) + " among them", {}};
        return {};
    case Kind::Tables:
        if (!node.is_array() || (node.as_array()->empty() && key.need == Need::Required)) return unless(false);
        for (const auto& element : *node.as_array())
            if (!element.is_table()) return Mismatch{described(element) + " among them", {}};
        return {};
    }
    return {};
}

} // namespace

bool is_number(const toml::node* node) { return node && (node->is_integer() || node->is_floating_point()); }
double number_of(const toml::node& node) { return node.is_integer() ? double(node.as_integer()->get()) : node.as_floating_point()->get(); }

// ---- the file as a tree, with the place of every key ----

Document::Document(std::string_view text, std::string name, const KeyTable& keys, std::span<const std::string> sets)
    : name_(std::move(name)), keys_(keys)
{
    if (text.size() > largest_file)
        throw BadInput(fmt::format("{}: expected {} of at most 1 MiB, found {} bytes; is this {} file?", name_, keys_.file(), text.size(),
                                   keys_.file()));
    const auto line_of_file = [&](std::size_t line) { return fmt::format("{}:{}", name_, line); };
    refuse_bad_bytes(text, line_of_file);
    refuse_deep_keys(text, line_of_file);
    try {
        root = toml::parse(text);
    } catch (const toml::parse_error& e) {
        throw BadInput(fmt::format("{}:{}: expected TOML, found an error in column {}: {}; correct this line", name_, e.source().begin.line,
                                   e.source().begin.column, e.description()));
    }
    for (const auto& set : sets) override_with(set);
}

void Document::complain(const std::string& path, const std::string& text)
{
    auto [location, line] = location_and_line(path);
    problems_.push_back({line, path.empty() ? fmt::format("{}: {}", location, text) : fmt::format("{}: {}: {}", location, path, text)});
}

/// More problems than will be shown.
bool Document::has_enough() const { return problems_.size() > 50 * most_problems; }

void Document::throw_if_any()
{
    if (problems_.empty()) return;
    std::stable_sort(problems_.begin(), problems_.end(), [](const auto& a, const auto& b) { return a.line < b.line; });
    std::string all;
    for (std::size_t i = 0; i < std::min(problems_.size(), most_problems); ++i) all += (i ? "\n" : "") + problems_[i].text;
    if (problems_.size() > most_problems) all += fmt::format("\nand {} more", problems_.size() - most_problems);
    throw BadInput(all);
}

const toml::node* Document::find(const std::string& path) const
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

std::size_t Document::line_of(const std::string& path) const
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

std::pair<std::string, std::size_t> Document::location_and_line(const std::string& path) const
{
    for (auto it = sets_.rbegin(); it != sets_.rend(); ++it)
        if (path == it->first || path.starts_with(it->first + ".")) return {"--set " + it->second, 0};
    for (const auto& [table, set] : made_)
        if (path == table) return {"--set " + set, 0};
    const std::size_t line = line_of(path);
    return {fmt::format("{}:{}", name_, line), line};
}

void Document::override_with(const std::string& set)
{
    const auto location = "--set " + set;
    refuse_bad_bytes(set, [&](std::size_t) { return std::string("--set"); });
    refuse_deep_keys(set, [&](std::size_t) { return std::string("--set"); });
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
        throw BadInput(location + ": expected key.path=value, for example --set space.spacing=0.02");

    const Key* key = keys_.find(path);
    const bool wants_text = !key || key->kind == Kind::Text || key->kind == Kind::Choice || key->kind == Kind::ChoiceOrTable;
    toml::table parsed;
    try {
        parsed = toml::parse("v = " + value);
    } catch (const toml::parse_error& e) {
        // A shell takes the quotes off strings.
        if (!wants_text)
            throw BadInput(fmt::format("{}: {}: expected {}, found {}; write, for example, {}={}", location, path, key->expected(), value,
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
            if (!table->contains(parts[k])) {
                table->insert(parts[k], toml::table{});
                made_.emplace_back(fmt::format("{}", fmt::join(parts.begin(), parts.begin() + std::ptrdiff_t(k) + 1, ".")), set);
            }
            node = table->get(parts[k]);
            // "rough" and "auto" give way to a table that is set key by key.
            const Key* here = keys_.find(fmt::format("{}", fmt::join(parts.begin(), parts.begin() + std::ptrdiff_t(k) + 1, ".")));
            if (here && here->kind == Kind::ChoiceOrTable && !node->is_table()) {
                table->insert_or_assign(parts[k], toml::table{});
                node = table->get(parts[k]);
            }
        } else if (auto* array = node->as_array()) {
            const auto i = as_index(parts[k]);
            node = i ? array->get(*i) : nullptr;
            if (!node)
                throw BadInput(fmt::format("{}: expected a number from 0 to {} after {}, found {}; the file has {} of them", location,
                                           std::int64_t(array->size()) - 1, parts[k - 1], parts[k], array->size()));
        } else node = nullptr;
        if (!node) break;
    }
    auto* table = node ? node->as_table() : nullptr;
    if (!table)
        throw BadInput(
            fmt::format("{}: expected a key inside a table, found {}, which is none; see the reference of its keys", location, path));
    if (!table->contains(parts.back())) made_.emplace_back(path, set);
    table->insert_or_assign(parts.back(), *parsed.get("v"));
    sets_.emplace_back(path, set);
}

const toml::node& Document::at(const std::string& path) const
{
    const auto* found = find(path);
    ensure(found, "a key is read that was not checked");
    return *found;
}

std::vector<std::string> Document::texts(const std::string& path) const
{
    std::vector<std::string> all;
    for (const auto& text : *at(path).as_array()) all.push_back(text.as_string()->get());
    return all;
}

std::vector<std::string> Document::names(const std::string& path) const
{
    const auto* table = find(path);
    if (!table) return {};
    // The library's tables do not keep the file's order; what --set added comes last.
    std::vector<std::pair<std::pair<std::size_t, std::size_t>, std::string>> found;
    for (const auto& [name, inside] : *table->as_table()) {
        const auto source = inside.source().begin;
        found.push_back({{source.line ? source.line : std::size_t(-1), source.column}, std::string(name.str())});
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::string> names;
    for (auto& [location, name] : found) names.push_back(std::move(name));
    return names;
}

// ---- every key against the table of keys ----

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

std::string read_document_text(const std::filesystem::path& path, std::string_view what)
{
    const auto refuse = [&](const std::string& found) {
        throw BadInput(fmt::format("{}: expected {} file, found {}; give the path of a .toml file", path.string(), what, found));
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

} // namespace kuzure::io
