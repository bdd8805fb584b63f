#pragma once
// A model is a smoothing kernel and the terms of the pair loop: its type says what the loop contains.
#include "solver/effects/artificial_stress.hpp"
#include "solver/effects/gradient_correction.hpp"
#include "solver/effects/hourglass.hpp"
#include "solver/effects/shifting.hpp"
#include "solver/effects/stress_diffusion.hpp"
#include "solver/effects/viscosity.hpp"
#include "solver/pairs/sums.hpp"
#include "solver/physics/smoothing.hpp"
#include <string>
#include <tuple>

namespace kuzure {

/// Kernel and terms with lengths in units of `unit` metres (1, or h in mixed precision). More: further pair forces of the staggered
/// scheme. Each has its Sums<V>, flops, from(interactions, unit), add(sums, batch, stresses of neighbours) and force(sums), which is
/// rho_i dv_i/dt without the kernel's constant, Pa/m; what it does to the energy is booked as stabilising.
template <class KernelType, class Viscous, class Tensile = NoArtificialStress, class Diffusive = NoStressDiffusion,
          class Corrected = NoCorrection, class Shifted = NoShifting, class... More>
struct Model {
    using Kernel = KernelType;
    using ArtificialStressTerm = Tensile;
    using DiffusionTerm = Diffusive;
    using CorrectionTerm = Corrected;
    using ShiftingTerm = Shifted;
    static constexpr bool viscous = !std::is_same_v<Viscous, NoViscosity>;
    static constexpr bool tensile = std::is_same_v<Tensile, ArtificialStress>;
    using TensionTerm = std::conditional_t<tensile, StrainOfTension, NoStrainOfTension>;
    static constexpr bool diffusive = std::is_same_v<Diffusive, StressDiffusion>;
    static constexpr bool corrected = std::is_same_v<Corrected, GradientCorrection>;
    static constexpr bool shifts = std::is_same_v<Shifted, Shifting>;
    using HourglassTerm = std::conditional_t<corrected, HourglassControl, NoHourglass>;
    using CarriedTerm = std::conditional_t<shifts, CarriedStress, NothingCarried>;
    static constexpr bool pushes = shifts || corrected || sizeof...(More) > 0;
    static constexpr double more_flops = (0.0 + ... + More::flops);
    template <class S, class... Terms> using WithMore = SumsOf<S, Terms..., More...>;
    Kernel kernel;
    Viscous viscosity;
    Tensile artificial_stress;
    Diffusive stress_diffusion;
    Corrected correction;
    bool correct;               // a model with the correction compiled in also serves scenes without
    bool adjoint;               // pair forces by the corrected gradients too
    HourglassControl hourglass; // of models with the correction
    Shifted shifting;
    std::tuple<More...> more;

    static Model from(const scene::Interactions& s, double unit)
    {
        const Kernel kernel(s.h / unit, s.dimensions);
        return {kernel,
                Viscous::from(s.effects, kernel.h),
                Tensile::from(s.effects, kernel, s.spacing / unit, s.dimensions),
                Diffusive::from(s.effects),
                {},
                s.correction != scene::Correction::None,
                s.correction == scene::Correction::Adjoint,
                {s.hourglass},
                Shifted::from(s.shifting, kernel, s.spacing / unit),
                {More::from(s, unit)...}};
    }
    static bool covers(const scene::Interactions& s)
    {
        const scene::Kernel asked = s.kernel;
        const bool same = std::is_same_v<Kernel, CubicSpline>  ? asked == scene::Kernel::CubicSpline
                          : std::is_same_v<Kernel, WendlandC2> ? asked == scene::Kernel::WendlandC2
                                                               : asked == scene::Kernel::WendlandC4;
        return same && Viscous::covers(s.effects) && (tensile || !s.effects.artificial_stress) &&
               (diffusive || !s.effects.stress_diffusion) && (corrected || (s.correction == scene::Correction::None && s.hourglass == 0)) &&
               (shifts || s.shifting == 0);
    }
    static std::string name()
    {
        std::string s = std::is_same_v<Kernel, CubicSpline>  ? "cubic spline"
                        : std::is_same_v<Kernel, WendlandC2> ? "wendland c2"
                                                             : "wendland c4";
        if (viscous) s += " + viscosity";
        if (tensile) s += " + artificial stress";
        if (diffusive) s += " + stress diffusion";
        if (corrected) s += " + gradient correction";
        if (shifts) s += " + shifting";
        return s;
    }
};

} // namespace kuzure
