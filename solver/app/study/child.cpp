#include "solver/app/study/child.hpp"
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/format.h>
#include <string_view>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace kuzure::study {
namespace {
volatile std::sig_atomic_t stop_signal = 0;
volatile std::sig_atomic_t child_pids[most_children] = {};
void pass_on(int signal)
{
    stop_signal = signal;
    for (const auto pid : child_pids)
        if (pid > 0) kill(pid_t(pid), SIGTERM);
}
/// The slot of a child among those that get signals; that of none (0) is a free one, or null.
volatile std::sig_atomic_t* slot_of(pid_t pid)
{
    for (auto& p : child_pids)
        if (p == std::sig_atomic_t(pid)) return &p;
    return nullptr;
}
} // namespace

StopRequest::StopRequest()
{
    stop_signal = 0;
    struct sigaction mine = {};
    mine.sa_handler = pass_on;
    sigaction(SIGINT, &mine, &before_int_), sigaction(SIGTERM, &mine, &before_term_);
}
StopRequest::~StopRequest() { sigaction(SIGINT, &before_int_, nullptr), sigaction(SIGTERM, &before_term_, nullptr); }
bool StopRequest::came() const { return stop_signal != 0; }

ChildResult run_child(const std::vector<std::string>& arguments, const io::Path& log) { return *Child(arguments, log).ended(true); }

Child::Child(const std::vector<std::string>& arguments, const io::Path& log, bool gives_way)
{
    if (!slot_of(0)) throw IoFailed(fmt::format("starting kuzure run failed: {} run already", most_children));
    // The child starts MPI anew: what this process's MPI left in the environment is not for it.
    std::vector<std::string> kept;
    for (char** e = environ; *e; ++e) {
        const std::string_view v(*e);
        bool ours = false;
        for (const char* head :
             {"KUZURE_MPI=", "PMIX_", "PMI_", "PRTE_", "OMPI_COMM_", "OMPI_MCA_ess", "OMPI_MCA_orte", "OMPI_UNIVERSE_", "OMPI_APP_CTX"})
            ours = ours || v.starts_with(head);
        if (!ours) kept.emplace_back(v);
    }
    if (gives_way && !std::getenv("OMP_WAIT_POLICY") && !std::getenv("GOMP_SPINCOUNT")) kept.emplace_back("OMP_WAIT_POLICY=passive");
    std::vector<char*> env, argv;
    for (auto& e : kept) env.push_back(e.data());
    env.push_back(nullptr);
    std::vector<std::string> words{"kuzure"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    for (auto& w : words) argv.push_back(w.data());
    argv.push_back(nullptr);

    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ == 0) {
        signal(SIGINT, SIG_DFL), signal(SIGTERM, SIG_DFL); // what came for it is not for the other children
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (getppid() != parent) _exit(127); // it ended in between
        const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
        if (out >= 0) dup2(out, 1), dup2(out, 2);
        const int none = open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (none >= 0) dup2(none, 0);
        execve("/proc/self/exe", argv.data(), env.data());
        _exit(127);
    }
    if (pid_ < 0) throw IoFailed(fmt::format("starting kuzure run failed: {}", io::cause(log, errno)));
    *slot_of(0) = std::sig_atomic_t(pid_);
    if (stop_signal) send(SIGTERM); // it came before the child did
}

Child::~Child()
{
    if (pid_ <= 0) return;
    send(SIGKILL);
    ended(true);
}

void Child::send(int signal) const
{
    if (pid_ > 0) kill(pid_, signal);
}

std::optional<ChildResult> Child::ended(bool wait)
{
    if (pid_ <= 0) return std::nullopt;
    int status = 0;
    struct rusage used = {};
    pid_t got = 0;
    while ((got = wait4(pid_, &status, wait ? 0 : WNOHANG, &used)) < 0 && errno == EINTR) {}
    if (got == 0) return std::nullopt;
    if (auto* slot = slot_of(pid_)) *slot = 0;
    pid_ = -1;
    ChildResult r;
    r.exit_code = got < 0 ? 127 : WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    r.core_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
    r.stopped = stop_signal != 0;
    return r;
}

} // namespace kuzure::study
