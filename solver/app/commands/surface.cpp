// kuzure surface: how high the soil of a run stands along the way it spreads, from its snapshots.
#include "io/snapshot.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/report/pictures.hpp"
#include "solver/app/study/profile.hpp"
#include <CLI/CLI.hpp>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {
namespace {

struct Arguments {
    std::string results;
    double at = HUGE_VAL; // s; infinite: the end
    double window = 0;    // m; 0: four spacings
    bool json = false;
};

const char* name_of(study::Spread s) { return s == study::Spread::Plane ? "plane" : s == study::Spread::Radial ? "radial" : "band"; }

void print_surface(const Comm& comm, const Arguments& a)
{
    const auto [results, scene] = open_results(comm, a.results);
    if (comm.rank() != 0) return;
    const double dx = scene.space.spacing, window = a.window > 0 ? a.window : 4 * dx;
    if (window < dx)
        throw BadInput(fmt::format("--window: expected at least the spacing of the run, {:g} m, found {:g}; leave it out for four of them",
                                   dx, window));
    const auto soil = io::read_snapshot(io::snapshot_next_to(results.path(), a.at));
    const auto p = study::measure_profile(scene, soil, window);
    if (a.json) {
        const nlohmann::ordered_json j{{"time", soil.time}, {"spread", name_of(p.spread)},
                                       {"window", window},  {"start", {p.start_low, p.start_high}},
                                       {"top", p.top},      {"runout", p.runout(scene.output.grain.value_or(dx))},
                                       {"at", p.at},        {"height", p.height}};
        fmt::print("{}\n", j.dump(1));
        return;
    }
    fmt::print("{},height\n# m,m\n", p.spread == study::Spread::Radial ? "radius" : "x");
    for (std::size_t k = 0; k < p.at.size(); ++k) fmt::print("{:.9g},{:.9g}\n", p.at[k], p.height[k]);
}

} // namespace

void add_surface(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("surface", "how high the soil of a run stands along its way, as CSV");
    auto a = std::make_shared<Arguments>();
    command->add_option("DIR", a->results, "the result directory")->required();
    command->add_option("--at", a->at, "of the snapshot next to this time, s (default: the last)")->type_name("T");
    command->add_option("--window", a->window, "width over which heights are taken, m (default: four spacings)")
        ->type_name("W")
        ->check(CLI::PositiveNumber);
    command->add_flag("--json", a->json, "as JSON, with run-out and greatest height");
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            print_surface(comm, *a);
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
