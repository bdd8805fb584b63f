#include "solver/app/hazard/cluster.hpp"
#include "solver/app/hazard/plan.hpp"
#include "solver/app/hazard/run_scene.hpp"
#include "solver/app/study/runs.hpp"
#include <fmt/format.h>

namespace kuzure::hazard {

ClusterRuns cluster_runs(const Comm& comm, const SceneArguments& scene, int members, const std::string& layers, const std::string& output)
{
    const auto checked = scene.read(comm);
    const auto uncertain = io::parse_uncertain(io::read_scene_text(scene.file), scene.file, scene.sets);
    if (!uncertain)
        throw BadInput(fmt::format("{}: --members: expected [uncertain] in the scene, from which members are drawn, found none. Remedy: "
                                   "[uncertain] bed_friction = {{ low = 16.0, likely = 20.0, high = 28.0 }} (docs/hazard.md)",
                                   scene.file));
    Base base = base_of(checked, uncertain, scene.file);
    const double own = base.layers_of(base.scene.space.spacing);
    std::string text = layers;
    if (text.empty())
        text = own > preliminary_layers ? fmt::format("{:g},{:.3g}", preliminary_layers, own) : fmt::format("{:.3g}", std::max(1.0, own));
    const Layers l = parse_layers(text);
    const bool fixed = !base.scene.start.from.empty();
    const auto spacing_of = [&](double n) { return fixed ? base.scene.space.spacing : possible_spacing(base, base.spacing_of(n)); };
    base.coarsest = spacing_of(l.preliminary);
    const auto r = run_scene(base, spacing_of(std::max(l.ensemble, l.finer)), corner_member(base.uncertain, {}), "the finest run", {});
    const int asked = members > 0 ? members : base.uncertain.members > 0 ? base.uncertain.members : usual_members;
    return {io::parse_checked_scene(r.text, scene.file + " with the layers of its finest run", r.sets, scene.step_limit()), text, asked,
            study::directory_for(output, base.scene, scene.file, "hazard")};
}

} // namespace kuzure::hazard
