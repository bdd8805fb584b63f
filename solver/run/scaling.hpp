#pragma once
// What a cut for any number of ranks gives each of them, counted on one machine: the same blocks, weights and cut as a
// run's. Serial in ranks, parallel in threads, no MPI.
#include "solver/run/blocks.hpp"

namespace kuzure {

/// The costs of blocks, in their order; blocks without soil are left out.
struct WeighedBlocks {
    std::vector<BlockWork> listed;
    std::vector<StepWork> work; // of each in `listed`
};
/// Counted with all threads. Blocks first, first + stride, ... of the soil's, so that ranks can share the counting.
WeighedBlocks weigh(const BlockSoil&, std::size_t first = 0, std::size_t stride = 1);

/// What one rank has to do in a step.
struct RankShare {
    StepWork work;
    std::int64_t seen = 0;   // own particles that others need: their clusters wait for ghosts
    std::int64_t ghosts = 0; // own periodic images included
    std::int64_t sent = 0;   // ghosts over MPI
    int messages = 0;        // sent over MPI
};
/// One message of a step.
struct HaloMessage {
    int from, to;
    std::int64_t ghosts;
};
struct CutShare {
    int blocks = 0;              // that hold soil
    std::vector<RankShare> rank; // by rank
    int scattered = 0;           // ranks whose blocks do not hang together
    std::vector<HaloMessage> message;
    double weigh_seconds = 0, cut_seconds = 0;

    StepWork sum() const;
    /// Largest over mean: of the ranks' pair work, and of their work with the particles' own.
    double pair_balance() const;
    double balance() const;
    /// Ghosts per owned particle.
    double ghost_share() const;
};
/// Cuts as a run on so many ranks would: of a start, or of a state. The blocks must be those of block_space() for as many ranks.
CutShare share_out(const BlockSoil&, int ranks, double reach, double ghost_bytes, Method = Method::Metis);

} // namespace kuzure
