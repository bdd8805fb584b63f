#include "solver/app/study/child.hpp"
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/format.h>
#include <string_view>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace kuzure::study {
namespace {
volatile std::sig_atomic_t stop_signal = 0;
volatile std::sig_atomic_t child_pid = 0;
void pass_on(int signal)
{
    stop_signal = signal;
    if (child_pid > 0) kill(pid_t(child_pid), SIGTERM);
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

ChildResult run_child(const std::vector<std::string>& arguments, const io::Path& log)
{
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
    std::vector<char*> env, argv;
    for (auto& e : kept) env.push_back(e.data());
    env.push_back(nullptr);
    std::vector<std::string> words{"kuzure"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    for (auto& w : words) argv.push_back(w.data());
    argv.push_back(nullptr);

    const pid_t pid = fork();
    if (pid == 0) {
        const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
        if (out >= 0) dup2(out, 1), dup2(out, 2);
        const int none = open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (none >= 0) dup2(none, 0);
        execve("/proc/self/exe", argv.data(), env.data());
        _exit(127);
    }
    if (pid < 0) throw IoFailed(fmt::format("starting kuzure run failed: {}", io::cause(log, errno)));
    child_pid = pid;
    if (stop_signal) kill(pid, SIGTERM); // it came before the child did
    int status = 0;
    struct rusage used = {};
    while (wait4(pid, &status, 0, &used) < 0 && errno == EINTR) {}
    child_pid = 0;
    ChildResult r;
    r.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    r.core_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
    r.stopped = stop_signal != 0;
    return r;
}

} // namespace kuzure::study
