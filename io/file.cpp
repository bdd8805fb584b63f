#include "io/file.hpp"
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace kuzure::io {
namespace {

/// An open file that closes itself.
struct Descriptor {
    int fd;
    explicit Descriptor(int d) : fd(d) {}
    Descriptor(const Descriptor&) = delete;
    ~Descriptor()
    {
        if (fd >= 0) ::close(fd);
    }
};

[[noreturn]] void fail(const Path& path, const char* doing, int error)
{
    throw IoFailed(fmt::format("{}: {} failed: {}", path.string(), doing, cause(path, error)));
}

} // namespace

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

std::uint64_t free_bytes(const Path& path)
{
    std::error_code ignored;
    Path there = std::filesystem::absolute(path, ignored);
    while (!std::filesystem::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
    struct statvfs disk;
    if (::statvfs(there.c_str(), &disk) != 0) fail(there, "asking for the free space", errno);
    return std::uint64_t(disk.f_bavail) * disk.f_frsize;
}

std::string cause(const Path& path, int error)
{
    std::string words = error ? std::strerror(error) : "no reason given by the system";
    std::uint64_t left;
    try {
        left = free_bytes(directory_of(path));
    } catch (const IoFailed&) {
        return words;
    }
    const std::uint64_t little = 1 << 20;
    if (error == ENOSPC || error == EDQUOT || left < little)
        words += fmt::format(". The disk is full ({:.1f} MB free): make room or choose another directory with -o, "
                             "then go on with --restart",
                             double(left) / 1e6);
    else if (error == EACCES || error == EPERM || error == EROFS) words += ". Choose a directory you may write to with -o";
    return words;
}

void write_atomically(const Path& path, std::string_view content)
{
    const Path beside = path.string() + ".tmp";
    int error = 0;
    {
        const Descriptor out(::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
        if (out.fd < 0) fail(path, "creating the file", errno);
        while (!content.empty()) {
            const auto n = ::write(out.fd, content.data(), content.size());
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) {
                error = n < 0 ? errno : ENOSPC;
                break;
            }
            content.remove_prefix(std::size_t(n));
        }
        if (!error && ::fsync(out.fd) != 0) error = errno;
    }
    if (error) {
        ::unlink(beside.c_str());
        fail(path, "writing", error);
    }
    move_file(beside, path);
    sync(directory_of(path));
}

std::string read_text(const Path& path, std::uint64_t limit)
{
    // A pipe that nobody writes to must not hold us up; on files this says nothing.
    const Descriptor in(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (in.fd < 0) fail(path, "opening", errno);
    struct stat info;
    if (::fstat(in.fd, &info) != 0) fail(path, "reading", errno);
    if (!S_ISREG(info.st_mode)) throw IoFailed(fmt::format("{}: expected a file, found something else", path.string()));
    if (std::uint64_t(info.st_size) > limit)
        throw IoFailed(fmt::format("{}: {} bytes, more than a file of this kind can have ({})", path.string(), info.st_size, limit));
    std::string text(std::size_t(info.st_size), '\0');
    std::size_t have = 0;
    while (have < text.size()) {
        const auto n = ::read(in.fd, text.data() + have, text.size() - have);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail(path, "reading", errno);
        if (n == 0) break;
        have += std::size_t(n);
    }
    text.resize(have);
    return text;
}

void sync(const Path& path)
{
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.fd < 0) fail(path, "opening", errno);
    // EINVAL: this file system does not sync directories; it then needs none.
    if (::fsync(file.fd) != 0 && errno != EINVAL) fail(path, "bringing it to the disk", errno);
}

void move_file(const Path& from, const Path& to)
{
    if (::rename(from.c_str(), to.c_str()) != 0) fail(to, fmt::format("renaming {} to it", from.string()).c_str(), errno);
}

Path directory_of(const Path& path)
{
    const Path parent = path.parent_path();
    return parent.empty() ? Path(".") : parent;
}

} // namespace kuzure::io
