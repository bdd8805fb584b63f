#pragma once
// The scenes whose pair passes are measured, by name, and one pass made ready to be run again and again.
#include "perf/bench/cloud.hpp"
#include "solver/core/simd.hpp"
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

/// The passes of one workload; a step of no length, so the state stays and the work is the same every time. As in a collapse,
/// one step in `cycle` prunes the lists, with a margin for the others.
class ReadyPass {
public:
    static constexpr int cycle = 5;
    ReadyPass(const Scene& s, Arithmetic arithmetic, int edge, double jitter) : model_(choose_model(s, arithmetic)), cloud_(edge, jitter, s)
    {
#pragma omp parallel
        flush_denormals();
        cloud_.prepare(*model_, s.accuracy.skin);
    }
    /// Directed pairs of one step.
    std::int64_t run()
    {
        StepInput in = cloud_.input(0);
        in.prune = passes_++ % cycle == 0, in.margin = 0.026 * cloud_.scene.support();
        return cloud_.step(*model_, in).pairs;
    }
    double flops(std::int64_t pairs) const
    {
        double sum = 0;
        for (const Stage& s : model_->stages())
            sum += double(pairs) * s.flops_per_pair + double(cloud_.particles.size()) * s.flops_per_particle;
        return sum;
    }
    double bytes() const
    {
        double sum = 0;
        for (const Stage& s : model_->stages()) sum += double(cloud_.particles.size()) * s.bytes_per_particle;
        return sum;
    }
    std::string model() const { return model_->name(); }

private:
    std::unique_ptr<PairModel> model_;
    Cloud cloud_;
    std::int64_t passes_ = 0;
};

} // namespace kuzure::bench
