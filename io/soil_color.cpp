#include "io/soil_color.hpp"
#include "io/keys.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

const std::string top = "/VTKHDF", data = "/VTKHDF/PointData/";
constexpr std::uint64_t block = 1 << 18; // rows read at a time

constexpr const char* of_vectors[] = {"_x", "_y", "_z"};
constexpr const char* of_tensors[] = {"_xx", "_yy", "_zz", "_xy", "_yz", "_xz"}; // VTK's order

bool has_vector(const H5Reader& in, const std::string& name) { return in.has(data + name) && in.table(data + name).components == 3; }
bool has_tensor(const H5Reader& in, const std::string& name) { return in.has(data + name) && in.table(data + name).components == 6; }

template <class T>
void read_as(const H5Reader& in, const std::string& table, std::uint64_t first, std::uint64_t count, int components,
             std::vector<double>& into)
{
    std::vector<T> raw;
    in.rows(table, first, count, components, raw);
    into.assign(raw.begin(), raw.end());
}
/// Any table of numbers, as doubles.
void read_numbers(const H5Reader& in, const std::string& table, std::uint64_t first, std::uint64_t count, std::vector<double>& into)
{
    const auto t = in.table(table);
    switch (t.number) {
    case Number::Float64:
        return in.rows(table, first, count, t.components, into);
    case Number::Int64:
        return read_as<std::int64_t>(in, table, first, count, t.components, into);
    case Number::Int32:
        return read_as<std::int32_t>(in, table, first, count, t.components, into);
    case Number::UInt8:
        return read_as<std::uint8_t>(in, table, first, count, t.components, into);
    }
}

/// f(row in the block, kind, position) of every point, a block at a time; before(first, count) is called ahead of each.
template <class Before, class F> void for_each_point(const H5Reader& in, Before before, F f)
{
    const std::uint64_t rows = in.table(top + "/Points").rows;
    std::vector<double> points;
    std::vector<std::int32_t> kind;
    for (std::uint64_t first = 0; first < rows; first += block) {
        const std::uint64_t count = std::min(block, rows - first);
        in.rows(top + "/Points", first, count, 3, points);
        in.rows(data + "kind", first, count, 1, kind);
        before(first, count);
        for (std::size_t i = 0; i < count; ++i) f(i, kind[i], Vector{points[3 * i], points[3 * i + 1], points[3 * i + 2]});
    }
}

} // namespace

const char* name_of(scene::Color c)
{
    switch (c) {
    case scene::Color::Displacement:
        return "displacement";
    case scene::Color::Speed:
        return "speed";
    case scene::Color::PlasticStrain:
        return "plastic_strain";
    case scene::Color::Pressure:
        return "pressure";
    }
    throw Broken("a picture colour without a name");
}

const char* field_behind(scene::Color c)
{
    return c == scene::Color::Speed ? "velocity" : c == scene::Color::Pressure ? "stress" : name_of(c);
}

std::vector<std::string> soil_colors(const H5Reader& in)
{
    std::vector<std::string> all;
    if (has_vector(in, "velocity")) all.push_back("speed");
    if (has_tensor(in, "stress")) all.push_back("pressure");
    for (const auto& table : in.names(top + "/PointData")) {
        if (table == "kind") continue;
        all.push_back(table);
        const int n = in.table(data + table).components;
        if (n == 3)
            for (const char* c : of_vectors) all.push_back(table + c);
        if (n == 6)
            for (const char* c : of_tensors) all.push_back(table + c);
    }
    return all;
}

SoilColor::SoilColor(const H5Reader& in, const std::string& name) : name_(name), table_(name)
{
    const auto known = soil_colors(in);
    if (std::find(known.begin(), known.end(), name) == known.end()) {
        const bool absent = name == "displacement" || name == "speed" || name == "plastic_strain" || name == "pressure";
        std::string list;
        for (const auto& k : known)
            if (k == "speed" || k == "pressure" || in.has(data + k)) list += (list.empty() ? "" : ", ") + k;
        if (absent)
            throw BadInput(
                fmt::format("color {}: {} does not hold what it needs. It can be coloured by {}. Remedy: run with [output] fields "
                            "that include it",
                            name, in.file().string(), list));
        throw BadInput(fmt::format("color: expected a field of {}, found \"{}\"{} It can be coloured by {}, and their "
                                   "components such as velocity_x",
                                   in.file().string(), name, did_you_mean(name, known), list));
    }
    quantity_.title = name;
    std::replace(quantity_.title.begin(), quantity_.title.end(), '_', ' ');
    if (name == "speed") table_ = "velocity", of_ = Of::Length;
    else if (name == "pressure") table_ = "stress", of_ = Of::Pressure;
    else if (!in.has(data + name)) {
        const auto split = name.rfind('_');
        table_ = name.substr(0, split);
        const std::string end = name.substr(split);
        for (int c = 0; c < 3; ++c)
            if (end == of_vectors[c]) component_ = c;
        for (int c = 0; c < 6; ++c)
            if (end == of_tensors[c]) component_ = c;
        of_ = Of::Component;
        quantity_.map = Quantity::Map::Diverging;
    } else if (const int n = in.table(data + name).components; n == 3) {
        of_ = Of::Length;
    } else if (n == 6) {
        of_ = Of::Deviator;
        quantity_.title = name == "stress" ? "von Mises stress" : "equivalent " + quantity_.title;
    } else if (n != 1) {
        throw BadInput(fmt::format("color {}: a field of {} columns has no one value to show", name, n));
    }
    if (name == "displacement") quantity_.map = Quantity::Map::Blues;
    quantity_.unit = in.has_attribute(data + table_, "unit") ? in.text(data + table_, "unit") : "1";
}

SoilColor::Soil SoilColor::read(const H5Reader& in) const
{
    Soil s;
    s.time = in.real(top, "time");
    const std::string table = data + table_;
    const auto n = std::size_t(in.table(table).components);
    if (in.table(table).rows != in.table(top + "/Points").rows) in.refuse(fmt::format("table {} and the points differ in number", table));
    std::vector<double> raw;
    std::vector<std::int64_t> id;
    const bool failed = s.broken = in.has_attribute(top, "failed_particle");
    const std::int64_t blamed = failed ? in.integer(top, "failed_particle") : -1;
    for_each_point(
        in,
        [&](std::uint64_t first, std::uint64_t count) {
            read_numbers(in, table, first, count, raw);
            if (failed) in.rows(data + "id", first, count, 1, id);
        },
        [&](std::size_t i, std::int32_t kind, const Vector& at) {
            if (kind != 0) return;
            if (failed && id[i] == blamed) s.failed = at;
            const double* v = &raw[i * n];
            double value = *v;
            switch (of_) {
            case Of::Number:
                break;
            case Of::Length:
                value = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
                break;
            case Of::Component:
                value = v[component_];
                break;
            case Of::Pressure:
                value = -(v[0] + v[1] + v[2]) / 3;
                break;
            case Of::Deviator: {
                const double a = v[0] - v[1], b = v[1] - v[2], c = v[2] - v[0];
                value = std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (v[3] * v[3] + v[4] * v[4] + v[5] * v[5]));
                break;
            }
            }
            s.positions.push_back(at);
            s.values.push_back(value);
        });
    return s;
}

std::vector<Vector> read_walls(const H5Reader& in)
{
    std::vector<Vector> all;
    for_each_point(
        in, [](std::uint64_t, std::uint64_t) {},
        [&](std::size_t, std::int32_t kind, const Vector& at) {
            if (kind == 1) all.push_back(at);
        });
    return all;
}

} // namespace kuzure::io
