#pragma once
// Who owns what: space in blocks, blocks to ranks. Everything here happens at rebuild steps that all ranks
// agree on; a cut decides who computes a particle, never a bit of the result.
#include "decomposition/block_space.hpp"
#include "decomposition/comm.hpp"
#include "decomposition/even_out.hpp"
#include "decomposition/halo.hpp"
#include "solver/core/particles.hpp"
#include <string>

namespace kuzure {

/// How a cut weighs the halo: its reach in m (0: a quarter of a block) and the bytes of a ghost's record.
struct HaloCost {
    double reach = 0;
    double ghost_bytes = 128;
};

/// Whether a cut leaves a part's work with the rank that holds it, or no rank holds any yet.
enum class Labels { Kept, Free };

class Domain {
public:
    /// Blocks of this size from this origin (m); on a periodic axis the period must hold a whole number of
    /// blocks, else BadInput.
    Domain(const Comm& comm, Vector origin, Vector block_size, std::array<bool, 3> periodic, Vector period_low, Vector period_length)
        : Domain(comm, BlockSpace(origin, block_size, periodic, period_low, period_length))
    {
    }
    Domain(const Comm& comm, const BlockSpace& space) : comm_(comm), space_(space) {}

    /// BlockSpace::block_of().
    Block block_of(Vector x) const { return space_.block_of(x); }

    /// Cuts anew; collective. `mine` lists what this rank's blocks cost; equal blocks of several ranks add
    /// up. Labels stay with the rank that listed most of a part's work, or are free (cut_blocks()). The report is the same
    /// on every rank, its seconds the longest of all ranks.
    CutReport cut(std::span<const BlockWork> mine, Method = Method::Metis, HaloCost = {}, Labels = Labels::Kept);

    /// Later cuts: hands blocks from heavier ranks to lighter ones that touch them (even_out()); collective. `mine` lists
    /// what the blocks of this rank's particles cost, whoever owns them. Particles are where migrate() leaves them. Throws
    /// Broken before cut().
    EvenReport even_out(std::span<const BlockWork> mine, HaloCost = {});
    /// After cut() and the migration that follows: keeps the owners of blocks up to two around this rank's own. From here
    /// on nothing that a rank holds grows with the whole scene.
    void keep_neighbourhood() { known_.keep_neighbourhood(comm_.rank(), space_.period()); }

    /// Of any block: where no soil was at the last cut, the owner of the nearest block that had some (BlockOwners). The same
    /// on every rank until keep_neighbourhood(); from then on for blocks around this rank's own. Throws Broken before cut().
    int owner_of(const Block&) const;
    int owner_of(Vector x) const { return owner_of(block_of(x)); }

    struct Moved {
        std::int64_t left = 0, arrived = 0;
    };
    /// Sends every particle to its owner; collective. Those that stay keep their order, arrivals follow by rank.
    Moved migrate(Particles&) const;

    /// Who needs to see this rank's particles; collective. Every particle within `reach` (m) of a particle of
    /// another rank, or of any particle across a period, is sent there, whoever owns it and whether or not
    /// its block held soil at the last cut. On periodic axes positions must lie in [low, low + length] and reach <= length.
    /// Throws NumbersFailed on every rank with the words of the highest one that complains: of a particle that is lost, or as `complaint`
    /// says of what went wrong before; Broken where positions are not as said.
    HaloPlan plan_halo(View<Shape::Vector, const double> x, Index n, double reach, const std::string& complaint = {}) const;
    HaloPlan plan_halo(const Particles& p, double reach) const { return plan_halo(p[field::position], p.size(), reach); }
    /// How often all ranks told all others where their soil is, for plan_halo().
    std::int64_t tellings() const { return surroundings_.tellings; }

    const Comm& comm() const { return comm_; }
    /// Blocks that held soil at the last cut, in lexicographic order, and their owners: all, or those that this rank knows.
    std::span<const Block> blocks() const { return known_.blocks(); }
    std::span<const int> owners() const { return known_.owners(); }
    /// What this rank knows of owners, to go back to when particles go back to where they were.
    const BlockOwners& known() const { return known_; }
    void restore_owners(BlockOwners earlier) { known_ = std::move(earlier); }
    /// Blocks per period by axis; 0 where open.
    const std::array<std::int32_t, 3>& period() const { return space_.period(); }
    const BlockSpace& space() const { return space_; }

private:
    /// What a rank looks at before it plans a halo: its particles' blocks (nothing where there is no other rank and no period), the largest
    /// of their coordinates (m), a particle that no block holds, or -1, and whether any lies outside its period.
    struct Surveyed {
        std::vector<std::uint64_t> key;
        double largest = 0;
        Index lost = -1;
        bool outside = false;
    };
    Surveyed survey(View<Shape::Vector, const double> x, Index n, bool keys) const;
    /// Ranks whose soil may be near this rank's, and the box around the soil of each when it was last told. From then on all ranks only
    /// agree on how far any soil has left its rank's box: what was further apart than `held` on some axis still is, by twice that less.
    struct Surroundings {
        Bounds told = Bounds::none(); // this rank's own box
        double held = -1;             // m; < 0: nothing was told yet
        std::vector<std::pair<int, Bounds>> near;
        std::int64_t tellings = 0;
    };
    void tell_all(const Bounds& mine, double reach, std::span<const std::array<double, 3>> shifts) const;
    /// The one reduction before a halo: who complains (thrown on all), who has soil where none may be; returns the largest coordinate or
    /// period of any rank, m, and in `grown` how far soil has left what was told.
    double agree(const Surveyed&, View<Shape::Vector, const double> x, const Bounds& whole, const std::string& complaint,
                 double& grown) const;
    /// Sends each rank that may be near the boxes of this rank's blocks that are in its reach; theirs, by rank.
    std::vector<MessageOf<Bounds>> exchange_boxes(const std::vector<Bounds>&, std::span<const std::array<double, 3>> shifts, double reach2,
                                                  double grown) const;
    /// The same NumbersFailed on every rank, if a particle of any rank is lost; collective.
    void stop_if_lost(bool mine, Vector x) const;

    const Comm& comm_;
    BlockSpace space_;
    BlockOwners known_;
    bool is_cut_ = false;
    mutable Surroundings surroundings_; // saves messages; no plan depends on it
};

} // namespace kuzure
