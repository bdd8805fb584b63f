#include "io/file.hpp"
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace kuzure::io {
namespace {

[[noreturn]] void fail(const Place& path, const std::string& doing, int error)
{
    throw IoFailed(fmt::format("{}: {} failed: {}", path.string(), doing, cause(path, error)));
}

/// What is at a place, or an errno.
int status_of(const Place& place, struct stat& info)
{
    return ::fstatat(place.from(), place.relative(), &info, place.held() ? AT_SYMLINK_NOFOLLOW : 0) == 0 ? 0 : errno;
}

} // namespace

// ---- places ---------------------------------------------------------------------------------------------------------
void Descriptor::close()
{
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
}

Place Place::operator/(std::string_view name) const
{
    if (!held()) return path_ / name;
    ensure(name_.empty() && !name.empty() && name.find('/') == name.npos && name != "..", "a held directory's files have plain names");
    Place p = *this;
    p.name_ = name;
    p.path_ /= name;
    return p;
}

Place Place::beside(std::string_view name) const { return directory_of(*this) / name; }

int Place::from() const { return held() ? int(*directory_) : AT_FDCWD; }
const char* Place::relative() const { return !held() ? path_.c_str() : name_.empty() ? "." : name_.c_str(); }

Place hold(const Place& directory)
{
    const int links = directory.held() ? O_NOFOLLOW : 0;
    Descriptor fd(::openat(directory.from(), directory.relative(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | links));
    if (fd < 0) {
        struct stat info;
        const int error = errno;
        if (links && status_of(directory, info) == 0 && S_ISLNK(info.st_mode))
            throw IoFailed(fmt::format("{}: expected a directory, found a link: kuzure does not follow links out of a result directory. "
                                       "Remedy: move the directory itself to where there is room, or choose another with -o",
                                       directory.string()));
        fail(directory, "opening the directory", error);
    }
    Place held(directory.path());
    held.directory_ = std::make_shared<const Descriptor>(std::move(fd));
    return held;
}

Place directory_of(const Place& place)
{
    if (place.held()) {
        Place directory = place;
        if (!place.name_.empty()) directory.name_.clear(), directory.path_ = place.path().parent_path();
        return directory;
    }
    const Path parent = place.path().parent_path();
    return parent.empty() ? Path(".") : parent;
}

Descriptor open_file(const Place& place, int flags)
{
    return Descriptor(::openat(place.from(), place.relative(), flags | O_CLOEXEC | (place.held() ? O_NOFOLLOW : 0)));
}

Descriptor create_file(const Place& place)
{
    if (::unlinkat(place.from(), place.relative(), 0) != 0 && errno != ENOENT) return Descriptor(-1);
    return Descriptor(::openat(place.from(), place.relative(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
}

FileIdentity identity(const Place& place)
{
    struct stat info;
    return status_of(place, info) == 0 ? FileIdentity{info.st_dev, info.st_ino} : FileIdentity{};
}

bool exists(const Place& place)
{
    struct stat info;
    return status_of(place, info) == 0;
}

std::vector<std::string> names_in(const Place& directory)
{
    Descriptor fd(::openat(directory.from(), directory.relative(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (fd < 0) fail(directory, "opening the directory", errno);
    const std::unique_ptr<DIR, int (*)(DIR*)> open(::fdopendir(::fcntl(fd, F_DUPFD_CLOEXEC, 0)), ::closedir);
    if (!open) fail(directory, "reading the directory", errno);
    std::vector<std::string> names;
    for (;;) {
        errno = 0;
        const dirent* e = ::readdir(open.get());
        if (!e && errno) fail(directory, "reading the directory", errno);
        if (!e) break;
        if (const std::string_view name = e->d_name; name != "." && name != "..") names.emplace_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
}

void remove_file(const Place& place)
{
    if (::unlinkat(place.from(), place.relative(), 0) != 0 && errno != ENOENT) fail(place, "removing it", errno);
}

void make_directory(const Place& place)
{
    if (::mkdirat(place.from(), place.relative(), 0777) != 0 && errno != EEXIST) fail(place, "making the directory", errno);
}

// ---- ranks ----------------------------------------------------------------------------------------------------------
void agree(const Team& team, const std::string& complaint)
{
    const auto none = std::int64_t(team.size());
    std::int64_t first = complaint.empty() ? none : team.rank();
    team.min(std::span(&first, 1));
    if (first == none) return;
    throw IoFailed(team.broadcast(complaint, int(first)));
}

void on_root(const Team& team, const std::function<void()>& work)
{
    std::string outcome; // empty, or a letter for the type and the message
    if (team.rank() == 0) {
        try {
            work();
        } catch (const BadInput& e) {
            outcome = std::string("B") + e.what();
        } catch (const std::exception& e) {
            outcome = std::string("I") + e.what();
        }
    }
    outcome = team.broadcast(outcome);
    if (outcome.empty()) return;
    if (outcome[0] == 'B') throw BadInput(outcome.substr(1));
    throw IoFailed(outcome.substr(1));
}

// ---- contents -------------------------------------------------------------------------------------------------------
std::uint64_t free_bytes(const Place& place)
{
    struct statvfs disk;
    if (place.held()) {
        if (::fstatvfs(place.from(), &disk) != 0) fail(place, "asking for the free space", errno);
    } else {
        std::error_code ignored;
        Path there = std::filesystem::absolute(place.path(), ignored);
        while (!std::filesystem::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
        if (::statvfs(there.c_str(), &disk) != 0) fail(there, "asking for the free space", errno);
    }
    return std::uint64_t(disk.f_bavail) * disk.f_frsize;
}

std::string cause(const Place& place, int error)
{
    std::string words = error ? std::strerror(error) : "no reason given by the system";
    std::uint64_t left;
    try {
        left = free_bytes(directory_of(place));
    } catch (const IoFailed&) {
        return words;
    }
    const std::uint64_t little = 1 << 20;
    if (error == EDQUOT)
        words += ". Your quota on this disk is used up: make room or choose another directory with -o, then go on with --restart";
    else if (error == EFBIG)
        words += ". A file may not grow to this size here: raise the limit (ulimit -f) or choose another file system with -o, then go on "
                 "with --restart";
    else if (error == ENOSPC || left < little)
        words += fmt::format(". The disk is full ({:.1f} MB free): make room or choose another directory with -o, "
                             "then go on with --restart",
                             double(left) / 1e6);
    else if (error == EACCES || error == EPERM || error == EROFS) words += ". Choose a directory you may write to with -o";
    else if (error == ELOOP) words += ". It is a link: kuzure does not follow links out of a result directory. Remedy: remove the link";
    return words;
}

int write_all(int descriptor, const void* bytes, std::size_t count, std::int64_t at)
{
    const char* from = static_cast<const char*>(bytes);
    while (count > 0) {
        const std::size_t most = std::size_t(1) << 30; // Linux writes at most 2 GiB at a time
        const auto n = ::pwrite(descriptor, from, std::min(count, most), off_t(at));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return n < 0 ? errno : ENOSPC;
        from += n, count -= std::size_t(n), at += n;
    }
    return 0;
}

namespace {

void write_beside_and_rename(const Place& place, std::string_view content, bool to_the_disk)
{
    const Place beside = place.beside(place.name() + ".tmp");
    int error = 0;
    {
        const Descriptor out = create_file(beside);
        if (out < 0) fail(place, "creating the file", errno);
        error = write_all(out, content.data(), content.size(), 0);
        if (!error && to_the_disk && ::fsync(out) != 0) error = errno;
    }
    if (error) {
        ::unlinkat(beside.from(), beside.relative(), 0);
        fail(place, "writing", error);
    }
    move_file(beside, place);
    if (to_the_disk) sync(directory_of(place));
}

} // namespace

void write_atomically(const Place& place, std::string_view content) { write_beside_and_rename(place, content, true); }

void write_lightly(const Place& place, std::string_view content) { write_beside_and_rename(place, content, false); }

std::string read_text(const Place& place, std::uint64_t limit)
{
    const Descriptor in = open_file(place, O_RDONLY | O_NONBLOCK); // a pipe without a writer would wait for ever
    if (in < 0) fail(place, "opening", errno);
    struct stat info;
    if (::fstat(in, &info) != 0) fail(place, "reading", errno);
    if (!S_ISREG(info.st_mode)) throw IoFailed(fmt::format("{}: expected a file, found something else", place.string()));
    if (std::uint64_t(info.st_size) > limit)
        throw IoFailed(fmt::format("{}: {} bytes, more than a file of this kind can have ({})", place.string(), info.st_size, limit));
    std::string text(std::size_t(info.st_size), '\0');
    std::size_t have = 0;
    while (have < text.size()) {
        const auto n = ::read(in, text.data() + have, text.size() - have);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail(place, "reading", errno);
        if (n == 0) break;
        have += std::size_t(n);
    }
    text.resize(have);
    return text;
}

void sync(const Place& directory)
{
    const Descriptor fd = open_file(directory, O_RDONLY | O_DIRECTORY);
    if (fd < 0) fail(directory, "opening", errno);
    // EINVAL: this file system does not sync directories; it then needs none.
    if (::fsync(fd) != 0 && errno != EINVAL) fail(directory, "bringing it to the disk", errno);
}

void move_file(const Place& from, const Place& to)
{
    if (::renameat(from.from(), from.relative(), to.from(), to.relative()) != 0)
        fail(to, fmt::format("renaming {} to it", from.string()), errno);
}

} // namespace kuzure::io
