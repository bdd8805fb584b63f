// kuzure check: what will be simulated and why, counts, step, memory, disk. Runs nothing.
#include "solver/scene/check.hpp"
#include "io/summary.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/scaling/forecast.hpp"
#include "solver/app/scaling/predict.hpp"
#include "solver/app/study/dial.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/numbers.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <numbers>

namespace kuzure {

namespace {

const double degrees = 180 / std::numbers::pi;

/// kuzure check --accuracy: settings from the measured table.
Exit turn_the_dial(const Comm& comm, const Scene& s, const std::string& accuracy, bool json)
{
    const double wanted = study::parse_accuracy(accuracy);
    use_threads(comm, 0);
    const auto estimate_of = [](const scene::Ready& r) { return estimate(r.scene, r.filling, *choose_model(r.scene, Arithmetic::Simd)); };
    // Counted, not timed, so that the same is proposed at every call; mixed precision took 0.76 of the time (docs/performance.md).
    const auto work = [&](const scene::Ready& r) {
        const Estimate e = estimate_of(r);
        return (e.mixed ? 0.76 : 1) * e.pairs + StepWork::particle * double(e.soil) * double(e.steps);
    };
    const auto proposal = study::propose(s, wanted, study::measured(), work);
    const auto& r = *proposal.ready;
    const double seconds = forecast(comm, r.scene, r.filling, estimate_of(r)).seconds;
    if (comm.rank() == 0)
        fmt::print("{}", json ? study::to_json(proposal, wanted, seconds).dump(2) + "\n" : study::to_text(proposal, wanted, seconds));
    return Exit::Ok;
}

const char* mass_unit(const Scene& s) { return s.dimensions == 2 ? "kg/m" : "kg"; }

/// Mass (kg, in 2-D kg/m) of one body's particles.
double mass_of(const Scene& s, const scene::Filling& f, int body)
{
    const auto& soil = s.soils[std::size_t(s.bodies[std::size_t(body)].soil)];
    return double(f.body_count(body)) * s.particle_volume() * soil.density;
}

/// What each body holds against its shape's volume, and what friction each soil's cone means.
nlohmann::ordered_json bodies_json(const Scene& s, const scene::Filling& f)
{
    auto all = nlohmann::ordered_json::array();
    for (int b = 0; b < int(s.bodies.size()); ++b)
        all.push_back({{"particles", f.body_count(b)}, {"mass", mass_of(s, f, b)}, {"excess_of_mass", scene::excess_of_mass(s, f, b)}});
    return all;
}
nlohmann::ordered_json soils_json(const Scene& s, const scene::Filling& f)
{
    auto all = nlohmann::ordered_json::object();
    for (const auto& soil : s.soils) {
        const auto m = Material::from(soil);
        all[soil.name] = {{"alpha", m.alpha},
                          {"k", m.k},
                          {"rough_bed_angle", m.angle_on_a_rough_bed() * degrees},
                          {"stress_circle_angle", m.circle_is_limited() ? nlohmann::ordered_json(m.angle_of_the_stress_circle() * degrees)
                                                                        : nlohmann::ordered_json()}};
    }
    for (const auto& n : scene::soil_numbers(s, f)) {
        auto& soil = all[n.name];
        soil["unit_weight"] = n.unit_weight, soil["at_rest"] = n.at_rest, soil["stability"] = n.stability;
        soil["c_p"] = n.c_p, soil["c_s"] = n.c_s;
    }
    return all;
}
std::string bodies_and_soils_text(const Scene& s, const scene::Filling& f)
{
    std::string text;
    for (int b = 0; b < int(s.bodies.size()); ++b) {
        const double excess = scene::excess_of_mass(s, f, b);
        text +=
            fmt::format("  body.{:<7}{} particles, {:.4g} {}: {} its shape's volume\n", b, f.body_count(b), mass_of(s, f, b), mass_unit(s),
                        std::abs(excess) < 5e-7 ? "the mass of"
                                                : fmt::format("{:.2g} % {} than", 100 * std::abs(excess), excess > 0 ? "more" : "less"));
    }
    for (const auto& soil : s.soils) {
        const auto m = Material::from(soil);
        text += fmt::format(
            "  soil.{:<7}alpha {:.4g}, k {:.4g} Pa: in plane strain at psi = 0 a slope on a rough bed of {:.1f} deg (atan 3 alpha), "
            "{} by the stress circle (asin 3 alpha)\n",
            soil.name, m.alpha, m.k, m.angle_on_a_rough_bed() * degrees,
            m.circle_is_limited() ? fmt::format("{:.1f} deg", m.angle_of_the_stress_circle() * degrees) : "no limit");
    }
    return text;
}

struct Arguments {
    SceneArguments scene;
    bool json = false;
    std::string machine, accuracy;
    int ranks = 0;
};

/// As JSON has whole numbers.
std::int64_t whole(double bytes) { return std::int64_t(std::min(bytes, 9e18)); }

Exit tell(const Comm& comm, const Arguments& a)
{
    const auto [s, doubts, filling] = a.scene.read(comm);
    if (!a.accuracy.empty()) return turn_the_dial(comm, s, a.accuracy, a.json);
    const auto model = choose_model(s, Arithmetic::Simd);
    const Estimate e = estimate(s, filling, *model);
    const double memory = e.memory + bytes_per_process * comm.size();
    Forecast time;
    std::string where_text = "this machine as it is now";
    if (!a.machine.empty()) {
        const auto m = machine_named(a.machine);
        const int all = a.ranks > 0 ? a.ranks : m.node.ranks, per_node = std::min(all, m.node.ranks);
        const int nodes = (all + per_node - 1) / per_node;
        time.seconds = predict_seconds(e, m, nodes, per_node);
        // A profile's constants were measured on other days and scenes: half as much again either way.
        time.low = time.seconds / 1.5, time.high = time.seconds * 1.5;
        where_text = fmt::format("{}, {} ranks on {} nodes, outputs left out", m.name, all, nodes);
    } else {
        use_threads(comm, 0);
        time = forecast(comm, s, filling, e);
    }
    std::vector<std::string> warnings;
    for (const auto& issue : doubts) warnings.push_back(in_words(issue));
    const io::Path where = s.output.directory.empty() ? io::Path("results") : io::Path(s.output.directory);
    if (const auto why = a.machine.empty() ? does_not_fit(comm, e, where) : std::string(); !why.empty())
        warnings.push_back("on this machine kuzure run would refuse this scene: " + why);
    if (comm.rank() != 0) return Exit::Ok;
    const auto judgements = scene::judge(s, filling);
    if (a.json) {
        auto numbers = nlohmann::ordered_json::object();
        for (const auto& n : judgements) numbers[n.name] = n.value;
        nlohmann::ordered_json j{{"soil_particles", e.soil},
                                 {"wall_particles", e.walls},
                                 {"dt", e.dt},
                                 {"steps", e.steps},
                                 {"memory_bytes", whole(memory)},
                                 {"disk_bytes", whole(e.disk())},
                                 {"predicted_seconds", time.seconds},
                                 {"predicted_interval", {time.low, time.high}},
                                 {"bodies", bodies_json(s, filling)},
                                 {"soils", soils_json(s, filling)},
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
    fmt::print("  time        about {} on {}\n\n", forecast_text(time), where_text);
    fmt::print("{}\n", bodies_and_soils_text(s, filling));
    for (const auto& n : s.notes) fmt::print("  {:<4}{}: {}\n", n.on ? "on" : "off", n.name, n.why);
    fmt::print("\n");
    for (const auto& n : judgements) fmt::print("  {:<12}{:<9.3g} {}\n", n.name, n.value, n.about);
    fmt::print("\n");
    for (const auto& n : scene::soil_numbers(s, filling)) {
        fmt::print("  soil {:<10}", n.name);
        if (n.unit_weight > 0) fmt::print("unit weight {:.4g} kN/m3, c/(gamma H) {:.3g}, ", 1e-3 * n.unit_weight, n.stability);
        fmt::print("K0 {:.3g}, c_p {:.3g} m/s, c_s {:.3g} m/s\n", n.at_rest, n.c_p, n.c_s);
    }
    for (const auto& w : warnings) fmt::print("\n  warning: {}\n", w);
    fmt::print("\n{}", io::write_scene(s));
    return Exit::Ok;
}

} // namespace

Exit tell_of_run(const Comm& comm, const SceneArguments& scene)
{
    Arguments a;
    a.scene = scene;
    return tell(comm, a);
}

void add_reference(CLI::App& app, Action& chosen)
{
    const auto add = [&](const char* name, const char* about, std::string (*text)()) {
        app.add_subcommand(name, about)->callback([&chosen, text] {
            chosen = [text](const Comm& comm) {
                if (comm.rank() == 0) fmt::print("{}", text());
                return Exit::Ok;
            };
        });
    };
    add("reference", "every key of a scene, as Markdown (docs/scene.md)", io::scene_reference);
    add("schema", "every key of a scene, as a JSON Schema by which editors complete and check scenes", io::scene_schema);
}

void add_check(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("check", "what will be simulated and why; runs nothing");
    auto a = std::make_shared<Arguments>();
    a->scene.add_to(*command);
    command->add_flag("--json", a->json, "as JSON");
    command
        ->add_option("--accuracy", a->accuracy,
                     "settings for this error, such as 5%, from the measured table, with time and expected error")
        ->type_name("ERROR");
    auto* profile =
        command->add_option("--machine", a->machine, "predict for a profile of jobs/machines, or the path of one")->type_name("NAME");
    command->add_option("--ranks", a->ranks, "ranks on that machine (default: one node full)")
        ->needs(profile)
        ->check(CLI::Range(1, 1000000000));
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return tell(comm, *a); }; });
}

} // namespace kuzure
