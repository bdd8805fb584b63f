#include "io/time_record.hpp"
#include "io/csv.hpp"
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::io {
namespace {
// As event.gravity and coordinates have it, and times as other keys have them.
constexpr double largest = 1e6, latest = 1e9; // m/s^2 or m; s
} // namespace

std::vector<std::array<double, 4>> read_time_record(const Path& path, const RecordOf& record)
{
    const Csv csv = read_csv(
        path, fmt::format("a .csv of {} with the columns time, x, y, z; the path counts from the scene file's directory", record.what));
    const auto columns = [&] { return csv.header.empty() ? std::string("nothing") : fmt::format("{}", fmt::join(csv.header, ", ")); };
    const char* names[] = {"time", "x", "y", "z"};
    std::array<std::optional<std::size_t>, 4> at;
    for (std::size_t c = 0; c < 4; ++c) at[c] = csv.column(names[c]);
    if (!at[0] || !(at[1] || at[2] || at[3]))
        csv.refuse(csv.header_line, fmt::format("expected a first line with the columns time and x, y or z, found {}; write, for example, "
                                                "time,x,z",
                                                columns()));
    std::vector<std::array<double, 4>> rows;
    for (const auto& [line, cells] : csv.rows) {
        auto& row = rows.emplace_back();
        for (std::size_t c = 0; c < 4; ++c) {
            if (!at[c]) continue;
            const auto x = csv_number(cells[*at[c]]);
            if (!x)
                csv.refuse(line, fmt::format("expected a number in {} for {}, found \"{}\"; write it with a point, without a unit",
                                             c == 0 ? "s" : record.unit, names[c], cells[*at[c]]));
            const double most = c == 0 ? latest : largest;
            if (std::fabs(*x) > most)
                csv.refuse(line, fmt::format("expected at most {:g} {} for {}, found {:g}; are these the units?", most,
                                             c == 0 ? "s" : record.unit, names[c], *x));
            row[c] = *x;
        }
        if (rows.size() == 1 ? row[0] < 0 : !(row[0] > rows[rows.size() - 2][0]))
            csv.refuse(line, fmt::format("expected times that rise from 0 s on, found {} s; they count from the event on", row[0]));
    }
    if (rows.size() < 2) csv.refuse(csv.lines, fmt::format("expected at least two rows, found {}", rows.size()));
    return rows;
}

} // namespace kuzure::io
