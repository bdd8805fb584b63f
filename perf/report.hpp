#pragma once
// Timers of all ranks as one table: timers.json and timers.txt.
#include "perf/machine.hpp"
#include "perf/phases.hpp"
#include "solver/core/team.hpp"
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kuzure {

/// What one rank had to do in one step. Bytes and messages are those it sends.
struct RankStep {
    std::int64_t soil = 0, pairs = 0, ghosts = 0, halo_bytes = 0, messages = 0;
};

/// What one rank has done in the time that its timers hold. Pairs are directed, soil i <- any j within 2 h.
struct WorkDone {
    std::int64_t steps = 0;          // the same on every rank
    std::int64_t particle_steps = 0; // soil particles owned, summed over the steps
    std::int64_t pairs = 0;
    std::int64_t asleep = 0;                   // of particle_steps: those in which the particle slept
    std::int64_t halo_bytes = 0, messages = 0; // sent to other ranks, once a step
    RankStep first_step{};                     // of these timers; of one rank, so without meaning in a sum
};

/// One phase over all ranks.
struct PhaseRow {
    double min = 0, mean = 0, max = 0; // s over the ranks
    std::int64_t calls = 0;            // the most of any rank
    double share = 0;                  // mean over the mean of the whole
    double flops = 0, bytes = 0;       // sums over the ranks
    /// 1e9 operations a second of all ranks while the slowest takes its time; 0 where nothing was counted.
    double gflops() const { return max > 0 ? flops / max * 1e-9 : 0; }
    /// 1e9 bytes a second, likewise.
    double gbytes() const { return max > 0 ? bytes / max * 1e-9 : 0; }
    /// Operations per byte moved; 0 where nothing was counted.
    double intensity() const { return bytes > 0 ? flops / bytes : 0; }
};

/// The timer report of a run.
struct PhaseReport {
    int ranks = 1, threads = 1;
    WorkDone work;      // steps; sums over the ranks of all others
    PhaseRow total;     // time in any phase
    PhaseRow pair_loop; // interior and rim together
    std::array<PhaseRow, n_phases> rows;
    std::vector<RankStep> first_step; // by rank
    std::optional<Machine> machine;   // set it, and both texts name the roofs

    /// The text of timers.json.
    std::string json() const;
    /// The text of timers.txt: one aligned row a phase that was entered, in the order of Phase.
    std::string text() const;
};

/// Bring the timers of all ranks together; collective, and the answer is the same on every rank. threads: of each rank.
PhaseReport phase_report(const Timers&, const WorkDone&, int threads, const Team&);

} // namespace kuzure
