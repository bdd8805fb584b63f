// The file as a tree: its bytes, the line of every key, --set. What its values must be: document.cpp.
#include "io/document.hpp"
#include "io/quote.hpp"
#include "io/trim.hpp"
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

} // namespace

bool is_number(const toml::node* node) { return node && (node->is_integer() || node->is_floating_point()); }
double number_of(const toml::node& node) { return node.is_integer() ? double(node.as_integer()->get()) : node.as_floating_point()->get(); }

// ---- the file as a tree, with the line of every key ----

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

/// The table that a --set writes into, made where it is missing.
toml::table& Document::table_for(const std::string& path, const std::vector<std::string_view>& parts, const std::string& set)
{
    const auto location = "--set " + set;
    const auto path_to = [&](std::size_t n) { return fmt::format("{}", fmt::join(parts.begin(), parts.begin() + std::ptrdiff_t(n), ".")); };
    toml::node* node = &root;
    for (std::size_t k = 0; k + 1 < parts.size(); ++k) {
        if (auto* table = node->as_table()) {
            if (!table->contains(parts[k])) {
                table->insert(parts[k], toml::table{});
                made_.emplace_back(path_to(k + 1), set);
            }
            node = table->get(parts[k]);
            // "rough" and "auto" give way to a table that is set key by key.
            const Key* here = keys_.find(path_to(k + 1));
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
    return *table;
}

void Document::override_with(const std::string& set)
{
    const auto location = "--set " + set;
    refuse_bad_bytes(set, [&](std::size_t) { return std::string("--set"); });
    refuse_deep_keys(set, [&](std::size_t) { return std::string("--set"); });
    const auto equals = set.find('=');
    const std::string path = trimmed(set.substr(0, equals)), value = equals == set.npos ? "" : trimmed(set.substr(equals + 1));
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

    toml::table& table = table_for(path, parts, set);
    if (!table.contains(parts.back())) made_.emplace_back(path, set);
    table.insert_or_assign(parts.back(), *parsed.get("v"));
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
