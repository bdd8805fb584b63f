#pragma once
// Density as users know it. field::density is that of the soil between what tension has opened, by which the sums weigh volumes; with the
// opened volume it is what continuity makes of the motion, drho/dt = -rho tr L.
#include "solver/core/particles.hpp"
#include <cmath>

namespace kuzure {

/// kg/m^3 of particle i with all that has opened: rho exp(-opened).
inline double bulk_density(const Particles& p, Index i)
{
    const double rho = p[field::density][i], opened = p.has(field::opened_volume) ? p[field::opened_volume][i] : 0.0;
    return opened > 0 ? rho * std::exp(-opened) : rho;
}

} // namespace kuzure
