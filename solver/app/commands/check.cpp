// kuzure check: what will be simulated and why, counts, step, memory, disk. Runs nothing.
#include "solver/scene/check.hpp"
#include "io/checkpoint.hpp"
#include "io/snapshot.hpp"
#include "io/summary.hpp"
#include "solver/app/command.hpp"
#include "solver/app/simulation.hpp"
#include "solver/kernels/step.hpp"
#include "solver/scene/material.hpp"
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

struct Estimate {
    std::int64_t soil, walls, steps;
    double dt, memory, disk, seconds;
};

Estimate estimate(const Scene& s, const scene::Filling& f, const PairModel& model, double seconds_per_pair)
{
    Estimate e{};
    e.soil = f.soil_count(), e.walls = f.wall_count();
    double c = 0;
    for (const auto& soil : s.soils) c = std::max(c, Material::from(soil).sound_speed);
    const double h = s.smoothing_length();
    const double g = s.effects.gravity ? length(*s.effects.gravity) : 0;
    // A collapse moves at about sqrt(g H): the signal speed that shortens a step which follows the motion.
    const double fall = std::sqrt(g * (f.soil_bounds().high.z - f.soil_bounds().low.z + s.space.spacing));
    e.dt = s.time.step ? *s.time.step : s.accuracy.cfl * h / (c + 0.25 * fall);
    e.steps = std::int64_t(std::llround(s.time.end / e.dt));

    const double pi = 3.14159265358979, k = 2 * s.space.h;
    const double neighbours = s.dimensions == 3 ? 4 * pi / 3 * k * k * k : pi * k * k;
    const bool mixed = model.precision() == scene::Precision::Mixed;
    const double records = 2.0 * (mixed ? 64 : 128) * (model.tensile() ? 1.5 : 1.0);
    const double skin = std::pow(1 + s.accuracy.skin, 3);
    const double list = 4.0 * neighbours * skin * 2.1 / model.cluster_width();
    e.memory = scene::column_bytes(f) + double(e.soil) * (records + list + 24) + 60.0 * double(e.walls) + 60e6;
    const double snapshots = s.output.every ? std::floor(s.time.end / *s.output.every) + 2 : 2;
    e.disk = snapshots * double(io::snapshot_bytes(e.soil + e.walls, s.output.fields)) +
             2.0 * double(io::checkpoint_bytes(e.soil, std::size_t(scene::column_bytes(f) / std::max<double>(1, double(e.soil))))) +
             (s.output.history ? s.time.end / *s.output.history * 320 : 0);
    // lists, sorting and output took 9 % on top of the pass in hirata_52 (docs/performance.md)
    e.seconds = double(e.steps) * double(e.soil) * neighbours * 0.95 * seconds_per_pair * 1.09;
    return e;
}

std::string bytes_text(double b) { return b > 1e9 ? fmt::format("{:.1f} GB", b * 1e-9) : fmt::format("{:.0f} MB", b * 1e-6); }

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
            const Estimate e = estimate(s, filling, *model, measure_pair(comm, s));
            std::vector<std::string> warnings;
            for (const auto& issue : scene::check(s, args->force_step ? scene::StepLimit::Force : scene::StepLimit::Enforce))
                warnings.push_back(issue.key + ": " + issue.text);
            if (comm.rank() != 0) return Exit::Ok;
            const auto judgements = scene::judge(s, filling);
            if (*json) {
                auto numbers = nlohmann::ordered_json::object();
                for (const auto& n : judgements) numbers[n.name] = n.value;
                nlohmann::ordered_json j{{"soil_particles", e.soil},
                                         {"wall_particles", e.walls},
                                         {"dt", e.dt},
                                         {"steps", e.steps},
                                         {"memory_bytes", std::int64_t(e.memory)},
                                         {"disk_bytes", std::int64_t(e.disk)},
                                         {"predicted_seconds", e.seconds},
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
            fmt::print("  memory      {} in all, disk {}\n", bytes_text(e.memory), bytes_text(e.disk));
            fmt::print("  time        about {:.1f} minutes on this machine\n\n", e.seconds / 60);
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
