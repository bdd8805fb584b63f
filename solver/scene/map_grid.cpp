#include "solver/scene/map_grid.hpp"
#include "solver/core/ensure.hpp"

namespace kuzure::scene {

MapGrid map_grid(const Scene& scene, const Filling& filling)
{
    ensure(scene.maps && scene.maps->cell > 0, "maps are made of a resolved scene that has some");
    const double cell = scene.maps->cell, half = 0.5 * scene.space.spacing;
    const Box& all = filling.bounds();
    // A face that lies on a multiple but for rounding needs no further cell.
    const auto first = [&](double low) { return std::floor((low - half) / cell + 1e-6); };
    const auto last = [&](double high) { return std::ceil((high + half) / cell - 1e-6); };
    const double x = first(all.low.x), y = first(all.low.y);
    const double columns = std::max(1.0, last(all.high.x) - x), rows = std::max(1.0, last(all.high.y) - y);
    const auto whole = [](double n) { return std::int64_t(std::min(n, 1e9)); };
    return {x * cell, y * cell, cell, whole(columns), whole(rows)};
}

} // namespace kuzure::scene
