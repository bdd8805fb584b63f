#include "solver/run/layout.hpp"
#include "solver/run/blocks.hpp"
#include "solver/scene/motion.hpp"

namespace kuzure {

Layout::Layout(const Scene& scene, const scene::Filling& filling, Vector origin)
    : scene_(scene), filling_(filling), columns_(Columns::of(scene, origin)), reach_(list_reach(scene)),
      skin_(scene.support() * scene.accuracy.skin), moving_(scene::moving_walls(scene))
{
}

bool Layout::outgrown(double displacement2) const { return !built_ || 2 * std::sqrt(displacement2) > skin_ * (1 - 1e-6); }

void Layout::wrap_into_period(Particles& p) const
{
    if (!scene_.space.low) return;
    const Vector lo = *scene_.space.low, hi = *scene_.space.high;
    const auto wrap = [&](int axis, double a, double b) {
        if (!scene_.space.periodic[axis]) return;
        double* x = p[field::position].column[axis];
        double* o = p[field::origin].column[axis];
        for (Index i = 0; i < p.size(); ++i) {
            const double periods = std::floor((x[i] - a) / (b - a));
            if (periods == 0) continue;
            x[i] -= periods * (b - a), o[i] -= periods * (b - a);
            x[i] = std::min(std::max(x[i], a), b);
        }
    };
    wrap(0, lo.x, hi.x), wrap(1, lo.y, hi.y), wrap(2, lo.z, hi.z);
}

void Layout::sort_at_present_positions(Particles& p) const
{
    const Index n = p.size();
    const auto x = p[field::position], to = p[field::sorted_position];
    for (int c = 0; c < 3; ++c)
#pragma omp parallel for schedule(static)
        for (Index i = 0; i < n; ++i) to.column[c][i] = x.column[c][i];
}

void Layout::rebuild(const Comm& comm, const Domain& domain, Particles& p, std::span<const Material> soils, PairModel& model,
                     Timers& timers, double way)
{
    reach_ = std::max(list_reach(scene_), scene_.support() + way * (1 + 1e-6));
    std::string complaint;
    try {
        timers.timed(Phase::Sort, [&] {
            const auto x = p[field::sorted_position];
            sorted_ = sort_into_columns(columns_, x.column[0], x.column[1], x.column[2], p[field::id].column[0], p.size());
            p.gather(sorted_.order);
            sorted_.order = {};
        });
        // every column read and written once
        timers.did(Phase::Sort, 0, 2.0 * double(p.bytes_per_particle()) * double(p.size()));
    } catch (const NumbersFailed& e) {
        complaint = e.what(); // all ranks fail together, when the halo is planned
    }
    timers.timed(Phase::Ghosts, [&] {
        exchange_ghosts(comm, domain, p, model, complaint);
        renew_walls(p, model);
    });
    timers.timed(Phase::Lists, [&] {
        const auto x = std::as_const(p)[field::sorted_position];
        const SortedPoints owned{x.column[0], x.column[1], x.column[2], std::as_const(p)[field::id].column[0], &sorted_, p.size()};
        const SortedPoints around{ghost_x_.data(), ghost_y_.data(), ghost_z_.data(), ghost_id_.data(), &ghost_sorted_, ghosts()};
        lists_.build(columns_, owned, around, walls_, reach_, model.cluster_width());
        model.make_records(p, soils, ghost_soil_);
    });
    // Of an entry that is kept: three differences, their squares and two sums; four bytes. Of a particle: its position and record.
    const auto entries = double(lists_.entries() + lists_.wall_entries());
    timers.did(Phase::Lists, 8 * entries, 4 * entries + double(p.size()) * double(24 + model.record_bytes() / 2));
    pruned_margin_ = 0;
    built_ = true;
}

void Layout::exchange_ghosts(const Comm& comm, const Domain& domain, const Particles& p, const PairModel& model,
                             const std::string& complaint)
{
    std::vector<std::size_t> ghost_bytes;
    for (const Stage& s : model.stages()) ghost_bytes.push_back(s.ghost_bytes);
    auto plan = domain.plan_halo(p[field::sorted_position], p.size(), reach_, complaint);
    std::vector<Ghost> arrived;
    halo_.emplace(comm, std::move(plan), ghost_bytes, p, arrived);
    const auto n = Index(arrived.size());
    Array<double> x(n), y(n), z(n);
    Array<std::int64_t> id(n);
    for (Index k = 0; k < n; ++k)
        x[k] = arrived[k].sorted_position.x, y[k] = arrived[k].sorted_position.y, z[k] = arrived[k].sorted_position.z,
        id[k] = arrived[k].id;
    ghost_sorted_ = sort_into_columns(columns_, x.data(), y.data(), z.data(), id.data(), n);
    for (auto* a : {&ghost_x_, &ghost_y_, &ghost_z_}) resize_anew(*a, std::size_t(n));
    resize_anew(ghost_id_, std::size_t(n)), resize_anew(ghost_soil_, std::size_t(n));
    std::vector<Index> slot(n);
    for (Index k = 0; k < n; ++k) {
        const Index from = ghost_sorted_.order[k];
        ghost_x_[k] = x[from], ghost_y_[k] = y[from], ghost_z_[k] = z[from], ghost_id_[k] = id[from];
        ghost_soil_[k] = arrived[from].soil;
        slot[from] = k;
    }
    halo_->assign_slots(slot);
    ghost_sorted_.order = {};
}

void Layout::renew_walls(const Particles& p, PairModel& model)
{
    if (scene_.walls.empty() || p.size() == 0) return;
    const double side = 2 * list_reach(scene_); // always the same, whatever the reach of these lists is
    const Cover needed(p, side, reach_);
    std::vector<scene::Pose> poses;
    for (const int w : moving_) poses.push_back(scene_.walls[std::size_t(w)].pose);
    if (near_soil_ && near_soil_->holds(needed) && poses == moved_poses_) return;
    moved_poses_ = std::move(poses);
    near_soil_.emplace(p, side, 4 * reach_);
    walls_.assign(scene_.walls.size(), {});
    for (std::size_t w = 0; w < walls_.size(); ++w) walls_[w].wall = int(w);
    // Walls repeat with the period as the soil does.
    const Vector step = period(scene_);
    const int px = scene_.space.periodic[0], py = scene_.space.periodic[1], pz = scene_.space.periodic[2];
    for (int a = -px; a <= px; ++a)
        for (int b = -py; b <= py; ++b)
            for (int c = -pz; c <= pz; ++c) {
                const Vector shift{a * step.x, b * step.y, c * step.z};
                near_soil_->for_each([&](Cover::Square square, const scene::Box& box) {
                    filling_.for_each_wall_in({box.low - shift, box.high - shift}, [&](std::int64_t id, Vector drawn, int w) {
                        const Vector at = drawn + shift;
                        if (!scene_.walls[std::size_t(w)].present || std::ranges::count(moving_, w) > 0) return;
                        if (near_soil_->square_of(at) != square) return;
                        walls_[w].x.push_back(at.x), walls_[w].y.push_back(at.y), walls_[w].z.push_back(at.z);
                        walls_[w].id.push_back(id);
                    });
                });
            }
    for (const int w : moving_)
        if (scene_.walls[std::size_t(w)].present) add_moved_points(w);
    for (auto& w : walls_) w.sort(columns_);
    ++wall_renewals_;
    model.set_walls(scene_, walls_);
    for (auto& w : walls_) w.id = {};
}

void Layout::add_moved_points(int wall)
{
    const scene::Wall& own = scene_.walls[std::size_t(wall)];
    const Vector step = period(scene_);
    const int px = scene_.space.periodic[0], py = scene_.space.periodic[1], pz = scene_.space.periodic[2];
    // Where a fixed wall is, or one that moves and has a lower number, its points are enough.
    const auto taken = [&](Vector x) {
        for (int w = 0; w < int(scene_.walls.size()); ++w) {
            const scene::Wall& other = scene_.walls[std::size_t(w)];
            if (w == wall || !other.present || (w > wall && std::ranges::count(moving_, w) > 0)) continue;
            if (scene::signed_distance(other, x, scene_.dimensions) < 0) return true;
        }
        return false;
    };
    auto& to = walls_[std::size_t(wall)];
    filling_.for_each_of_wall(wall, [&](std::int64_t id, Vector drawn) {
        const Vector x = scene::placed(own.pose, drawn);
        if (taken(x)) return;
        for (int a = -px; a <= px; ++a)
            for (int b = -py; b <= py; ++b)
                for (int c = -pz; c <= pz; ++c) {
                    const Vector at = x + Vector{a * step.x, b * step.y, c * step.z};
                    if (!near_soil_->holds(at)) continue;
                    to.x.push_back(at.x), to.y.push_back(at.y), to.z.push_back(at.z), to.id.push_back(id);
                }
    });
}

void Layout::prepare_lists(StepInput& in, double way, double speed)
{
    // No pair comes nearer than by twice the longest way of any particle; positions in mixed precision have grains of h/2^20.
    const double grain = 4e-6 * scene_.smoothing_length();
    in.prune = 2 * (pruned_way_ + way) + grain > pruned_margin_;
    if (in.prune) {
        lists_.forget_pruned();
        // Instructions a cluster: 113 an entry of the pruned list, of which a margin of m supports adds 95 * 2.3 m; 25 for each of 117
        // entries of the whole list in one of m/u steps, u the way of two particles in a step. Least in sum at m = sqrt(0.12 u).
        constexpr double prune_cost = 25.0 * 117 / (113 * 95 * 2.3);
        const double u = 2 * in.dt * speed / scene_.support();
        pruned_margin_ = std::clamp(std::sqrt(prune_cost * u), 1e-4, scene_.accuracy.skin) * scene_.support();
        // Pruned after this step's move, seen by a stage halfway along it.
        if (way > 0) pruned_margin_ = std::max(pruned_margin_, way * (1 + 1e-6) + grain);
        pruned_way_ = 0;
    } else pruned_way_ += way;
    in.margin = pruned_margin_;
}

Vector Layout::sorted(const Particles& p, Index record) const
{
    const Index n = p.size();
    if (record < n) return p[field::sorted_position][record];
    return {ghost_x_[record - n], ghost_y_[record - n], ghost_z_[record - n]};
}

void Layout::add_bytes(MemoryUse& to) const
{
    to.lists += lists_.bytes() + sorted_.bytes() + ghost_sorted_.bytes();
    to.pruned_lists += lists_.pruned_bytes();
    to.ghosts += (ghost_x_.capacity() + ghost_y_.capacity() + ghost_z_.capacity()) * sizeof(double) +
                 ghost_id_.capacity() * sizeof(std::int64_t) + ghost_soil_.capacity() * sizeof(std::int32_t);
    if (halo_) to.ghosts += halo_->bytes();
    for (const auto& w : walls_) to.walls += w.bytes();
}

} // namespace kuzure
