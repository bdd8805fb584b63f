#pragma once
// What asks a run to stop or to keep a checkpoint: signals, the clock, a file STOP, a lost result directory.
#include "io/result_directory.hpp"
#include "solver/app/run/arguments.hpp"
#include "solver/core/wall_clock.hpp"
#include "solver/run/simulation.hpp"

namespace kuzure {

class StopRequests {
public:
    /// `start`: wall_clock() when this run began, unless the arguments name an earlier beginning.
    StopRequests(const Comm& comm, const RunArguments& a, const Scene& scene, const io::ResultDirectory& directory, double start)
        : root_(comm.rank() == 0), args_(a), interval_(60 * scene.output.checkpoint_minutes), directory_(directory),
          began_(a.began.value_or(start)), last_checkpoint_(wall_clock())
    {
    }
    /// What this rank asks of the step to come. The files are polled once a second, by rank 0.
    Requests now();
    /// A checkpoint was just written.
    void checkpoint_written() { last_checkpoint_ = wall_clock(); }

private:
    bool root_;
    const RunArguments& args_;
    double interval_; // s
    const io::ResultDirectory& directory_;
    double began_, last_checkpoint_, last_poll_ = 0; // s of wall_clock()
    bool by_file_ = false;
};

} // namespace kuzure
