#include "solver/app/hazard/kept.hpp"
#include "io/json.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::hazard {

const char* word(Part p)
{
    return p == Part::Preliminary ? "preliminary" : p == Part::Likely ? "likely" : p == Part::Member ? "member" : "finer";
}
const char* word(Status s)
{
    return s == Status::NotRun     ? "not run"
           : s == Status::Finished ? "finished"
           : s == Status::Failed   ? "numbers failed"
           : s == Status::Refused  ? "refused"
                                   : "stopped";
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double largest = 1e9; // of what is measured in m, layers and s
constexpr int most_members = 1'000'000;
constexpr std::size_t most_runs = 1'000'000;

/// A value in a message.
std::string shown(const Json& j)
{
    std::string all = j.dump(-1, ' ', true);
    if (all.size() > 60) all = all.substr(0, 57) + "...";
    return all;
}

/// A number of an object, from `least` to `most`.
double number(const Json& of, const char* key, double least, double most)
{
    const Json& j = of.at(key);
    const double x = j.is_number() ? j.get<double>() : NAN;
    if (!(x >= least && x <= most))
        throw std::runtime_error(fmt::format("{}: expected a number from {:g} to {:g}, found {}", key, least, most, shown(j)));
    return x;
}
double above_zero(const Json& of, const char* key) { return number(of, key, 1e-9, largest); }
int whole(const Json& of, const char* key, int most) { return int(number(of, key, 0, most)); }
std::string text(const Json& of, const char* key)
{
    const Json& j = of.at(key);
    if (!j.is_string()) throw std::runtime_error(fmt::format("{}: expected a text, found {}", key, shown(j)));
    return j.get<std::string>();
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

template <class Word> Word named(const std::string& name, std::initializer_list<Word> all)
{
    for (const Word w : all)
        if (name == word(w)) return w;
    throw std::runtime_error(fmt::format("expected \"{}\" or the like, found {}", word(*all.begin()), shown(Json(name))));
}

Run run_from(const Json& m, const std::vector<std::string>& inputs)
{
    Run r;
    r.part = named(text(m, "part"), {Part::Member, Part::Preliminary, Part::Likely, Part::Finer});
    r.status = named(text(m, "status"), {Status::Finished, Status::NotRun, Status::Failed, Status::Refused, Status::Stopped});
    r.member.number = whole(m, "number", most_members);
    r.layers = above_zero(m, "layers"), r.spacing = above_zero(m, "spacing"), r.seconds = number(m, "seconds", 0, largest);
    r.directory = io::Path(text(m, "directory")).lexically_normal();
    if (r.directory.empty() || r.directory.is_absolute() || *r.directory.begin() == ".." || *r.directory.begin() == ".")
        throw std::runtime_error(fmt::format("directory: expected one below that of the file, found {}", shown(m.at("directory"))));
    if (m.contains("message")) r.message = text(m, "message");
    for (const auto& input : inputs) r.member.values.push_back(number(m.at("settings"), input.c_str(), -1e300, 1e300));
    return r;
}

} // namespace

KeptPlan plan_from_text(std::string_view json)
{
    return reading(json, [](const Json& j) {
        KeptPlan p{text(j, "of"), above_zero(j, "preliminary_spacing"), whole(j, "group", most_members), {}, {}};
        if (j.contains("ensemble_layers")) p.ensemble_layers = above_zero(j, "ensemble_layers");
        if (j.contains("finer_layers") && !j["finer_layers"].is_null()) {
            if (!j["finer_layers"].is_array() || j["finer_layers"].size() > 100)
                throw std::runtime_error("finer_layers: expected a short list of numbers, found something else");
            for (const auto& x : j["finer_layers"]) p.finer_layers.push_back(above_zero(Json{{"finer_layers", x}}, "finer_layers"));
        }
        return p;
    });
}

std::string to_text(const KeptPlan& p)
{
    Json j{{"of", p.of}, {"preliminary_spacing", p.preliminary_spacing}, {"group", p.group}};
    if (p.ensemble_layers) j["ensemble_layers"] = *p.ensemble_layers;
    if (!p.finer_layers.empty()) j["finer_layers"] = p.finer_layers;
    return j.dump(1) + "\n";
}

KeptFit fit_from_text(std::string_view json)
{
    return reading(json, [](const Json& j) {
        KeptFit f{text(j, "of"), {}};
        if (j.contains("spacing")) f.spacing = above_zero(j, "spacing");
        return f;
    });
}

std::string to_text(const KeptFit& f)
{
    Json j{{"of", f.of}};
    if (f.spacing) j["spacing"] = *f.spacing;
    return j.dump(1) + "\n";
}

KeptRuns runs_from_text(std::string_view json, const std::vector<std::string>& inputs)
{
    return reading(json, [&](const Json& j) {
        KeptRuns k{above_zero(j, "coarsest_spacing"),
                   number(j, "deadline_seconds", 0, largest),
                   number(j, "ended_seconds", 0, largest),
                   whole(j, "group", most_members),
                   {}};
        for (const char* list : {"likely_runs", "members"}) {
            const Json& runs = j.at(list);
            if (!runs.is_array() || runs.size() > most_runs) throw std::runtime_error(fmt::format("{}: expected a list of runs", list));
            for (const auto& m : runs) k.runs.push_back(run_from(m, inputs));
        }
        return k;
    });
}

std::optional<KeptEnd> end_from_text(std::string_view json)
{
    const Json j = io::parse_json<Json>(json, false);
    if (!j.is_object() || !j.contains("status")) return {};
    const auto seconds = [&] {
        const double x = j.contains("wall_seconds") && j["wall_seconds"].is_number() ? j["wall_seconds"].get<double>() : 0;
        return x >= 0 && x <= largest ? x : 0;
    };
    if (j["status"] == "finished") return KeptEnd{Status::Finished, seconds(), {}};
    if (j["status"] != "numbers failed") return {};
    return KeptEnd{Status::Failed, 0, j.contains("message") && j["message"].is_string() ? j["message"].get<std::string>() : std::string()};
}

} // namespace kuzure::hazard
