#pragma once
// The scenes whose pair passes are measured, by name, and one pass made ready to be run again and again.
#include "perf/bench/cloud.hpp"
#include <numeric>
#include <omp.h>

namespace kuzure::bench {

struct Workload {
    std::string name;
    Scene scene;
};

/// Dry sand on the jittered lattice with more and more effects; "cubic" is the bare model of a dry collapse.
inline std::vector<Workload> workloads(scene::Precision precision)
{
    using scene::Kernel;
    const auto scene = [&](Kernel kernel) {
        Scene s = dry_sand();
        s.accuracy.kernel = kernel, s.accuracy.precision = precision;
        return s;
    };
    std::vector<Workload> all{{"cubic_inviscid", scene(Kernel::CubicSpline)}, {"cubic", scene(Kernel::CubicSpline)}};
    all[0].scene.effects.viscosity.reset();
    const auto add = [&](const char* name, Kernel kernel, auto change) {
        all.push_back({name, scene(kernel)});
        change(all.back().scene);
    };
    const auto nothing = [](Scene&) {};
    const auto tensile = [](Scene& s) { s.effects.artificial_stress = scene::ArtificialStress{}; };
    const auto diffusive = [](Scene& s) { s.effects.stress_diffusion = scene::StressDiffusion{}; };
    const auto corrected = [](Scene& s) { s.accuracy.correction = scene::Correction::Gradient; };
    const auto everything = [&](Scene& s) { tensile(s), diffusive(s), corrected(s), s.effects.viscosity->beta = 0.1; };
    add("wendland_c2", Kernel::WendlandC2, nothing);
    add("cubic_quadratic_viscosity", Kernel::CubicSpline, [](Scene& s) { s.effects.viscosity->beta = 0.1; });
    add("cubic_tensile", Kernel::CubicSpline, tensile);
    add("wendland_c2_tensile", Kernel::WendlandC2, tensile);
    add("cubic_diffusive", Kernel::CubicSpline, diffusive);
    add("wendland_c2_diffusive", Kernel::WendlandC2, diffusive);
    add("wendland_c2_corrected", Kernel::WendlandC2, corrected);
    add("cubic_softening", Kernel::CubicSpline, [](Scene& s) { s.soils[0].softening = scene::Softening{0, 0.3, 0.01}; });
    add("cubic_rate_friction", Kernel::CubicSpline, [](Scene& s) { s.soils[0].rate_friction = scene::RateFriction{0.6, 0.3, 1e-3, 2600}; });
    add("cubic_pore_pressure", Kernel::CubicSpline, [](Scene& s) {
        s.effects.pore_pressure = scene::PorePressure{{{0.0, 1.0}, {2.0, 0.5}}};
    });
    add("cubic_everything", Kernel::CubicSpline, everything);
    add("wendland_c2_everything", Kernel::WendlandC2, everything);
    add("wendland_c4_everything", Kernel::WendlandC4, everything);
    return all;
}

/// The pass of one workload; a step of no length, so the state stays and the work is the same every time. As in a collapse,
/// one pass in `cycle` prunes the lists, with a margin for the others.
template <class T> class ReadyPass {
public:
    static constexpr int cycle = 5;
    ReadyPass(const Scene& s, Arithmetic arithmetic, int edge, double jitter)
        : model_(choose_model(s, arithmetic)), cloud_(edge, jitter, s), water_(PoreWater::from(s.effects))
    {
#pragma omp parallel
        flush_denormals();
        cloud_.sort();
        cloud_.build(model_->cluster_width(), s.accuracy.skin);
        cloud_.make_records(now_);
        next_.resize(now_.size()), tension_.resize(now_.size()), next_tension_.resize(now_.size());
        for (auto& t : tension_) t = {};
        clusters_.resize(cloud_.lists.size());
        std::iota(clusters_.begin(), clusters_.end(), 0);
        for (const auto& m : cloud_.soils) evolving_ = evolving_ || m.evolves();
    }
    /// Directed pairs of one pass.
    std::int64_t run()
    {
        auto p = cloud_.pass(now_, next_, 0);
        p.prune = passes_++ % cycle == 0, p.margin = 0.026 * cloud_.scene.support();
        p.kick = 0, p.tension = tension_.data(), p.next_tension = next_tension_.data();
        p.water = water_.present() ? &water_ : nullptr, p.evolving = evolving_;
        return model_->run(p, clusters_).pairs;
    }
    double flops(std::int64_t pairs) const
    {
        return double(pairs) * model_->flops_per_pair() + double(cloud_.particles.size()) * model_->flops_per_particle();
    }
    double bytes() const { return double(cloud_.particles.size()) * model_->bytes_per_particle(); }
    std::string model() const { return model_->name(); }

private:
    std::unique_ptr<PairModel> model_;
    Cloud cloud_;
    PoreWater water_;
    bool evolving_ = false;
    std::int64_t passes_ = 0;
    Array<Record<T>> now_, next_;
    Array<Tension<T>> tension_, next_tension_;
    std::vector<Index> clusters_;
};

} // namespace kuzure::bench
