#pragma once
// The blocks by which a scene is cut, and what each costs: counted from particles, which are those of the scene's start
// (computed, never stored) or of a state. Shared by the run and by `kuzure scale`, so both cut alike. No ranks here.
#include "decomposition/block_space.hpp"
#include "solver/core/particles.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"
#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace kuzure {

/// Blocks of soil a rank at least, where its soil is many enough: small enough to share work evenly, large enough for METIS.
inline constexpr int default_blocks_per_rank = 50;
/// The grid of blocks for so many ranks: edges of whole spacings, a whole number of blocks in a period.
BlockSpace block_space(const Scene&, const scene::Filling&, int ranks, int blocks_per_rank = default_blocks_per_rank);
/// A block and `margin` m around it.
scene::Box box_of(const BlockSpace&, const Block&, double margin);
/// Lower corner of the soil at the start, half a spacing before its first points, m.
Vector low_corner(const scene::Filling&, const Scene&);
/// Lengths of the box, m; 1 where there is none.
Vector period(const Scene&);
/// How far lists and ghosts reach, m: the support and its skin.
inline double list_reach(const Scene& s) { return s.support() * (1 + s.accuracy.skin); }

/// What a step of a set of particles consists of. Pairs are directed, soil i <- j closer than the support.
struct StepWork {
    std::int64_t particles = 0, soil_pairs = 0, wall_pairs = 0;
    // A wall pair and a particle's update in units of a soil pair: docs/performance.md
    static constexpr double wall = 2, particle = 11;
    double pairs() const { return double(soil_pairs) + wall * double(wall_pairs); }
    double total() const { return pairs() + particle * double(particles); }
    void add(const StepWork& o) { particles += o.particles, soil_pairs += o.soil_pairs, wall_pairs += o.wall_pairs; }
};

/// Soil by blocks, and what its neighbours are. Safe to ask from several threads at once.
class BlockSoil {
public:
    BlockSoil(const Scene&, const scene::Filling&, const BlockSpace&);
    virtual ~BlockSoil() = default;

    /// Blocks that may hold soil; every block that does is among them.
    virtual std::vector<Block> blocks() const = 0;
    /// Appends the points of a block inside the period, m.
    virtual void points(const Block&, std::vector<Vector>&) const = 0;

    /// What a block's step consists of.
    StepWork work(const Block&) const;

    /// A rank that needs particles of a block as ghosts, directly or across periods.
    struct Receiver {
        int owner;
        std::array<std::int8_t, 3> period_shift; // periods between the two
        std::int64_t particles;                  // particles within reach of it
    };
    struct HaloDemand {
        std::vector<Receiver> by;
        std::int64_t seen = 0; // particles that any rank needs as ghosts
    };
    /// Which ranks need particles of a block that `mine` owns as ghosts; owner_of gives -1 for a block without soil.
    HaloDemand halo_demand(const Block&, int mine, const std::function<int(const Block&)>& owner_of, double reach) const;

    const BlockSpace& space() const { return space_; }

protected:
    /// A text that two blocks share only if they and the blocks around them hold soil and walls at the same points relative
    /// to the block; empty where that is undefined.
    virtual std::string pattern_key(const Block&) const { return {}; }

    const Scene& scene_;
    const scene::Filling& filling_;
    const BlockSpace& space_;

private:
    struct Sight;
    class NearCounts;
    /// Visits the blocks around one, itself among them: visit(wrapped block, way there in blocks, periods crossed).
    template <class Visit> void around(const Block&, double reach, Visit visit) const;
    /// One block each way holds everything within reach.
    bool next_block_holds(double reach) const;
    StepWork count(const Block&) const;

    mutable std::mutex mutex_;
    mutable std::map<std::string, StepWork> work_of_;
    mutable std::map<std::string, std::int64_t> known_counts_;
};

/// The soil of a scene's start. Blocks that look alike are counted once, so any number of blocks costs little.
class StartSoil final : public BlockSoil {
public:
    using BlockSoil::BlockSoil;
    std::vector<Block> blocks() const override;
    void points(const Block&, std::vector<Vector>&) const override;

protected:
    std::string pattern_key(const Block&) const override;
};

/// The soil of a state: points in m, inside the periods. Throws NumbersFailed for a point that no block holds.
class StateSoil final : public BlockSoil {
public:
    StateSoil(const Scene&, const scene::Filling&, const BlockSpace&, std::vector<Vector>);
    std::vector<Block> blocks() const override { return block_; }
    void points(const Block&, std::vector<Vector>&) const override;

private:
    std::vector<Vector> x_; // by block
    std::vector<Block> block_;
    std::vector<std::size_t> first_;
    BlockIndex index_;
};

} // namespace kuzure
