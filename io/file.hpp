#pragma once
// Plain files: written whole or not at all, under names that no other process can turn elsewhere, and failures that reach every rank at
// once. No other file in io/ opens, renames or syncs a file by hand.
#include "solver/core/ensure.hpp"
#include "solver/core/team.hpp"
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kuzure::io {

using Path = std::filesystem::path;

/// An open file that closes itself; below 0 where opening failed.
class Descriptor {
public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    Descriptor(Descriptor&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
    Descriptor& operator=(Descriptor&& o) noexcept
    {
        std::swap(fd_, o.fd_);
        return *this;
    }
    ~Descriptor() { close(); }
    void close();
    operator int() const { return fd_; }

private:
    int fd_;
};

/// Where a file is: any path, or one name in a directory that is held open (hold()). A held directory stays the one that was opened,
/// whatever becomes of its name, and nothing in it is ever followed through a link.
class Place {
public:
    Place() = default;
    Place(const Path& path) : path_(path) {}        // NOLINT(google-explicit-constructor)
    Place(const std::string& path) : path_(path) {} // NOLINT(google-explicit-constructor)
    Place(const char* path) : path_(path) {}        // NOLINT(google-explicit-constructor)

    /// The path by which it was asked for: for words, and for tools that want a name.
    const Path& path() const { return path_; }
    std::string string() const { return path_.string(); }
    std::string name() const { return path_.filename().string(); }
    bool held() const { return directory_ != nullptr; }
    bool empty() const { return path_.empty(); }
    /// A file of this directory. In a held one a name, without '/'; throws Broken otherwise.
    Place operator/(std::string_view name) const;
    /// A file beside this one.
    Place beside(std::string_view name) const;
    /// The held directory, or AT_FDCWD; and what it is called from there.
    int from() const;
    const char* relative() const;

private:
    friend Place hold(const Place&);
    friend Place directory_of(const Place&);
    std::shared_ptr<const Descriptor> directory_;
    std::string name_; // in it; empty: the directory itself
    Path path_;
};

/// Opens a directory and holds it. Throws IoFailed; in a held directory also where the name is a link.
Place hold(const Place& directory);

/// Opens a file with these flags of open(2), not across exec; in a held directory not through a link. Below 0 with errno where it fails.
Descriptor open_file(const Place&, int flags);

/// A new file for reading and writing, whatever had its name before (a link is removed, not followed). Below 0 with errno where it fails.
Descriptor create_file(const Place&);

/// Device and number of a file, by which it is known under any name; zeros where there is none.
struct FileIdentity {
    std::uint64_t device = 0, number = 0;
    bool operator==(const FileIdentity&) const = default;
};
FileIdentity identity(const Place&);

/// Whether there is something of this name; in a held directory a link counts as itself.
bool exists(const Place&);

/// The names in a directory, in order. Throws IoFailed.
std::vector<std::string> names_in(const Place& directory);

/// Removes a file (or a link); nothing there is fine. Throws IoFailed.
void remove_file(const Place&);

/// Makes a directory if there is none. Throws IoFailed.
void make_directory(const Place&);

/// Collective. If any rank brings a complaint (not empty), all throw IoFailed with the lowest such rank's words.
void agree(const Team&, const std::string& complaint);

/// Collective. Rank 0 works; what it throws (BadInput, IoFailed, anything else as IoFailed) is thrown on every rank.
void on_root(const Team&, const std::function<void()>& work);

/// Bytes an ordinary user may still write where this path lies or will lie.
std::uint64_t free_bytes(const Place&);

/// The words for an errno, with the remedy where the cause has one: a full disk, a quota, a limit on file sizes, missing rights.
std::string cause(const Place&, int error);

/// The file gets this content or keeps what it had: written beside it, synced, renamed. Throws IoFailed.
void write_atomically(const Place&, std::string_view content);

/// The same without waiting for the disk: for what can be made again from other files. Throws IoFailed.
void write_lightly(const Place&, std::string_view content);

/// The whole file, at most `limit` bytes. Throws IoFailed.
std::string read_text(const Place&, std::uint64_t limit = std::uint64_t(1) << 30);

/// All bytes to an offset in an open file; 0 or the errno.
int write_all(int descriptor, const void* bytes, std::size_t count, std::int64_t at);

/// Wait until a directory's names are on the disk. Throws IoFailed.
void sync(const Place& directory);

/// Rename, replacing what is there. Throws IoFailed.
void move_file(const Place& from, const Place& to);

/// The directory a file lies in, never empty.
Place directory_of(const Place&);

} // namespace kuzure::io
