#include "solver/app/hazard/fits.hpp"
#include "solver/app/hazard/plan.hpp"
#include "solver/app/scaling/forecast.hpp"
#include "solver/app/scaling/predict.hpp"
#include "solver/kernels/pair_model.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {
namespace {

using Json = nlohmann::ordered_json;

constexpr int most_cluster_members = 40;

/// The same scene with `factor` times the layers.
Estimate finer(Estimate e, double factor)
{
    const double cube = factor * factor * factor;
    e.soil = std::llround(double(e.soil) * cube), e.walls = std::llround(double(e.walls) * cube);
    e.shown = std::llround(double(e.shown) * cube);
    e.steps = std::max<std::int64_t>(1, std::llround(double(e.steps) * factor)), e.dt /= factor;
    e.pairs *= cube * factor, e.longest *= factor, e.columns *= factor * factor;
    return e;
}

struct Found {
    Plan plan;
    double preliminary = 0, of_preliminary = 0; // s, layers
    std::string where;
};

Found on_this_machine(const Comm& comm, const scene::CheckedScene& coarse, const Estimate& e, double within, double layers, int asked)
{
    const int cores = use_threads(comm, 0);
    Found f;
    f.where = fmt::format("this machine as it is now, {} core{}", cores, cores == 1 ? "" : "s");
    f.preliminary = forecast(comm, coarse.scene, coarse.filling, e).seconds + 1, f.of_preliminary = layers;
    Cost cost{1.0 / cores, f.preliminary - 1, layers};
    f.plan = make_plan(cost, within - f.preliminary - std::clamp(0.02 * within, 0.3, 2.0), asked);
    return f;
}

Found on(const io::MachineProfile& m, int ranks, const Estimate& e, double within, double layers, int asked)
{
    Found f;
    const int all = ranks > 0 ? ranks : m.node.ranks, per_node = std::min(all, m.node.ranks), nodes = (all + per_node - 1) / per_node;
    f.where = fmt::format("{}, {} node{}, a member on each", m.name, nodes, nodes == 1 ? "" : "s");
    f.preliminary = predict_seconds(e, m, nodes, per_node), f.of_preliminary = layers;
    const double left = within - f.preliminary;
    f.plan.members = asked > 0 ? asked : std::clamp(nodes - 1, usual_members, most_cluster_members);
    const int waves = (f.plan.members + 1 + nodes - 1) / nodes;
    const auto one = [&](double at) { return predict_seconds(finer(e, at / layers), m, 1, per_node); };
    const auto together = [&](double at) { return predict_seconds(finer(e, at / layers), m, nodes, per_node); };
    f.plan.layers = layers;
    for (double at = layers; at <= most_layers && waves * one(at) <= 0.6 * left; at += 0.1) f.plan.layers = at;
    f.plan.seconds = waves * one(f.plan.layers);
    const double spare = 0.85 * (left - f.plan.seconds);
    for (double at = 1.15 * f.plan.layers; at <= most_layers && together(at) <= spare; at += 0.1) f.plan.finer = at;
    if (f.plan.finer > 0) f.plan.seconds += together(f.plan.finer);
    return f;
}

} // namespace

Exit print_what_fits(const Comm& comm, const scene::CheckedScene& checked, const std::optional<scene::Uncertain>& uncertain,
                     const FitArguments& a)
{
    const double within = parse_within(a.within);
    Base base = base_of(checked, uncertain, a.scene);
    const double own = base.layers_of(base.scene.space.spacing);
    const double spacing = base.scene.start.from.empty()
                               ? possible_spacing(base, base.spacing_of(std::min(preliminary_layers, std::max(own, 1.0))))
                               : base.scene.space.spacing;
    base.coarsest = spacing;
    const auto likely = run_scene(base, spacing, corner_member(base.uncertain, {}), "preliminary", {});
    const auto coarse =
        io::parse_checked_scene(likely.text, a.scene + " with the layers of a preliminary run", likely.sets, scene::StepLimit::Enforce);
    const Estimate e = estimate(coarse.scene, coarse.filling, *choose_model(coarse.scene, Arithmetic::Simd));
    const double layers = base.layers_of(spacing);
    const Found f = a.machine.empty() ? on_this_machine(comm, coarse, e, within, layers, base.uncertain.members)
                                      : on(machine_named(a.machine), a.ranks, e, within, layers, base.uncertain.members);
    if (comm.rank() != 0) return Exit::Ok;
    const bool fits = f.preliminary < within,
               ensemble = uncertain.has_value() && f.plan.seconds > 0 && f.preliminary + f.plan.seconds <= 1.02 * within;
    if (a.json) {
        fmt::print("{}\n", Json{{"within_seconds", within},
                                {"where", f.where},
                                {"preliminary_layers", f.of_preliminary},
                                {"preliminary_seconds", f.preliminary},
                                {"members", uncertain ? f.plan.members : 0},
                                {"layers", uncertain ? f.plan.layers : f.of_preliminary},
                                {"finer_layers", f.plan.finer},
                                {"predicted_seconds", f.preliminary + f.plan.seconds},
                                {"fits", fits && (ensemble || !uncertain)}}
                               .dump(2));
        return Exit::Ok;
    }
    fmt::print("within {:g} s on {}:\n", within, f.where);
    fmt::print("  preliminary map  {:.3g} layers, {} soil particles, about {:.3g} s{}\n", f.of_preliminary, e.soil, f.preliminary,
               fits ? "" : ": longer than there is. Remedy: more time, fewer --layers");
    if (fits && uncertain)
        fmt::print("  ensemble         {} members of {:.3g} layers{}\n", f.plan.members, f.plan.layers,
                   ensemble ? "" : ": more than the time; as many as fit will be run");
    if (!uncertain) fmt::print("  ensemble         none: the scene has no [uncertain]\n");
    if (fits)
        fmt::print("  finer            {}\n",
                   f.plan.finer > 0 ? fmt::format("the likely values with {:.3g} layers", f.plan.finer) : "none fits");
    fmt::print("A prediction; kuzure hazard goes by what it measures on the way.\n");
    return Exit::Ok;
}

namespace {
int members_of(const scene::Uncertain& u) { return u.members > 0 ? u.members : usual_members; }
} // namespace

std::string uncertain_text(const scene::Uncertain& u)
{
    const int n = members_of(u);
    return fmt::format("[uncertain]: the {} that kuzure hazard draws{} (seed {})\n", fmt::format("{} members", n),
                       u.members > 0 ? "" : " unless the time allows others", u.seed) +
           members_table(u, draw_members(u, n, n));
}

Json uncertain_json(const scene::Uncertain& u)
{
    Json inputs = Json::array(), members = Json::array();
    for (const auto& i : inputs_of(u))
        inputs.push_back({{"name", i.name}, {"unit", i.unit}, {"low", i.range.low}, {"likely", i.range.likely}, {"high", i.range.high}});
    const int n = members_of(u);
    for (const auto& m : draw_members(u, n, n)) members.push_back(m.values);
    return {{"seed", u.seed}, {"inputs", inputs}, {"members", members}};
}

} // namespace kuzure::hazard
