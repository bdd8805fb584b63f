#include "solver/app/run/clock_text.hpp"
#include "io/json.hpp"
#include "solver/app/cli/command.hpp"
#include <fmt/format.h>

namespace kuzure {

static void to_json(nlohmann::ordered_json& j, const WideUnits& u) { j = {u.high, u.low}; }
static void from_json(const nlohmann::json& j, WideUnits& u) { j.at(0).get_to(u.high), j.at(1).get_to(u.low); }

namespace {
constexpr std::array dissipated_names{"plastic", "viscous", "wall", "damping", "stabilising", "moved_wall", "loads"};
static_assert(dissipated_names.size() == std::tuple_size_v<decltype(DissipatedUnits::members)>);
} // namespace

std::string clock_text(const Simulation& sim)
{
    Clock c = sim.clock();
    nlohmann::ordered_json extremes, dissipated, later;
    std::size_t k = 0;
    for_each_member(c.extremes, c.extremes, [&](double& x, double&) { extremes[Extremes::names[k++]] = x; });
    k = 0;
    for_each_member(c.dissipated, c.dissipated, [&](std::int64_t& u, std::int64_t&) { dissipated[dissipated_names[k++]] = u; });
    k = 0;
    for_each_member(c.later, c.later, [&](std::int64_t& u, std::int64_t&) { later[dissipated_names[k++]] = u; });
    return nlohmann::ordered_json{{"time", c.time},
                                  {"step", c.step},
                                  {"dt", c.dt},
                                  {"extremes", extremes},
                                  {"pairs", c.pairs},
                                  {"dissipated", dissipated},
                                  {"later", later},
                                  {"next", c.next},
                                  {"energy_at_start", c.energy_at_start},
                                  {"energy_unit", c.energy_unit},
                                  {"step_scale", c.step_scale},
                                  {"base_time", c.base_time},
                                  {"base_step", c.base_step},
                                  {"inspected", c.inspected},
                                  {"events", c.events},
                                  {"taken", c.taken},
                                  {"impulse", c.impulse},
                                  {"sorted_time", c.sorted_time},
                                  {"frame_way", {c.frame_way.x, c.frame_way.y, c.frame_way.z}},
                                  {"largest_energy", c.largest_energy},
                                  {"largest_taken", {c.largest_taken.plastic, c.largest_taken.viscous, c.largest_taken.damping}},
                                  {"model", sim.model().name()},
                                  {"version", version_text()}}
        .dump();
}

Clock clock_from_text(const std::string& header, const io::Place& file)
{
    try {
        const auto j = io::parse_json(header);
        Clock c;
        j.at("time").get_to(c.time), j.at("step").get_to(c.step), j.at("dt").get_to(c.dt), j.at("pairs").get_to(c.pairs);
        std::size_t k = 0;
        for_each_member(c.extremes, c.extremes, [&](double& x, double&) { j.at("extremes").at(Extremes::names[k++]).get_to(x); });
        k = 0;
        for_each_member(c.dissipated, c.dissipated,
                        [&](std::int64_t& u, std::int64_t&) { j.at("dissipated").at(dissipated_names[k++]).get_to(u); });
        k = 0;
        for_each_member(c.later, c.later, [&](std::int64_t& u, std::int64_t&) { j.at("later").at(dissipated_names[k++]).get_to(u); });
        j.at("next").get_to(c.next);
        j.at("energy_at_start").get_to(c.energy_at_start), j.at("energy_unit").get_to(c.energy_unit);
        j.at("step_scale").get_to(c.step_scale), j.at("base_time").get_to(c.base_time);
        j.at("base_step").get_to(c.base_step), j.at("inspected").get_to(c.inspected);
        j.at("sorted_time").get_to(c.sorted_time);
        j.at("events").get_to(c.events), j.at("taken").get_to(c.taken), j.at("impulse").get_to(c.impulse);
        const auto& way = j.at("frame_way");
        way.at(0).get_to(c.frame_way.x), way.at(1).get_to(c.frame_way.y), way.at(2).get_to(c.frame_way.z);
        const auto& taken = j.at("largest_taken");
        j.at("largest_energy").get_to(c.largest_energy), taken.at(0).get_to(c.largest_taken.plastic);
        taken.at(1).get_to(c.largest_taken.viscous), taken.at(2).get_to(c.largest_taken.damping);
        // JSON has no infinities; what a run cannot have is left.
        if (c.time < 0 || c.dt < 0 || c.step < 0 || c.pairs < 0 || c.events < 0)
            throw IoFailed(fmt::format("{}: the clock of this checkpoint is not one that a run can have (t = {:g} s, step {}, dt {:g} s)",
                                       file.string(), c.time, c.step, c.dt));
        return c;
    } catch (const nlohmann::json::exception& e) {
        throw IoFailed(fmt::format("{}: the clock of this checkpoint cannot be read ({})", file.string(), e.what()));
    }
}

} // namespace kuzure
