#pragma once
// Later cuts: ranks that touch hand each other blocks until all have the same work. Nothing is gathered: a rank knows
// its own blocks and those up to two further, and of the others only sums, maxima and bounding boxes.
#include "decomposition/owners.hpp"
#include "decomposition/rank_group.hpp"

namespace kuzure {

/// What evening out found and did; the same on every rank.
struct EvenReport {
    double before = 1, after = 1; // max/mean of the ranks' work
    double mean = 0;              // work of a rank
    double halo = 0;              // bytes of halo between blocks of different ranks, per byte of owned particles' records
    std::int64_t blocks = 0;      // in all
    std::int64_t moved = 0;       // of them
    int iterations = 0;           // exchanges of one number between peers
    int rounds = 0;               // of offers
    double busy = 0;              // s, of the rank that computed longest
    double seconds = 0;           // s, waiting included
};

/// Work flows from heavier to lighter ranks: with L the Laplacian of the graph of ranks whose blocks touch, conjugate gradients
/// solve L p = work - mean, and p's difference should go across each pair (the least flow that evens out: Hu, Blake, Emerson,
/// Concurrency 10 (1998) 467). Ranks offer blocks of their rim accordingly, the best for the halo first; then those above the
/// mean offer single blocks to lighter peers, each of which lowers the sum of squared loads. A block moves once, to a rank
/// that touched its old owner before; no part falls into more pieces, loses its last block, or gets one that does not touch it.
/// `listed`: of each rank here the blocks of its particles, wrapped, whoever owns them; of two ranks that take a block for
/// their own, who has more of its work keeps it. `known`: what each rank here knows, and then must know. Throws Broken on
/// every rank as block_graph() does.
EvenReport even_out(const RankGroup&, const std::vector<std::vector<BlockWork>>& listed, const BlockGrid&, std::vector<BlockOwners>& known);

} // namespace kuzure
