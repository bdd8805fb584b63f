#include "solver/scene/check.hpp"
#include "solver/scene/at_rest.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/loads.hpp"
#include "solver/scene/map_grid.hpp"
#include "solver/scene/numbers.hpp"
#include "solver/scene/rules.hpp"
#include "solver/scene/shape.hpp"
#include "solver/scene/step_limits.hpp"
#include <algorithm>

namespace kuzure::scene {
namespace {

void check_maps(const Scene& scene, const Filling& filling, Rules& rules)
{
    const auto& maps = scene.maps;
    if (!maps) return;
    if (maps->cell < scene.space.spacing * (1 - 1e-9))
        rules.warning("maps.cell",
                      text("cells of {:.4g} m are narrower than a particle ({:.4g} m): between particles they stay empty; take "
                           "two spacings or more",
                           maps->cell, scene.space.spacing));
    for (std::size_t k = 0; k < maps->limits.size(); ++k)
        if (std::find(maps->limits.begin(), maps->limits.begin() + std::ptrdiff_t(k), maps->limits[k]) !=
            maps->limits.begin() + std::ptrdiff_t(k))
            rules.error("maps.limits", text("expected each limit once, found {} again; leave it out", maps->limits[k]));
    const MapGrid grid = map_grid(scene, filling);
    if (const double cells = double(grid.columns) * double(grid.rows); cells > most_map_cells)
        rules.error("maps.cell", text("expected at most {:.3g} cells over all walls and soil, found {:.3g} of {:.4g} m; "
                                      "let maps.cell be {:.2g} or more",
                                      most_map_cells, cells, maps->cell, 1.05 * maps->cell * std::sqrt(cells / most_map_cells)));
}

void check_time(const Scene& scene, StepLimit limit, Rules& rules)
{
    const auto severity = limit == StepLimit::Enforce ? Severity::Error : Severity::Warning;
    if (const auto step = scene.time.step) {
        if (std::round(scene.time.end / *step) < 1)
            rules.error("time.step", text("expected a step of at most time.end = {} s, found {} s", scene.time.end, *step));
        else if (scene.time.end / *step > 1e12)
            rules.error("time.step", text("expected fewer than 1e12 steps, found {:.3g}; is the step in seconds?", scene.time.end / *step));
        if (*step > stable_step(scene))
            rules.issues.push_back({severity,
                                    "time.step",
                                    text("expected a step below the stable limit {:.4g} s ({:.3g} h/c_p), found {:.4g} s; use "
                                         "{:.4g} s or less, or leave the key out",
                                         stable_step(scene), unstable_courant(scene), *step, recommended_step(scene)),
                                    {}});
        else if (*step > recommended_step(scene))
            rules.warning("time.step", text("the step {:.4g} s is stable but above the recommended {:.4g} s ({:.3g} h/c_p)", *step,
                                            recommended_step(scene), recommended_courant(scene)));
    } else if (const double steps = scene.time.end / (scene.accuracy.cfl * crossing_time(scene)); steps > 1e12) {
        rules.error("time.end",
                    text("expected fewer than 1e12 steps, found {:.3g} of {:.3g} s; is time.end in seconds, and young in Pa? Or "
                         "is accuracy.cfl too small",
                         steps, scene.accuracy.cfl * crossing_time(scene)));
    } else if (scene.accuracy.cfl > unstable_courant(scene)) {
        rules.issues.push_back({severity,
                                "accuracy.cfl",
                                text("expected a number below the stable limit {:.3g}, found {}; use {:.3g} or less",
                                     unstable_courant(scene), scene.accuracy.cfl, recommended_courant(scene)),
                                {}});
    } else if (scene.accuracy.cfl > recommended_courant(scene)) {
        rules.warning("accuracy.cfl",
                      text("{} is stable but above the recommended {:.3g}", scene.accuracy.cfl, recommended_courant(scene)));
    }
    if (scene.accuracy.correction == Correction::Adjoint && scene.accuracy.scheme == Scheme::LeapFrog)
        rules.error("accuracy.correction", "expected \"none\" or \"gradient\" with the leap-frog scheme, found \"adjoint\". Remedy: "
                                           "accuracy.scheme = \"staggered\"");
    if (scene.accuracy.shifting > 0 && scene.accuracy.scheme == Scheme::LeapFrog)
        rules.error("accuracy.shifting", text("expected 0, found {}: the leap-frog scheme shifts no particles. Remedy: "
                                              "accuracy.scheme = \"staggered\", or no shifting",
                                              scene.accuracy.shifting));
    if (scene.accuracy.hourglass > 0 && scene.accuracy.scheme == Scheme::LeapFrog)
        rules.error("accuracy.hourglass", text("expected 0, found {}: the leap-frog scheme has no hourglass control. Remedy: "
                                               "accuracy.scheme = \"staggered\", or no control",
                                               scene.accuracy.hourglass));
    if (scene.accuracy.sleep_below > 0 && sleep_interval(scene) < 3)
        rules.warning("accuracy.sleep_below",
                      "nothing will sleep: in steps this long a P-wave crosses half a support; 0, or a smaller step");
}

/// What the schemes know of the ground.
void check_ground(const Scene& scene, Rules& rules)
{
    if (!scene.terrain || scene.accuracy.scheme != Scheme::LeapFrog) return;
    for (const auto& [key, there] :
         {std::pair("friction_map", !scene.terrain->friction_map.empty()), {"xi", scene.terrain->xi.has_value()}})
        if (there)
            rules.error(text("terrain.{}", key), text("the leap-frog scheme knows one Coulomb friction for the whole ground. Remedy: "
                                                      "accuracy.scheme = \"staggered\", or no {}",
                                                      key));
}

/// The soils, effects and steps of every stage obey the rules of a start.
void check_stages(const Scene& scene, StepLimit limit, Rules& rules)
{
    const auto order = order_of_events(scene);
    for (std::size_t k = 0; k < order.size(); ++k) {
        const Event& e = scene.events[std::size_t(order[k])];
        const Scene stage = stage_of(scene, int(k) + 1, end_of(e));
        Rules then;
        check_soils(stage, then);
        check_effects(stage, then);
        check_time(stage, limit, then);
        for (const auto& issue : then.issues)
            if (issue.severity == Severity::Error)
                rules.error(text("event.{}", order[k]),
                            text("{} ({}): {}: {}", time_in_words(e), in_words(scene, e), issue.key, issue.text));
    }
    if (!scene.events.empty() && scene.accuracy.scheme == Scheme::LeapFrog &&
        std::ranges::any_of(scene.walls, [](const Wall& w) { return !w.name.empty(); }))
        rules.warning("wall", "the leap-frog scheme does not tell the force on each wall: there will be no forces.csv");
}

/// What follows from the scene alone.
void check_parts(const Scene& scene, StepLimit limit, Rules& rules)
{
    check_space(scene, rules);
    check_names_and_events(scene, rules.issues);
    check_soils(scene, rules);
    check_bodies(scene, rules);
    check_effects(scene, rules);
    check_time(scene, limit, rules);
    check_ground(scene, rules);
    check_plausible(scene, rules);
    check_inside(scene, rules);
    if (!rules.errors()) check_stages(scene, limit, rules);
    if (scene.maps && scene.dimensions == 2)
        rules.error("maps",
                    "expected dimensions = 3 with [maps], which are drawn in plan, found 2; use dimensions = 3 or leave [maps] out");
}

/// What follows from its particles.
void check_particles(const Scene& scene, const Filling& filling, Rules& rules)
{
    check_edges(scene, rules);
    check_loaded_soil(scene, filling, rules.issues);
    check_maps(scene, filling, rules);
    for (auto& n : dimensionless_numbers(scene, filling))
        if (!n.warning.empty()) rules.warning(n.name, n.warning);
    for (std::size_t k = 0; k < scene.probes.size(); ++k)
        if (const auto& p = scene.probes[k].particle; p && *p >= filling.soil_count())
            rules.error(text("probe.{}.particle", k),
                        text("expected a particle of soil, an id from 0 to {}, found {}", filling.soil_count() - 1, *p));
    for (std::size_t b = 0; b < scene.bodies.size(); ++b)
        if (const double excess = excess_of_mass(scene, filling, int(b)); std::abs(excess) > most_excess + 1e-9)
            rules.warning(text("body.{}.{}", b, name_of(scene.bodies[b].shape)),
                          text("its particles hold {:.2g} % {} mass than its volume would: lattice points and faces do not fit; a "
                               "smaller space.spacing, or faces moved by part of one, come nearer",
                               100 * std::abs(excess), excess > 0 ? "more" : "less"));
    const double height = filling.soil_height();
    if (scene.output.grain && *scene.output.grain > height)
        rules.warning("output.grain", text("no column of soil is {:.4g} m high, all of it {:.4g} m: fronts in history.csv will be empty",
                                           *scene.output.grain, height));
}

/// How the soil comes to its first state, beside what the scene's effects say.
void note_start(Scene& scene, const Filling& filling)
{
    if (!scene.start.from.empty()) scene.notes.push_back({"start", "from the last state of " + scene.start.from, true});
    else if (const auto why = no_closed_form(scene, filling); !why.empty())
        scene.notes.push_back(
            {"settling",
             text("the stress \"at rest\" is no closed form: {}; the soil settles under damping before t = 0, about {:.0f} steps", why,
                  steps_to_settle(scene, filling)),
             true});
}

} // namespace

Issues check(const Scene& scene, StepLimit limit)
{
    Issues issues;
    check_and_fill(scene, limit, issues);
    return issues;
}

std::optional<CheckedScene> check_and_fill(Scene scene, StepLimit limit, Issues& issues)
{
    Rules rules;
    check_parts(scene, limit, rules);
    std::optional<Filling> filling; // asks for shapes that make sense
    if (!rules.errors()) {
        Issues problems;
        filling = Filling::of(scene, problems);
        for (auto& issue : problems) rules.issues.push_back(std::move(issue));
    }
    if (filling) {
        check_particles(scene, *filling, rules);
        note_start(scene, *filling);
    }
    issues = rules.issues;
    if (!filling || rules.errors()) return {};
    return CheckedScene{std::move(scene), std::move(rules.issues), std::move(*filling)};
}

double excess_of_mass(const Scene& scene, const Filling& filling, int body)
{
    const double held = double(filling.body_count(body)) * scene.particle_volume();
    return held / volume(scene.bodies[std::size_t(body)].shape, scene.dimensions) - 1;
}

} // namespace kuzure::scene
