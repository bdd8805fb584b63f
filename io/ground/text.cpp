#include "io/ground/text.hpp"
#include <iconv.h>

namespace kuzure::io::ground {

bool is_utf8(const std::string& text)
{
    const auto byte = [&](std::size_t k) { return k < text.size() ? (unsigned char)(text[k]) : 0u; };
    for (std::size_t k = 0; k < text.size();) {
        const unsigned c = byte(k);
        const std::size_t n = c < 0x80 ? 1 : c >= 0xC2 && c < 0xE0 ? 2 : c >= 0xE0 && c < 0xF0 ? 3 : c >= 0xF0 && c < 0xF5 ? 4 : 0;
        if (n == 0) return false;
        for (std::size_t i = 1; i < n; ++i)
            if ((byte(k + i) & 0xC0) != 0x80) return false;
        if ((c == 0xE0 && byte(k + 1) < 0xA0) || (c == 0xED && byte(k + 1) > 0x9F) || (c == 0xF0 && byte(k + 1) < 0x90) ||
            (c == 0xF4 && byte(k + 1) > 0x8F))
            return false;
        k += n;
    }
    return true;
}

std::string as_utf8(const std::string& text, const std::string& code_page)
{
    if (is_utf8(text)) return text;
    for (const std::string& page : {code_page, std::string("CP932"), std::string("ISO-8859-1")}) {
        if (page.empty()) continue;
        const iconv_t way = ::iconv_open("UTF-8", page.c_str());
        if (way == iconv_t(-1)) continue;
        std::string in = text, out(4 * text.size(), '\0');
        char *from = in.data(), *to = out.data();
        std::size_t from_left = in.size(), to_left = out.size();
        const bool done = ::iconv(way, &from, &from_left, &to, &to_left) != std::size_t(-1);
        ::iconv_close(way);
        if (!done) continue;
        out.resize(out.size() - to_left);
        return out;
    }
    return "";
}

} // namespace kuzure::io::ground
