#pragma once
// Where a run leaves its files: made once, never on top of another run's results, one writer at a time, and held: what is written goes
// into the directory that was opened, also where it is moved or another put there.
#include "io/file.hpp"
#include "io/owner.hpp"

namespace kuzure::io {

/// What to do with a directory that already holds something.
enum class Existing { Refuse, GoOn, MoveAside };

class ResultDirectory {
public:
    /// Collective. Takes hold of what is there of this name, and owns it until the end; makes nothing. Throws BadInput where Existing
    /// forbids it, where another run lives there, or where the name belongs to a file; IoFailed where the system fails. An empty
    /// directory is welcome. `say` gets, on rank 0, a sentence where an owner must be waited for.
    ResultDirectory(const Team&, const Path&, Existing, std::function<void(const std::string&)> say = {});

    /// Collective. Makes the directory and its parents where there is none, or moves what it holds aside; opens it on all ranks. To be
    /// called once, before anything is written. MoveAside does so only with what is a result directory. Throws as the constructor.
    void make(Existing);

    const Path& path() const { return path_; }
    /// Where the old results went, if they were moved aside; else empty.
    const Path& moved_to() const { return moved_to_; }
    /// The directory: held if it is there.
    const Place& place() const { return place_; }
    Place operator/(std::string_view name) const { return place_ / name; }

    Place scene() const { return place_ / "scene.toml"; }
    const Place& snapshots() const { return snapshots_; }
    Place history() const { return place_ / "history.csv"; }
    Place progress() const { return place_ / "progress.csv"; }
    Place summary() const { return place_ / "summary.json"; }
    Place stop() const { return place_ / "STOP"; }

    /// Rank 0: false once another run took the directory over, or it is no more; always true elsewhere.
    bool owned() const;
    /// Collective. Throws IoFailed where it is not.
    void require_owned() const;
    /// Whether the path still leads to the directory that is held: for tools that want a name.
    bool in_place() const;

private:
    void open_held();

    const Team& team_;
    Path path_, moved_to_;
    std::function<void(const std::string&)> say_;
    Place place_, snapshots_;
    std::unique_ptr<Ownership> ownership_; // rank 0
};

} // namespace kuzure::io
