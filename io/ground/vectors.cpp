#include "io/ground/vectors.hpp"
#include "io/ground/crs.hpp"
#include "io/ground/formats.hpp"
#include "io/ground/text.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#if KUZURE_TERRAIN
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <shapefil.h>
#endif

namespace kuzure::io {

bool inside(const std::vector<scene::Ring>& rings, double x, double y)
{
    bool in = false;
    for (const auto& ring : rings)
        for (std::size_t k = 0, last = ring.size() - 1; k < ring.size(); last = k++) {
            const auto &a = ring[last], &b = ring[k];
            // Half open in y, so that a corner counts once.
            if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])) in = !in;
        }
    return in;
}

namespace {
double signed_area(const scene::Ring& ring)
{
    double twice = 0;
    const auto o = ring[0]; // near the ring: map coordinates are large
    for (std::size_t k = 0, last = ring.size() - 1; k < ring.size(); last = k++)
        twice += (ring[last][0] - o[0]) * (ring[k][1] - o[1]) - (ring[k][0] - o[0]) * (ring[last][1] - o[1]);
    return 0.5 * twice;
}
} // namespace

double area(const std::vector<scene::Ring>& rings)
{
    double sum = 0;
    for (std::size_t k = 0; k < rings.size(); ++k) {
        int depth = 0;
        for (std::size_t i = 0; i < rings.size(); ++i)
            if (i != k && inside({rings[i]}, rings[k][0][0], rings[k][0][1])) ++depth;
        sum += (depth % 2 ? -1 : 1) * std::abs(signed_area(rings[k]));
    }
    return sum;
}

