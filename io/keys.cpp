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
    }
    return {};
}

const Key* KeyTable::row(std::string_view pattern) const
{
    const auto found = std::find_if(keys_.begin(), keys_.end(), [&](const Key& k) { return k.path == pattern; });
    return found == keys_.end() ? nullptr : &*found;
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

std::vector<const Key*> KeyTable::inside(std::string_view pattern) const
{
    const std::string head = pattern.empty() ? "" : std::string(pattern) + ".";
    std::vector<const Key*> inside;
    for (const Key& k : keys_)
        if (k.path.starts_with(head) && k.path.find('.', head.size()) == k.path.npos && k.leaf() != "*") inside.push_back(&k);
    return inside;
}

int edit_distance(std::string_view a, std::string_view b)
{
    std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i)
        for (std::size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = int(i + j);
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

std::string nearest(std::string_view written, const std::vector<std::string>& known)
{
    // What others call it is nearer than any word of similar letters.
    static constexpr std::pair<std::string_view, std::string_view> others[] = {
        {"rho", "density"},        {"E", "young"},    {"nu", "poisson"},    {"c", "cohesion"},   {"phi", "friction_angle"},
        {"psi", "dilation_angle"}, {"dx", "spacing"}, {"dp", "spacing"},    {"dt", "step"},      {"g", "gravity"},
        {"diameter", "radius"},    {"size", "high"},  {"boundary", "wall"}, {"material", "soil"}};
    for (const auto& [other, ours] : others)
        if (written == other && std::find(known.begin(), known.end(), ours) != known.end()) return std::string(ours);
    // A very long word is near to nothing, and the table of distances would be large.
    const auto word = written.substr(0, 100);
    const auto best = std::min_element(known.begin(), known.end(),
                                       [&](const auto& a, const auto& b) { return edit_distance(word, a) < edit_distance(word, b); });
    return best == known.end() ? "" : *best;
}

} // namespace kuzure::io
