#include "io/snapshot.hpp"
#include "io/hdf5.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::io {
namespace {

constexpr std::uint8_t vtk_vertex = 1;

struct Column {
    const char* name;
    const char* unit;
    int components;
};
constexpr Column columns[] = {
    {"velocity", "m/s", 3}, {"stress", "Pa", 6}, {"density", "kg/m^3", 1}, {"plastic_strain", "1", 1}, {"displacement", "m", 3}};

bool wanted(const std::vector<std::string>& fields, std::string_view name)
{
    return fields.empty() || std::find(fields.begin(), fields.end(), name) != fields.end();
}

/// Rows of this rank as they go to the file: its soil, then its walls.
class Rows {
public:
    Rows(const Particles& p, const WallPoints& w, int dimensions)
        : p_(p), n_(std::size_t(p.size())), walls_(w.size()), flat_(dimensions == 2)
    {
    }
    /// Soil values by particle (a Vec3, Sym3 or number), wall values by wall point.
    template <class Soil, class Wall> std::span<const double> of(int components, Soil soil, Wall wall)
    {
        buffer_.resize((n_ + walls_) * std::size_t(components));
        double* to = buffer_.data();
        for (std::size_t i = 0; i < n_; ++i) to = put(to, soil(Index(i)));
        for (std::size_t i = 0; i < walls_; ++i) to = put(to, wall(i));
        return buffer_;
    }

private:
    double* put(double* to, double a) const { return *to = a, to + 1; }
    double* put(double* to, const Vector& a) const
    {
        to[0] = a.x, to[1] = flat_ ? 0 : a.y, to[2] = a.z;
        return to + 3;
    }
    double* put(double* to, const Stress& a) const
    {
        to[0] = a.xx, to[1] = a.yy, to[2] = a.zz, to[3] = a.xy, to[4] = a.yz, to[5] = a.xz;
        return to + 6;
    }
    const Particles& p_;
    std::size_t n_, walls_;
    bool flat_;
    std::vector<double> buffer_;
};

} // namespace

std::optional<int> snapshot_number(const Path& file)
{
    const std::string name = file.filename().string();
    if (name.size() != 16 || !name.starts_with("state_") || !name.ends_with(".hdf") || name.find_first_not_of("0123456789", 6) != 12)
        return {};
    return std::stoi(name.substr(6, 6));
}

std::vector<std::string> snapshot_fields()
{
    std::vector<std::string> names;
    for (const auto& c : columns) names.emplace_back(c.name);
    return names;
}

std::uint64_t snapshot_bytes(std::int64_t points, const std::vector<std::string>& fields)
{
    // Points, connectivity, offsets, types; id, kind, soil.
    std::uint64_t row = 24 + 8 + 8 + 1 + 8 + 4 + 4;
    for (const auto& c : columns)
        if (wanted(fields, c.name)) row += 8 * std::uint64_t(c.components);
    return row * std::uint64_t(points) + 32768;
}

