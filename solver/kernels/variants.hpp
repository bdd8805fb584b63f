#pragma once
// The pair models that are compiled, one object file each, cheapest first. A scene gets the first that covers it; the
// last of each kernel covers everything. To make a new combination fast, add a line and raise the number.
#include "solver/kernels/model.hpp"
#include <tuple>

namespace kuzure {

template <class Kernel> using Everything = Model<Kernel, Viscosity, ArtificialStress, StressDiffusion, GradientCorrection, Shifting>;

using Variants = std::tuple<Model<CubicSpline, NoViscosity>, Model<CubicSpline, LinearViscosity>, Model<WendlandC2, LinearViscosity>,
                            Model<CubicSpline, Viscosity, ArtificialStress>, Model<WendlandC2, Viscosity, ArtificialStress>,
                            Model<CubicSpline, LinearViscosity, NoArtificialStress, StressDiffusion>,
                            Model<WendlandC2, LinearViscosity, NoArtificialStress, StressDiffusion>,
                            Model<WendlandC2, LinearViscosity, NoArtificialStress, NoStressDiffusion, GradientCorrection>,
                            Model<WendlandC2, LinearViscosity, NoArtificialStress, NoStressDiffusion, NoCorrection, Shifting>,
                            Everything<CubicSpline>, Everything<WendlandC2>, Everything<WendlandC4>>;

inline constexpr int KUZURE_VARIANTS = 12; // read by CMakeLists.txt and Makefile.knl
static_assert(std::tuple_size_v<Variants> == KUZURE_VARIANTS);

/// Bui's leap-frog is compiled for the paper's dry collapse and for everything, the last three.
inline constexpr bool has_leap_frog(int variant) { return variant == 1 || variant >= KUZURE_VARIANTS - 3; }

} // namespace kuzure
