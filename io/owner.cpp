#include "io/owner.hpp"
#include "io/json.hpp"
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <mutex>
#include <sys/file.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

namespace kuzure::io {
namespace {

using nlohmann::ordered_json;

std::string first_line(const char* file)
{
    try {
        const Descriptor in = open_file(file, O_RDONLY);
        char text[4096];
        const auto n = in < 0 ? 0 : ::read(in, text, sizeof text);
        const std::string all(text, std::size_t(std::max<ssize_t>(n, 0)));
        return all.substr(0, all.find('\n'));
    } catch (const std::exception&) {
        return {};
    }
}

/// When a process of this machine started, in ticks after boot; nothing if it is no more (or waits to be buried).
std::optional<std::int64_t> start_of(std::int64_t pid)
{
    const std::string stat = first_line(fmt::format("/proc/{}/stat", pid).c_str());
    const auto name_ends = stat.rfind(')');
    if (name_ends == stat.npos) return {};
    const char state = stat.size() > name_ends + 2 ? stat[name_ends + 2] : 'X';
    if (state == 'Z' || state == 'X' || state == 'x') return {};
    // The 22nd word; the state is the third.
    std::size_t at = name_ends + 2;
    for (int word = 3; word < 22; ++word) {
        at = stat.find(' ', at);
        if (at == stat.npos) return {};
        ++at;
    }
    return std::strtoll(stat.c_str() + at, nullptr, 10);
}

std::string environment(const char* name)
{
    const char* value = std::getenv(name);
    return value ? std::string(value).substr(0, 200) : "";
}

std::string text_of(const Owner& o)
{
    return ordered_json{{"what", "a kuzure run writes into this directory"},
                        {"host", o.host},
                        {"pid", o.pid},
                        {"started", o.started},
                        {"boot", o.boot},
                        {"pid_namespace", o.pid_namespace},
                        {"job", o.job},
                        {"restarts", o.restarts},
                        {"since", o.since},
                        {"directory", o.directory}}
               .dump(1, ' ', false, ordered_json::error_handler_t::replace) +
           "\n";
}

/// Nothing where the text does not say it: half written, or no lock of ours.
std::optional<Owner> owner_from(const std::string& text)
{
    try {
        const auto j = parse_json<ordered_json>(text);
        Owner o;
        o.host = j.at("host"), o.pid = j.at("pid"), o.started = j.at("started"), o.boot = j.at("boot");
        o.pid_namespace = j.at("pid_namespace"), o.job = j.at("job"), o.restarts = j.at("restarts");
        o.since = j.at("since"), o.directory = j.at("directory");
        return o;
    } catch (const ordered_json::exception&) {
        return {};
    }
}

/// What lies there as a lock.
struct Found {
    std::string text;
    std::optional<Owner> owner;
    double beat = 0; // s, the file system's clock
};
std::optional<Found> find(const Place& file)
{
    for (int tries = 0;; ++tries) {
        // Opened anew at each poll: that is what makes network file systems ask their server.
        const Descriptor in = open_file(file, O_RDONLY | O_NONBLOCK);
        if (in < 0 && errno == ENOENT) return {};
        struct stat info;
        if (in < 0 || ::fstat(in, &info) != 0)
            throw IoFailed(fmt::format("{}: reading who owns the directory failed: {}", file.string(), cause(file, errno)));
        if (!S_ISREG(info.st_mode))
            throw IoFailed(fmt::format("{}: expected a file, found something else. Remedy: remove it", file.string()));
        Found f{{}, {}, double(info.st_mtim.tv_sec) + 1e-9 * double(info.st_mtim.tv_nsec)};
        char text[4096];
        const auto n = ::read(in, text, sizeof text);
        if (n < 0) throw IoFailed(fmt::format("{}: reading who owns the directory failed: {}", file.string(), cause(file, errno)));
        f.text.assign(text, std::size_t(n));
        f.owner = owner_from(f.text);
        if (f.owner || tries == 20) return f;
        std::this_thread::sleep_for(std::chrono::milliseconds(10)); // it may be just being written
    }
}

/// The file system's clock now: that of a server may differ from ours.
double clock_of(const Place& directory)
{
    const Place probe = directory / fmt::format("{}.{}.{}", Ownership::file_name, Owner::self().host.substr(0, 64), ::getpid());
    struct stat info {};
    {
        const Descriptor made = create_file(probe);
        if (made < 0 || ::fstat(made, &info) != 0) return double(std::time(nullptr));
    }
    ::unlinkat(probe.from(), probe.relative(), 0);
    return double(info.st_mtim.tv_sec) + 1e-9 * double(info.st_mtim.tv_nsec);
}

enum class Life { Alive, Dead, Unknown };

/// What can be told without waiting.
Life life_of(const Found& f, const Place& directory)
{
    if (!f.owner) return Life::Unknown;
    const Owner &o = *f.owner, me = Owner::self();
    if (o.directory != identity(directory).number) return Life::Dead;                      // a copy of another's directory
    if (!o.job.empty() && o.job == me.job && o.restarts != me.restarts) return Life::Dead; // the batch system has ended it
    if (o.boot.empty() || o.boot != me.boot || o.pid_namespace != me.pid_namespace) return Life::Unknown;
    if (const auto started = start_of(o.pid)) return *started == o.started ? Life::Alive : Life::Dead;
    // Gone, or waiting to be buried; of other users' processes /proc may tell nothing.
    return ::kill(pid_t(o.pid), 0) == 0 || errno == ESRCH ? Life::Dead : Life::Unknown;
}

[[noreturn]] void refuse(const Place& directory, const Found& f, bool certain)
{
    std::string words = fmt::format("{}: {}: {}. Wait for its end, stop it, or choose another directory with -o", directory.string(),
                                    Ownership::refusal, f.owner ? f.owner->words() : "it does not say who it is");
    if (!certain)
        words += fmt::format(". If that process is no more, remove {} and start again", (directory / Ownership::file_name).string());
    throw BadInput(words);
}

/// Where file locks work, takers of one directory come one after the other.
class Turn {
public:
    explicit Turn(const Place& directory) : fd_(open_file(directory, O_RDONLY | O_DIRECTORY))
    {
        for (int k = 0; k < 500 && fd_ >= 0 && ::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK; ++k)
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }

private:
    Descriptor fd_; // closing it gives the lock back
};

/// Makes the lock if there is none; false where there is one. Throws IoFailed.
bool make(const Place& file, const std::string& text)
{
    const Descriptor made(::openat(file.from(), file.relative(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (made < 0 && errno == EEXIST) return false;
    if (made < 0) throw IoFailed(fmt::format("{}: creating the file failed: {}", file.string(), cause(file, errno)));
    int error = write_all(made, text.data(), text.size(), 0);
    if (!error && ::fsync(made) != 0) error = errno;
    if (!error) return true;
    ::unlinkat(file.from(), file.relative(), 0);
    throw IoFailed(fmt::format("{}: writing failed: {}", file.string(), cause(file, error)));
}

/// Removes the lock that was judged dead and no other: it is renamed first, which only one can, and looked at again.
void bury(const Place& directory, const Place& file, const Found& dead)
{
    const Place grave = directory / fmt::format("{}.dead.{}.{}", Ownership::file_name, Owner::self().host.substr(0, 64), ::getpid());
    if (::renameat(file.from(), file.relative(), grave.from(), grave.relative()) != 0) {
        if (errno == ENOENT) return;
        throw IoFailed(fmt::format("{}: taking over the directory failed: {}", file.string(), cause(file, errno)));
    }
    const auto buried = find(grave);
    if (buried && buried->text != dead.text) // another's, who was quicker: back with it
        static_cast<void>(::linkat(grave.from(), grave.relative(), file.from(), file.relative(), 0));
    remove_file(grave);
}

} // namespace

Owner Owner::self()
{
    Owner o;
    char host[256] = "";
    ::gethostname(host, sizeof host - 1);
    o.host = host;
    o.boot = first_line("/proc/sys/kernel/random/boot_id");
    char space[128] = "";
    if (::readlink("/proc/self/ns/pid", space, sizeof space - 1) > 0) o.pid_namespace = space;
    o.pid = ::getpid();
    o.started = start_of(o.pid).value_or(0);
    for (const auto& [kind, name] : {std::pair("Slurm", "SLURM_JOB_ID"), std::pair("PBS", "PBS_JOBID"), std::pair("PJM", "PJM_JOBID"),
                                     std::pair("LSF", "LSB_JOBID"), std::pair("Grid Engine", "JOB_ID")})
        if (const auto id = environment(name); o.job.empty() && !id.empty()) o.job = fmt::format("{} job {}", kind, id);
    o.restarts = std::strtoll(environment("SLURM_RESTART_COUNT").c_str(), nullptr, 10);
    o.since = fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(std::time(nullptr)));
    return o;
}

std::string Owner::words() const
{
    // Of a file that any user may have written: no control characters to the terminal.
    std::string all = fmt::format("process {} on host {}{}{}, since {}", pid, host, job.empty() ? "" : ", ", job, since);
    for (char& c : all)
        if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
    return all;
}

/// Tells others by the lock's date that this process lives, whatever it is busy with.
struct Ownership::Heart {
    std::mutex mutex;
    std::condition_variable ends;
    bool ended = false;
    std::thread thread;

    explicit Heart(const Ownership& of)
    {
        // Signals are for the main thread.
        sigset_t all, before;
        sigfillset(&all);
        pthread_sigmask(SIG_BLOCK, &all, &before);
        thread = std::thread([this, &of] {
            std::unique_lock lock(mutex);
            while (!ends.wait_for(lock, std::chrono::seconds(beat_seconds), [&] { return ended; }))
                if (of.stands()) ::utimensat(of.file_.from(), of.file_.relative(), nullptr, AT_SYMLINK_NOFOLLOW);
        });
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
    }
    ~Heart()
    {
        {
            const std::lock_guard lock(mutex);
            ended = true;
        }
        ends.notify_all();
        thread.join();
    }
};

Ownership::Ownership(const Place& directory, const std::function<void(const std::string&)>& say)
    : directory_(directory), file_(directory / file_name)
{
    ensure(directory.held(), "only a held directory can be owned");
    Owner me = Owner::self();
    me.directory = identity(directory).number;
    mine_ = text_of(me);
    bool said = false;
    const auto poll_interval = std::chrono::milliseconds(500);
    std::optional<double> first_beat;
    for (;;) {
        std::optional<Found> found;
        {
            const Turn turn(directory);
            found = find(file_);
            if (found) {
                Life life = life_of(*found, directory);
                if (life == Life::Alive) refuse(directory, *found, true);
                if (life == Life::Unknown) {
                    if (first_beat && found->beat != *first_beat) refuse(directory, *found, false);
                    first_beat = found->beat;
                    if (clock_of(directory) - found->beat > dead_after_seconds) life = Life::Dead;
                }
                if (life == Life::Dead) {
                    bury(directory, file_, *found);
                    found.reset();
                }
            }
            if (!found && make(file_, mine_)) break;
            if (!found) continue; // another was quicker: who is it?
        }
        if (!said)
            say(fmt::format("{}: {} wrote into this directory; waiting up to {} s for a sign that it still lives", directory.string(),
                            found->owner ? found->owner->words() : "somebody", dead_after_seconds));
        said = true;
        std::this_thread::sleep_for(poll_interval);
    }
    heart_ = std::make_unique<Heart>(*this);
}

Ownership::~Ownership()
{
    heart_.reset();
    if (stands()) ::unlinkat(file_.from(), file_.relative(), 0);
}

bool Ownership::stands() const
{
    try {
        const auto found = find(file_);
        return found && found->text == mine_;
    } catch (const IoFailed&) {
        return false;
    }
}

bool Ownership::lost() const
{
    auto found = find(file_);
    if (!found && make(file_, mine_)) return false; // removed by hand
    if (!found) found = find(file_);
    return !found || found->text != mine_;
}

void Ownership::refuse_if_owned(const Place& directory)
{
    const auto found = find(directory / file_name);
    if (found && life_of(*found, directory) == Life::Alive) refuse(directory, *found, true);
}

} // namespace kuzure::io
