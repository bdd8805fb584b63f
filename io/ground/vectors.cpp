#include "io/ground/vectors.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/features.hpp"
#include "solver/scene/ring.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::io {

double area(const std::vector<scene::Ring>& rings)
{
    double sum = 0;
    for (std::size_t k = 0; k < rings.size(); ++k) {
        int depth = 0;
        for (std::size_t i = 0; i < rings.size(); ++i)
            if (i != k && scene::encloses(rings[i], rings[k][0][0], rings[k][0][1])) ++depth;
        sum += (depth % 2 ? -1 : 1) * std::abs(scene::signed_area(rings[k]));
    }
    return sum;
}

#if KUZURE_TERRAIN
namespace ground {

std::string lower(std::string text)
{
    for (char& c : text) c = char(std::tolower((unsigned char)(c)));
    return text;
}

bool on_map(double x, double y) { return std::fabs(x) < 1e9 && std::fabs(y) < 1e9; }

[[noreturn]] void refuse(const Path& path, std::size_t feature, const std::string& text)
{
    throw BadInput(fmt::format("{}: feature {}: {}", path.string(), feature + 1, text));
}

/// A closed ring without its last corner.
scene::Ring checked_ring(scene::Ring ring, const Path& path, std::size_t feature)
{
    for (const auto& p : ring)
        if (!on_map(p[0], p[1])) refuse(path, feature, fmt::format("a corner is no place on the map. {}", mend));
    if (ring.size() < 2 || ring.front() != ring.back())
        refuse(path, feature,
               ring.empty() ? fmt::format("a ring without corners. {}", mend)
                            : fmt::format("its ring is open: it begins at ({}, {}) and ends at ({}, {}). {}", ring.front()[0],
                                          ring.front()[1], ring.back()[0], ring.back()[1], mend));
    ring.pop_back();
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    if (ring.size() < 3) refuse(path, feature, fmt::format("a ring that encloses nothing. {}", mend));
    return ring;
}

std::optional<double> number(const std::string& text)
{
    double x;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
    if (error != std::errc() || end != text.data() + text.size()) return {};
    return x;
}

std::optional<double> thickness_of(const std::string& text, const Path& path, std::size_t feature)
{
    if (text.find_first_not_of(' ') == text.npos) return {};
    const auto first = text.find_first_not_of(' ');
    const auto x = number(text.substr(first, text.find_last_not_of(' ') + 1 - first));
    if (!x || !std::isfinite(*x) || *x < 0)
        refuse(path, feature,
               fmt::format("its attribute \"thickness\" should be metres from 0, found \"{}\". Remedy: correct the attribute table", text));
    return x;
}

} // namespace ground

using namespace ground;

namespace {

struct Side {
    std::array<double, 2> a, b;
    std::size_t feature;
    double low_x() const { return std::min(a[0], b[0]); }
    double high_x() const { return std::max(a[0], b[0]); }
};

/// Where two sides cross, each within the other; sides that touch do not.
std::optional<std::array<double, 2>> crossing(const Side& p, const Side& q)
{
    if (std::max(p.a[1], p.b[1]) < std::min(q.a[1], q.b[1]) || std::max(q.a[1], q.b[1]) < std::min(p.a[1], p.b[1])) return {};
    const auto turn = [](const auto& a, const auto& b, const auto& c) {
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    };
    const double c = turn(p.a, p.b, q.a), d = turn(p.a, p.b, q.b), e = turn(q.a, q.b, p.a), f = turn(q.a, q.b, p.b);
    if (!(c * d < 0) || !(e * f < 0)) return {};
    const double t = e / (e - f);
    return std::array<double, 2>{p.a[0] + t * (p.b[0] - p.a[0]), p.a[1] + t * (p.b[1] - p.a[1])};
}

void check_outlines(const Outlines& o, const Path& path)
{
    if (o.features.empty())
        throw BadInput(
            fmt::format("{}: expected polygons, found no feature at all. Remedy: draw the outline and save the layer", path.string()));
    std::vector<Side> sides;
    for (std::size_t k = 0; k < o.features.size(); ++k)
        for (const auto& ring : o.features[k].rings)
            for (std::size_t i = 0, last = ring.size() - 1; i < ring.size(); last = i++) sides.push_back({ring[last], ring[i], k});
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.low_x() < b.low_x(); });
    for (std::size_t i = 0; i < sides.size(); ++i)
        for (std::size_t k = i + 1; k < sides.size() && sides[k].low_x() <= sides[i].high_x(); ++k)
            if (const auto at = crossing(sides[i], sides[k])) {
                const auto other = sides[k].feature;
                refuse(path, sides[i].feature,
                       other == sides[i].feature
                           ? fmt::format("its outline crosses itself at ({:.10g}, {:.10g}). {}", (*at)[0], (*at)[1], mend)
                           : fmt::format(
                                 "it overlaps feature {} at ({:.10g}, {:.10g}). Remedy: unite them (QGIS: Vector > Dissolve), or cut one",
                                 other + 1, (*at)[0], (*at)[1]));
            }
    for (std::size_t k = 0; k < o.features.size(); ++k)
        for (const auto& ring : o.features[k].rings)
            if (scene::signed_area(ring) == 0) refuse(path, k, fmt::format("a ring that encloses nothing. {}", mend));
    for (std::size_t i = 0; i < o.features.size(); ++i)
        for (std::size_t k = 0; k < o.features.size(); ++k)
            if (i != k)
                for (const auto& ring : o.features[i].rings)
                    if (scene::encloses(o.features[k].rings, ring[0][0], ring[0][1]) &&
                        scene::encloses(o.features[k].rings, ring[1][0], ring[1][1]) &&
                        scene::encloses(o.features[k].rings, ring[2][0], ring[2][1]))
                        refuse(path, i,
                               fmt::format("it lies inside feature {}. Remedy: a hole is a ring of its polygon (QGIS: Add ring), "
                                           "not a feature of its own; else delete one",
                                           k + 1));
}

bool is_shp(const Path& path)
{
    const auto ending = lower(path.extension().string());
    if (ending == ".shp") return true;
    if (ending == ".geojson" || ending == ".json") return false;
    throw BadInput(fmt::format(
        "{}: expected a name ending in .shp, .geojson or .json. Remedy: in QGIS, Export > Save features as ESRI Shapefile", path.string()));
}

} // namespace

Outlines read_outlines(const Path& path)
{
    auto out = is_shp(path) ? outlines_of_shapefile(path) : outlines_of_geojson(path);
    check_outlines(out, path);
    return out;
}

NamedPoints read_points(const Path& path)
{
    auto out = is_shp(path) ? points_of_shapefile(path) : points_of_geojson(path);
    if (out.points.empty())
        throw BadInput(fmt::format("{}: expected points, found no feature at all. Remedy: draw them and save the layer", path.string()));
    return out;
}

#else

Outlines read_outlines(const Path& path)
{
    need_terrain(path.string());
    return {};
}
NamedPoints read_points(const Path& path)
{
    need_terrain(path.string());
    return {};
}
#endif

} // namespace kuzure::io
