#include "solver/effects/pore_water.hpp"

namespace kuzure {

PoreWater::Pressure PoreWater::at(Vector x) const
{
    if (table.empty()) return {};
    double z = table.front()[1], slope = 0;
    if (x.x >= table.back()[0]) z = table.back()[1];
    else
        for (std::size_t k = 0; k + 1 < table.size(); ++k) {
            const auto &a = table[k], &b = table[k + 1];
            if (x.x < a[0] || x.x >= b[0]) continue;
            slope = (b[1] - a[1]) / (b[0] - a[0]);
            z = a[1] + slope * (x.x - a[0]);
        }
    if (x.z >= z) return {};
    return {unit_weight * (z - x.z), {unit_weight * slope, 0, -unit_weight}};
}

} // namespace kuzure
