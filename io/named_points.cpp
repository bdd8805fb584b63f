#include "io/named_points.hpp"
#include "io/keys.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <optional>
#include <set>

namespace kuzure::io {
namespace {

constexpr std::size_t most_points = 1'000'000;
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
    for (auto& c : cells) {
        const auto first = c.find_first_not_of(" \t"), last = c.find_last_not_of(" \t");
        c = first == c.npos ? std::string() : c.substr(first, last - first + 1);
    }
    return cells;
}

std::optional<double> number(const std::string& cell)
{
    double x = 0;
    const auto* end = cell.data() + cell.size();
    const auto read = std::from_chars(cell.data() + (cell.starts_with('+') ? 1 : 0), end, x);
    if (cell.empty() || read.ec != std::errc{} || read.ptr != end || !std::isfinite(x)) return {};
    return x;
}

} // namespace

NamedPoints read_named_points(const Path& path)
{
    std::string ending = path.extension().string();
    for (auto& c : ending) c = char(std::tolower((unsigned char)(c)));
    if (ending != ".csv" && ending != ".txt") return read_points(path);
    std::string text;
    try {
        text = read_text(path, largest_file);
    } catch (const IoFailed& e) {
        throw BadInput(fmt::format("{}. Expected a .csv of named points with the columns name, x, y; the path counts from the scene file's "
                                   "directory",
                                   e.what()));
    }
    int line = 0;
    const auto refuse = [&](const std::string& what) { throw BadInput(fmt::format("{}:{}: {}", path.string(), line, what)); };
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
    NamedPoints all;
    auto& points = all.points;
    std::set<std::string> names;
    std::vector<std::string> header;
    std::array<std::size_t, 3> at{};
    char separator = ',';
    for (std::size_t begin = 0; begin < text.size();) {
        const auto end = std::min(text.find('\n', begin), text.size());
        std::string_view row = std::string_view(text).substr(begin, end - begin);
        begin = end + 1, ++line;
        if (row.ends_with('\r')) row.remove_suffix(1);
        if (row.find_first_not_of(" \t,;") == row.npos || row.starts_with('#')) continue;
        if (header.empty() && row.find(',') == row.npos && row.find(';') != row.npos) separator = ';';
        const auto read = cells_of(row, separator);
        if (!read) refuse("expected a quoted cell to end in its line, found none that does; close the quote");
        const auto& cells = *read;
        if (header.empty()) {
            header = cells;
            for (auto& h : header)
                for (auto& c : h) c = char(std::tolower((unsigned char)(c)));
            std::size_t k = 0;
            for (const char* wanted : {"name", "x", "y"}) {
                const auto found = std::ranges::find(header, wanted);
                if (found == header.end())
                    refuse(fmt::format("expected a first line with the columns name, x, y, found {}; write, for example, name,x,y",
                                       fmt::join(header, ", ")));
                at[k++] = std::size_t(found - header.begin());
            }
            continue;
        }
        if (cells.size() != header.size())
            refuse(fmt::format("expected {} cells as in the first line, found {}; a name with a \"{}\" in it is put in quotes",
                               header.size(), cells.size(), separator));
        NamedPoint p{cells[at[0]], 0, 0};
        if (p.name.empty()) refuse("expected a name, found none; every point needs one");
        if (const auto wrong = not_one_line(p.name); !wrong.empty()) refuse("expected a name in one line, found " + wrong);
        for (const int k : {1, 2}) {
            const std::string& cell = cells[at[std::size_t(k)]];
            const auto x = number(cell);
            if (!x)
                refuse(fmt::format("expected a number in m for {}, found \"{}\"; write it with a point, without a unit", k == 1 ? "x" : "y",
                                   cell));
            (k == 1 ? p.x : p.y) = *x;
        }
        if (!names.insert(p.name).second) refuse(fmt::format("expected each name once, found \"{}\" again; rename one", p.name));
        if (points.size() == most_points) refuse(fmt::format("expected at most {} points; leave the others out", most_points));
        points.push_back(std::move(p));
    }
    if (header.empty()) refuse("expected a first line with the columns name, x, y, found nothing");
    if (points.empty()) refuse("expected at least one point, found none; leave maps.points out, or add a line");
    return all;
}

std::string csv_cell(const std::string& s)
{
    if (s.find_first_of(",;\"#") == s.npos) return s;
    std::string out = "\"";
    for (const char c : s) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + '"';
}

} // namespace kuzure::io
