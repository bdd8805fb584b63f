#pragma once
// What a fast pass makes of a cloud, measured from outside: acceleration, all of L, stress diffusion, powers. All that knows
// what a model is asked, and how its scheme advances, is here.
//
// The half-step values are the pass's to advance, and no force depends on them: they are set such that their change is sharp.
// - half_velocity = 0 and a kick of 2^-60 s: it becomes kick a, exactly.
// - half_stress = 0, a soil so strong that it stays elastic: it becomes kick times the stress rate; so short a kick turns
//   nothing. Hooke's law backwards gives D = (L + L^T)/2 to the last digits. Stress diffusion is what remains when the same
//   model runs with zeta = 0.
// - half_stress = +-S0 of distinct principal stresses, a longer kick: half the difference is R S0 R^T, whatever the strain adds,
//   with R = (1 - w)^-1 (1 + w), w the skew part of L times kick/2 (Hughes & Winget). Backwards: w to round-off over |w|, 1e-13.
// - Powers and pairs come for every cluster alone; for every particle in the plain loop.
#include "perf/bench/cloud.hpp"
#include <omp.h>

namespace kuzure::measured {

struct Group { // of particles passed together
    Index first;
    int count;
    std::int64_t pairs;
    double wall, viscous, damping; // W
};
struct Rates {
    std::string model;
    std::vector<Vector> acceleration;
    std::vector<Mat3<double>> L;
    std::vector<double> density; // drho/dt
    std::vector<Stress> diffusion;
    std::vector<Group> groups;
};

namespace detail {

/// One compiled model over one sorted cloud.
class Passes {
public:
    Passes(const bench::Cloud& cloud, Arithmetic arithmetic, double damping)
        : cloud_(cloud), model_(choose_model(cloud.scene, arithmetic)), damping_(damping)
    {
        cloud_.prepare(*model_, 0.1);
        start_ = cloud_.particles;
    }
    Passes(const Passes&) = delete; // the model reads the cloud's walls
    Index size() const { return start_.size(); }
    std::string name() const { return model_->name(); }
    const Particles& start() const { return start_; }
    const Particles& now() const { return cloud_.particles; }

