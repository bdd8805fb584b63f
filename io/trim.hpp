#pragma once
#include <string>
#include <string_view>

namespace kuzure::io {

inline constexpr const char* in_a_line = " \t"; // blanks

/// What stands between blanks.
inline std::string trimmed(std::string_view s, const char* blanks = " \t\r\n")
{
    const auto first = s.find_first_not_of(blanks);
    return first == s.npos ? std::string() : std::string(s.substr(first, s.find_last_not_of(blanks) - first + 1));
}

} // namespace kuzure::io
