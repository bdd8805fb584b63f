#include "io/keys.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::io {

bool Range::holds(double x) const { return (low_open ? x > low : x >= low) && (high_open ? x < high : x <= high); }

std::string Range::text() const
{
    const bool below = low > -std::numeric_limits<double>::infinity(), above = high < std::numeric_limits<double>::infinity();
    if (below && above) return fmt::format("{:g} {} x {} {:g}", low, low_open ? "<" : "<=", high_open ? "<" : "<=", high);
    if (below) return fmt::format("x {} {:g}", low_open ? ">" : ">=", low);
    return above ? fmt::format("x {} {:g}", high_open ? "<" : "<=", high) : "";
}

std::string Key::expected() const
{
    const std::string of_unit = unit.empty() || unit == "1" ? "" : unit.starts_with("of ") ? " " + unit : " in " + unit;
    const std::string limits = range.text().empty() ? "" : ", " + range.text();
    const auto one_of = [&] { return fmt::format("\"{}\"", fmt::join(choices, "\", \"")); };
    switch (kind) {
    case Kind::Text:
        return "a string";
    case Kind::Number:
        return "a number" + of_unit + limits;
    case Kind::Integer:
        return "an integer" + limits;
    case Kind::Flag:
        return "true or false";
    case Kind::Vector:
        return "three numbers [x, y, z]" + of_unit;
    case Kind::Pair:
        return "two numbers [from, to]" + of_unit;
    case Kind::Points:
        return "an array of corners [x, z]" + of_unit;
    case Kind::Choice:
        return (choices.size() > 1 ? "one of " : "") + one_of();
    case Kind::Choices:
        return "an array of " + one_of();
    case Kind::ChoiceOrTable:
        return one_of() + " or a table";
    case Kind::Table:
        return "a table";
    case Kind::Tables:
        return fmt::format("tables [[{}]]", path);
    case Kind::Named:
        return fmt::format("tables [{}.<name>]", path);
    case Kind::Texts:
        return "an array of strings";
    case Kind::TextOrTrue:
        return "a string or true";
    case Kind::Settings:
        return "a table";
    }
    return {};
}

KeyTable::KeyTable(std::string file, std::vector<Key> keys) : file_(std::move(file)), keys_(std::move(keys))
{
    for (const Key& k : keys_) {
        rows_.emplace(k.path, &k);
        const auto dot = k.path.rfind('.');
        const auto parent = std::string_view(k.path).substr(0, dot == k.path.npos ? 0 : dot);
        if (k.leaf() != "*") inside_[parent].push_back(&k);
    }
}

const Key* KeyTable::row(std::string_view pattern) const
{
    const auto found = rows_.find(pattern);
    return found == rows_.end() ? nullptr : found->second;
}

const Key* KeyTable::find(std::string_view path) const { return row(pattern_of(path)); }

std::string KeyTable::pattern_of(std::string_view path) const
{
    const auto first = path.find('.');
    const auto head = path.substr(0, first);
    const Key* many = first == path.npos ? nullptr : row(head);
    if (!many || (many->kind != Kind::Named && many->kind != Kind::Tables)) return std::string(path);
    const auto second = path.find('.', first + 1);
    return std::string(head) + ".*" + std::string(second == path.npos ? "" : path.substr(second));
}

const std::vector<const Key*>& KeyTable::inside(std::string_view pattern) const
{
    static const std::vector<const Key*> none;
    const auto found = inside_.find(pattern);
    return found == inside_.end() ? none : found->second;
}

int edit_distance(std::string_view a, std::string_view b)
{
    // Of the table of distances between the beginnings of both words, the row of this letter of a and the two before.
    std::vector<int> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) now[j] = int(j);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::swap(before, last);
        std::swap(last, now);
        now[0] = int(i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const int same = last[j - 1] + int(a[i - 1] != b[j - 1]);
            now[j] = std::min(std::min(last[j], now[j - 1]) + 1, same);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
        }
    }
    return now[b.size()];
}

std::string nearest(std::string_view written, const std::vector<std::string>& known)
{
    // What others call it is nearer than any word of similar letters.
    static constexpr std::pair<std::string_view, std::string_view> others[] = {
        {"rho", "density"},        {"E", "young"},    {"nu", "poisson"},    {"c", "cohesion"},    {"phi", "friction_angle"},
        {"psi", "dilation_angle"}, {"dx", "spacing"}, {"dp", "spacing"},    {"dt", "step"},       {"g", "gravity"},
        {"diameter", "radius"},    {"size", "high"},  {"boundary", "wall"}, {"material", "soil"}, {"cuboid", "box"}};
    for (const auto& [other, ours] : others)
        if (written == other && std::find(known.begin(), known.end(), ours) != known.end()) return std::string(ours);
    // A very long word is near to nothing, and its distances would take long.
    const auto word = written.substr(0, 100);
    const std::string* best = nullptr;
    int least = 0;
    for (const auto& candidate : known)
        if (const int distance = edit_distance(word, candidate); !best || distance < least) best = &candidate, least = distance;
    return best ? *best : "";
}

} // namespace kuzure::io
