#pragma once
// Outlines, points and lines on the map: shapefiles and GeoJSON. Shapefiles are what kuzure writes: with a .prj they carry any system of
// coordinates and every GIS reads them, where GeoJSON (RFC 7946) is of WGS 84 alone.
#include "io/file.hpp"
#include "solver/scene/parts.hpp"
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace kuzure::io {

struct Outline {
    std::vector<scene::Ring> rings;  // outer ones and holes, map coordinates: inside is what an odd number of them encloses
    std::optional<double> thickness; // m, of the attribute of this name
};
struct Outlines {
    std::vector<Outline> features;
    std::string crs; // WKT; empty: none
};
/// Polygons of a .shp or GeoJSON. Throws BadInput with file and feature (from 1): open or crossing rings, features in
/// one another, no areas.
Outlines read_outlines(const Path&);

struct NamedPoint {
    std::string name; // of the attribute "name", else its number from 1
    double x, y;
};
struct NamedPoints {
    std::vector<NamedPoint> points;
    std::string crs; // WKT; empty: none
};
/// Points of a .shp or GeoJSON. Throws BadInput with file and feature.
NamedPoints read_points(const Path&);

/// Something to draw on the map, with attributes.
struct MapFeature {
    std::vector<scene::Ring> parts; // rings, lines, or one point
    std::vector<std::variant<double, std::string>> values;
};
struct MapLayer {
    enum Kind { Polygons, Lines, Points } kind = Polygons;
    std::vector<std::string> columns; // of the attributes, at most 10 letters
    std::vector<MapFeature> features;
    std::string crs; // WKT; empty: none
};
/// name.shp with .shx, .dbf, .cpg and .prj beside it; the same bytes for the same layer. Throws IoFailed.
void write_shapefile(const Place& shp, const MapLayer&);

/// Area of what an odd number of rings encloses, m^2, where no two cross.
double area(const std::vector<scene::Ring>&);

} // namespace kuzure::io
