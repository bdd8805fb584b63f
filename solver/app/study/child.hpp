#pragma once
// Children `kuzure run`: one that fails does not end the study, and its processor time is the system's own count.
#include "io/file.hpp"
#include <csignal>
#include <optional>
#include <string>
#include <sys/types.h>
#include <utility>
#include <vector>

namespace kuzure::study {

struct ChildResult {
    int exit_code = 0;       // of the program; 128 + signal if one ended it
    double core_seconds = 0; // user and system time of all its threads
    bool stopped = false;    // this program was asked to stop meanwhile
};
/// While it lives, a SIGINT or SIGTERM is remembered and passed on to the children that run, if some do: also between two children this
/// program is not ended by it. One at a time.
class StopRequest {
public:
    StopRequest();
    ~StopRequest();
    StopRequest(const StopRequest&) = delete;
    StopRequest& operator=(const StopRequest&) = delete;
    bool came() const;

private:
    struct sigaction before_int_ = {}, before_term_ = {};
};
/// Children at a time.
inline constexpr int most_children = 1024;
/// A child that runs beside this program; it is asked to stop (SIGTERM) where this program ends before it, however that ends.
class Child {
public:
    /// Starts this very program with other arguments, output into `log`. A StopRequest must live. Throws IoFailed where it cannot be
    /// started; at most `most_children` live. One that gives way lets its threads sleep where they wait for one another: on cores that
    /// others use as well, waiting awake is what takes the time.
    Child(const std::vector<std::string>& arguments, const io::Path& log, bool gives_way = false);
    Child(Child&& o) noexcept : pid_(std::exchange(o.pid_, -1)) {}
    Child& operator=(Child&&) = delete;
    /// Kills it, where it still runs.
    ~Child();
    /// What became of it, once, where it has ended; nothing while it runs. With `wait` not before it has ended.
    std::optional<ChildResult> ended(bool wait = false);
    void send(int signal) const;

private:
    pid_t pid_;
};
/// Runs this very program with other arguments, output into `log`, and waits. A StopRequest must live. Throws IoFailed.
ChildResult run_child(const std::vector<std::string>& arguments, const io::Path& log);

} // namespace kuzure::study
