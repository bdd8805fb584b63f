#pragma once
// What colours the soil of a picture, read from snapshots: displacement, speed, plastic_strain, pressure, and every table of a snapshot.
#include "io/hdf5.hpp"
#include "io/picture.hpp"

namespace kuzure::io {

/// The names by which the soil of this snapshot can be coloured.
std::vector<std::string> soil_colors(const H5Reader&);
/// The field of a snapshot that a colour of [output] picture needs.
const char* field_behind(scene::Color);
const char* name_of(scene::Color);

/// One of soil_colors().
class SoilColor {
public:
    /// Throws BadInput, with the nearest name, where the snapshot has nothing of that name.
    SoilColor(const H5Reader&, const std::string& name);
    const Quantity& quantity() const { return quantity_; }
    const std::string& name() const { return name_; }
    bool has_signs() const { return quantity_.map == Quantity::Map::Diverging; }

    struct Soil {
        std::vector<Vector> positions; // m
        std::vector<double> values;    // one a position
        double time = 0;               // s
        bool broken = false;           // the numbers failed in this state
        std::optional<Vector> failed;  // m, where; absent if that is no number either
    };
    /// The soil of a snapshot, in the file's order. Throws IoFailed.
    Soil read(const H5Reader&) const;

private:
    enum class Of { Number, Length, Component, Pressure, Deviator };
    std::string name_, table_;
    Of of_ = Of::Number;
    int component_ = 0;
    Quantity quantity_;
};

/// The wall points of a snapshot or of walls.hdf. Throws IoFailed.
std::vector<Vector> read_walls(const H5Reader&);

} // namespace kuzure::io
