#pragma once
// A model is a smoothing kernel and the terms of the pair loop: its type says what the loop contains.
#include "solver/physics/smoothing.hpp"
#include "solver/physics/terms.hpp"

namespace kuzure {

struct NoViscosity {
    static NoViscosity from(const scene::Effects&, double) { return {}; }
    static bool covers(const scene::Effects& e) { return !e.viscosity; }
};
struct NoArtificialStress {
    template <class Kernel> static NoArtificialStress from(const scene::Effects&, const Kernel&, double) { return {}; }
};
struct NoStressDiffusion {
    static NoStressDiffusion from(const scene::Effects&) { return {}; }
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

    static Model from(const scene::Interactions& s, double unit)
    {
        const Kernel kernel(s.h / unit, s.dimensions);
        return {kernel, Viscous::from(s.effects, kernel.h), Tension::from(s.effects, kernel, s.spacing / unit), Diffusion::from(s.effects),
                s.correction == scene::Correction::Gradient};
    }
    static bool covers(const scene::Interactions& s)
    {
        const scene::Kernel asked = s.kernel;
        const bool same = std::is_same_v<Kernel, CubicSpline>  ? asked == scene::Kernel::CubicSpline
                          : std::is_same_v<Kernel, WendlandC2> ? asked == scene::Kernel::WendlandC2
                                                               : asked == scene::Kernel::WendlandC4;
        return same && Viscous::covers(s.effects) && (tensile || !s.effects.artificial_stress) &&
               (diffusive || !s.effects.stress_diffusion) && (corrected || s.correction == scene::Correction::None);
    }
};

} // namespace kuzure
