#pragma once
// A model is a smoothing kernel and the terms of the pair loop: its type says what the loop contains.
#include "solver/physics/smoothing.hpp"
#include "solver/physics/terms.hpp"

namespace kuzure {

struct NoViscosity {
    static NoViscosity from(const Scene&, double) { return {}; }
    static bool covers(const scene::Effects& e) { return !e.viscosity; }
};
struct NoArtificialStress {
    template <class Kernel> static NoArtificialStress from(const Scene&, const Kernel&, double) { return {}; }
};
struct NoStressDiffusion {
    static NoStressDiffusion from(const Scene&) { return {}; }
};
struct NoCorrection {};

/// Kernel and terms with lengths in units of `unit` metres (1, or h in mixed precision).
template <class KernelType, class Viscous, class Tension = NoArtificialStress, class Diffusion = NoStressDiffusion,
          class Correction = NoCorrection>
struct Model {
    using Kernel = KernelType;
    static constexpr bool viscous = !std::is_same_v<Viscous, NoViscosity>;
    static constexpr bool tensile = std::is_same_v<Tension, ArtificialStress>;
    static constexpr bool diffusive = std::is_same_v<Diffusion, StressDiffusion>;
    static constexpr bool corrected = std::is_same_v<Correction, GradientCorrection>;
    Kernel kernel;
    Viscous viscosity;
    Tension artificial_stress;
    Diffusion stress_diffusion;
    bool correct; // a model with the correction compiled in also serves scenes without

    static Model from(const Scene& s, double unit)
    {
        const Kernel kernel(s.smoothing_length() / unit, s.dimensions);
        return {kernel, Viscous::from(s, kernel.h), Tension::from(s, kernel, s.space.spacing / unit), Diffusion::from(s),
                s.accuracy.correction == scene::Correction::Gradient};
    }
    static bool covers(const Scene& s)
    {
        const scene::Kernel asked = s.accuracy.kernel;
        const bool same = std::is_same_v<Kernel, CubicSpline>  ? asked == scene::Kernel::CubicSpline
                          : std::is_same_v<Kernel, WendlandC2> ? asked == scene::Kernel::WendlandC2
                                                               : asked == scene::Kernel::WendlandC4;
        return same && Viscous::covers(s.effects) && (tensile || !s.effects.artificial_stress) &&
               (diffusive || !s.effects.stress_diffusion) && (corrected || s.accuracy.correction == scene::Correction::None);
    }
};

} // namespace kuzure
