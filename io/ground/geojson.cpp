// GeoJSON: of WGS 84 as RFC 7946 has it, or of the system that an older file names in "crs".
#include "io/ground/crs.hpp"
#include "io/ground/features.hpp"
#include "io/json.hpp"
#if KUZURE_TERRAIN
#include <cmath>

namespace kuzure::io::ground {
namespace {

using nlohmann::json;

struct GeoJson {
    json features = json::array(); // each { geometry, properties }
    std::string crs;
    bool by_standard = false; // no member says otherwise: WGS 84
};

GeoJson geojson(const Path& path)
{
    if (!exists(path))
        throw BadInput(
            fmt::format("{}: there is no such file. Remedy: correct the path; it counts from the scene file's directory", path.string()));
    json all;
    try {
        all = parse_json(read_text(path, std::uint64_t(256) << 20));
    } catch (const json::exception& e) {
        throw BadInput(fmt::format("{}: cannot be read as GeoJSON: {}. Remedy: save the layer again", path.string(), e.what()));
    }
    const auto type_of = [](const json& j) {
        return j.is_object() && j.contains("type") && j["type"].is_string() ? j["type"].get<std::string>() : std::string();
    };
    GeoJson g;
    const auto type = type_of(all);
    if (type == "FeatureCollection" && all.contains("features") && all["features"].is_array()) g.features = all["features"];
    else if (type == "Feature") g.features.push_back(all);
    else if (type == "Polygon" || type == "MultiPolygon" || type == "Point")
        g.features.push_back({{"type", "Feature"}, {"geometry", all}, {"properties", nullptr}});
    else
        throw BadInput(fmt::format("{}: expected GeoJSON with a FeatureCollection, found {}. Remedy: save the layer as GeoJSON or .shp",
                                   path.string(), type.empty() ? "no \"type\"" : "\"" + type + "\""));
    if (!all.contains("crs")) {
        g.crs = crs_from("EPSG:4326", path.string()), g.by_standard = true;
    } else if (!all["crs"].is_null()) {
        const auto name = all["crs"].is_object() && all["crs"].contains("properties") && all["crs"]["properties"].is_object()
                              ? all["crs"]["properties"].value("name", json())
                              : json();
        if (!name.is_string())
            throw BadInput(fmt::format("{}: its member \"crs\" names no system. Remedy: save the layer again", path.string()));
        g.crs = crs_from(name.get<std::string>() == "urn:ogc:def:crs:OGC:1.3:CRS84" ? "EPSG:4326" : name.get<std::string>(), path.string());
    }
    return g;
}

std::array<double, 2> position(const json& j, const GeoJson& g, const Path& path, std::size_t feature)
{
    if (!j.is_array() || j.size() < 2 || !j[0].is_number() || !j[1].is_number())
        refuse(path, feature, "a corner is not [x, y]. Remedy: save the layer again");
    const std::array<double, 2> p{j[0].get<double>(), j[1].get<double>()};
    if (g.by_standard && (std::abs(p[0]) > 180 || std::abs(p[1]) > 90))
        refuse(path, feature,
               fmt::format("({}, {}) is no longitude and latitude, as GeoJSON has them where no \"crs\" stands in it (RFC 7946). "
                           "Remedy: save the layer as .shp, or as GeoJSON in EPSG:4326",
                           p[0], p[1]));
    if (!on_map(p[0], p[1])) refuse(path, feature, fmt::format("({}, {}) is no place on the map. {}", p[0], p[1], mend));
    return p;
}

const json& geometry(const json& feature, const Path& path, std::size_t k)
{
    if (!feature.is_object() || !feature.contains("geometry") || !feature["geometry"].is_object() ||
        !feature["geometry"].contains("type") || !feature["geometry"]["type"].is_string() || !feature["geometry"].contains("coordinates"))
        refuse(path, k, "it has no geometry. Remedy: delete it, or draw it");
    return feature["geometry"];
}

std::string property(const json& feature, const std::string& name)
{
    if (!feature.contains("properties") || !feature["properties"].is_object()) return "";
    for (const auto& [key, value] : feature["properties"].items()) {
        if (lower(key) != name || value.is_null()) continue;
        return value.is_string() ? value.get<std::string>() : value.dump();
    }
    return "";
}

} // namespace

Outlines outlines_of_geojson(const Path& path)
{
    const GeoJson g = geojson(path);
    Outlines out;
    out.crs = g.crs;
    for (std::size_t k = 0; k < g.features.size(); ++k) {
        const json& shape = geometry(g.features[k], path, k);
        const auto type = shape["type"].get<std::string>();
        Outline outline;
        const auto polygon = [&](const json& rings) {
            if (!rings.is_array() || rings.empty()) refuse(path, k, "a polygon without rings. Remedy: delete it, or draw it");
            for (const auto& corners : rings) {
                if (!corners.is_array()) refuse(path, k, "a ring that is no list of corners. Remedy: save the layer again");
                scene::Ring ring;
                for (const auto& p : corners) ring.push_back(position(p, g, path, k));
                outline.rings.push_back(checked_ring(std::move(ring), path, k));
            }
        };
        if (type == "Polygon") polygon(shape["coordinates"]);
        else if (type == "MultiPolygon" && shape["coordinates"].is_array())
            for (const auto& one : shape["coordinates"]) polygon(one);
        else
            refuse(
                path, k,
                fmt::format("expected a Polygon or MultiPolygon, found \"{}\". Remedy: QGIS: Lines to polygons, or draw the area", type));
        if (outline.rings.empty()) refuse(path, k, "it has no geometry. Remedy: delete it, or draw it");
        outline.thickness = thickness_of(property(g.features[k], "thickness"), path, k);
        out.features.push_back(std::move(outline));
    }
    return out;
}

NamedPoints points_of_geojson(const Path& path)
{
    const GeoJson g = geojson(path);
    NamedPoints out;
    out.crs = g.crs;
    for (std::size_t k = 0; k < g.features.size(); ++k) {
        const json& shape = geometry(g.features[k], path, k);
        if (shape["type"] != "Point")
            refuse(path, k, fmt::format("expected a Point, found {}. Remedy: QGIS: Vector geometry > Centroids", shape["type"].dump()));
        const auto p = position(shape["coordinates"], g, path, k);
        const auto name = property(g.features[k], "name");
        out.points.push_back({name.empty() ? std::to_string(k + 1) : name, p[0], p[1]});
    }
    return out;
}

} // namespace kuzure::io::ground
#endif
