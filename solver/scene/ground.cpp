#include "solver/scene/ground.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/motion.hpp"
#include <algorithm>
#include <cmath>
#include <numbers>

namespace kuzure::scene {

double friction_angle_at(const Wall& wall, Vector x)
{
    const auto* ground = std::get_if<Ground>(&wall.shape);
    if (!ground || !ground->friction) return wall.friction_angle;
    const double there = bilinear(*ground->friction, x.x, x.y);
    return std::isfinite(there) ? there : wall.friction_angle;
}

bool has_left(const Scene& s, Vector x)
{
    const HeightField* ground = ground_of(s);
    if (!ground || !s.terrain || s.terrain->edge == Edge::Closed) return false;
    const auto height = [&](double dx, double dy) { return ground->at(x.x + dx, x.y + dy).z; };
    if (std::isfinite(height(0, 0))) return false;
    const double reach = 2 * s.support(), aslant = reach / std::numbers::sqrt2;
    const double ways[8][2] = {{reach, 0},       {-reach, 0},       {0, reach},        {0, -reach},
                               {aslant, aslant}, {-aslant, aslant}, {aslant, -aslant}, {-aslant, -aslant}};
    if (std::ranges::any_of(ways, [&](const auto& way) { return x.z > height(way[0], way[1]) - reach; })) return false;
    // It may yet fall upon another wall.
    return std::ranges::none_of(s.walls, [&](const Wall& w) {
        if (!w.present || std::holds_alternative<Ground>(w.shape)) return false;
        const Box b = bounds(w);
        return x.x > b.low.x - reach && x.x < b.high.x + reach && x.y > b.low.y - reach && x.y < b.high.y + reach && x.z > b.low.z - reach;
    });
}

} // namespace kuzure::scene
