#pragma once
// Which block a part can spare best: for the serial cut of all blocks and for a rank that knows only those around it.
#include "decomposition/partition.hpp"
#include <algorithm>

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

/// The same for many choices one after the other, of which each changes little: what each block could do is kept, and only that of the
/// neighbours of a block that goes is judged anew.
class RimChoices {
public:
    /// All must outlive it. `ties` as above.
    RimChoices(const BlockGraph& g, std::span<const int> part, int from, std::span<const int> members, std::vector<double>& ties)
        : g_(g), part_(part), from_(from), members_(members), ties_(ties), choices_(members.size()), number_(std::size_t(g.size()), -1)
    {
        for (std::size_t k = 0; k < members.size(); ++k) number_[members[k]] = int(k), judge(k);
    }
    template <class May> RimBlock best(May may) const
    {
        RimBlock best;
        for (std::size_t k = 0; k < members_.size(); ++k)
            for (const auto& c : choices_[k])
                if ((best.block < 0 || c.gain > best.gain) && may(members_[k], c.to)) best = {members_[k], c.to, c.gain};
        return best;
    }
    /// After part[b] of a member has changed.
    void changed(int b)
    {
        judge(std::size_t(number_[b]));
        for (const auto& l : g_.links(b))
            if (const int k = number_[l.block]; k >= 0) judge(std::size_t(k));
    }

private:
    struct Choice {
        int to;
        double gain;
    };
    void judge(std::size_t k)
    {
        const int b = members_[k];
        auto& mine = choices_[k];
        mine.clear();
        if (part_[b] != from_ || g_.work[b] <= 0) return;
        for (const auto& l : g_.links(b)) ties_[part_[l.block]] += l.bytes;
        for (const auto& l : g_.links(b)) {
            const int q = part_[l.block];
            if (q != from_ && std::ranges::find(mine, q, &Choice::to) == mine.end()) mine.push_back({q, ties_[q] - ties_[from_]});
        }
        for (const auto& l : g_.links(b)) ties_[part_[l.block]] = 0;
    }
    const BlockGraph& g_;
    std::span<const int> part_;
    int from_;
    std::span<const int> members_;
    std::vector<double>& ties_;
    std::vector<std::vector<Choice>> choices_; // of each member, in the order of its links
    std::vector<int> number_;                  // of each block among the members, or -1
};

} // namespace kuzure
