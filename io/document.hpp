#pragma once
// A TOML file checked by a table of keys: the line of every key for messages, --set, unknown and misspelt keys, defaults.
// For files of io/ alone: it brings toml++.
#include "io/keys.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>
// Compiled into us, toml++ 3.3 asserts what a file like "[[[" breaks, although the code behind the assertion reports it.
#define TOML_ASSERT(expression) static_assert(true)
#include <toml++/toml.h>

namespace kuzure::io {

/// The file's bytes; `what` is "a scene". Throws BadInput if it cannot be read or is larger than 1 MiB.
std::string read_document_text(const std::filesystem::path&, std::string_view what);

/// Whether a node is an integer or a floating-point number.
bool is_number(const toml::node*);
/// Its value; only for a number.
double number_of(const toml::node&);

/// A file as a tree, with what is wrong in it.
class Document {
public:
    /// `name` is what messages call the file; every set is "key.path=value". Throws BadInput for what is no TOML.
    Document(std::string_view text, std::string name, const KeyTable&, std::span<const std::string> sets = {});

    toml::table root;

    /// Checks everything against the keys and fills in defaults. Throws BadInput with up to 20 lines.
    void check();

    /// "scene.toml:12", or "--set time.step=1".
    std::string location(const std::string& path) const { return location_and_line(path).first; }
    /// Remembers a problem at this key.
    void complain(const std::string& path, const std::string& text);
    /// Throws BadInput with the problems so far, in the order of the file.
    void throw_if_any();

    /// The node of a path, or nullptr.
    const toml::node* find(const std::string& path) const;
    /// The value of a key that is there because check() saw to it.
    const toml::node& at(const std::string& path) const;
    double number(const std::string& path) const { return number_of(at(path)); }
    int integer(const std::string& path) const { return int(at(path).as_integer()->get()); }
    const std::string& text(const std::string& path) const { return at(path).as_string()->get(); }
    std::vector<std::string> texts(const std::string& path) const;
    /// The value whose word stands at a Choice that has these words.
    template <class Enum> Enum choice(const std::string& path, const Words<Enum>& words) const
    {
        const auto found = std::find_if(words.begin(), words.end(), [&](const auto& w) { return w.word == text(path); });
        ensure(found != words.end(), "a choice is read that was not checked");
        return found->value;
    }
    /// Names of the tables inside, in the order of the file; none where the key is not there.
    std::vector<std::string> names(const std::string& path) const;

private:
    struct Problem {
        std::size_t line; // 0: from a --set
        std::string text; // with line and key
    };
    bool has_enough() const;
    std::size_t line_of(const std::string& path) const;
    std::pair<std::string, std::size_t> location_and_line(const std::string& path) const;
    void override_with(const std::string& set);
    toml::table& table_for(const std::string& path, const std::vector<std::string_view>& parts, const std::string& set);
    void complain_unknown(const std::string& path, std::string_view leaf, std::string_view pattern);
    void check_table(toml::table&, const std::string& path);
    void check_alternatives(const toml::table&, const std::string& path, const std::string& pattern);

    std::string name_;
    const KeyTable& keys_;
    bool complain_misspelt_name(const toml::node&, const std::string& path, const std::string& named);

    std::vector<std::pair<std::string, std::string>> sets_; // path and words of every --set
    std::vector<std::pair<std::string, std::string>> made_; // the tables that only a --set speaks of, and its words
    std::vector<Problem> problems_;
};

} // namespace kuzure::io
