#include "decomposition/owners.hpp"
#include <limits>
#include <tuple>
#include <unordered_set>

namespace kuzure {

int BlockOwners::owner_of(const Block& b, const std::array<std::int32_t, 3>& period) const
{
    if (block_.empty()) return 0;
    if (const int k = index_of(b); k >= 0) return owner_[k];

    // (largest difference, squared distance, lexicographic position): the least wins.
    using Rank = std::tuple<std::int64_t, std::int64_t, int>;
    const auto rank_of = [&](int k) {
        std::int64_t largest = 0, squared = 0;
        for (int a = 0; a < 3; ++a) {
            std::int64_t d = std::abs(std::int64_t(block_[k][a]) - b[a]);
            if (period[a]) d = std::min(d, period[a] - d);
            largest = std::max(largest, d);
            squared += d * d;
        }
        return Rank(largest, squared, k);
    };
    const Rank none(std::numeric_limits<std::int64_t>::max(), 0, 0);
    Rank best = none;
    constexpr int shells = 3; // looked up one by one; further away, the whole list is faster
    for (int s = 1; s <= shells && best == none; ++s)
        for (int i = -s; i <= s; ++i)
            for (int j = -s; j <= s; ++j)
                for (int l = -s; l <= s; l += std::abs(i) == s || std::abs(j) == s ? 1 : 2 * s) {
                    const Block near = wrapped({b[0] + i, b[1] + j, b[2] + l}, period);
                    const int k = index_of(near);
                    if (k >= 0) best = std::min(best, rank_of(k));
                }
    if (best == none)
        for (int k = 0; k < int(block_.size()); ++k) best = std::min(best, rank_of(k));
    return owner_[std::get<2>(best)];
}

void BlockOwners::keep_neighbourhood(int rank, const std::array<std::int32_t, 3>& period)
{
    if (!all_) return;
    std::unordered_set<std::uint64_t> near;
    for (std::size_t k = 0; k < block_.size(); ++k) {
        if (owner_[k] != rank) continue;
        const Block& b = block_[k];
        for (int i = -2; i <= 2; ++i)
            for (int j = -2; j <= 2; ++j)
                for (int l = -2; l <= 2; ++l) {
                    const Block there = wrapped({b[0] + i, b[1] + j, b[2] + l}, period);
                    if (within_limit(there)) near.insert(key_of(there));
                }
    }
    std::vector<Block> blocks;
    std::vector<int> owners;
    for (std::size_t k = 0; k < block_.size(); ++k)
        if (near.contains(key_of(block_[k]))) blocks.push_back(block_[k]), owners.push_back(owner_[k]);
    *this = {std::move(blocks), std::move(owners), false}; // lists as long as what is kept
}

} // namespace kuzure
