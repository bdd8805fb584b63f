#include "io/result_directory.hpp"
#include <fmt/format.h>

namespace kuzure::io {
namespace fs = std::filesystem;

namespace {

/// DIR.old-1, or the first number after it that is free.
Path free_old_name(const Path& path)
{
    for (int k = 1;; ++k)
        if (const Path old = fmt::format("{}.old-{}", path.string(), k); !fs::exists(fs::symlink_status(old))) return old;
}

Path without_trailing_slash(const Path& path)
{
    Path p = path.lexically_normal();
    if (!p.has_filename() && p.has_relative_path()) p = p.parent_path();
    return p;
}

} // namespace

ResultDirectory::ResultDirectory(const Team& team, const Path& path, Existing existing) : path_(without_trailing_slash(path))
{
    std::string moved;
    on_root(team, [&] {
        const std::string name = path_.string();
        if (name.empty()) throw BadInput("the result directory has no name: give one with -o DIR");
        if (fs::exists(path_) && !fs::is_directory(path_))
            throw BadInput(fmt::format("{}: a file of this name exists: choose another result directory with -o DIR", name));
        try {
            if (fs::is_directory(path_) && !fs::is_empty(path_)) {
                if (existing == Existing::Refuse)
                    throw BadInput(fmt::format("{}: the result directory exists and is not empty. Go on with --restart, move "
                                               "it aside with --force, or choose another with -o DIR",
                                               name));
                if (existing == Existing::MoveAside) {
                    if (fs::equivalent(path_, fs::current_path()))
                        throw BadInput(fmt::format("{}: the directory you stand in cannot be moved aside: choose another "
                                                   "result directory with -o DIR",
                                                   name));
                    const Path old = free_old_name(path_);
                    move_file(path_, old);
                    moved = old.string();
                }
            }
            fs::create_directories(snapshots());
        } catch (const fs::filesystem_error& e) {
            throw IoFailed(fmt::format("{}: making the result directory failed: {}", name, cause(path_, e.code().value())));
        }
    });
    moved_to_ = team.broadcast(moved);
}

} // namespace kuzure::io
