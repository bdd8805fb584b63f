#pragma once
// What the two stages of the staggered scheme make of a cloud, each from the same given state, measured from outside.
//
// Stage "strain" shows the velocity gradient only in what it does to stress and density, so it runs four times:
// - as it is: sigma, rho, plastic strain, energies, viscous acceleration;
// - with soil so strong that it stays elastic, without stress: sigma' = R l R^T + l, l = dt/2 C : D, solved for l by repeated insertion;
// - so strong, with +-S0 of distinct principal stresses: half the difference is R S0 R^T, and its spin w follows as in run_pass.hpp.
#include "solver/run/loads.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/motion.hpp"
#include "tests/unit/run_pass.hpp"

namespace kuzure::measured {

/// Walls of a scene whose events move them, in a step of `wall_dt` before one of `wall_next`, s;
/// a little way on, where all go the same way.
constexpr double wall_dt = 0.02, wall_next = 0.03;
inline std::vector<WallPoses> poses_of(const Scene& s)
{
    std::vector<WallPoses> poses(s.walls.size());
    const auto moving = scene::moving_walls(s);
    const auto velocity = [&](int w) {
        return std::ranges::find_if(s.events, [&](const auto& e) { return e.move->wall == s.walls[std::size_t(w)].name; })->move->velocity;
    };
    bool together = moving.size() == s.walls.size();
    for (const int w : moving) together = together && velocity(w) == velocity(moving[0]);
    for (const int w : moving) {
        const Vector v = velocity(w), on = together ? 0.01 * v : Vector{};
        auto& pose = poses[std::size_t(w)];
        pose.before.shift = on - wall_dt * v, pose.after.shift = on, pose.later.shift = on + (0.6 * wall_next) * v;
    }
    return poses;
}

/// Energies of particles passed together, J.
struct Worked {
    Index first;
    int count;
    PassResult result;
};
struct StrainStageResult {
    std::string model;
    std::vector<Mat3<double>> L;
    Particles after;
    std::vector<Worked> worked;
};
struct ForceStageResult {
    Particles after;
    std::vector<Worked> worked;
};

namespace detail {

/// One compiled staggered model over one sorted cloud, whose particles have all columns of the scheme set by `state`.
template <class State> class Stages {
public:
    Stages(const bench::Cloud& cloud, Arithmetic arithmetic, double damping, State state)
        : cloud_(cloud), model_(choose_model(cloud.scene, arithmetic)), damping_(damping)
    {
        cloud_.prepare(*model_, 0.1);
        state(cloud_.particles);
        model_->make_records(cloud_.particles, cloud_.soils, {});
        if (scene::any_wall_moves(cloud_.scene)) {
            const auto poses = poses_of(cloud_.scene);
            model_->place_walls({poses, wall_dt, wall_next, false});
        }
        start_ = cloud_.particles;
    }
    Stages(const Stages&) = delete;
    std::string name() const { return model_->name(); }
    const Particles& start() const { return start_; }
    const Particles& now() const { return cloud_.particles; }
    std::span<const Material> soils() const { return cloud_.soils; }

    void reset() { cloud_.particles = start_; }
    /// This stress and nothing else that changes it but strain; soil that has opened has opened by next to nothing.
    void set_stress(const Stress& s)
    {
        for (Index i = 0; i < start_.size(); ++i) {
            cloud_.particles[field::stress].set(i, s);
            if (start_.has(field::stress_rate)) cloud_.particles[field::stress_rate].set(i, Stress{});
            if (start_.has(field::opened_volume))
                cloud_.particles[field::opened_volume].set(i, std::as_const(start_)[field::opened_volume][i] > 0 ? 1e-300 : 0.0);
        }
        model_->make_records(cloud_.particles, cloud_.soils, {}); // who is in tension
    }
    /// Every cluster alone.
    std::vector<Worked> run(int stage, double dt, double next, double energy_unit)
    {
        StepInput in = cloud_.input(dt);
        const auto loads = loads_now(cloud_.scene);
        in.next = next, in.energy_unit = energy_unit, in.forces.damping = damping_, in.loads = loads;
        std::vector<Worked> worked;
        for (Index c = 0; c < cloud_.lists.size(); ++c)
            worked.push_back({cloud_.lists.first(c), cloud_.lists.count(c), model_->run(stage, in, std::array{c})});
        return worked;
    }

private:
    bench::Cloud cloud_;
    std::unique_ptr<PairModel> model_;
    double damping_;
    Particles start_;
};

/// l with R l R^T + l = s.
inline Stress half_loading(const Stress& s, Vector w)
{
    Stress l = 0.5 * s;
    for (int k = 0; k < 80; ++k) l = 0.5 * s - 0.5 * (rotate(w, l) - l);
    return l;
}

} // namespace detail

/// Stage "strain" with a step of length dt, from columns that state(particles) sets; energies counted in `unit`, J.
template <class State> StrainStageResult run_strain(const bench::Cloud& sorted, Arithmetic arithmetic, double dt, double unit, State state)
{
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    StrainStageResult of;
    {
        detail::Stages stages(sorted, arithmetic, 0, state);
        of.model = stages.name();
        of.worked = stages.run(0, dt, dt, unit);
        of.after = stages.now();
    }
    bench::Cloud strong = sorted;
    for (auto& m : strong.soils) {
        m.k = m.residual_k = 1e30, m.apex = m.cutoff = std::numeric_limits<double>::infinity();
        m.softening_slip = m.dilation_decay = std::numeric_limits<double>::infinity(), m.grain = 0;
    }
    detail::Stages stages(strong, arithmetic, 0, state);
    const Index n = stages.start().size();
    const Stress S{1e8, 0, -1e8, 0, 0, 0};
    std::vector<Stress> loaded(n), turned(n);
    const auto run = [&](const Stress& s) {
        stages.reset(), stages.set_stress(s);
        stages.run(0, dt, dt, 1e30);
        return stages.now()[field::stress];
    };
    const auto unstressed = run({});
    for (Index i = 0; i < n; ++i) loaded[i] = unstressed[i];
    // under a pressure, which no rotation turns: soil in tension is strained less
    const Stress pressed{-1.5e8, -1.5e8, -1.5e8, 0, 0, 0};
    const auto forth = run(pressed + S);
    for (Index i = 0; i < n; ++i) turned[i] = forth[i];
    const auto back = run(pressed - S);
    for (Index i = 0; i < n; ++i) {
        const Vector w = detail::half_spin_between(S, 0.5 * (turned[i] - back[i])); // of W dt/2
        const Vector W = (2 / dt) * w;
        const Material& m = stages.soils()[stages.start()[field::soil][i]];
        const Stress d = (2 / dt) * detail::strain_of(detail::half_loading(loaded[i], 2.0 * w), m);
        of.L.push_back({{d.xx, d.xy + W.x, d.xz + W.y}, {d.xy - W.x, d.yy, d.yz + W.z}, {d.xz - W.y, d.yz - W.z, d.zz}});
    }
    omp_set_num_threads(threads);
    return of;
}

/// Stage "force" for a step of length dt before it and `next` after it, from columns that state(particles) sets. The acceleration of
/// viscosity is that of a strain stage of no length, which comes before.
template <class State>
ForceStageResult run_force(const bench::Cloud& sorted, Arithmetic arithmetic, double damping, double dt, double next, double unit,
                           State state)
{
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    detail::Stages stages(sorted, arithmetic, damping, state);
    stages.run(0, 0, next, unit);
    ForceStageResult of;
    of.worked = stages.run(1, dt, next, unit);
    of.after = stages.now();
    omp_set_num_threads(threads);
    return of;
}

} // namespace kuzure::measured
