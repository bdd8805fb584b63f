#include "io/snapshot.hpp"
#include "io/hdf5.hpp"
#include "solver/core/bulk_density.hpp"
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

namespace {

/// One snapshot as it is written: all ranks' rows, table by table.
class Writer {
public:
    Writer(const Team& team, const Place& file, const Particles& p, const WallPoints& walls, const SnapshotLabel& label)
        : p_(p), walls_(walls), label_(label), n_(std::size_t(p.size())), mine_(n_ + walls.size()),
          first_(team.sum_below(std::int64_t(mine_))), total_(team.sum(std::int64_t(mine_))), last_(team.rank() == team.size() - 1),
          root_(team.rank() == 0), out_(team, file, snapshot_bytes(total_, label.fields)), rows_(p, walls, label.dimensions)
    {
    }
    void write()
    {
        head(), cells(), marks();
        for (const auto& c : columns)
            if (wanted(label_.fields, c.name)) table(data + "/" + c.name, values(c.name), c.components, c.unit);
        const std::string more = top + "/FieldData";
        out_.group(more);
        table(more + "/TimeValue", std::span<const double>(&label_.time, root_ ? 1 : 0), 1, "s");
        table(more + "/step", std::span<const std::int64_t>(&label_.step, root_ ? 1 : 0), 1, "1");
        out_.publish();
    }

private:
    void table(const std::string& name, auto rows, int components, const char* unit)
    {
        out_.table(name, rows, components);
        out_.attribute(name, "unit", unit);
    }

    void head()
    {
        out_.group(top);
        const std::int64_t version[] = {1, 0};
        out_.attribute(top, "Version", std::span<const std::int64_t>(version));
        out_.attribute(top, "Type", "UnstructuredGrid");
        out_.attribute(top, "time", label_.time);
        out_.attribute(top, "step", label_.step);
        out_.attribute(top, "time_unit", "s");
        out_.attribute(top, "title", label_.title);
        if (label_.failed) out_.attribute(top, "failed_particle", *label_.failed);
        if (label_.walls_change) out_.attribute(top, "walls_change", std::int64_t(1));
    }

    /// One partition: its sizes, the vertices as cells.
    void cells()
    {
        for (const char* count : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"})
            table(top + "/" + count, std::span<const std::int64_t>(&total_, root_ ? 1 : 0), 1, "1");
        std::vector<std::int64_t> whole(mine_ + 1);
        for (std::size_t i = 0; i <= mine_; ++i) whole[i] = first_ + std::int64_t(i);
        const std::span<const std::int64_t> numbers(whole);
        table(top + "/Connectivity", numbers.first(mine_), 1, "1");
        table(top + "/Offsets", numbers.first(mine_ + (last_ ? 1 : 0)), 1, "1");
        const std::vector<std::uint8_t> types(mine_, vtk_vertex);
        table(top + "/Types", std::span<const std::uint8_t>(types), 1, "1");
        table(top + "/Points",
              rows_.of(
                  3, [x = p_[field::position]](Index i) { return x[i]; }, [&](std::size_t i) { return walls_.position[i]; }),
              3, "m");
    }

    /// Whole numbers of the points.
    void marks()
    {
        out_.group(data);
        const auto id = p_[field::id];
        std::vector<std::int64_t> whole(mine_);
        for (std::size_t i = 0; i < mine_; ++i) whole[i] = i < n_ ? id[Index(i)] : walls_.id[i - n_];
        table(data + "/id", std::span<const std::int64_t>(whole), 1, "1");
        std::vector<std::int32_t> small(mine_);
        for (std::size_t i = 0; i < mine_; ++i) small[i] = i < n_ ? 0 : 1;
        table(data + "/kind", std::span<const std::int32_t>(small), 1, "1");
        // Without the column there is one soil only.
        const bool soils = p_.has(field::soil);
        for (std::size_t i = 0; i < mine_; ++i) small[i] = i >= n_ ? -1 : soils ? p_[field::soil][Index(i)] : 0;
        table(data + "/soil", std::span<const std::int32_t>(small), 1, "1");
    }

    std::span<const double> values(std::string_view name)
    {
        const auto none = [](std::size_t) { return 0.0; };
        const auto no_vector = [](std::size_t) { return Vector{}; };
        if (name == "velocity")
            return rows_.of(
                3, [v = p_[field::velocity]](Index i) { return v[i]; }, no_vector);
        if (name == "stress")
            return rows_.of(
                6, [s = p_[field::stress]](Index i) { return s[i]; }, [](std::size_t) { return Stress{}; });
        if (name == "density")
            return rows_.of(
                1, [this](Index i) { return bulk_density(p_, i); }, [&](std::size_t i) { return walls_.density[i]; });
        if (name == "plastic_strain") {
            if (!p_.has(field::plastic_strain))
                return rows_.of(
                    1, [](Index) { return 0.0; }, none);
            return rows_.of(
                1, [e = p_[field::plastic_strain]](Index i) { return e[i]; }, none);
        }
        return rows_.of(
            3, [x = p_[field::position], o = p_[field::origin]](Index i) { return x[i] - o[i]; }, no_vector);
    }

    static inline const std::string top = "/VTKHDF", data = top + "/PointData";
    const Particles& p_;
    const WallPoints& walls_;
    const SnapshotLabel& label_;
    std::size_t n_, mine_; // soil, and all points, of this rank
    std::int64_t first_, total_;
    bool last_, root_;
    H5Writer out_;
    Rows rows_;
};

} // namespace

void write_snapshot(const Team& team, const Place& file, const Particles& p, const WallPoints& walls, const SnapshotLabel& label)
{
    for (const auto& f : label.fields) {
        const auto known = snapshot_fields();
        if (std::find(known.begin(), known.end(), f) == known.end())
            throw BadInput(fmt::format("[output] fields: '{}' is not a field: expected some of {}", f, fmt::join(known, ", ")));
    }
    ensure(walls.id.size() == walls.size() && walls.density.size() == walls.size(), "wall points without id or density");
    Writer(team, file, p, walls, label).write();
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
    in.rows(data + "id", 0, rows, 1, s.id);
    std::size_t n = 0;
    for (std::size_t i = 0; i < rows; ++i)
        if (kind[i] == 0) s.id[n++] = s.id[i];
    s.id.resize(n);
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
