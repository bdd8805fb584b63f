#pragma once
// What the fuzzers share: how a finding ends the program, and a directory in memory for readers that want a file.
#include "io/file.hpp"
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <string>
#include <string_view>
#include <unistd.h>

namespace kuzure::fuzz {

[[noreturn]] inline void found(const std::string& what)
{
    std::fprintf(stderr, "fuzz: %s\n", what.c_str());
    std::abort();
}

/// A refusal has words, and not too many.
inline void judge_refusal(std::string_view words)
{
    if (words.empty()) found("a refusal without a word");
    if (words.size() > 100000) found("a refusal of more than 100 kB");
}

/// A directory in memory that goes with the program.
struct Scratch {
    io::Path path;
    Scratch()
    {
        char shared[] = "/dev/shm/kuzure_fuzz_XXXXXX", plain[] = "/tmp/kuzure_fuzz_XXXXXX";
        const char* made = mkdtemp(shared);
        if (!made) made = mkdtemp(plain);
        if (!made) found("no place for files");
        path = made;
    }
    ~Scratch()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

/// The file gets these bytes, without waiting for the disk.
inline void write(const io::Path& file, std::string_view bytes)
{
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0 || ::write(fd, bytes.data(), bytes.size()) != ssize_t(bytes.size()) || ::ftruncate(fd, off_t(bytes.size())) != 0)
        found("the scratch file cannot be written");
    ::close(fd);
}

/// Takes the text up to the next zero byte.
inline std::string_view take(std::string_view& all)
{
    const auto end = all.find('\0');
    const auto piece = all.substr(0, end);
    all.remove_prefix(end == all.npos ? all.size() : end + 1);
    return piece;
}

} // namespace kuzure::fuzz