void write_snapshot(const Team& team, const Place& file, const Particles& p, const WallPoints& walls, const SnapshotLabel& label)
{
    for (const auto& f : label.fields) {
        const auto known = snapshot_fields();
        if (std::find(known.begin(), known.end(), f) == known.end())
            throw BadInput(fmt::format("[output] fields: '{}' is not a field: expected some of {}", f, fmt::join(known, ", ")));
    }
    ensure(walls.id.size() == walls.size() && walls.density.size() == walls.size(), "wall points without id or density");

    const auto n = std::size_t(p.size()), mine = n + walls.size();
    const std::int64_t first = team.sum_below(std::int64_t(mine)), total = team.sum(std::int64_t(mine));
    const bool last = team.rank() == team.size() - 1;
    const bool root = team.rank() == 0;

    H5Writer out(team, file, snapshot_bytes(total, label.fields));
    const std::string top = "/VTKHDF";
    out.group(top);
    const std::int64_t version[] = {1, 0};
    out.attribute(top, "Version", std::span<const std::int64_t>(version));
    out.attribute(top, "Type", "UnstructuredGrid");
    out.attribute(top, "time", label.time);
    out.attribute(top, "step", label.step);
    out.attribute(top, "time_unit", "s");
    out.attribute(top, "title", label.title);
    if (label.failed) out.attribute(top, "failed_particle", *label.failed);

    const auto table = [&](const std::string& name, auto rows, int components, const char* unit) {
        out.table(name, rows, components);
        out.attribute(name, "unit", unit);
    };
    // One partition: its sizes, the vertices as cells.
    for (const char* count : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"})
        table(top + "/" + count, std::span<const std::int64_t>(&total, root ? 1 : 0), 1, "1");
    std::vector<std::int64_t> whole(mine + 1);
    for (std::size_t i = 0; i <= mine; ++i) whole[i] = first + std::int64_t(i);
    const std::span<const std::int64_t> numbers(whole);
    table(top + "/Connectivity", numbers.first(mine), 1, "1");
    table(top + "/Offsets", numbers.first(mine + (last ? 1 : 0)), 1, "1");
    const std::vector<std::uint8_t> types(mine, vtk_vertex);
    table(top + "/Types", std::span<const std::uint8_t>(types), 1, "1");

    Rows rows(p, walls, label.dimensions);
    const auto none = [](std::size_t) { return 0.0; };
    const auto no_vector = [](std::size_t) { return Vector{}; };
    const auto x = p[field::position];
    table(top + "/Points",
          rows.of(
              3, [&](Index i) { return x[i]; }, [&](std::size_t i) { return walls.position[i]; }),
          3, "m");

    const std::string data = top + "/PointData";
    out.group(data);
    const auto id = p[field::id];
    for (std::size_t i = 0; i < mine; ++i) whole[i] = i < n ? id[Index(i)] : walls.id[i - n];
    table(data + "/id", numbers.first(mine), 1, "1");
    std::vector<std::int32_t> small(mine);
    for (std::size_t i = 0; i < mine; ++i) small[i] = i < n ? 0 : 1;
    table(data + "/kind", std::span<const std::int32_t>(small), 1, "1");
    // Without the column there is one soil only.
    const bool soils = p.has(field::soil);
    for (std::size_t i = 0; i < mine; ++i) small[i] = i >= n ? -1 : soils ? p[field::soil][Index(i)] : 0;
    table(data + "/soil", std::span<const std::int32_t>(small), 1, "1");

    const auto values = [&](std::string_view name) -> std::span<const double> {
        if (name == "velocity")
            return rows.of(
                3, [v = p[field::velocity]](Index i) { return v[i]; }, no_vector);
        if (name == "stress")
            return rows.of(
                6, [s = p[field::stress]](Index i) { return s[i]; }, [](std::size_t) { return Stress{}; });
        if (name == "density")
            return rows.of(
                1, [r = p[field::density]](Index i) { return r[i]; }, [&](std::size_t i) { return walls.density[i]; });
        if (name == "plastic_strain") {
            if (!p.has(field::plastic_strain))
                return rows.of(
                    1, [](Index) { return 0.0; }, none);
            return rows.of(
                1, [e = p[field::plastic_strain]](Index i) { return e[i]; }, none);
        }
        return rows.of(
            3, [x, o = p[field::origin]](Index i) { return x[i] - o[i]; }, no_vector);
    };
    for (const auto& c : columns)
        if (wanted(label.fields, c.name)) table(data + "/" + c.name, values(c.name), c.components, c.unit);

    const std::string more = top + "/FieldData";
    out.group(more);
    table(more + "/TimeValue", std::span<const double>(&label.time, root ? 1 : 0), 1, "s");
    table(more + "/step", std::span<const std::int64_t>(&label.step, root ? 1 : 0), 1, "1");
    out.publish();
}

SoilSnapshot read_snapshot(const Place& file)
{
    const H5Reader in(file);
    const std::string top = "/VTKHDF", data = top + "/PointData/";
    const auto rows = in.table(top + "/Points").rows;
    SoilSnapshot s;
    s.time = in.real(top, "time");
    std::vector<std::int32_t> kind;
    in.rows(data + "kind", 0, rows, 1, kind);
    std::vector<double> values;
    const auto soil = [&](const std::string& name, int components, auto put) {
        in.rows(name, 0, rows, components, values);
        for (std::size_t i = 0; i < rows; ++i)
            if (kind[i] == 0) put(values.data() + i * std::size_t(components));
    };
    const auto vector = [](std::vector<Vector>& to) { return [&to](const double* v) { to.push_back({v[0], v[1], v[2]}); }; };
    soil(top + "/Points", 3, vector(s.position));
    if (in.has(data + "displacement")) soil(data + "displacement", 3, vector(s.displacement));
    if (in.has(data + "stress"))
        soil(data + "stress", 6, [&](const double* v) { s.stress.push_back({v[0], v[1], v[2], v[3], v[4], v[5]}); });
    return s;
}

Path last_snapshot(const Path& results)
{
    Path last;
    std::error_code error;
    for (const auto& e : std::filesystem::directory_iterator(results / "snapshots", error))
        if (snapshot_number(e.path()) && last.filename() < e.path().filename()) last = e.path();
    if (last.empty()) throw IoFailed(fmt::format("{}: no snapshot is there: run the scene again", (results / "snapshots").string()));
    return last;
}

Path snapshot_next_to(const Path& results, double time)
{
    Path best = last_snapshot(results);
    if (std::isinf(time)) return best;
    double distance = HUGE_VAL;
    for (const auto& e : std::filesystem::directory_iterator(results / "snapshots")) {
        if (!snapshot_number(e.path())) continue;
        const double d = std::fabs(H5Reader(e.path()).real("/VTKHDF", "time") - time);
        // Two as near as each other: the earlier, in whatever order the directory names them.
        if (d < distance || (d == distance && e.path().filename() < best.filename())) best = e.path(), distance = d;
    }
    return best;
}

// ---- series ---------------------------------------------------------------------------------------------------------
Snapshots::Snapshots(const Team& team, const Place& directory, std::optional<double> restart_time) : team_(team), directory_(directory)
{
    if (!restart_time) return;
    std::string found; // "name time" lines, from rank 0 to all
    on_root(team, [&] {
        std::vector<std::string> names = names_in(directory);
        std::erase_if(names, [](const std::string& name) { return !snapshot_number(name); });
        // The files are the truth: they know their times also where the series was lost.
        nlohmann::json kept = nlohmann::json::array();
        for (const auto& name : names) {
            double time;
            try {
                time = H5Reader(directory / name).real("/VTKHDF", "time");
            } catch (const IoFailed&) {
                continue; // a damaged picture of the past is no reason not to go on; its number is used again
            }
            if (time > *restart_time) remove_file(directory / name);
            else kept.push_back({{"name", name}, {"time", time}});
        }
        found = kept.dump();
    });
    for (const auto& e : nlohmann::json::parse(team.broadcast(found)))
        entries_.push_back({e["name"].get<std::string>(), e["time"].get<double>()});
    if (!entries_.empty()) next_ = std::stoi(entries_.back().name.substr(6, 6)) + 1;
    write_series();
}

Place Snapshots::write(const Particles& p, const WallPoints& walls, const SnapshotLabel& label)
{
    const Entry entry{fmt::format("state_{:06}.hdf", next_), label.time};
    if (!walls_there_ && !label.walls_change) {
        const Place alone = directory_ / "walls.hdf";
        const bool there = team_.any(team_.rank() == 0 && exists(alone));
        Particles no_soil;
        no_soil.require(field::density);
        if (!there && team_.sum(std::int64_t(walls.size())) > 0)
            write_snapshot(team_, alone, no_soil, walls, {label.time, label.step, label.dimensions, label.title, {"density"}, {}});
        walls_there_ = true;
    }
    write_snapshot(team_, directory_ / entry.name, p, next_ == 0 || label.walls_change ? walls : WallPoints{}, label);
    entries_.push_back(entry);
    ++next_;
    write_series();
    return directory_ / entry.name;
}

std::optional<double> Snapshots::last_time() const
{
    if (entries_.empty()) return {};
    return entries_.back().time;
}

void Snapshots::write_series() const
{
    on_root(team_, [&] {
        nlohmann::ordered_json files = nlohmann::ordered_json::array();
        for (const auto& e : entries_) files.push_back({{"name", e.name}, {"time", e.time}});
        const nlohmann::ordered_json series = {{"file-series-version", "1.0"}, {"files", files}};
        write_atomically(directory_ / "state.hdf.series", series.dump(1) + "\n");
    });
}

} // namespace kuzure::io
