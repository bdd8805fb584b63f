#pragma once
// Keys of a TOML file as rows of a table: what a value must be, its unit, range and default, and what it is for. Scene files,
// machine profiles and sweeps each have such a table; io/document.hpp checks files by it.
#include <limits>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace kuzure::io {

enum class Kind {
    Text,
    Number,
    Integer,
    Flag,          // true or false
    Vector,        // [x, y, z]
    Pair,          // [from, to]
    Points,        // [[x, z], ...]
    Window,        // [x from, y from, x to, y to]
    Numbers,       // an array of numbers
    Choice,        // one of the choices
    Choices,       // an array of them, each at most once
    ChoiceOrTable, // one of the choices, or a table of keys
    Table,         // a table of keys
    Tables,        // [[...]], any number of tables
    Named,         // [....name], any number of tables with names
    Texts,         // an array of strings
    TextOrTexts,   // a string, or an array of them
    TextOrTrue,    // a string, or true
    Settings       // a table, or one of several, in which any key may stand beside those that have rows
};

/// Interval of allowed numbers; open ends are excluded.
struct Range {
    double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
    bool low_open = false, high_open = false;
    bool holds(double) const;
    /// "0 < x <= 0.5", or empty if every number is allowed.
    std::string text() const;
};
constexpr Range above(double low) { return {.low = low, .low_open = true}; }
constexpr Range from(double low) { return {.low = low}; }
constexpr Range between(double low, double high) { return {.low = low, .high = high}; }
constexpr Range from_below(double low, double high) { return {.low = low, .high = high, .high_open = true}; }
constexpr Range above_to(double low, double high) { return {.low = low, .high = high, .low_open = true}; }

enum class Need {
    Required,
    Optional,
    Default,
    OneOf // exactly one of the keys of its table that need this
};
/// On restart the physics of a run may not change; what else a scene says may.
enum class Role { Physics, Bookkeeping };

struct Key {
    std::string path; // "soil.*.density": * stands for a name or a number counted from 0
    Kind kind;
    std::string unit;
    Need need;
    std::string fallback; // the default as TOML, where need is Default
    Range range;
    std::vector<std::string> choices;
    std::string example; // a value as TOML
    std::string doc;
    Role role = Role::Physics;

    /// "number", "one of ...": what stands on the right of the equals sign.
    std::string expected() const;
    std::string_view leaf() const { return std::string_view(path).substr(path.rfind('.') + 1); }
};

/// A value of an enum and the word that stands for it in a file.
template <class Enum> struct Word {
    const char* word;
    Enum value;
};
template <class Enum> using Words = std::vector<Word<Enum>>;
/// The words alone: a Key's choices.
template <class Enum> std::vector<std::string> choices_of(const Words<Enum>& words)
{
    std::vector<std::string> choices;
    for (const auto& w : words) choices.emplace_back(w.word);
    return choices;
}

/// The keys of one kind of file.
class KeyTable {
public:
    /// `file`: "a scene", as messages call it. All keys, parents before children.
    KeyTable(std::string file, std::vector<Key> keys);
    KeyTable(const KeyTable&) = delete;
    KeyTable& operator=(const KeyTable&) = delete;
    const std::string& file() const { return file_; }
    auto begin() const { return keys_.begin(); }
    auto end() const { return keys_.end(); }

    /// The row of a path such as "soil.sand.density" or "body.0.box", or nullptr.
    const Key* find(std::string_view path) const;
    /// The pattern of a path: "soil.sand.density" gives "soil.*.density".
    std::string pattern_of(std::string_view path) const;
    /// The keys directly inside a table of this pattern; the top level is "".
    const std::vector<const Key*>& inside(std::string_view pattern) const;

private:
    const Key* row(std::string_view pattern) const;
    std::string file_;
    std::vector<Key> keys_;
    std::unordered_map<std::string_view, const Key*> rows_;                // by pattern
    std::unordered_map<std::string_view, std::vector<const Key*>> inside_; // by pattern of the parent
};

/// Edits (insert, delete, replace, exchange two neighbours) that lead from one word to the other.
int edit_distance(std::string_view, std::string_view);
/// The word that was probably meant by the one written; empty where none is like it.
std::string nearest(std::string_view written, const std::vector<std::string>& known);
/// The end of a message that names a wrong word: `; did you mean "clay"?`, or "." where no known word is like it.
std::string did_you_mean(std::string_view written, const std::vector<std::string>& known);
/// Why a text cannot stand in a line of a message, a figure or a script: control characters, or more than 4096 bytes; empty where it can.
std::string not_one_line(std::string_view);
/// One sentence for the name of something that soil does elsewhere but not in kuzure ("rain", "vegetation"), with what comes nearest to it;
/// empty for other words.
std::string not_simulated(std::string_view written);

} // namespace kuzure::io
