#pragma once
// Coordinate systems of maps (PROJ). A system is kept as WKT in one line; coordinates are always x to the east, y to the north (degrees of
// longitude and latitude where it is geographic), whatever order of axes the system itself has.
#include <array>
#include <memory>
#include <span>
#include <string>

namespace kuzure::io {

/// Whether this build reads and writes maps; where not, every function of io/ground throws BadInput with the packages to install.
bool has_terrain();
/// Throws BadInput with the packages to install where has_terrain() is false.
void need_terrain(const std::string& who);
/// What it says.
extern const char* const built_without_maps;

/// The WKT of "EPSG:6670", of WKT of any kind or of a PROJ string. A system that EPSG knows becomes EPSG's own, heights are left out.
/// Throws BadInput, beginning with `who` (a file, a key).
std::string crs_from(const std::string& text, const std::string& who);
/// "JGD2011 / Japan Plane Rectangular CS II (EPSG:6670)"
std::string crs_name(const std::string& wkt);
/// The number of EPSG; 0 where it has none.
int epsg_of(const std::string& wkt);
bool is_geographic(const std::string& wkt);
/// Metres of one unit of a projected system's axes; 0 where they differ or are no lengths.
double metres_per_unit(const std::string& wkt);
/// Whether coordinates mean the same in both.
bool same_crs(const std::string& a, const std::string& b);
/// Whether a point lies where the system is meant to be used, or within two degrees of it; true where nothing is known of that.
bool lies_in(const std::string& wkt, double x, double y);
/// "EPSG:32652": the zone of UTM around a longitude and latitude.
std::string utm_zone(double longitude, double latitude);
/// As .prj files have it (ESRI's WKT).
std::string esri_wkt(const std::string& wkt);

/// Coordinates from one system to another.
class Transform {
public:
    /// Throws BadInput where no exact way is known, beginning with `who`.
    Transform(const std::string& from, const std::string& to, const std::string& who);
    Transform(Transform&&) noexcept;
    ~Transform();
    /// NaN where it cannot be.
    std::array<double, 2> operator()(double x, double y) const;
    std::array<double, 2> back(double x, double y) const;

private:
    struct Handle;
    std::unique_ptr<Handle> handle_;
};

} // namespace kuzure::io
