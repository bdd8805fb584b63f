#include "solver/app/safety/kept.hpp"
#include "io/json.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::safety {
namespace {

using Json = nlohmann::ordered_json;

double number(const Json& of, const char* key)
{
    const Json& j = of.at(key);
    const double x = j.is_number() ? j.get<double>() : NAN;
    if (!std::isfinite(x)) throw std::runtime_error(fmt::format("{}: expected a number, found none", key));
    return x;
}

/// The library's complaints too as std::runtime_error.
template <class Read> auto reading(std::string_view json, Read read)
{
    try {
        return read(io::parse_json<Json>(json));
    } catch (const Json::exception& e) {
        throw std::runtime_error(e.what());
    }
}

} // namespace

Json legs_of(const std::vector<Seen>& seen)
{
    Json list = Json::array();
    for (const auto& s : seen)
        list.push_back({{"time", s.time}, {"displacement", s.displacement}, {"creep", s.creep}, {"unbalanced", s.unbalanced}});
    return list;
}

KeptTrial trial_from_text(std::string_view json)
{
    return reading(json, [](const Json& j) {
        KeptTrial t{number(j, "factor"), {}, number(j, "seconds")};
        const Json& list = j.at("legs");
        if (!list.is_array() || list.size() > legs)
            throw std::runtime_error(fmt::format("legs: expected a list of at most {}, found something else", legs));
        for (const auto& leg : list)
            t.seen.push_back({number(leg, "time"), number(leg, "displacement"), number(leg, "creep"), number(leg, "unbalanced")});
        return t;
    });
}

std::string to_text(const KeptTrial& t)
{
    return Json{{"factor", t.factor}, {"legs", legs_of(t.seen)}, {"seconds", t.seconds}}.dump(1) + "\n";
}

std::string identity_from_text(std::string_view json)
{
    return reading(json, [](const Json& j) { return j.at("of").get<std::string>(); });
}

std::string plan_text(const std::string& identity) { return Json{{"of", identity}}.dump(1) + "\n"; }

} // namespace kuzure::safety
