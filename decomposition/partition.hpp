#pragma once
// Who gets which block of space: a graph of the blocks that hold soil, weighted by work and by halo bytes,
// cut into parts of equal work with little halo. Serial and without MPI, so `kuzure scale` cuts for any number of ranks.
#include "solver/core/mix.hpp"
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kuzure {

/// Name and version of the library that cuts graphs.
std::string partitioner_library();

/// Position of a block in the grid of blocks, by axis.
using Block = std::array<std::int32_t, 3>;

/// Blocks reach from -block_limit to block_limit - 1 on each axis.
inline constexpr std::int32_t block_limit = 1 << 20;
/// True if a block lies there.
inline bool within_limit(const Block& b)
{
    return std::ranges::all_of(b, [](std::int32_t c) { return c >= -block_limit && c < block_limit; });
}

/// A block's position as one number. Only for blocks within the limit.
inline std::uint64_t key_of(const Block& b)
{
    std::uint64_t k = 0;
    for (const auto c : b) k = k << 21 | std::uint64_t(c + block_limit);
    return k;
}

/// A block's position within the periods (blocks by axis; 0: open).
inline Block wrapped(Block b, const std::array<std::int32_t, 3>& period)
{
    for (int a = 0; a < 3; ++a) {
        if (!period[a]) continue;
        b[a] %= period[a];
        if (b[a] < 0) b[a] += period[a];
    }
    return b;
}

/// From blocks to their index in a list. A table of slots, half of them empty at least, where a block is at the first free one from
/// where its key is mixed to: a cut looks at the 26 blocks around each, of which a std::unordered_map would make its greatest part.
class BlockIndex {
public:
    void reserve(std::size_t n)
    {
        std::size_t size = 16;
        while (size < 2 * n) size *= 2;
        if (size <= slot_.size()) return;
        std::vector<Slot> old(size);
        old.swap(slot_);
        for (const Slot& p : old)
            if (p.value >= 0) slot_[where(p.key)] = p;
    }
    /// Values are not negative.
    void set(const Block& b, int value)
    {
        reserve(count_ + 1);
        Slot& p = slot_[where(key_of(b))];
        count_ += p.value < 0;
        p = {key_of(b), value};
    }
    /// The value set for this block, or -1.
    int operator[](const Block& b) const { return of_key(key_of(b)); }
    int of_key(std::uint64_t key) const { return slot_.empty() ? -1 : slot_[where(key)].value; }

private:
    struct Slot {
        std::uint64_t key = 0;
        int value = -1;
    };
    /// The slot of this key, or the empty one where it belongs.
    std::size_t where(std::uint64_t key) const
    {
        std::size_t k = mix(key) & (slot_.size() - 1);
        while (slot_[k].value >= 0 && slot_[k].key != key) k = (k + 1) & (slot_.size() - 1);
        return k;
    }
    std::vector<Slot> slot_;
    std::size_t count_ = 0;
};

/// What a block costs: `work` in any unit (seconds, pairs x cost), and its soil particles.
struct BlockWork {
    Block block;
    double work;
    double particles;
};

/// How blocks touch: blocks per period of each axis (0: open), the halo's reach in blocks per axis, and the
/// bytes of a ghost's record.
struct BlockGrid {
    std::array<std::int32_t, 3> period{0, 0, 0};
    std::array<double, 3> reach{0.25, 0.25, 0.25};
    double ghost_bytes = 128;
};

/// The occupied blocks, in lexicographic order, and their links to the 26 around them (across periodic axes too).
struct BlockGraph {
    struct Link {
        std::int32_t block;           // the neighbour
        std::array<std::int8_t, 3> d; // where it lies: -1, 0, 1 on each axis
        double bytes;                 // of halo, both ways, if different ranks own the two
    };
    BlockGrid grid;
    std::vector<Block> block;
    std::vector<double> work;
    std::vector<double> particles;
    std::vector<std::size_t> first; // links of block b: first[b] .. first[b + 1]
    std::vector<Link> link;

    int size() const { return int(block.size()); }
    std::span<const Link> links(int b) const { return {link.data() + first[b], first[b + 1] - first[b]}; }
};
/// Sums equal blocks (in the order given) and links neighbours. Throws Broken on a block beyond block_limit,
/// on a work or particle count that is negative or not finite, and on a block outside its period.
BlockGraph block_graph(std::span<const BlockWork>, const BlockGrid& = {});

/// Throws Broken on a block that block_graph() refuses.
void check_block(const BlockWork&, const BlockGrid&);
/// Appends the links of block b to those of the graph's blocks that the index knows.
void append_links(const BlockGraph&, const BlockIndex&, int b, std::vector<BlockGraph::Link>&);

/// max/mean of work below which only the halo counts.
inline constexpr double good_balance = 1.03;

enum class Method { Metis, Hilbert };
const char* name(Method);

/// What a cut is worth. Sizes are estimates from the blocks' particle counts.
struct CutReport {
    int parts = 0, blocks = 0;
    double imbalance = 1;          // max/mean of the parts' work (empty parts count)
    double cut_bytes = 0;          // halo bytes per refresh, over all parts
    double seconds = 0;            // to build the graph and cut it
    std::vector<double> work;      // of each part
    std::vector<double> particles; // owned by each part
    std::vector<double> ghosts;    // of each part, its own periodic images included
    std::vector<int> peers;        // parts that each part sends to
    std::vector<int> pieces;       // of each part: sets of its blocks that do not touch each other
};
/// Looks at a given cut: part[b] in 0 .. parts-1.
CutReport describe(const BlockGraph&, std::span<const int> part, int parts);

/// Part of each block, 0 .. parts-1; the same for the same input. No part is empty unless parts outnumber the
/// blocks. `previous` (part of each block before, or -1) only permutes the labels, so that most work stays
/// where it was. Metis: the best of several cuts by METIS 5, evened out; where none is better, the Hilbert
/// curve's. Serial: for the start, a restart, and where even_out() leaves too much.
std::vector<int> partition(const BlockGraph&, int parts, Method = Method::Metis, const std::vector<int>* previous = nullptr);

/// A cut with what it was made from.
struct BlockCut {
    BlockGraph graph;
    std::vector<int> owner; // of each block of the graph
    CutReport report;       // its seconds are left to the caller
};
/// Cuts blocks listed by several ranks: equal blocks add up, and a part keeps the label of the rank that listed most of
/// its work. Without listers labels are free: parts of neighbouring numbers lie near each other. Throws as block_graph().
BlockCut cut_blocks(std::span<const BlockWork> listed, std::span<const int> lister, const BlockGrid&, int parts, Method = Method::Metis);

/// Index of a point of the grid 0 .. 2^bits - 1 along the Hilbert curve. Skilling, AIP Conf. Proc. 707 (2004) 381.
std::uint64_t hilbert_index(std::array<std::uint32_t, 3> point, int bits);

} // namespace kuzure
