#include "io/quote.hpp"
#include "solver/core/ensure.hpp"
#include <fmt/format.h>

namespace kuzure::io {
namespace {

/// Bytes of the control character that begins here: 0 if none does. U+0080 .. U+009F and the line separators count as such.
std::size_t control(std::string_view s, std::size_t i)
{
    const auto byte = [&](std::size_t k) { return k < s.size() ? (unsigned char)(s[k]) : 0u; };
    const unsigned c = byte(i);
    if (c < 0x20 || c == 0x7F) return 1;
    if (c == 0xC2 && byte(i + 1) >= 0x80 && byte(i + 1) < 0xA0) return 2;
    if (c == 0xE2 && byte(i + 1) == 0x80 && (byte(i + 2) == 0xA8 || byte(i + 2) == 0xA9)) return 3;
    return 0;
}

std::string in_single_quotes(std::string_view s, std::string_view quote)
{
    std::string out = "'";
    for (const char c : s) {
        if (c == '\'') out += quote;
        else out += c;
    }
    return out + "'";
}

} // namespace

std::size_t malformed(std::string_view s)
{
    for (std::size_t i = 0; i < s.size();) {
        const auto byte = [&](std::size_t k) { return k < s.size() ? (unsigned char)(s[k]) : 0u; };
        const unsigned b = byte(i);
        const int more = b < 0x80 ? 0 : b >= 0xC2 && b < 0xE0 ? 1 : b >= 0xE0 && b < 0xF0 ? 2 : b >= 0xF0 && b < 0xF5 ? 3 : -1;
        if (more < 0) return i;
        for (int k = 1; k <= more; ++k)
            if ((byte(i + std::size_t(k)) & 0xC0) != 0x80) return i;
        const unsigned second = byte(i + 1);
        if ((b == 0xE0 && second < 0xA0) || (b == 0xED && second > 0x9F) || (b == 0xF0 && second < 0x90) || (b == 0xF4 && second > 0x8F))
            return i;
        i += std::size_t(more) + 1;
    }
    return s.npos;
}

std::string shell_word(std::string_view s)
{
    // A zero byte ends every argument of a program: nothing can be meant by one.
    if (s.find('\0') != s.npos) throw BadInput("expected text without zero bytes for a shell, found one; remove it");
    std::string out = in_single_quotes(s, "'\\''"), line;
    for (const char c : out)
        if ((unsigned char)(c) < 0x20 || c == 0x7F) line += fmt::format("'$'\\x{:02x}''", (unsigned char)(c));
        else line += c;
    return line;
}

std::string gnuplot_string(std::string_view s) { return in_single_quotes(comment_text(s), "''"); }

std::string comment_text(std::string_view s)
{
    std::string out;
    for (std::size_t i = 0; i < s.size();) {
        const std::size_t n = control(s, i);
        if (n > 0) out += ' ';
        else out += s[i];
        i += n > 0 ? n : 1;
    }
    return out;
}

std::string batch_value(std::string_view s, std::string_view what)
{
    const char* plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.,:=+@%/";
    if (s.empty() || s.front() == '-' || s.find_first_not_of(plain) != s.npos)
        throw BadInput(
            fmt::format("{} {}: expected a name of letters, digits and -_.,:=+@%/ for the batch system, found \"{}\"; give it as "
                        "the machine knows it",
                        what, printable(s), printable(s)));
    return std::string(s);
}

std::string printable(std::string_view s)
{
    std::string out;
    std::size_t bad = malformed(s);
    for (std::size_t i = 0; i < s.size();) {
        if (i > bad) bad = malformed(s.substr(i)), bad = bad == s.npos ? bad : bad + i;
        const std::size_t n = i == bad ? 1 : s[i] == '\n' || s[i] == '\t' ? 0 : control(s, i);
        if (n == 0) out += s[i++];
        else
            for (std::size_t k = 0; k < n; ++k, ++i) out += fmt::format("\\x{:02x}", (unsigned char)(s[i]));
    }
    return out;
}

} // namespace kuzure::io
