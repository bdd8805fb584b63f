#pragma once
// The weight on soil at rest: what stands above a point in a closed form, and whether that is an equilibrium.
#include "solver/scene/fill.hpp"
#include <string>

namespace kuzure::scene {

/// True if a body starts with the stress "at rest".
inline bool rests(const Body& b) { return b.stress == InitialStress::AtRest; }

/// Soil above points of soil, in columns one spacing wide.
///
/// A column carries the stacks of particles (Stack) that stand on it, each by the share of the column's width that it covers:
/// 1 on the same lattice, less on a shifted one. What stands on those counts likewise, and so on up to the first gap, be it air or a
/// wall. What stands beside the column counts nothing, though cells of shifted lattices overlap a little there.
class Columns {
public:
    Columns(const Scene&, const Filling&);
    /// The soil on a horizontal plane through a point.
    struct Above {
        double mass;    // kg/m^2
        double surface; // m, height of the highest soil that counts
    };
    /// Above a particle of a body at its position (m).
    Above above(Vector x, int body) const;

private:
    template <class Visit> void for_each_image(Vector x, double reach, Visit visit) const;
    bool stands_on(int upper, double foot, int lower, double top, Vector x) const;

    const Scene& scene_;
    const Filling& filling_;
    double nothing_; // shares of a column, and distances in spacings, up to this are rounding
};

/// Why the stress of columns, K0 times the weight above, is no equilibrium of the soil "at rest": tilted gravity, ground or water table
/// that is not level, a wall beside it just out of reach. Empty where it is one, or where nothing starts at rest. Soil that a gate
/// holds, free at its sides, passes: only the heights of soil that touches sideways are compared. Where this says why, a settling run
/// finds the state (run/settle.hpp).
std::string no_closed_form(const Scene&, const Filling&);
/// Steps that this settling run is likely to take: a P-wave passes eight times through the height of the soil.
double steps_to_settle(const Scene&, const Filling&);
/// Seconds that a P-wave takes through the height of the soil at rest, the slowest of several soils.
double time_through_height(const Scene&, const Filling&);

} // namespace kuzure::scene
