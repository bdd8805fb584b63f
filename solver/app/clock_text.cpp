#include "solver/app/clock_text.hpp"
#include "solver/app/command.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {

namespace {
constexpr std::array dissipated_names{"plastic", "viscous", "wall", "damping"};
static_assert(dissipated_names.size() == std::tuple_size_v<decltype(DissipatedUnits::members)>);
} // namespace

std::string clock_text(const Simulation& sim)
{
    Clock c = sim.clock();
    nlohmann::ordered_json extremes, dissipated;
    std::size_t k = 0;
    for_each_member(c.extremes, c.extremes, [&](double& x, double&) { extremes[Extremes::names[k++]] = x; });
    k = 0;
    for_each_member(c.dissipated, c.dissipated, [&](std::int64_t& u, std::int64_t&) { dissipated[dissipated_names[k++]] = u; });
    return nlohmann::ordered_json{{"time", c.time},
                                  {"step", c.step},
                                  {"dt", c.dt},
                                  {"extremes", extremes},
                                  {"pairs", c.pairs},
                                  {"dissipated", dissipated},
                                  {"energy_at_start", c.energy_at_start},
                                  {"energy_unit", c.energy_unit},
                                  {"step_scale", c.step_scale},
                                  {"base_time", c.base_time},
                                  {"base_step", c.base_step},
                                  {"inspected", c.inspected},
                                  {"model", sim.model().name()},
                                  {"version", version_text()}}
        .dump();
}

Clock clock_from_text(const std::string& header, const io::Path& file)
{
    try {
        const auto j = nlohmann::json::parse(header);
        Clock c;
        j.at("time").get_to(c.time), j.at("step").get_to(c.step), j.at("dt").get_to(c.dt), j.at("pairs").get_to(c.pairs);
        std::size_t k = 0;
        for_each_member(c.extremes, c.extremes, [&](double& x, double&) { j.at("extremes").at(Extremes::names[k++]).get_to(x); });
        k = 0;
        for_each_member(c.dissipated, c.dissipated,
                        [&](std::int64_t& u, std::int64_t&) { j.at("dissipated").at(dissipated_names[k++]).get_to(u); });
        j.at("energy_at_start").get_to(c.energy_at_start), j.at("energy_unit").get_to(c.energy_unit);
        j.at("step_scale").get_to(c.step_scale), j.at("base_time").get_to(c.base_time);
        j.at("base_step").get_to(c.base_step), j.at("inspected").get_to(c.inspected);
        return c;
    } catch (const nlohmann::json::exception& e) {
        throw IoFailed(fmt::format("{}: the clock of this checkpoint cannot be read ({})", file.string(), e.what()));
    }
}

} // namespace kuzure