#if KUZURE_TERRAIN
namespace {

std::string lower(std::string text)
{
    for (char& c : text) c = char(std::tolower((unsigned char)(c)));
    return text;
}

[[noreturn]] void refuse(const Path& path, std::size_t feature, const std::string& text)
{
    throw BadInput(fmt::format("{}: feature {}: {}", path.string(), feature + 1, text));
}

constexpr const char* mend = "Remedy: in QGIS, Vector geometry > Fix geometries, or draw it again";

/// A closed ring without its last corner.
scene::Ring checked_ring(scene::Ring ring, const Path& path, std::size_t feature)
{
    for (const auto& p : ring)
        if (!std::isfinite(p[0]) || !std::isfinite(p[1])) refuse(path, feature, fmt::format("a corner is no place on the map. {}", mend));
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
            if (signed_area(ring) == 0) refuse(path, k, fmt::format("a ring that encloses nothing. {}", mend));
    for (std::size_t i = 0; i < o.features.size(); ++i)
        for (std::size_t k = 0; k < o.features.size(); ++k)
            if (i != k)
                for (const auto& ring : o.features[i].rings)
                    if (inside(o.features[k].rings, ring[0][0], ring[0][1]) && inside(o.features[k].rings, ring[1][0], ring[1][1]) &&
                        inside(o.features[k].rings, ring[2][0], ring[2][1]))
                        refuse(path, i,
                               fmt::format("it lies inside feature {}. Remedy: a hole is a ring of its polygon (QGIS: Add ring), "
                                           "not a feature of its own; else delete one",
                                           k + 1));
}

std::optional<double> number(const std::string& text)
{
    double x;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
    if (error != std::errc() || end != text.data() + text.size()) return {};
    return x;
}

// ---- shapefiles ---------------------------------------------------------------------------------------------------------

thread_local std::string last_words; // of shapelib

SAHooks hooks()
{
    SAHooks h;
    SASetupDefaultHooks(&h);
    h.Error = [](const char* text) { last_words = text; };
    return h;
}
struct CloseShp {
    void operator()(SHPInfo* s) const { SHPClose(s); }
};
struct CloseDbf {
    void operator()(DBFInfo* d) const { DBFClose(d); }
};
struct DestroyShape {
    void operator()(SHPObject* o) const { SHPDestroyObject(o); }
};
using Shp = std::unique_ptr<SHPInfo, CloseShp>;
using Dbf = std::unique_ptr<DBFInfo, CloseDbf>;
using Object = std::unique_ptr<SHPObject, DestroyShape>;

/// The features of a .shp and the text of one attribute of each; "" where there is none.
class Shapefile {
public:
    explicit Shapefile(const Path& path) : path_(path)
    {
        if (!exists(path))
            throw BadInput(fmt::format("{}: there is no such file. Remedy: correct the path; it counts from the scene file's directory",
                                       path.string()));
        for (const char* ending : {".shx"}) {
            Path beside = path;
            Path upper = path;
            beside.replace_extension(ending), upper.replace_extension(".SHX");
            if (!exists(beside) && !exists(upper))
                throw BadInput(
                    fmt::format("{}: its {} is not beside it. Remedy: copy .shp, .shx, .dbf and .prj together", path.string(), ending));
        }
        SAHooks h = hooks();
        last_words.clear();
        shp_.reset(SHPOpenLL(path.c_str(), "rb", &h));
        if (!shp_)
            throw BadInput(fmt::format("{}: cannot be read as a shapefile: {}. Remedy: save the layer again", path.string(), last_words));
        dbf_.reset(DBFOpenLL(path.c_str(), "rb", &h));
        SHPGetInfo(shp_.get(), &count_, &type_, nullptr, nullptr);
    }
    std::size_t count() const { return std::size_t(std::max(count_, 0)); }
    int type() const { return type_; }
    Object feature(std::size_t k) const
    {
        Object o(SHPReadObject(shp_.get(), int(k)));
        if (!o) refuse(path_, k, fmt::format("cannot be read: {}. Remedy: save the layer again", last_words));
        return o;
    }
    std::string attribute(const std::string& name, std::size_t k) const
    {
        if (!dbf_ || int(k) >= DBFGetRecordCount(dbf_.get())) return "";
        for (int field = 0; field < DBFGetFieldCount(dbf_.get()); ++field) {
            char called[XBASE_FLDNAME_LEN_READ + 1];
            DBFGetFieldInfo(dbf_.get(), field, called, nullptr, nullptr);
            if (lower(called) != name || DBFIsAttributeNULL(dbf_.get(), int(k), field)) continue;
            const char* text = DBFReadStringAttribute(dbf_.get(), int(k), field);
            const char* page = DBFGetCodePage(dbf_.get());
            return text ? ground::as_utf8(text, page && std::strncmp(page, "LDID", 4) != 0 ? page : "") : "";
        }
        return "";
    }

private:
    Path path_;
    Shp shp_;
    Dbf dbf_;
    int count_ = 0, type_ = 0;
};

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

const char* kind_of(int type)
{
    switch (type) {
    case SHPT_POINT:
    case SHPT_POINTZ:
    case SHPT_POINTM:
        return "points";
    case SHPT_ARC:
    case SHPT_ARCZ:
    case SHPT_ARCM:
        return "lines";
    case SHPT_POLYGON:
    case SHPT_POLYGONZ:
    case SHPT_POLYGONM:
        return "polygons";
    }
    return "shapes of another kind";
}

Outlines outlines_of_shp(const Path& path)
{
    const Shapefile file(path);
    if (std::string(kind_of(file.type())) != "polygons")
        throw BadInput(fmt::format("{}: expected polygons, found {}. Remedy: QGIS: Lines to polygons, or draw the area", path.string(),
                                   kind_of(file.type())));
    Outlines out;
    out.crs = ground::crs_beside(path);
    for (std::size_t k = 0; k < file.count(); ++k) {
        const Object o = file.feature(k);
        if (o->nSHPType == SHPT_NULL || o->nVertices == 0) refuse(path, k, "it has no geometry. Remedy: delete the row, or draw its area");
        Outline outline;
        for (int part = 0; part < std::max(o->nParts, 1); ++part) {
            const int from = o->nParts ? o->panPartStart[part] : 0, to = part + 1 < o->nParts ? o->panPartStart[part + 1] : o->nVertices;
            scene::Ring ring;
            for (int i = from; i < to; ++i) ring.push_back({o->padfX[i], o->padfY[i]});
            outline.rings.push_back(checked_ring(std::move(ring), path, k));
        }
        outline.thickness = thickness_of(file.attribute("thickness", k), path, k);
        out.features.push_back(std::move(outline));
    }
    return out;
}

NamedPoints points_of_shp(const Path& path)
{
    const Shapefile file(path);
    if (std::string(kind_of(file.type())) != "points")
        throw BadInput(
            fmt::format("{}: expected points, found {}. Remedy: QGIS: Vector geometry > Centroids", path.string(), kind_of(file.type())));
    NamedPoints out;
    out.crs = ground::crs_beside(path);
    for (std::size_t k = 0; k < file.count(); ++k) {
        const Object o = file.feature(k);
        if (o->nSHPType == SHPT_NULL || o->nVertices != 1 || !std::isfinite(o->padfX[0]) || !std::isfinite(o->padfY[0]))
            refuse(path, k, "it has no place. Remedy: delete the row, or draw its point");
        const auto name = file.attribute("name", k);
        out.points.push_back({name.empty() ? std::to_string(k + 1) : name, o->padfX[0], o->padfY[0]});
    }
    return out;
}

// ---- GeoJSON ------------------------------------------------------------------------------------------------------------

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
        all = json::parse(read_text(path, std::uint64_t(256) << 20));
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

bool is_shp(const Path& path)
{
    const auto ending = lower(path.extension().string());
    if (ending == ".shp") return true;
    if (ending == ".geojson" || ending == ".json") return false;
    throw BadInput(fmt::format(
        "{}: expected a name ending in .shp, .geojson or .json. Remedy: in QGIS, Export > Save features as ESRI Shapefile", path.string()));
}

// ---- writing ------------------------------------------------------------------------------------------------------------

/// Files in memory, by name, through which shapelib writes.
struct Files {
    std::map<std::string, std::string> bytes;
};
struct Open {
    std::string* bytes;
    std::size_t at = 0;
};
thread_local Files* written = nullptr;

SAHooks memory_hooks()
{
    SAHooks h = hooks();
    h.FOpen = [](const char* name, const char* mode) -> SAFile {
        if (mode[0] == 'w') written->bytes[name].clear();
        else if (!written->bytes.contains(name)) return nullptr;
        return reinterpret_cast<SAFile>(new Open{&written->bytes[name]});
    };
    h.FRead = [](void* to, SAOffset size, SAOffset n, SAFile f) -> SAOffset {
        auto& o = *reinterpret_cast<Open*>(f);
        const std::size_t left = o.at < o.bytes->size() ? o.bytes->size() - o.at : 0,
                          count = size ? std::min(std::size_t(n), left / size) : 0;
        std::memcpy(to, o.bytes->data() + o.at, count * size);
        o.at += count * size;
        return SAOffset(count);
    };
    h.FWrite = [](void* from, SAOffset size, SAOffset n, SAFile f) -> SAOffset {
        auto& o = *reinterpret_cast<Open*>(f);
        const std::size_t count = std::size_t(size) * n;
        if (o.bytes->size() < o.at + count) o.bytes->resize(o.at + count, '\0');
        std::memcpy(o.bytes->data() + o.at, from, count);
        o.at += count;
        return n;
    };
    h.FSeek = [](SAFile f, SAOffset to, int whence) -> SAOffset {
        auto& o = *reinterpret_cast<Open*>(f);
        o.at = std::size_t(to) + (whence == SEEK_CUR ? o.at : whence == SEEK_END ? o.bytes->size() : 0);
        return 0;
    };
    h.FTell = [](SAFile f) { return SAOffset(reinterpret_cast<Open*>(f)->at); };
    h.FFlush = [](SAFile) { return 0; };
    h.FClose = [](SAFile f) {
        delete reinterpret_cast<Open*>(f);
        return 0;
    };
    h.Remove = [](const char* name) {
        written->bytes.erase(name);
        return 0;
    };
    return h;
}

} // namespace

