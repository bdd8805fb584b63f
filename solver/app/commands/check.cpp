// kuzure check: what will be simulated and why, counts, step, memory, disk. Runs nothing.
#include "solver/scene/check.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/hazard/fits.hpp"
#include "solver/app/report/scene_facts.hpp"
#include "solver/app/run/maps.hpp"
#include "solver/app/scaling/predict.hpp"
#include "solver/app/study/dial.hpp"
#include "solver/kernels/pair_model.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {

namespace {

struct Arguments {
    SceneArguments scene;
    bool json = false;
    std::string machine, accuracy, within;
    int ranks = 0;
};

Exit print_facts(const Comm& comm, const Arguments& a)
{
    const auto checked = a.scene.read(comm);
    const auto& [s, scene_warnings, filling] = checked;
    const auto uncertain = io::parse_uncertain(io::read_scene_text(a.scene.file), a.scene.file, a.scene.sets);
    if (!a.within.empty()) return hazard::print_what_fits(comm, checked, uncertain, {a.scene.file, a.within, a.machine, a.ranks, a.json});
    if (!a.accuracy.empty()) return study::print_proposal(comm, s, a.accuracy, a.json);
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
    for (const auto& issue : scene_warnings) warnings.push_back(in_words(issue));
    const io::Path where = s.output.directory.empty() ? io::Path("results") : io::Path(s.output.directory);
    if (s.maps) points_of_maps(comm, s, filling, [&](const std::string& w) { warnings.push_back(w); });
    if (const auto why = a.machine.empty() ? does_not_fit(comm, e, where) : std::string(); !why.empty())
        warnings.push_back("on this machine kuzure run would refuse this scene: " + why);
    if (comm.rank() != 0) return Exit::Ok;
    const SceneFacts facts{s, filling, e, model->name(), memory, time, where_text, warnings};
    if (a.json) {
        auto j = to_json(facts);
        if (uncertain) j["uncertain"] = hazard::uncertain_json(*uncertain);
        fmt::print("{}\n", j.dump(2));
    } else {
        fmt::print("{}{}", to_text(facts), uncertain ? "\n" + hazard::uncertain_text(*uncertain) : std::string());
    }
    return Exit::Ok;
}

} // namespace

Exit print_estimate(const Comm& comm, const SceneArguments& scene)
{
    Arguments a;
    a.scene = scene;
    return print_facts(comm, a);
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
    command
        ->add_option("--within", a->within,
                     "what kuzure hazard could answer in this time, such as 30m: layers and members, here or on a --machine")
        ->type_name("TIME");
    auto* profile =
        command->add_option("--machine", a->machine, "predict for a profile of jobs/machines, or the path of one")->type_name("NAME");
    command->add_option("--ranks", a->ranks, "ranks on that machine (default: one node full)")
        ->needs(profile)
        ->check(CLI::Range(1, 1000000000));
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return print_facts(comm, *a); }; });
}

} // namespace kuzure
