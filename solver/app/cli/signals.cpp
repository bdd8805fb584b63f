#include "solver/app/cli/signals.hpp"
#include <csignal>
#include <ctime>
#include <fcntl.h>
#include <unistd.h>

namespace kuzure {
namespace {

constexpr int requests[] = {SIGTERM, SIGINT, SIGHUP, SIGUSR1};
volatile std::sig_atomic_t asked = 0; // the last signal
volatile std::sig_atomic_t interrupted_at = -1;

/// Tenths of a second, modulo what a sig_atomic_t holds.
std::sig_atomic_t tenths()
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return std::sig_atomic_t((t.tv_sec * 10 + t.tv_nsec / 100000000) & 0x3fffffff);
}

void on_request(int signal)
{
    if (signal == SIGINT) {
        // One Ctrl-C may come twice: from the terminal and from mpirun.
        const auto now = tenths();
        if (interrupted_at >= 0 && now - interrupted_at >= 5) {
            std::signal(SIGINT, SIG_DFL);
            raise(SIGINT); // pending until this handler returns
            return;
        }
        if (interrupted_at < 0) interrupted_at = now;
    }
    asked = signal;
}

} // namespace

void listen_to_signals()
{
    for (int fd = 0; fd <= 2; ++fd)
        if (fcntl(fd, F_GETFD) == -1) static_cast<void>(open("/dev/null", fd == 0 ? O_RDONLY : O_WRONLY)); // the lowest free number: fd
    struct sigaction ours = {};
    ours.sa_handler = on_request;
    sigemptyset(&ours.sa_mask);
    ours.sa_flags = SA_RESTART;
    for (const int s : requests) sigaction(s, &ours, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

void stop_listening()
{
    for (const int s : requests) std::signal(s, SIG_DFL);
    std::signal(SIGPIPE, SIG_DFL);
    if (asked) raise(asked);
}

bool asked_to_stop() { return asked != 0; }

} // namespace kuzure
