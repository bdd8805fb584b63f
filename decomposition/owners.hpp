#pragma once
// Blocks and who owns them, as one rank knows them: all of them while a cut of the whole domain arrives, else those around its own.
#include "decomposition/partition.hpp"
#include <algorithm>

namespace kuzure {

class BlockOwners {
public:
    BlockOwners() = default;
    /// Blocks in lexicographic order, wrapped, and the owner of each; `all`: there may be far ones.
    BlockOwners(std::vector<Block> blocks, std::vector<int> owners, bool all = true)
        : block_(std::move(blocks)), owner_(std::move(owners)), all_(all)
    {
    }

    /// Of a wrapped block: its owner; where it is not known, that of the nearest known block (largest difference of an axis,
    /// then distance, then lexicographic order). 0 where no block is known. Ranks that know different blocks may differ;
    /// who is asked next knows nearer ones, so what is sent on arrives.
    int owner_of(const Block&, const std::array<std::int32_t, 3>& period) const;
    /// Forgets what is more than two blocks away from all of a rank's own.
    void keep_neighbourhood(int rank, const std::array<std::int32_t, 3>& period);

    std::span<const Block> blocks() const { return block_; }
    std::span<const int> owners() const { return owner_; }

private:
    /// Index of a wrapped block in block_, or -1.
    int index_of(const Block& b) const
    {
        const auto at = std::ranges::lower_bound(block_, b);
        return at != block_.end() && *at == b ? int(at - block_.begin()) : -1;
    }
    std::vector<Block> block_;
    std::vector<int> owner_;
    bool all_ = true; // may hold blocks that are far
};

} // namespace kuzure
