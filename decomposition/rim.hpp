#pragma once
// Which block a part can spare best: for the serial cut of all blocks and for a rank that knows only those around it.
#include "decomposition/partition.hpp"

namespace kuzure {

/// A block of the rim and the part that it should go to; no block where `block` is -1.
struct RimBlock {
    int block = -1, to = -1;
    double gain = 0; // bytes of halo towards the new part less those towards the old one
};

/// Of the `members` of part `from`, the block and the part that it touches with the largest gain, where may(block, part).
/// `ties` has a zero for every part, and has them again afterwards.
template <class May>
RimBlock best_rim_block(const BlockGraph& g, std::span<const int> part, int from, std::span<const int> members, std::vector<double>& ties,
                        May may)
{
    RimBlock best;
    for (const int b : members) {
        if (part[b] != from || g.work[b] <= 0) continue;
        for (const auto& l : g.links(b)) ties[part[l.block]] += l.bytes;
        for (const auto& l : g.links(b)) {
            const int q = part[l.block];
            if (q == from) continue;
            const double gain = ties[q] - ties[from];
            if ((best.block < 0 || gain > best.gain) && may(b, q)) best = {b, q, gain}; // asked last: it may cost much
        }
        for (const auto& l : g.links(b)) ties[part[l.block]] = 0;
    }
    return best;
}

} // namespace kuzure
