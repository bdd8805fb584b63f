#pragma once
// Charts as SVG, in the colours of the page: curves over time, and the roofline.
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace kuzure::report {

/// A number for people: four digits, and thousands or millions as a letter where `prefixed`.
std::string shown(double, bool prefixed = false);

struct Curve {
    std::string label;
    std::span<const double> y;
};

/// Curves over x with axes, units and a legend that names the last values; a sentence where there are too few points. Values
/// that are not finite leave a gap. `from_zero` keeps zero on the axis.
std::string chart(const std::string& title, const std::string& x_name, const std::string& x_unit, std::span<const double> x,
                  const std::string& y_unit, const std::vector<Curve>&, bool from_zero = true);

/// What a machine can do at most, 1e9 a second.
struct Roofs {
    double gflops, gbytes;
    std::string label; // of the level roof
};
struct Dot {
    std::string label;
    double intensity, gflops; // flop/byte, 1e9 flop/s
};
/// Attainable and reached operations a second over operations a byte, both logarithmic. Without roofs, the dots alone.
std::string roofline(const Roofs*, const std::vector<Dot>&);

} // namespace kuzure::report