Outlines read_outlines(const Path& path)
{
    auto out = is_shp(path) ? outlines_of_shp(path) : outlines_of_geojson(path);
    check_outlines(out, path);
    return out;
}

NamedPoints read_points(const Path& path)
{
    auto out = is_shp(path) ? points_of_shp(path) : points_of_geojson(path);
    if (out.points.empty())
        throw BadInput(fmt::format("{}: expected points, found no feature at all. Remedy: draw them and save the layer", path.string()));
    return out;
}

void write_shapefile(const Place& place, const MapLayer& layer)
{
    Files files;
    written = &files;
    const int type = layer.kind == MapLayer::Polygons ? SHPT_POLYGON : layer.kind == MapLayer::Lines ? SHPT_ARC : SHPT_POINT;
    {
        SAHooks h = memory_hooks();
        const Shp shp(SHPCreateLL("map.shp", type, &h));
        const Dbf dbf(DBFCreateLL("map.dbf", "UTF-8", &h));
        ensure(shp && dbf, "a shapefile cannot be made in memory");
        const auto is_text = [&](std::size_t column) {
            return !layer.features.empty() && std::holds_alternative<std::string>(layer.features[0].values.at(column));
        };
        for (std::size_t c = 0; c < layer.columns.size(); ++c) {
            ensure(layer.columns[c].size() <= 10, "a column's name in a shapefile has more than 10 letters");
            const int at = is_text(c) ? DBFAddField(dbf.get(), layer.columns[c].c_str(), FTString, 254, 0)
                                      : DBFAddField(dbf.get(), layer.columns[c].c_str(), FTDouble, 24, 6);
            ensure(at == int(c), "a shapefile's column cannot be made");
        }
        // Without a column many readers refuse the table.
        if (layer.columns.empty()) DBFAddField(dbf.get(), "id", FTInteger, 9, 0);
        for (std::size_t k = 0; k < layer.features.size(); ++k) {
            const MapFeature& feature = layer.features[k];
            std::vector<int> starts;
            std::vector<double> x, y;
            for (const auto& part : feature.parts) {
                starts.push_back(int(x.size()));
                for (const auto& p : part) x.push_back(p[0]), y.push_back(p[1]);
                if (layer.kind == MapLayer::Polygons && !part.empty()) x.push_back(part[0][0]), y.push_back(part[0][1]);
            }
            const Object o(
                SHPCreateObject(type, -1, int(starts.size()), starts.data(), nullptr, int(x.size()), x.data(), y.data(), nullptr, nullptr));
            if (layer.kind == MapLayer::Polygons) SHPRewindObject(shp.get(), o.get()); // outer rings clockwise, holes against it
            const int row = SHPWriteObject(shp.get(), -1, o.get());
            ensure(row == int(k), "a shapefile's feature cannot be written");
            ensure(feature.values.size() == layer.columns.size(), "a feature has more or fewer values than its layer has columns");
            for (std::size_t c = 0; c < layer.columns.size(); ++c) {
                if (const auto* text = std::get_if<std::string>(&feature.values[c]))
                    DBFWriteStringAttribute(dbf.get(), row, int(c), text->substr(0, 254).c_str());
                else if (const double v = std::get<double>(feature.values[c]); std::isfinite(v))
                    DBFWriteDoubleAttribute(dbf.get(), row, int(c), v);
                else DBFWriteNULLAttribute(dbf.get(), row, int(c));
            }
            if (layer.columns.empty()) DBFWriteIntegerAttribute(dbf.get(), row, 0, int(k + 1));
        }
    }
    written = nullptr;
    const auto stem = Path(place.name()).stem().string();
    if (!layer.crs.empty()) write_lightly(place.beside(stem + ".prj"), esri_wkt(layer.crs) + "\n");
    for (const char* ending : {".cpg", ".dbf", ".shx", ".shp"}) // what points to the others last
        write_lightly(place.beside(stem + ending), files.bytes["map" + std::string(ending)]);
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
void write_shapefile(const Place&, const MapLayer&) { throw Broken("maps are written by a program that was built without them"); }

#endif

} // namespace kuzure::io
