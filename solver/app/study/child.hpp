#pragma once
// A child `kuzure run`: a point that fails does not end the study, and its processor time is the system's own count.
#include "io/file.hpp"
#include <csignal>
#include <string>
#include <vector>

namespace kuzure::study {

struct ChildResult {
    int exit_code = 0;       // of the program; 128 + signal if one ended it
    double core_seconds = 0; // user and system time of all its threads
    bool stopped = false;    // this program was asked to stop meanwhile
};
/// While it lives, a SIGINT or SIGTERM is remembered and passed on to the child that runs, if one does: also between two children this
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
/// Runs this very program with other arguments, output into `log`, and waits. A StopRequest must live. Throws IoFailed where it cannot be
/// started.
ChildResult run_child(const std::vector<std::string>& arguments, const io::Path& log);

} // namespace kuzure::study
