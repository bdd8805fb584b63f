#pragma once
// Snapshots for ParaView: VTKHDF 1.0, an unstructured grid of vertices, one file a time, and the series that
// gives the files their times.
#include "io/file.hpp"
#include "io/wall_points.hpp"
#include "solver/core/particles.hpp"
#include <optional>
#include <vector>

namespace kuzure::io {

/// Names of the fields a snapshot can hold besides id, kind and soil, in the file's order.
std::vector<std::string> snapshot_fields();

struct SnapshotLabel {
    double time = 0; // s
    std::int64_t step = 0;
    int dimensions = 3;
    std::string title;
    std::vector<std::string> fields;         // of snapshot_fields(); empty: all
    std::optional<std::int64_t> failed = {}; // id of the particle at which the numbers failed
    bool walls_change = false;               // in the course of the run: every snapshot has the walls of its time
};

/// Size of a snapshot file of that many points (soil and wall).
std::uint64_t snapshot_bytes(std::int64_t points, const std::vector<std::string>& fields);

/// Collective; every rank brings its soil and its walls, or none. Needs the velocity, stress, density and
/// origin columns where those fields are asked for; a plastic strain that the store does not hold is written as zero.
/// Throws BadInput for an unknown field, IoFailed.
void write_snapshot(const Team&, const Place& file, const Particles&, const WallPoints&, const SnapshotLabel&);

/// The soil of a snapshot, in the file's order.
struct SoilSnapshot {
    double time = 0; // s
    std::vector<std::int64_t> id;
    std::vector<Vector> position, displacement; // m; displacement only where the file has it
    std::vector<Stress> stress;                 // Pa; only where the file has it
};
/// Reads a snapshot that kuzure wrote, on this rank alone. Throws IoFailed.
SoilSnapshot read_snapshot(const Place& file);
/// The newest snapshot of a result directory. Throws IoFailed where there is none.
Path last_snapshot(const Path& results);
/// The snapshot of a result directory whose time (s) is next to this one; infinite: the newest. Throws IoFailed where there is none or one
/// is damaged.
Path snapshot_next_to(const Path& results, double time);

/// True of state_000000.hdf and its like; the number in it.
std::optional<int> snapshot_number(const Path& file);

/// The snapshots of one run: state_000000.hdf, state_000001.hdf ... and state.hdf.series. Walls that stay as they are, are in the first
/// of them and, alone, in walls.hdf; walls that events change are in all of them.
class Snapshots {
public:
    /// Collective; the directory exists. With a restart time the snapshots up to it stay and later ones are
    /// removed; without, counting starts at 0.
    Snapshots(const Team&, const Place& directory, std::optional<double> restart_time = {});

    /// Collective. Writes the next snapshot and the series; gives the file's path. Throws IoFailed.
    Place write(const Particles&, const WallPoints&, const SnapshotLabel&);
    /// Time of the last snapshot in the directory, if there is one: a restart must not write it again.
    std::optional<double> last_time() const;
    int count() const { return next_; }

private:
    struct Entry {
        std::string name;
        double time;
    };
    void write_series() const;

    const Team& team_;
    Place directory_;
    std::vector<Entry> entries_;
    int next_ = 0;
    bool walls_there_ = false;
};

} // namespace kuzure::io
