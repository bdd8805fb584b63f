#pragma once
// The order of this rank's particles and what lies around them: sort, ghosts, wall points, lists. Made anew when particles have
// moved so far that the lists may no longer hold everything in reach.
#include "decomposition/domain.hpp"
#include "perf/phases.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/run/cover.hpp"
#include "solver/run/memory_use.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

class Layout {
public:
    /// `origin`: of the columns, m; the scene and its filling must outlive it.
    Layout(const Scene&, const scene::Filling&, Vector origin);

    /// True where a particle may have moved further since the last sort than the lists allow (squared displacement, m^2).
    bool outgrown(double displacement2) const;
    /// Other walls or particles: nothing of what was built holds any more, nor that particles are those of the lists.
    void forget() { built_ = false, near_soil_.reset(); }
    /// Positions and origins of what left a period are taken back into it.
    void wrap_into_period(Particles&) const;
    /// The present positions are where particles are sorted from now on.
    void sort_at_present_positions(Particles&) const;
    /// Sorts by sorted_position; then ghosts, walls, lists, and the model's records. Pairs may have been nearer by `way` m in the step
    /// under way. Collective. Throws NumbersFailed.
    void rebuild(const Comm&, const Domain&, Particles&, std::span<const Material>, PairModel&, Timers&, double way);

    /// Decides whether a step's first stage prunes the lists anew and with which margin: particles may move by `way` m before the
    /// last stage, and by some more each step. Call it once a step.
    void prepare_lists(StepInput&, double way, double speed);
    /// What particles moved after the last stage, m.
    void moved(double way) { pruned_way_ += way; }

    ClusterLists& lists() { return lists_; }
    const ClusterLists& lists() const { return lists_; }
    Halo& halo() { return *halo_; }
    const std::optional<Halo>& made_halo() const { return halo_; }
    Index ghosts() const { return Index(ghost_id_.size()); }
    /// Where owned particles and ghosts were sorted, by record, m.
    Vector sorted(const Particles&, Index record) const;
    const std::vector<WallPoints>& walls() const { return walls_; }
    /// How often those were made anew.
    std::int64_t wall_renewals() const { return wall_renewals_; }
    /// How far lists and ghosts reach, m.
    double reach() const { return reach_; }
    bool built() const { return built_; }
    void add_bytes(MemoryUse&) const;

private:
    void exchange_ghosts(const Comm&, const Domain&, const Particles&, const PairModel&, const std::string& complaint);
    void renew_walls(const Particles&, PairModel&);
    /// Adds the points of a wall that moves as it stands now, those near the soil that are in no other wall.
    void add_moved_points(int wall);

    const Scene& scene_;
    const scene::Filling& filling_;
    Columns columns_;
    double reach_, skin_; // m
    ColumnSort sorted_, ghost_sorted_;
    Array<double> ghost_x_, ghost_y_, ghost_z_;
    Array<std::int64_t> ghost_id_;
    std::vector<std::int32_t> ghost_soil_;
    std::optional<Halo> halo_;
    ClusterLists lists_;
    std::vector<WallPoints> walls_;
    std::optional<Cover> near_soil_;       // where wall points were made
    std::vector<int> moving_;              // walls that events move
    std::vector<scene::Pose> moved_poses_; // for which walls are as they are
    std::int64_t wall_renewals_ = 0;
    // How far beyond the support the pruned lists reach, and an upper bound of any particle's displacement since they were made, m.
    double pruned_margin_ = 0, pruned_way_ = 0;
    bool built_ = false;
};

} // namespace kuzure
