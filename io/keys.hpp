#pragma once
// Keys of a TOML file as rows of a table: what a value must be, its unit, range and default, and what it is for. Scene files
// and machine profiles each have such a table; io/document.hpp checks files by it.
#include <limits>
#include <string>
#include <string_view>
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
    Choice,        // one of the choices
    Choices,       // an array of them, each at most once
    ChoiceOrTable, // one of the choices, or a table of keys
    Table,         // a table of keys
    Tables,        // [[...]], any number of tables
    Named,         // [....name], any number of tables with names
    Texts          // an array of strings
};

/// Interval of allowed numbers; open ends are excluded.
struct Range {
    double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
    bool low_open = false, high_open = false;
    bool holds(double) const;
    /// "0 < x <= 0.5", or empty if every number is allowed.
    std::string text() const;
};

enum class Need { Required, Optional, Default };
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

/// The keys of one kind of file.
class KeyTable {
public:
    /// `file`: "a scene", as messages call it. All keys, parents before children.
    KeyTable(std::string file, std::vector<Key> keys) : file_(std::move(file)), keys_(std::move(keys)) {}
    const std::string& file() const { return file_; }
    auto begin() const { return keys_.begin(); }
    auto end() const { return keys_.end(); }

    /// The row of a path such as "soil.sand.density" or "body.0.box", or nullptr.
    const Key* find(std::string_view path) const;
    /// The pattern of a path: "soil.sand.density" gives "soil.*.density".
    std::string pattern_of(std::string_view path) const;
    /// Names of the keys directly inside a table of this pattern; the top level is "".
    std::vector<const Key*> inside(std::string_view pattern) const;

private:
    const Key* row(std::string_view pattern) const;
    std::string file_;
    std::vector<Key> keys_;
};

/// Edits (insert, delete, replace, exchange two neighbours) that lead from one word to the other.
int edit_distance(std::string_view, std::string_view);
/// The word closest to the one written; empty if there are none.
std::string nearest(std::string_view written, const std::vector<std::string>& known);

} // namespace kuzure::io
