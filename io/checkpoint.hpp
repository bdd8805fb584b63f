#pragma once
// Checkpoints: everything needed to go on bit for bit, on any number of ranks. Each is checked end to end
// when it is read (a checksum over the rows of each table, the same for any number of ranks), and the one
// before the last is kept.
#include "io/file.hpp"
#include "solver/core/particles.hpp"
#include <optional>

namespace kuzure::io {

class H5Reader;

/// A checkpoint, open: it stays the one that was looked at, also where another gets its name.
struct Checkpoint {
    Place file;
    std::int64_t particles = 0; // over all ranks
    std::string scene_hash;     // of the scene that made it: the caller refuses another
    std::string header;         // the caller's own text (time, step, counters ...)
    std::shared_ptr<const H5Reader> opened;
};

/// Rows beside the particles', on any ranks in any order.
struct CheckpointTable {
    std::string name, unit;
    int components = 1;
    std::vector<double> rows; // this rank's, one after the other
};

/// A checkpoint that could not be written; its words name the one that is still good.
struct CheckpointFailed : IoFailed {
    using IoFailed::IoFailed;
};

/// Size of a checkpoint of that many particles, without tables.
std::uint64_t checkpoint_bytes(std::int64_t particles, std::size_t bytes_per_particle);

/// Collective. Writes every present field and these tables (all ranks name the same) to directory/checkpoint.h5; the checkpoint before it
/// becomes checkpoint.prev.h5. Until the new one is whole and on the disk, the old ones stay as they are. Throws CheckpointFailed. Gives
/// the file's path.
Place write_checkpoint(const Team&, const Place& directory, const Particles&, const std::string& scene_hash, const std::string& header,
                       std::span<const CheckpointTable> tables = {});

/// Collective. Replaces the particles: each rank gets a contiguous share of the rows as written, with the
/// fields of the file. Refuses by IoFailed, on all ranks, what is damaged, truncated, of another format, or
/// lacks a field that the particles already carry; they are then left empty.
Checkpoint read_checkpoint(const Team&, const Place& file, Particles&);
/// The same of the very file that was verified.
void read_checkpoint(const Team&, const Checkpoint&, Particles&);

/// Collective. A contiguous share of a table of a checkpoint that was verified, or nothing where it has none of this name. Throws IoFailed.
std::optional<std::vector<double>> read_checkpoint_table(const Team&, const Checkpoint&, const std::string& name, int components);

/// Collective. Reads the whole checkpoint without keeping its particles. Throws IoFailed as read_checkpoint does.
Checkpoint verify_checkpoint(const Team&, const Place& file);

/// Collective. Makes sure that the next write_checkpoint into its directory keeps this good checkpoint: a whole one that had not got its
/// name gets it, and a newer one, damaged or not wanted, becomes checkpoint.aside.h5. Gives where it is then. Throws IoFailed.
Place keep_generation(const Team&, const Checkpoint&);

/// Collective. The newest checkpoint of the directory that passes verify_checkpoint, or nothing if there is
/// none at all. `say` gets, on rank 0, a sentence for each one passed over. Throws IoFailed if there are some
/// and all are damaged.
std::optional<Checkpoint> newest_good(const Team&, const Place& directory, const std::function<void(const std::string&)>& say);

} // namespace kuzure::io
