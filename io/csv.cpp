#include "io/csv.hpp"
#include "io/trim.hpp"
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

constexpr std::uint64_t largest_file = 256 << 20; // bytes

/// The cells of one line; nothing where a quote is not closed.
std::optional<std::vector<std::string>> cells_of(std::string_view line, char separator)
{
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t k = 0; k < line.size(); ++k) {
        const char c = line[k];
        if (quoted && c == '"' && k + 1 < line.size() && line[k + 1] == '"') cells.back() += '"', ++k;
        else if (c == '"') quoted = !quoted;
        else if (c == separator && !quoted) cells.emplace_back();
        else cells.back() += c;
    }
    if (quoted) return {};
    for (auto& c : cells) c = trimmed(c, in_a_line);
    return cells;
}

} // namespace

std::optional<double> csv_number(const std::string& cell)
{
    double x = 0;
    const auto* end = cell.data() + cell.size();
    const auto read = std::from_chars(cell.data() + (cell.starts_with('+') ? 1 : 0), end, x);
    if (cell.empty() || read.ec != std::errc{} || read.ptr != end || !std::isfinite(x)) return {};
    return x;
}

void Csv::refuse(int line, const std::string& what) const { throw BadInput(fmt::format("{}:{}: {}", file, line, what)); }

std::optional<std::size_t> Csv::column(const std::string& name) const
{
    const auto found = std::ranges::find(header, name);
    if (found == header.end()) return {};
    return std::size_t(found - header.begin());
}

Csv read_csv(const Path& path, const std::string& expected)
{
    std::string text;
    try {
        text = read_text(path, largest_file);
    } catch (const IoFailed& e) {
        throw BadInput(fmt::format("{}. Expected {}", e.what(), expected));
    }
    Csv csv;
    csv.file = path.string();
    int& line = csv.lines;
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
    char separator = ',';
    for (std::size_t begin = 0; begin < text.size();) {
        const auto end = std::min(text.find('\n', begin), text.size());
        std::string_view row = std::string_view(text).substr(begin, end - begin);
        begin = end + 1, ++line;
        if (row.ends_with('\r')) row.remove_suffix(1);
        if (row.find_first_not_of(" \t,;") == row.npos || row.starts_with('#')) continue;
        if (csv.header.empty() && row.find(',') == row.npos && row.find(';') != row.npos) separator = ';';
        auto cells = cells_of(row, separator);
        if (!cells) csv.refuse(line, "expected a quoted cell to end in its line, found none that does; close the quote");
        if (csv.header.empty()) {
            for (auto& h : *cells)
                for (auto& c : h) c = char(std::tolower((unsigned char)(c)));
            csv.header = std::move(*cells), csv.header_line = line;
            continue;
        }
        if (cells->size() != csv.header.size())
            csv.refuse(line, fmt::format("expected {} cells as in the first line, found {}; a name with a \"{}\" in it is put in quotes",
                                         csv.header.size(), cells->size(), separator));
        csv.rows.push_back({line, std::move(*cells)});
    }
    return csv;
}

} // namespace kuzure::io
