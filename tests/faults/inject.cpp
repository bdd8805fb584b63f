// Stands between a program and the system (LD_PRELOAD) and lets the n-th call of one kind fail, in one directory and what lies below it.
//   KUZURE_FAULT_BELOW   the directory
//   KUZURE_FAULT         kind:n:errno:times; kinds: see names. times = 0: from the n-th on, as a disk that stays full
//   KUZURE_FAULT_COUNT   a file that gets "kind count" lines at the program's end
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

namespace {

enum Kind { Open, Create, Read, Write, Sync, Rename, Truncate, Allocate, Mkdir, Unlink, Kinds };
const char* const names[Kinds] = {"open", "create", "read", "write", "sync", "rename", "truncate", "allocate", "mkdir", "unlink"};
std::atomic<long> seen[Kinds];

struct Plan {
    char below[PATH_MAX] = "";
    std::size_t length = 0;
    int kind = -1, error = 0;
    long first = 0, times = 1;
    Plan()
    {
        if (const char* d = std::getenv("KUZURE_FAULT_BELOW")) length = std::size_t(std::snprintf(below, sizeof below, "%s", d));
        const char* f = std::getenv("KUZURE_FAULT");
        char word[32] = "";
        if (f && std::sscanf(f, "%31[^:]:%ld:%d:%ld", word, &first, &error, &times) == 4)
            for (int k = 0; k < Kinds; ++k)
                if (std::strcmp(word, names[k]) == 0) kind = k;
    }
    ~Plan()
    {
        const char* file = std::getenv("KUZURE_FAULT_COUNT");
        if (!file || !length) return;
        if (FILE* out = std::fopen(file, "w")) {
            for (int k = 0; k < Kinds; ++k) std::fprintf(out, "%s %ld\n", names[k], seen[k].load());
            std::fclose(out);
        }
    }
    bool inside(const char* path) const
    {
        return length && std::strncmp(path, below, length) == 0 && (path[length] == '/' || path[length] == '\0' || path[length] == ' ');
    }
    bool inside(int fd) const
    {
        if (!length) return false;
        char link[64], path[PATH_MAX];
        std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
        const auto n = ::readlink(link, path, sizeof path - 1);
        if (n <= 0) return false;
        path[n] = '\0';
        return inside(path);
    }
    bool inside(int directory, const char* name) const
    {
        if (name[0] == '/') return inside(name);
        if (directory != AT_FDCWD) return inside(directory);
        char path[2 * PATH_MAX];
        if (!length || !::getcwd(path, PATH_MAX)) return false;
        std::snprintf(path + std::strlen(path), PATH_MAX, "/%s", name);
        return inside(path);
    }
};
Plan& plan()
{
    static Plan p;
    return p;
}
Plan& made_at_start = plan();

/// Counts a call that concerns the directory; true if it is to fail, errno set.
bool fails(Kind k, bool concerns)
{
    if (!concerns) return false;
    const long n = ++seen[k];
    const Plan& p = plan();
    if (p.kind != k || n < p.first || (p.times > 0 && n >= p.first + p.times)) return false;
    errno = p.error;
    return true;
}

template <class F> F* next(const char* name, F*) { return reinterpret_cast<F*>(::dlsym(RTLD_NEXT, name)); }
int opened(const char* symbol, int directory, const char* name, int flags, mode_t mode)
{
    if (fails(flags & O_CREAT ? Create : Open, plan().inside(directory, name))) return -1;
    static auto* const real = reinterpret_cast<int (*)(int, const char*, int, ...)>(::dlsym(RTLD_NEXT, symbol));
    return real(directory, name, flags, mode);
}

} // namespace

#define MODE(flags)                                                                                                                        \
    mode_t mode = 0;                                                                                                                       \
    if (flags & O_CREAT) {                                                                                                                 \
        va_list more;                                                                                                                      \
        va_start(more, flags);                                                                                                             \
        mode = va_arg(more, mode_t);                                                                                                       \
        va_end(more);                                                                                                                      \
    }
#define REAL(name) static auto* const real = next(#name, &::name)

#pragma GCC diagnostic ignored "-Wredundant-decls"
extern "C" {
int openat(int d, const char* name, int flags, ...)
{
    MODE(flags)
    return opened("openat", d, name, flags, mode);
}
int openat64(int d, const char* name, int flags, ...)
{
    MODE(flags)
    return opened("openat", d, name, flags, mode);
}
int open(const char* name, int flags, ...)
{
    MODE(flags)
    return opened("openat", AT_FDCWD, name, flags, mode);
}
int open64(const char* name, int flags, ...)
{
    MODE(flags)
    return opened("openat", AT_FDCWD, name, flags, mode);
}
ssize_t read(int fd, void* to, size_t n)
{
    if (fails(Read, plan().inside(fd))) return -1;
    REAL(read);
    return real(fd, to, n);
}
ssize_t pread(int fd, void* to, size_t n, off_t at)
{
    if (fails(Read, plan().inside(fd))) return -1;
    REAL(pread);
    return real(fd, to, n, at);
}
ssize_t pread64(int fd, void* to, size_t n, off64_t at) { return pread(fd, to, n, at); }
ssize_t write(int fd, const void* from, size_t n)
{
    if (fails(Write, plan().inside(fd))) return -1;
    REAL(write);
    return real(fd, from, n);
}
ssize_t pwrite(int fd, const void* from, size_t n, off_t at)
{
    if (fails(Write, plan().inside(fd))) return -1;
    REAL(pwrite);
    return real(fd, from, n, at);
}
ssize_t pwrite64(int fd, const void* from, size_t n, off64_t at) { return pwrite(fd, from, n, at); }
int fsync(int fd)
{
    if (fails(Sync, plan().inside(fd))) return -1;
    REAL(fsync);
    return real(fd);
}
int rename(const char* from, const char* to) noexcept
{
    if (fails(Rename, plan().inside(AT_FDCWD, from) || plan().inside(AT_FDCWD, to))) return -1;
    REAL(rename);
    return real(from, to);
}
int renameat(int a, const char* from, int b, const char* to) noexcept
{
    if (fails(Rename, plan().inside(a, from) || plan().inside(b, to))) return -1;
    REAL(renameat);
    return real(a, from, b, to);
}
int ftruncate(int fd, off_t to) noexcept
{
    if (fails(Truncate, plan().inside(fd))) return -1;
    REAL(ftruncate);
    return real(fd, to);
}
int ftruncate64(int fd, off64_t to) noexcept { return ftruncate(fd, to); }
int fallocate(int fd, int mode, off_t at, off_t n)
{
    if (fails(Allocate, plan().inside(fd))) return -1;
    REAL(fallocate);
    return real(fd, mode, at, n);
}
int fallocate64(int fd, int mode, off64_t at, off64_t n) { return fallocate(fd, mode, at, n); }
int mkdir(const char* name, mode_t mode) noexcept
{
    if (fails(Mkdir, plan().inside(AT_FDCWD, name))) return -1;
    REAL(mkdir);
    return real(name, mode);
}
int mkdirat(int d, const char* name, mode_t mode) noexcept
{
    if (fails(Mkdir, plan().inside(d, name))) return -1;
    REAL(mkdirat);
    return real(d, name, mode);
}
int unlinkat(int d, const char* name, int flags) noexcept
{
    if (fails(Unlink, plan().inside(d, name))) return -1;
    REAL(unlinkat);
    return real(d, name, flags);
}
}
