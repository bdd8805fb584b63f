#pragma once
// The pair models that are compiled, one object file each, cheapest first. A scene gets the first that covers it; the
// last of each kernel covers everything. To make a new combination fast, add a line and raise the number.
#include "solver/physics/model.hpp"
#include <tuple>

namespace kuzure {

using Variants = std::tuple<Model<CubicSpline, NoViscosity, NoArtificialStress>, Model<CubicSpline, LinearViscosity, NoArtificialStress>,
                            Model<WendlandC2, LinearViscosity, NoArtificialStress>, Model<CubicSpline, Viscosity, ArtificialStress>,
                            Model<WendlandC2, Viscosity, ArtificialStress>, Model<WendlandC4, Viscosity, ArtificialStress>>;

inline constexpr int KUZURE_VARIANTS = 6; // read by CMakeLists.txt and Makefile.knl
static_assert(std::tuple_size_v<Variants> == KUZURE_VARIANTS);

} // namespace kuzure
