#pragma once
// The heap that a run left behind, measured alike at every resolution: its height by volume over the same widths, whatever the
// spacing, so that single thrown grains do not move it and differences between resolutions are those of the soil.
#include "io/snapshot.hpp"
#include "solver/scene/fill.hpp"
#include <optional>
#include <vector>

namespace kuzure::study {

/// Which way a heap spreads: along x in 2-D, away from its axis where all bodies stand upright and round on one axis, else along
/// x in a band through its middle.
enum class Spread { Plane, Radial, Band };

/// Positions and heights (m) along the spread; x counts from the origin in Plane and Band, from the axis in Radial.
struct Profile {
    Spread spread = Spread::Plane;
    std::vector<double> at, height;
    double start_low = 0, start_high = 0; // m, where the soil stood before it moved
    double top = 0;                       // m, greatest height

    /// Height (m) at a point, linear between neighbours, 0 beyond.
    double operator()(double x) const;
    /// How far (m) the soil that stands at least `grain` high has run beyond where it stood: the mean of the sides that moved.
    double runout(double grain) const;
};
/// `window` (m): the width over which heights are taken.
Profile measure_profile(const Scene&, const io::SoilSnapshot&, double window);

/// sqrt(sum (a - b)^2/sum b^2) over the points of b where either stands: P_d of two profiles.
double profile_distance(const Profile& a, const Profile& b);

/// For each row of the initial lattice (2-D): x left of which no particle moved more than `limit` (m); {x, z}.
std::vector<std::array<double, 2>> failure_line(const io::SoilSnapshot&, double spacing, double limit);

/// L2 norm of sigma_zz + rho g depth over that of rho g depth, and the way (m) that the top row settled: an elastic column at
/// rest under its weight. Depths are those at the start.
struct AtRest {
    double stress, settlement, settlement_expected;
};
AtRest measure_at_rest(const Scene&, const io::SoilSnapshot&);

/// Greatest speed of a run, m/s: `of_steps`, seen at its steps since the last restart, or that of the rows of its history.
double greatest_speed(const io::Path& run, double of_steps);

} // namespace kuzure::study
