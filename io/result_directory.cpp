#include "io/result_directory.hpp"
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <thread>

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

/// The names in a directory, the lock's own left out.
std::vector<std::string> holdings(const Place& directory)
{
    auto names = names_in(directory);
    std::erase_if(names, Ownership::is_lock);
    return names;
}

/// Whether a run of kuzure made it: its scene.toml says so; or it got no further than its beginnings.
bool is_result_directory(const Place& directory)
{
    const auto names = holdings(directory);
    const auto beginning = [](const std::string& name) { return name == "snapshots" || name == "twins" || name == "scene.toml.tmp"; };
    if (std::all_of(names.begin(), names.end(), beginning)) return true;
    if (!exists(directory / "snapshots")) return false;
    for (const char* name : {"checkpoint.h5", "checkpoint.h5.tmp", "checkpoint.prev.h5"})
        if (exists(directory / name)) return true;
    try {
        return exists(directory / "scene.toml") && read_text(directory / "scene.toml", 1 << 26).starts_with("# kuzure ");
    } catch (const IoFailed&) {
        return false;
    }
}

/// A wrong -o may name a home directory. Throws BadInput.
void require_result_directory(const Place& directory)
{
    if (!is_result_directory(directory))
        throw BadInput(fmt::format("{}: this is no result directory of kuzure (expected a scene.toml that kuzure wrote, beside snapshots), "
                                   "so kuzure neither goes on in it nor moves it aside. Remedy: choose another with -o DIR, or move it "
                                   "yourself",
                                   directory.string()));
}

} // namespace

ResultDirectory::ResultDirectory(const Team& team, const Path& path, Existing existing, std::function<void(const std::string&)> say)
    : team_(team), path_(without_trailing_slash(path)), say_(say ? std::move(say) : [](const std::string&) {}), place_(path_)
{
    std::int64_t there = 0;
    on_root(team, [&] {
        const std::string name = path_.string();
        if (name.empty()) throw BadInput("the result directory has no name: give one with -o DIR");
        std::error_code error;
        const auto status = fs::status(path_, error);
        if (!fs::exists(status)) return;
        if (!fs::is_directory(status))
            throw BadInput(fmt::format("{}: a file of this name exists: choose another result directory with -o DIR", name));
        const Place held = hold(path_);
        Ownership::refuse_if_owned(held);
        if (existing == Existing::Refuse && !holdings(held).empty())
            throw BadInput(fmt::format("{}: the result directory exists and is not empty. Go on with --restart, move "
                                       "it aside with --force, or choose another with -o DIR",
                                       name));
        if (existing != Existing::Refuse) require_result_directory(held);
        if (existing != Existing::Refuse && !holdings(held).empty()) ownership_ = std::make_unique<Ownership>(held, say_);
        there = 1;
    });
    there = team.max(there);
    if (there) open_held();
}

void ResultDirectory::make(Existing existing)
{
    std::string moved;
    on_root(team_, [&] {
        const std::string name = path_.string();
        std::unique_ptr<Ownership> old;
        if (place_.held() && existing == Existing::MoveAside && !holdings(place_).empty()) {
            if (!in_place()) throw BadInput(fmt::format("{}: another directory got this name meanwhile: start again", name));
            require_result_directory(place_);
            if (identity(place_) == identity("."))
                throw BadInput(fmt::format("{}: the directory you stand in cannot be moved aside: choose another "
                                           "result directory with -o DIR",
                                           name));
            const Path to = free_old_name(path_);
            move_file(path_, to);
            moved = to.string();
            old = std::move(ownership_); // until the new one is ours
        }
        try {
            fs::create_directories(path_);
        } catch (const fs::filesystem_error& e) {
            throw IoFailed(fmt::format("{}: making the result directory failed: {}", name, cause(path_, e.code().value())));
        }
        const Place held = ownership_ ? place_ : hold(path_);
        if (!ownership_) ownership_ = std::make_unique<Ownership>(held, say_);
        if (existing != Existing::GoOn && !holdings(held).empty())
            throw BadInput(fmt::format("{}: another run has left results here meanwhile: go on with --restart, move it aside with --force, "
                                       "or choose another with -o DIR",
                                       name));
        make_directory(held / "snapshots");
    });
    moved_to_ = team_.broadcast(moved);
    open_held();
    std::string trouble;
    try {
        snapshots_ = hold(place_ / "snapshots");
    } catch (const IoFailed& e) {
        trouble = e.what();
    }
    agree(team_, trouble);
}

void ResultDirectory::open_held()
{
    // A network file system may show a new directory late on other nodes.
    std::string trouble;
    Place held;
    for (int tries = 0; tries < 200; ++tries) {
        trouble.clear();
        try {
            held = hold(path_);
            break;
        } catch (const IoFailed& e) {
            trouble = e.what();
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    agree(team_, trouble);
    place_ = held;
    // Devices have other numbers on other nodes, directories have not.
    const auto mine = std::int64_t(identity(place_).number);
    std::int64_t first = mine;
    team_.broadcast(std::as_writable_bytes(std::span(&first, 1)));
    if (first != mine)
        trouble = fmt::format("{}: rank {} finds another directory of this name than rank 0: expected one that all nodes share. Remedy: "
                              "choose a shared file system with -o",
                              path_.string(), team_.rank());
    agree(team_, trouble);
}

bool ResultDirectory::owned() const
{
    try {
        return !ownership_ || !ownership_->lost();
    } catch (const IoFailed&) {
        return true; // nothing is known: the next renewal tells, or the next checkpoint fails with words
    }
}

void ResultDirectory::require_owned() const
{
    on_root(team_, [&] {
        if (!ownership_->lost()) return;
        throw IoFailed(fmt::format("{}: another run has taken this directory over (its {} is not this run's any more), so nothing more is "
                                   "written. This happens where a run was halted for minutes or somebody removed the file",
                                   path_.string(), Ownership::file_name));
    });
}

bool ResultDirectory::in_place() const { return place_.held() && identity(path_) == identity(place_); }

} // namespace kuzure::io
