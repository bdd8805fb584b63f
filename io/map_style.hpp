#pragma once
// The maps of a run by name, and how they are coloured, in QGIS and in the report alike.
#include "io/canvas.hpp"
#include <array>
#include <string>

namespace kuzure::io {

struct MapKind {
    const char *name, *unit, *title; // of the file, without .tif
};
inline constexpr std::array map_kinds{
    MapKind{"h_max", "m", "greatest thickness"},
    MapKind{"h_end", "m", "thickness at the end"},
    MapKind{"v_max", "m/s", "greatest speed"},
    MapKind{"hv_max", "m2/s", "greatest thickness times speed"},
    MapKind{"p_max", "kPa", "greatest dynamic pressure"},
    MapKind{"force_deposit", "kPa", "active earth pressure of the deposit"},
    MapKind{"t_arrival", "s", "arrival"},
    MapKind{"t_stop", "s", "last motion"},
    MapKind{"bed_change", "m", "change of the surface"},
    MapKind{"trust", "layers", "layers of particles in the deposit"},
};
/// Whether its numbers have both signs.
inline bool has_signs(const MapKind& kind) { return std::string_view(kind.name) == "bed_change"; }

/// The colour of a share (0 to 1) of a map's range.
Rgb map_color(double share, bool signs);

/// A QGIS style (.qml, of QGIS 3): a single band in colours from `low` to `high`, what is no number clear.
std::string qml_style(const MapKind&, double low, double high);

} // namespace kuzure::io
