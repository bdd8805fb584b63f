#pragma once
// Pore water that does not flow.
#include "solver/core/tensor.hpp"
#include "solver/scene/parts.hpp"

namespace kuzure {

/// Still pore water: p_w = rho_w g (z_w(x) - z) below the table, whose gradient drives the skeleton (buoyancy, seepage):
///     rho dv/dt = div sigma' - grad p_w + rho g.  Bui et al. (2011), with the gradient of the given table itself.
struct PoreWater {
    std::vector<std::array<double, 2>> table; // x, z in m
    double unit_weight = 0;                   // N/m^3
    static PoreWater from(const scene::Effects& e)
    {
        const auto& p = e.pore_pressure;
        if (!p) return {};
        return {p->table, p->density * length(e.gravity.value_or(Vector{}))};
    }
    bool present() const { return !table.empty(); }
    /// Pressure (Pa) and its gradient (Pa/m) at a point.
    struct Pressure {
        double value = 0;
        Vector gradient{};
    };
    Pressure at(Vector x) const;
};

} // namespace kuzure
