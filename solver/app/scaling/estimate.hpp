#pragma once
// What a run will need, known before anything is allocated or written, and whether this machine has it.
#include "decomposition/comm.hpp"
#include "io/file.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"
#include <string>

namespace kuzure {

struct Estimate {
    std::int64_t soil, walls, steps;
    std::int64_t shown; // wall particles of which a rank has its share for snapshots
    double dt;          // s
    double memory;      // bytes of all ranks together, but for what every process takes to begin with
    double snapshot;    // bytes of one: soil
    double wall_files;  // bytes of the walls in the first snapshot and in walls.hdf
    double checkpoint;  // bytes of one
    double snapshots;   // how many
    double history;     // bytes
    double history_rows;
    double pairs; // directed pairs of all steps, each once a step
    scene::Scheme scheme;
    double record;  // bytes of a ghost particle, sent every step
    double support; // radius in which particles see each other, spacings
    bool mixed;     // precision of the pair sums
    double columns; // of the box around all soil, two spacings wide: one rank may hold them all
    double longest; // side of that box, spacings

    /// Bytes on the disk in the end and at the worst moment before: two checkpoints and the one being written.
    double disk() const { return snapshots * snapshot + wall_files + 3 * checkpoint + history; }
};
/// Neighbours inside the support of one soil particle, walls included: mean over the scene as filled.
double neighbours_at_start(const Scene&, const scene::Filling&);
Estimate estimate(const Scene&, const scene::Filling&, const PairModel&);

/// What a step costs in those of the one-pass scheme over the same soil: a staggered step goes over its pairs twice.
double step_price(scene::Scheme);
/// The work of all steps in directed pairs of the one-pass scheme in double precision: counted, not timed, so the same at every call.
double work(const Estimate&);

/// Columns that a run begins with at most; where soil spreads over more, one rank alone could not hold it, so none begins.
inline constexpr double most_columns = 5e7;
/// Spacings over which soil may lie: three of them are a block at least, and blocks have numbers up to 2^20.
inline constexpr double longest_box = 1e6;

/// Bytes that every process takes before its first particle: MPI, HDF5, the program.
inline constexpr double bytes_per_process = 60e6;

/// Bytes that the processes of this machine may have together: what is installed, or less where a container or a job is limited to less.
double machine_memory();

/// "1.2 GB"
std::string bytes_text(double bytes);

/// Why the run cannot fit into the memory of its machines or on the disk of `directory`, with the numbers and the remedy, or
/// empty. `done` is the share of the run that lies behind a restart. Collective; the same on all ranks.
std::string does_not_fit(const Comm&, const Estimate&, const io::Path& directory, double done = 0);

} // namespace kuzure
