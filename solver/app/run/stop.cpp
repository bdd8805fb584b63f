#include "solver/app/run/stop.hpp"
#include "solver/app/cli/signals.hpp"

namespace kuzure {

Requests StopRequests::now()
{
    Requests asked;
    const double t = wall_clock();
    asked.stop = asked_to_stop() || (args_.max_minutes > 0 && t - began_ > 60 * args_.max_minutes);
    if (root_) {
        if (t - last_poll_ > 1) {
            last_poll_ = t;
            by_file_ = io::exists(directory_.stop()) || !directory_.owned() || (!args_.also_stop.empty() && io::exists(args_.also_stop));
        }
        asked.stop = asked.stop || by_file_;
        asked.checkpoint = t - last_checkpoint_ > interval_;
    }
    return asked;
}

} // namespace kuzure
