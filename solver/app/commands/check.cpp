// kuzure check: what will be simulated and why, counts, step, memory, disk. Runs nothing.
#include "solver/scene/check.hpp"
#include "io/summary.hpp"
#include "solver/app/command.hpp"
#include "solver/app/estimate.hpp"
#include "solver/app/simulation.hpp"
#include "solver/kernels/step.hpp"
#include "solver/scene/numbers.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

namespace kuzure {

namespace {

/// Seconds a directed pair takes here and now, with all cores: a few steps of a small block of the scene's own soil and kernel.
double measure_pair(const Comm& comm, Scene s)
{
    const double edge = (s.dimensions == 3 ? 20 : 90) * s.space.spacing;
    s.space.low.reset(), s.space.high.reset(), s.space.periodic = {};
    s.walls.clear();
    s.bodies.resize(1);
    s.bodies[0] = {.soil = s.bodies[0].soil, .shape = scene::Box{{0, 0, 0}, {edge, edge, edge}}};
    s.time = {1.0, 1e-3 * scene::crossing_time(s)};
    use_threads(comm, 0);
    Simulation sim(comm, s);
    for (int k = 0; k < 3; ++k) sim.step();
    const auto pairs = sim.pairs();
    const double begin = omp_get_wtime();
    for (int k = 0; k < 6; ++k) sim.step();
    return (omp_get_wtime() - begin) / double(std::max<std::int64_t>(1, sim.pairs() - pairs));
}

/// As JSON has whole numbers.
std::int64_t whole(double bytes) { return std::int64_t(std::min(bytes, 9e18)); }

} // namespace

void add_reference(CLI::App& app, Action& chosen)
{
    app.add_subcommand("reference", "every key of a scene, as Markdown (docs/scene.md)")->callback([&chosen] {
        chosen = [](const Comm& comm) {
            if (comm.rank() == 0) fmt::print("{}", io::scene_reference());
            return Exit::Ok;
        };
    });
}

void add_check(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("check", "what will be simulated and why; runs nothing");
    auto args = std::make_shared<SceneArguments>();
    auto json = std::make_shared<bool>(false);
    args->add_to(*command);
    command->add_flag("--json", *json, "as JSON");
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            const Scene s = args->read(comm);
            const scene::Filling filling(s);
            const auto model = choose_model(s, Arithmetic::Lanes);
            const Estimate e = estimate(s, filling, *model);
            const double memory = e.memory + bytes_per_process * comm.size();
            // lists, sorting and output took 9 % on top of the pass in hirata_52 (docs/performance.md)
            const double seconds = e.pairs * measure_pair(comm, s) * 1.09;
            std::vector<std::string> warnings;
            for (const auto& issue : scene::check(s, args->force_step ? scene::StepLimit::Force : scene::StepLimit::Enforce))
                warnings.push_back(issue.key + ": " + issue.text);
            const io::Path where = s.output.directory.empty() ? io::Path("results") : io::Path(s.output.directory);
            if (const auto why = does_not_fit(comm, e, where); !why.empty())
                warnings.push_back("on this machine kuzure run would refuse this scene: " + why);
            if (comm.rank() != 0) return Exit::Ok;
            const auto judgements = scene::judge(s, filling);
            if (*json) {
                auto numbers = nlohmann::ordered_json::object();
                for (const auto& n : judgements) numbers[n.name] = n.value;
                nlohmann::ordered_json j{{"soil_particles", e.soil},
                                         {"wall_particles", e.walls},
                                         {"dt", e.dt},
                                         {"steps", e.steps},
                                         {"memory_bytes", whole(memory)},
                                         {"disk_bytes", whole(e.disk())},
                                         {"predicted_seconds", seconds},
                                         {"effects", io::effects_json(s.notes)},
                                         {"numbers", numbers},
                                         {"warnings", warnings}};
                fmt::print("{}\n", j.dump(2));
                return Exit::Ok;
            }
            fmt::print("{}\n\n", s.title);
            fmt::print("  particles   {} soil, {} wall, {:g} m apart, {}-D\n", e.soil, e.walls, s.space.spacing, s.dimensions);
            fmt::print("  step        {:.3g} s{}, {}{} steps to {:g} s\n", e.dt, s.time.step ? " (fixed)" : " (follows the motion)",
                       s.time.step ? "" : "about ", e.steps, s.time.end);
            fmt::print("  pair model  {}\n", model->name());
            fmt::print("  memory      {} in all, disk {}\n", bytes_text(memory), bytes_text(e.disk()));
            fmt::print("  time        about {:.1f} minutes on this machine\n\n", seconds / 60);
            for (const auto& n : s.notes) fmt::print("  {:<4}{}: {}\n", n.on ? "on" : "off", n.name, n.why);
            fmt::print("\n");
            for (const auto& n : judgements) fmt::print("  {:<12}{:<9.3g} {}\n", n.name, n.value, n.about);
            for (const auto& w : warnings) fmt::print("\n  warning: {}\n", w);
            fmt::print("\n{}", io::write_scene(s));
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
