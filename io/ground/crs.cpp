#include "io/ground/crs.hpp"
#include "io/trim.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#if KUZURE_TERRAIN
#include <limits>
#include <map>
#include <proj.h>
#include <proj_experimental.h>
#include <sstream>
#endif

namespace kuzure::io {

bool has_terrain()
{
#if KUZURE_TERRAIN
    return true;
#else
    return false;
#endif
}

const char* const built_without_maps = "this kuzure was built without maps. Remedy: run jobs/install.sh (Debian: libtiff-dev "
                                       "libgeotiff-dev libproj-dev libshp-dev libpugixml-dev libarchive-dev) and build again with "
                                       "-D KUZURE_TERRAIN=ON";

void need_terrain(const std::string& who)
{
    if (!has_terrain()) throw BadInput(who + ": " + built_without_maps);
}

std::string utm_zone(double longitude, double latitude)
{
    const int zone = std::clamp(int(std::floor((longitude + 180) / 6)) + 1, 1, 60);
    return fmt::format("EPSG:{}", (latitude < 0 ? 32700 : 32600) + zone);
}

#if KUZURE_TERRAIN
namespace {

struct FreeContext {
    void operator()(PJ_CONTEXT* c) const { proj_context_destroy(c); }
};
struct FreePj {
    void operator()(PJ* p) const { proj_destroy(p); }
};
using Context = std::unique_ptr<PJ_CONTEXT, FreeContext>;
using Pj = std::unique_ptr<PJ, FreePj>;

Context new_context()
{
    Context c(proj_context_create());
    proj_log_level(c.get(), PJ_LOG_NONE);
    proj_context_set_enable_network(c.get(), 0); // the same answer everywhere
    return c;
}

/// This thread's: to open the library's database takes longer than most of what is asked of it.
PJ_CONTEXT* context()
{
    thread_local const Context c = new_context();
    return c.get();
}

bool is_crs(const Pj& p) { return p && proj_is_crs(p.get()); }

/// The part of a system that says where in plan: without heights, and without a way to another datum.
Pj horizontal(PJ_CONTEXT* c, Pj p)
{
    for (int k = 0; k < 4 && p; ++k) {
        const auto type = proj_get_type(p.get());
        if (type == PJ_TYPE_COMPOUND_CRS) p.reset(proj_crs_get_sub_crs(c, p.get(), 0));
        else if (type == PJ_TYPE_BOUND_CRS) p.reset(proj_get_source_crs(c, p.get()));
        else if (type == PJ_TYPE_GEOGRAPHIC_3D_CRS) p.reset(proj_crs_demote_to_2D(c, nullptr, p.get()));
        else break;
    }
    return p;
}

std::string wkt_of(PJ_CONTEXT* c, const PJ* p, PJ_WKT_TYPE type = PJ_WKT2_2019)
{
    const char* const options[] = {"MULTILINE=NO", nullptr};
    const char* text = proj_as_wkt(c, p, type, options);
    return text ? text : "";
}

/// EPSG's own system where this one is the same and says so with confidence: one text for one system, whatever file it came from.
Pj known(PJ_CONTEXT* c, Pj p)
{
    const auto number = [](const Pj& x) -> std::string {
        const char *code = proj_get_id_code(x.get(), 0), *authority = proj_get_id_auth_name(x.get(), 0);
        return code && authority && std::string(authority) == "EPSG" ? code : "";
    };
    std::string code = number(p);
    if (code.empty()) {
        int* confidence = nullptr;
        PJ_OBJ_LIST* found = proj_identify(c, p.get(), "EPSG", nullptr, &confidence);
        if (found && proj_list_get_count(found) > 0 && confidence[0] >= 90) code = number(Pj(proj_list_get(c, found, 0)));
        proj_int_list_destroy(confidence);
        proj_list_destroy(found);
    }
    if (code.empty()) return p;
    Pj own(proj_create_from_database(c, "EPSG", code.c_str(), PJ_CATEGORY_CRS, 0, nullptr));
    return own ? std::move(own) : std::move(p);
}

Pj made(PJ_CONTEXT* c, const std::string& wkt)
{
    Pj p(proj_create(c, wkt.c_str()));
    ensure(is_crs(p), "a coordinate system is no WKT");
    return p;
}

bool geographic(const Pj& p)
{
    const auto type = proj_get_type(p.get());
    return type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
}

/// A number of an authority, the number of a system of heights behind a plus left out.
Pj by_number(PJ_CONTEXT* c, std::string authority, const std::string& code)
{
    for (char& x : authority) x = x >= 'a' && x <= 'z' ? char(x - 'a' + 'A') : x;
    return Pj(proj_create_from_database(c, authority.c_str(), code.substr(0, code.find('+')).c_str(), PJ_CATEGORY_CRS, 0, nullptr));
}

/// A PROJ string with its +proj= in front, by which PROJ knows it; empty where a word has no plus, or none is +proj=.
std::string proj_words(const std::string& text)
{
    std::istringstream in(text);
    std::string first, others;
    for (std::string word; in >> word;) {
        if (!word.starts_with("+")) return {};
        if (first.empty() && word.starts_with("+proj=")) first = word;
        else others += " " + word;
    }
    return first.empty() ? first : first + others;
}

/// "EPSG:6670", "urn:ogc:def:crs:EPSG::6670", WKT, a PROJ string, PROJJSON. Each by its own way: what is none of them PROJ would take for
/// a name, and find a system whose name is like it.
Pj by_its_form(PJ_CONTEXT* c, const std::string& text)
{
    const std::string urn = "urn:ogc:def:crs:";
    const auto colon = text.find(':');
    if (text.starts_with("{")) return Pj(proj_create(c, text.c_str()));
    if (text.find_first_of("[(") != text.npos) return Pj(proj_create_from_wkt(c, text.c_str(), nullptr, nullptr, nullptr));
    if (text.starts_with("+")) {
        const auto words = proj_words(text);
        if (words.empty()) return Pj();
        Pj p(proj_create(c, words.c_str()));
        if (!is_crs(p) && words.find("+type=crs") == words.npos) p.reset(proj_create(c, (words + " +type=crs").c_str()));
        return p;
    }
    if (text.starts_with(urn) && text.find(':', urn.size()) != text.npos)
        return by_number(c, text.substr(urn.size(), text.find(':', urn.size()) - urn.size()), text.substr(text.rfind(':') + 1));
    return colon == text.npos ? Pj() : by_number(c, text.substr(0, colon), text.substr(colon + 1));
}

std::string newly_read(const std::string& text, const std::string& who)
{
    auto* c = context();
    Pj p = by_its_form(c, text);
    const auto shown = text.substr(0, 80);
    if (!is_crs(p))
        throw BadInput(fmt::format("{}: expected a coordinate system, found \"{}\". Remedy: name it by its EPSG number, as "
                                   "\"EPSG:6670\" (epsg.io finds it)",
                                   who, shown));
    p = horizontal(c, std::move(p));
    const auto type = is_crs(p) ? proj_get_type(p.get()) : PJ_TYPE_UNKNOWN;
    if (type != PJ_TYPE_PROJECTED_CRS && type != PJ_TYPE_GEOGRAPHIC_2D_CRS)
        throw BadInput(fmt::format("{}: expected a projected or geographic coordinate system, found \"{}\", which does not say where in "
                                   "plan. Remedy: name the map's system by its EPSG number, as \"EPSG:6670\"",
                                   who, shown));
    return wkt_of(c, known(c, std::move(p)).get());
}

} // namespace

std::string crs_from(const std::string& given, const std::string& who)
{
    const auto text = trimmed(given); // PROJ would keep a line's end behind a number as part of it
    // Each of hundreds of tiles names the one system of them all.
    thread_local std::map<std::string, std::string> already_read;
    if (const auto found = already_read.find(text); found != already_read.end()) return found->second;
    auto wkt = newly_read(text, who);
    if (already_read.size() >= 64) already_read.clear();
    already_read.emplace(text, wkt);
    return wkt;
}

std::string crs_name(const std::string& wkt)
{
    auto* c = context();
    const Pj p = made(c, wkt);
    const char* code = proj_get_id_code(p.get(), 0);
    return code ? fmt::format("{} ({}:{})", proj_get_name(p.get()), proj_get_id_auth_name(p.get(), 0), code) : proj_get_name(p.get());
}

int epsg_of(const std::string& wkt)
{
    auto* c = context();
    const Pj p = made(c, wkt);
    const char *code = proj_get_id_code(p.get(), 0), *authority = proj_get_id_auth_name(p.get(), 0);
    return code && authority && std::string(authority) == "EPSG" ? std::atoi(code) : 0;
}

bool is_geographic(const std::string& wkt)
{
    auto* c = context();
    return geographic(made(c, wkt));
}

double metres_per_unit(const std::string& wkt)
{
    auto* c = context();
    const Pj p = made(c, wkt);
    if (geographic(p)) return 0;
    const Pj axes(proj_crs_get_coordinate_system(c, p.get()));
    double factor[2] = {0, 0};
    for (int k = 0; k < 2; ++k)
        if (!axes || !proj_cs_get_axis_info(c, axes.get(), k, nullptr, nullptr, nullptr, &factor[k], nullptr, nullptr, nullptr)) return 0;
    return factor[0] == factor[1] ? factor[0] : 0;
}

bool same_crs(const std::string& a, const std::string& b)
{
    if (a == b) return true;
    if (a.empty() || b.empty()) return false;
    auto* c = context();
    // Compared as they are used: x to the east, y to the north.
    const auto plain = [&](const std::string& wkt) { return Pj(proj_normalize_for_visualization(c, made(c, wkt).get())); };
    const Pj p = plain(a), q = plain(b);
    if (p && q && proj_is_equivalent_to_with_ctx(c, p.get(), q.get(), PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS)) return true;
    // Without a datum's name its numbers count.
    if (!p || !q || (a.find("nknown") == a.npos && b.find("nknown") == b.npos)) return false;
    const auto numbers = [&](const Pj& x) {
        const char* text = proj_as_proj_string(c, x.get(), PJ_PROJ_5, nullptr);
        return std::string(text ? text : "");
    };
    const auto said = numbers(p);
    return !said.empty() && said == numbers(q);
}

bool lies_in(const std::string& wkt, double x, double y)
{
    auto* c = context();
    const Pj p = made(c, wkt);
    double west = 0, south = 0, east = 0, north = 0;
    if (!proj_get_area_of_use(c, p.get(), &west, &south, &east, &north, nullptr) || west == -1000 || west > east) return true;
    const Pj way(proj_create_crs_to_crs(c, wkt.c_str(), "EPSG:4326", nullptr));
    const Pj plain(way ? proj_normalize_for_visualization(c, way.get()) : nullptr);
    if (!plain) return true;
    const PJ_COORD at = proj_trans(plain.get(), PJ_FWD, proj_coord(x, y, 0, HUGE_VAL));
    const double margin = 2;
    return at.xy.x >= west - margin && at.xy.x <= east + margin && at.xy.y >= south - margin && at.xy.y <= north + margin;
}

std::string esri_wkt(const std::string& wkt)
{
    auto* c = context();
    auto text = wkt_of(c, made(c, wkt).get(), PJ_WKT1_ESRI);
    return text.empty() ? wkt : text;
}

struct Transform::Handle {
    Context c;
    Pj p;
};

Transform::Transform(const std::string& from, const std::string& to, const std::string& who) : handle_(std::make_unique<Handle>())
{
    handle_->c = new_context();
    auto* c = handle_->c.get();
    // A "ballpark" way leaves the difference of the datums out, which may be hundreds of metres.
    const char* const options[] = {"ALLOW_BALLPARK=NO", nullptr};
    const Pj a = made(c, from), b = made(c, to);
    const Pj way(proj_create_crs_to_crs_from_pj(c, a.get(), b.get(), nullptr, options));
    if (way) handle_->p.reset(proj_normalize_for_visualization(c, way.get()));
    if (!handle_->p)
        throw BadInput(fmt::format("{}: no exact way is known from its coordinate system, {}, to {}. Remedy: project the file first, for "
                                   "instance with gdalwarp or ogr2ogr -t_srs",
                                   who, crs_name(from), crs_name(to)));
}
Transform::Transform(Transform&&) noexcept = default;
Transform::~Transform() = default;

namespace {
std::array<double, 2> moved(PJ* p, PJ_DIRECTION direction, double x, double y)
{
    const PJ_COORD at = proj_trans(p, direction, proj_coord(x, y, 0, HUGE_VAL));
    const double none = std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(at.xy.x) || !std::isfinite(at.xy.y)) return {none, none};
    return {at.xy.x, at.xy.y};
}
} // namespace

std::array<double, 2> Transform::operator()(double x, double y) const { return moved(handle_->p.get(), PJ_FWD, x, y); }
std::array<double, 2> Transform::back(double x, double y) const { return moved(handle_->p.get(), PJ_INV, x, y); }

#else

std::string crs_from(const std::string&, const std::string& who)
{
    need_terrain(who);
    return "";
}
std::string crs_name(const std::string& wkt) { return wkt; }
int epsg_of(const std::string&) { return 0; }
bool is_geographic(const std::string&) { return false; }
double metres_per_unit(const std::string&) { return 1; }
bool same_crs(const std::string& a, const std::string& b) { return a == b; }
bool lies_in(const std::string&, double, double) { return true; }
std::string esri_wkt(const std::string& wkt) { return wkt; }
struct Transform::Handle {};
Transform::Transform(const std::string&, const std::string&, const std::string& who) { need_terrain(who); }
Transform::Transform(Transform&&) noexcept = default;
Transform::~Transform() = default;
std::array<double, 2> Transform::operator()(double x, double y) const { return {x, y}; }
std::array<double, 2> Transform::back(double x, double y) const { return {x, y}; }

#endif

} // namespace kuzure::io
