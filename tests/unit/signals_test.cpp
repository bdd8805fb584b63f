// What the system tells a program asks it to stop and never ends it without its knowing.
#include "solver/app/cli/signals.hpp"
#include <cerrno>
#include <csignal>
#include <fcntl.h>
#include <functional>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace kuzure;

namespace {

/// How a child ends: its exit code, or 128 and the signal.
int ends(const std::function<int()>& child)
{
    const pid_t pid = fork();
    if (pid == 0) _exit(child());
    int status = 0;
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

} // namespace

TEST(Signals, RequestsAreHeard)
{
    for (const int s : {SIGTERM, SIGINT, SIGHUP, SIGUSR1})
        EXPECT_EQ(ends([s] {
                      listen_to_signals();
                      if (asked_to_stop()) return 1;
                      raise(s);
                      return asked_to_stop() ? 0 : 2;
                  }),
                  0)
            << s;
}

TEST(Signals, ASecondInterruptEnds)
{
    // One Ctrl-C may come twice. A machine that does something else for half a second in between makes two of it: not five times in a row.
    int code = 128 + SIGINT;
    for (int tries = 0; tries < 5 && code == 128 + SIGINT; ++tries)
        code = ends([] {
            listen_to_signals();
            raise(SIGINT), raise(SIGINT);
            return asked_to_stop() ? 0 : 2;
        });
    EXPECT_EQ(code, 0);
    EXPECT_EQ(ends([] {
                  listen_to_signals();
                  raise(SIGINT);
                  usleep(700000);
                  raise(SIGINT);
                  return 0;
              }),
              128 + SIGINT);
}

TEST(Signals, CommandsThatDoNotListenEnd)
{
    EXPECT_EQ(ends([] {
                  listen_to_signals();
                  stop_listening();
                  raise(SIGTERM);
                  return 0;
              }),
              128 + SIGTERM);
    EXPECT_EQ(ends([] {
                  listen_to_signals();
                  raise(SIGTERM);
                  stop_listening(); // what came before counts
                  return 0;
              }),
              128 + SIGTERM);
}

TEST(Signals, AWriteThatCannotBeFailsAndNoMore)
{
    EXPECT_EQ(ends([] {
                  listen_to_signals();
                  int ends_of[2];
                  if (pipe(ends_of) != 0) return 1;
                  close(ends_of[0]);
                  return write(ends_of[1], "x", 1) < 0 && errno == EPIPE ? 0 : 2;
              }),
              0);
    EXPECT_EQ(ends([] {
                  listen_to_signals();
                  raise(SIGXFSZ);
                  return 0;
              }),
              0);
}

TEST(Signals, ClosedStreamsDoNotBecomeFiles)
{
    EXPECT_EQ(ends([] {
                  close(0), close(1), close(2);
                  listen_to_signals();
                  return open("/dev/zero", O_RDONLY) > 2 ? 0 : 1;
              }),
              0);
}
