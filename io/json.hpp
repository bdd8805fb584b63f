#pragma once
// JSON from files that somebody else may have written. The library copies and writes values by calling itself, so that brackets a hundred
// thousand deep in one another end the program wherever such a value goes.
#include <nlohmann/json.hpp>
#include <string_view>

namespace kuzure::io {

/// Deeper than any file of kuzure or of a GIS has its brackets.
inline constexpr int deepest_json = 64;

/// How many bytes of the text come before its first bracket that is too deep; all of them as a rule.
inline std::size_t sound_depth(std::string_view text)
{
    int depth = 0;
    bool inside = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (inside) {
            if (c == '\\') ++i;
            else inside = c != '"';
        } else if (c == '"') inside = true;
        else if ((c == '[' || c == '{') && ++depth > deepest_json) return i;
        else if (c == ']' || c == '}') --depth;
    }
    return text.size();
}

/// As Json::parse(), but text of too deep brackets is none: its message gives the place as the end of what was read. Throws
/// Json::exception, or gives a discarded value.
template <class Json = nlohmann::json> Json parse_json(std::string_view text, bool throws = true)
{
    return Json::parse(text.substr(0, sound_depth(text)), nullptr, throws);
}

} // namespace kuzure::io