    /// A step of no length, but a kick, from half-step velocities of zero and a uniform half-step stress; every cluster alone.
    std::vector<Group> kick(double seconds, const Stress& half_stress)
    {
        auto& p = cloud_.particles;
        p = start_;
        double power = 0; // W, what the largest stress and speed make of one particle
        for (Index i = 0; i < size(); ++i) {
            p[field::half_velocity].set(i, Vector{}), p[field::half_stress].set(i, half_stress);
            p[field::half_density].set(i, start_[field::density][i]);
            const Stress s = start_[field::stress][i];
            power = std::max(power, std::sqrt(contract(s, s)) * length(start_[field::velocity][i]));
        }
        power *= cloud_.scene.particle_volume() / cloud_.scene.smoothing_length();
        StepInput in = cloud_.input(0);
        in.kick = seconds, in.energy_unit = seconds * power * 0x1p-44; // as fine as their sums allow
        in.forces.damping = damping_;
        std::vector<Group> groups;
        for (Index c = 0; c < cloud_.lists.size(); ++c) {
            const PassResult r = model_->run(0, in, std::array{c});
            groups.push_back({cloud_.lists.first(c), cloud_.lists.count(c), r.pairs, r.energy.wall / seconds,
                              (r.energy.viscous + r.energy.stabilising) / seconds, r.energy.damping / seconds});
        }
        return groups;
    }

private:
    bench::Cloud cloud_;
    std::unique_ptr<PairModel> model_;
    double damping_;
    Particles start_;
};

/// Strain of an elastic stress.
inline Stress strain_of(const Stress& s, const Material& m)
{
    return plus_isotropic((0.5 / m.shear) * deviator(s), trace(s) / (9 * m.bulk));
}

/// (w_xy, w_xz, w_yz) of the skew w with A = R S R^T, R = (1 - w)^-1 (1 + w), |w| well below 1:
///     A - S = w M - M w + w (A - S) w,  M = A + S, solved by repeated insertion.
inline Vector half_spin_between(const Stress& S, const Stress& A)
{
    const Stress d = A - S, M = A + S;
    Vector w{};
    for (int k = 0; k < 60; ++k) {
        const Vector x{0, w.x, w.y}, y{-w.x, 0, w.z}, z{-w.y, -w.z, 0}; // rows of w; its columns are -x, -y, -z
        const double xy = d.xy + dot(x, d * y), xz = d.xz + dot(x, d * z), yz = d.yz + dot(y, d * z);
        w = {(xy - w.y * M.yz - w.z * M.xz) / (M.yy - M.xx), (xz - w.x * M.yz + w.z * M.xy) / (M.zz - M.xx),
             (yz + w.x * M.xz + w.y * M.xy) / (M.zz - M.yy)};
    }
    return w;
}

inline Rates run_pass(const bench::Cloud& cloud, Arithmetic arithmetic, double damping)
{
    bench::Cloud strong = cloud;
    for (auto& m : strong.soils) m.k = m.residual_k = 1e12, m.apex = m.cutoff = std::numeric_limits<double>::infinity();
    Passes passes(strong, arithmetic, damping);
    const Index n = passes.size();
    const auto material = [&](Index i) -> const Material& { return strong.soils[passes.start()[field::soil][i]]; };

    Rates of;
    of.model = passes.name();
    constexpr double brief = 0x1p-60;
    of.groups = passes.kick(brief, {});
    std::vector<Stress> rate(n);
    for (Index i = 0; i < n; ++i) {
        of.acceleration.push_back((1 / brief) * passes.now()[field::half_velocity][i]);
        rate[i] = (1 / brief) * passes.now()[field::half_stress][i];
    }
    of.diffusion.resize(n);
    if (auto& d = strong.scene.effects.stress_diffusion) {
        d->zeta = 0;
        Passes undiffused(strong, arithmetic, damping);
        undiffused.kick(brief, {});
        for (Index i = 0; i < n; ++i) {
            const Stress by_strain = (1 / brief) * undiffused.now()[field::half_stress][i];
            of.diffusion[i] = rate[i] - by_strain, rate[i] = by_strain;
        }
    }

    double fastest = 0;
    for (Index i = 0; i < n; ++i) fastest = std::max(fastest, length(passes.start()[field::velocity][i]));
    const double kick = strong.scene.smoothing_length() / (32 * fastest);
    const Stress S{1e8, 0, -1e8, 0, 0, 0};
    passes.kick(kick, S);
    std::vector<Stress> turned(n);
    for (Index i = 0; i < n; ++i) {
        turned[i] = passes.now()[field::half_stress][i];
        of.density.push_back((passes.now()[field::half_density][i] - passes.start()[field::density][i]) / kick);
    }
    passes.kick(kick, -1.0 * S);
    for (Index i = 0; i < n; ++i) {
        const Stress A = 0.5 * (turned[i] - passes.now()[field::half_stress][i]);
        const Vector W = (2 / kick) * half_spin_between(S, A);
        const Stress d = strain_of(rate[i], material(i));
        of.L.push_back({{d.xx, d.xy + W.x, d.xz + W.y}, {d.xy - W.x, d.yy, d.yz + W.z}, {d.xz - W.y, d.yz - W.z, d.zz}});
    }
    return of;
}

} // namespace detail

/// Runs the model that the cloud's scene chooses, in the scene's precision, over the sorted cloud and its walls.
inline Rates run_pass(const bench::Cloud& sorted, Arithmetic arithmetic, double damping = 0)
{
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1); // one cluster at a time is too little for a team
    Rates of = detail::run_pass(sorted, arithmetic, damping);
    omp_set_num_threads(threads);
    return of;
}

} // namespace kuzure::measured
