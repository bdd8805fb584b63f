#pragma once
// Where a run leaves its files: made once, never on top of another run's results.
#include "io/file.hpp"

namespace kuzure::io {

/// What to do with a directory that already holds something.
enum class Existing { Refuse, GoOn, MoveAside };

class ResultDirectory {
public:
    /// Collective. Makes the directory and its parents. Throws BadInput where Existing forbids it or where
    /// the name belongs to a file (nothing is changed then), IoFailed where the system does. An empty
    /// directory is welcome.
    ResultDirectory(const Team&, const Path&, Existing);

    const Path& path() const { return path_; }
    /// Where the old results went, if they were moved aside; else empty.
    const Path& moved_to() const { return moved_to_; }
    Path operator/(std::string_view name) const { return path_ / name; }

    Path scene() const { return path_ / "scene.toml"; }
    Path snapshots() const { return path_ / "snapshots"; }
    Path history() const { return path_ / "history.csv"; }
    Path progress() const { return path_ / "progress.csv"; }
    Path summary() const { return path_ / "summary.json"; }
    Path stop() const { return path_ / "STOP"; }

private:
    Path path_, moved_to_;
};

} // namespace kuzure::io
