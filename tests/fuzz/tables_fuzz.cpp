// Any bytes are a table or a refusal in words. The first byte of the input chooses whose:
//   0  a record of ground motion; 1  points with names; 2  history.csv, as the report reads it.
#include "io/named_points.hpp"
#include "io/time_record.hpp"
#include "solver/app/report/record.hpp"
#include "solver/core/ensure.hpp"
#include "tests/fuzz/fuzz.hpp"
#include <cmath>
#include <set>

using namespace kuzure;
using namespace kuzure::fuzz;

namespace {

void inspect_motion(const std::vector<std::array<double, 4>>& rows)
{
    if (rows.size() < 2) found("a record without two rows");
    for (std::size_t k = 0; k < rows.size(); ++k) {
        if (!(k == 0 ? rows[k][0] >= 0 : rows[k][0] > rows[k - 1][0])) found("times that do not rise");
        for (const double x : rows[k])
            if (!(std::fabs(x) <= 1e9)) found("a number without bounds");
    }
}

void inspect_points(const io::NamedPoints& all)
{
    std::set<std::string> names;
    for (const auto& p : all.points) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y)) found("a point that is nowhere");
        if (p.name.empty() || !names.insert(p.name).second) found("a point without a name of its own");
        if (io::csv_cell(p.name).find('\n') != std::string::npos) found("a name of two lines");
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    static const Scratch scratch;
    static const io::Path file = scratch.path / "table.csv";
    if (size == 0 || size > (1 << 20)) return 0;
    const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        switch (data[0] % 3) {
        case 0:
            write(file, rest), inspect_motion(io::read_time_record(file, {"ground motion", "m/s^2"}));
            break;
        case 1:
            write(file, rest), inspect_points(io::read_named_points(file));
            break;
        default: {
            const auto table = report::read_table(std::string(rest));
            for (const auto& [name, column] : table)
                if (column.size() != table.begin()->second.size()) found("columns of several lengths");
        }
        }
    } catch (const BadInput& e) {
        judge_refusal(e.what());
    }
    return 0;
}
