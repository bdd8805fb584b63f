#pragma once
// Wall time per phase of a run, on this rank. No MPI here: perf/report.hpp brings the ranks together.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>
#include <utility>

namespace kuzure {

/// The rows of the timer report, in the order in which they are printed.
enum class Phase {
    // Once
    Setup,
    Partition,
    // Per rebuild of the lists
    Migrate,
    Sort,
    Ghosts,
    Lists,
    // Per step
    Move,
    HaloBegin,
    Interior,
    HaloWait,
    Rim,
    Reduce,
    Guard,
    // Output
    Snapshot,
    History,
    Maps,
    Checkpoint,
    Picture,
    // What encloses them all: its own row is the time in no other phase
    Total,
    Count
};
inline constexpr int n_phases = int(Phase::Count);

/// Names as they stand in timers.json and timers.txt.
inline constexpr std::array<std::string_view, n_phases> phase_names{
    "setup",     "partition", "migrate", "sort",     "ghosts",  "lists", "move",       "begin halo", "interior pairs", "wait for halo",
    "rim pairs", "reduce",    "guard",   "snapshot", "history", "maps",  "checkpoint", "picture",    "other"};
static_assert(std::ranges::none_of(phase_names, &std::string_view::empty), "every phase needs a name");

constexpr std::string_view name(Phase phase) { return phase_names[int(phase)]; }

/// Stopwatches of one rank, used by its main thread alone. Phases may nest: an inner phase stops the clock of
/// the one around it, so that the rows add up to the whole. One clock reading at the start of a phase and one at its end.
class Timers {
public:
    /// Run `work`, charge its time to `phase`, and hand back what it returns.
    template <class Work> decltype(auto) timed(Phase phase, Work&& work)
    {
        const Running running(*this, phase);
        return std::forward<Work>(work)();
    }
    /// Count what a phase computed and moved to and from memory: for Gflop/s and flop/byte.
    void did(Phase phase, double flops, double bytes)
    {
        flops_[int(phase)] += flops;
        bytes_[int(phase)] += bytes;
    }

    /// Time spent in a phase and in none inside it, s. For a phase that is running: until the last start or end of one.
    double seconds(Phase phase) const { return std::chrono::duration<double>(spent_[int(phase)]).count(); }
    std::int64_t calls(Phase phase) const { return calls_[int(phase)]; }
    double flops(Phase phase) const { return flops_[int(phase)]; }
    double bytes(Phase phase) const { return bytes_[int(phase)]; }
    /// Time in all phases together, s.
    double total() const
    {
        double sum = 0;
        for (int p = 0; p < n_phases; ++p) sum += seconds(Phase(p));
        return sum;
    }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr int outside = n_phases;

    struct Running {
        Running(Timers& t, Phase phase) : timers(t), around(t.turn_to(int(phase))) { ++t.calls_[int(phase)]; }
        ~Running() { timers.turn_to(around); }
        Running(const Running&) = delete;
        Running& operator=(const Running&) = delete;
        Timers& timers;
        int around;
    };
    /// Charge the time since the last turn to whatever ran, go on with `next`; returns what ran.
    int turn_to(int next)
    {
        const auto now = Clock::now();
        spent_[running_] += now - since_;
        since_ = now;
        return std::exchange(running_, next);
    }

    int running_ = outside;
    Clock::time_point since_ = Clock::now();
    std::array<Clock::duration, n_phases + 1> spent_{};
    std::array<std::int64_t, n_phases> calls_{};
    std::array<double, n_phases> flops_{}, bytes_{};
};

} // namespace kuzure
