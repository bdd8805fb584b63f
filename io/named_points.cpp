#include "io/named_points.hpp"
#include "io/csv.hpp"
#include "io/keys.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <array>
#include <cctype>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <set>

namespace kuzure::io {
namespace {

constexpr std::size_t most_points = 1'000'000;
} // namespace

NamedPoints read_named_points(const Path& path)
{
    std::string ending = path.extension().string();
    for (auto& c : ending) c = char(std::tolower((unsigned char)(c)));
    if (ending != ".csv" && ending != ".txt") return read_points(path);
    const Csv csv = read_csv(path, "a .csv of named points with the columns name, x, y; the path counts from the scene file's directory");
    NamedPoints all;
    auto& points = all.points;
    std::set<std::string> names;
    if (csv.header.empty()) csv.refuse(csv.lines, "expected a first line with the columns name, x, y, found nothing");
    std::array<std::size_t, 3> at{};
    std::size_t k = 0;
    for (const char* wanted : {"name", "x", "y"}) {
        const auto found = csv.column(wanted);
        if (!found)
            csv.refuse(csv.header_line,
                       fmt::format("expected a first line with the columns name, x, y, found {}; write, for example, name,x,y",
                                   fmt::join(csv.header, ", ")));
        at[k++] = *found;
    }
    for (const auto& [line, cells] : csv.rows) {
        const auto refuse = [&, line = line](const std::string& what) { csv.refuse(line, what); };
        NamedPoint p{cells[at[0]], 0, 0};
        if (p.name.empty()) refuse("expected a name, found none; every point needs one");
        if (const auto wrong = not_one_line(p.name); !wrong.empty()) refuse("expected a name in one line, found " + wrong);
        for (const int c : {1, 2}) {
            const std::string& cell = cells[at[std::size_t(c)]];
            const auto x = csv_number(cell);
            if (!x)
                refuse(fmt::format("expected a number in m for {}, found \"{}\"; write it with a point, without a unit", c == 1 ? "x" : "y",
                                   cell));
            (c == 1 ? p.x : p.y) = *x;
        }
        if (!names.insert(p.name).second) refuse(fmt::format("expected each name once, found \"{}\" again; rename one", p.name));
        if (points.size() == most_points) refuse(fmt::format("expected at most {} points; leave the others out", most_points));
        points.push_back(std::move(p));
    }
    if (points.empty()) csv.refuse(csv.lines, "expected at least one point, found none; leave maps.points out, or add a line");
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
