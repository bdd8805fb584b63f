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
    case Kind::Window:
        return "four numbers [x from, y from, x to, y to]" + of_unit;
    case Kind::Numbers:
        return "an array of numbers" + of_unit + limits;
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
    case Kind::TextOrTexts:
        return "a string or an array of strings";
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
    std::string pattern;
    bool name = false; // what comes next is one, or a number
    for (std::size_t at = 0; at <= path.size();) {
        const auto end = std::min(path.find('.', at), path.size());
        const auto part = path.substr(at, end - at);
        at = end + 1;
        if (!pattern.empty()) pattern += '.';
        pattern += name ? "*" : part;
        const Key* here = name ? nullptr : row(pattern);
        name = here && (here->kind == Kind::Named || here->kind == Kind::Tables);
    }
    return pattern;
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

namespace {
std::string lower(std::string_view s)
{
    std::string out(s);
    for (char& c : out)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return out;
}
} // namespace

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
    const auto word = lower(written.substr(0, 100));
    const std::string* best = nullptr;
    double least = 0;
    for (const auto& candidate : known) {
        const std::string other = lower(candidate);
        double distance = edit_distance(word, other);
        // A part of a name, such as "friction" or "oakforest", is like it however long the whole.
        const auto &shorter = word.size() < other.size() ? word : other, &longer = word.size() < other.size() ? other : word;
        const bool part = shorter.size() >= 4 && longer.find(shorter) != longer.npos;
        // Two letters of five may be wrong, one of three or four; of one or two none.
        const double longest = double(longer.size());
        if (!part && distance > (longest > 2 ? std::max(1.0, 0.4 * longest) : 0.0)) continue;
        if (part) distance = std::min(distance, 1 + 0.1 * distance);
        if (!best || distance < least) best = &candidate, least = distance;
    }
    return best ? *best : "";
}

std::string did_you_mean(std::string_view written, const std::vector<std::string>& known)
{
    const std::string meant = nearest(written, known);
    return meant.empty() ? "." : fmt::format("; did you mean \"{}\"?", meant);
}

std::string not_one_line(std::string_view text)
{
    const std::size_t longest = 4096;
    if (text.size() > longest) return fmt::format("one of {} bytes; shorten it to {}", text.size(), longest);
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto c = (unsigned char)(text[i]);
        const bool second_set = c == 0xC2 && i + 1 < text.size() && (unsigned char)(text[i + 1]) < 0xA0; // U+0080 .. U+009F
        if (c < 0x20 || c == 0x7F || second_set)
            return fmt::format("one with {}; write it in one line of plain letters",
                               c == '\n' || c == '\r' ? std::string("a line break")
                                                      : fmt::format("the control character U+{:04X}",
                                                                    second_set ? unsigned((unsigned char)(text[i + 1])) : unsigned(c)));
    }
    return {};
}

std::string not_simulated(std::string_view written)
{
    // Beginnings of words by which people look for an effect, and what there is.
    static constexpr std::pair<std::string_view, std::string_view> ideas[] = {
        {"rain", "Rain and infiltration are not simulated; a water table that stays is (effects.pore_pressure)."},
        {"infiltration", "Rain and infiltration are not simulated; a water table that stays is (effects.pore_pressure)."},
        {"precipitation", "Rain and infiltration are not simulated; a water table that stays is (effects.pore_pressure)."},
        {"seepage", "Flow of water through soil is not simulated; still water below a table is (effects.pore_pressure)."},
        {"water", "Flowing water is not simulated; still water below a table is (effects.pore_pressure)."},
        {"groundwater", "Flowing water is not simulated; still water below a table is (effects.pore_pressure)."},
        {"fluid", "Flowing water is not simulated; still water below a table is (effects.pore_pressure)."},
        {"flood", "Flowing water is not simulated; still water below a table is (effects.pore_pressure)."},
        {"permeability", "Pore pressure does not flow or build up here: soil is drained, or undrained by its strength (cohesion alone)."},
        {"consolidation", "Pore pressure does not flow or build up here: soil is drained, or undrained by its strength (cohesion alone)."},
        {"liquefaction", "Pore pressure does not flow or build up here; strength that falls with slip is there (soil.NAME.softening)."},
        {"suction", "Suction of unsaturated soil is not simulated; give the cohesion that it lends the soil."},
        {"saturation", "Suction of unsaturated soil is not simulated; give the cohesion that it lends the soil."},
        {"vegetation", "Plants are not simulated; give the cohesion that roots lend the soil as that of a soil of its own."},
        {"root", "Plants are not simulated; give the cohesion that roots lend the soil as that of a soil of its own."},
        {"tree", "Plants are not simulated; give the cohesion that roots lend the soil as that of a soil of its own."},
        {"earthquake",
         "Shaking ground is an event: [[event]] shaking = \"record.csv\"; a steady sideways part of gravity is pseudo-static."},
        {"seismic", "Shaking ground is an event: [[event]] shaking = \"record.csv\"; a steady sideways part of gravity is pseudo-static."},
        {"quake", "Shaking ground is an event: [[event]] shaking = \"record.csv\"; a steady sideways part of gravity is pseudo-static."},
        {"temperature", "Heat is not simulated: soil keeps its properties."},
        {"thermal", "Heat is not simulated: soil keeps its properties."},
        {"heat", "Heat is not simulated: soil keeps its properties."},
        {"frost", "Frost and snow are not simulated: soil keeps its properties."},
        {"snow", "Frost and snow are not simulated: soil keeps its properties."},
        {"ice", "Frost and snow are not simulated: soil keeps its properties."},
        {"wind", "Air is not simulated: soil moves through nothing."},
        {"air", "Air is not simulated: soil moves through nothing."},
        {"structure", "Structures that bend or break are not simulated; a wall that stands still is ([[wall]])."},
        {"building", "Structures that bend or break are not simulated; a wall that stands still is ([[wall]])."},
        {"anchor", "Anchors and reinforcement are not simulated; give the cohesion that they lend the soil."},
        {"geotextile", "Anchors and reinforcement are not simulated; give the cohesion that they lend the soil."},
        {"reinforcement", "Anchors and reinforcement are not simulated; give the cohesion that they lend the soil."},
        {"creep", "Slow creep is not simulated: strength depends on slip (softening) and on the rate of shear (rate_friction) only."},
        {"gpu", "kuzure runs on processors only; threads and ranks are given on the command line."},
    };
    const std::string word = lower(written.substr(0, 100));
    for (const auto& [begin, sentence] : ideas) {
        // "rain", "rainfall", "rain_rate"; of three letters the whole word or the first of several.
        if (!word.starts_with(begin)) continue;
        if (begin.size() > 3 || word.size() == begin.size() || word[begin.size()] == '_') return std::string(sentence);
    }
    return {};
}

} // namespace kuzure::io
