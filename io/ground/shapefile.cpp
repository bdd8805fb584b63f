// Shapefiles by shapelib: read, and written through memory so that they come into being whole.
#include "io/ground/crs.hpp"
#include "io/ground/features.hpp"
#include "io/ground/formats.hpp"
#include "io/ground/text.hpp"
#if KUZURE_TERRAIN
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <shapefil.h>
#endif

namespace kuzure::io {

#if KUZURE_TERRAIN
namespace ground {
namespace {

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
            return text ? as_utf8(text, page && std::strncmp(page, "LDID", 4) != 0 ? page : "") : "";
        }
        return "";
    }

private:
    Path path_;
    Shp shp_;
    Dbf dbf_;
    int count_ = 0, type_ = 0;
};

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

} // namespace

Outlines outlines_of_shapefile(const Path& path)
{
    const Shapefile file(path);
    if (std::string(kind_of(file.type())) != "polygons")
        throw BadInput(fmt::format("{}: expected polygons, found {}. Remedy: QGIS: Lines to polygons, or draw the area", path.string(),
                                   kind_of(file.type())));
    Outlines out;
    out.crs = crs_beside(path);
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

NamedPoints points_of_shapefile(const Path& path)
{
    const Shapefile file(path);
    if (std::string(kind_of(file.type())) != "points")
        throw BadInput(
            fmt::format("{}: expected points, found {}. Remedy: QGIS: Vector geometry > Centroids", path.string(), kind_of(file.type())));
    NamedPoints out;
    out.crs = crs_beside(path);
    for (std::size_t k = 0; k < file.count(); ++k) {
        const Object o = file.feature(k);
        if (o->nSHPType == SHPT_NULL || o->nVertices != 1 || !on_map(o->padfX[0], o->padfY[0]))
            refuse(path, k, "it has no place. Remedy: delete the row, or draw its point");
        const auto name = file.attribute("name", k);
        out.points.push_back({name.empty() ? std::to_string(k + 1) : name, o->padfX[0], o->padfY[0]});
    }
    return out;
}

namespace {

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
} // namespace ground

void write_shapefile(const Place& place, const MapLayer& layer)
{
    using namespace ground;
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

void write_shapefile(const Place&, const MapLayer&) { throw Broken("maps are written by a program that was built without them"); }

#endif

} // namespace kuzure::io
