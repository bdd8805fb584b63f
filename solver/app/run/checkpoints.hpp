#pragma once
// A run's checkpoints: what they hold beside the particles, which run may go on from one, which is the newest good one.
#include "io/checkpoint.hpp"
#include "io/result_directory.hpp"
#include "solver/app/run/maps.hpp"
#include "solver/run/simulation.hpp"
#include <string>

namespace kuzure {

/// Collective: the newest good checkpoint of a result directory, or the checkpoint that a path names; nothing where a directory has none.
/// Throws IoFailed where it is damaged or not there.
std::optional<io::Checkpoint> checkpoint_at(const Comm&, const io::Path&);

/// Version, compiler and instruction set of the program that wrote a checkpoint; empty if it was this one.
std::string other_writer(const io::Checkpoint&);
/// Collective. Throws BadInput, with the keys that differ, where a checkpoint belongs to another scene.
void require_same_scene(const Comm&, const io::Checkpoint&, const Scene&);
/// Collective. A checkpoint of elsewhere goes on where its own scene left results, or where nothing is yet: never among those of another.
/// Throws BadInput.
void require_room_for(const Comm&, const io::Checkpoint& from, const io::Path& where, const std::string& scene_hash);
/// The greatest speed (m/s) of the run up to a checkpoint; 0 where an older program left it out.
double peak_speed_of(const io::Checkpoint&);

class Checkpoints {
public:
    Checkpoints(const Comm& comm, const io::ResultDirectory& directory, std::string scene_hash)
        : comm_(comm), directory_(directory), hash_(std::move(scene_hash))
    {
    }
    /// The one that the run goes on from.
    void went_on_from(io::Place file) { last_ = std::move(file); }
    /// Collective: the newest one. `peak_speed`: the greatest speed (m/s) of all legs; `maps`: those of the run, or nullptr. Throws
    /// CheckpointFailed, IoFailed.
    void write(const Simulation&, double peak_speed, const Maps* maps);
    const io::Place& last() const { return last_; }
    /// Half a sentence that begins with a full stop, to be put behind what failed.
    std::string last_in_words() const;

private:
    const Comm& comm_;
    const io::ResultDirectory& directory_;
    std::string hash_;
    io::Place last_;
};

} // namespace kuzure
