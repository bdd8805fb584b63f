#include "solver/run/settle.hpp"
#include "solver/run/simulation.hpp"
#include "solver/run/start.hpp"
#include "solver/scene/at_rest.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/loads.hpp"
#include "solver/walls/friction.hpp"
#include <fmt/format.h>
#include <limits>

namespace kuzure {
namespace {

double gravity(const Scene& s) { return length(s.effects.gravity.value_or(Vector{})); }

/// The scene with nothing but its soil at rest, critically damped in its lowest mode for as long as it takes; strength is that of soil
/// that has not yet been sheared. `held`: so strong that nothing yields.
Scene settling_scene(const Scene& scene, double end, bool held)
{
    Scene s = scene;
    std::erase_if(s.bodies, [](const scene::Body& b) { return !scene::rests(b); });
    std::erase_if(s.walls, [](const scene::Wall& w) { return !w.present; });
    s.events.clear(), s.probes.clear();
    std::erase_if(s.loads, [&](const scene::Load& l) { return !l.present || (!l.body.empty() && scene::body_named(s, l.body) < 0); });
    for (auto& b : s.bodies) b.velocity = {};
    for (auto& soil : s.soils) {
        soil.softening.reset(), soil.dilation_decay.reset(), soil.rate_friction.reset();
        if (held) soil.cohesion = 1e3 * soil.young, soil.tension_cutoff.reset();
    }
    // Soil holds on to real ground until it is let go.
    for (auto& wall : s.walls)
        if (std::holds_alternative<scene::Ground>(wall.shape)) wall.surface = scene::Surface::Rough;
    s.effects.damping = scene::Damping{1, std::numeric_limits<double>::infinity()};
    s.time.end = end, s.time.retry = false;
    s.accuracy.sleep_below = 0, s.accuracy.shifting = 0;
    return s;
}

/// Ids of the whole scene from those of its bodies at rest alone.
class Ids {
public:
    Ids(const Scene& scene, const scene::Filling& filling)
    {
        std::int64_t first = 0, own = 0;
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            const std::int64_t n = filling.body_count(int(b));
            if (scene::rests(scene.bodies[b])) parts_.push_back({own, first - own, int(b)}), own += n;
            first += n;
        }
    }
    struct Found {
        std::int64_t id;
        int body;
    };
    Found operator()(std::int64_t own) const
    {
        auto p = std::find_if(parts_.rbegin(), parts_.rend(), [&](const Part& q) { return q.first <= own; });
        return {own + p->offset, p->body};
    }

private:
    struct Part {
        std::int64_t first, offset;
        int body;
    };
    std::vector<Part> parts_;
};

double displacement(const Comm& comm, const Particles& p)
{
    double d = 0;
    for (Index i = 0; i < p.size(); ++i) d = std::max(d, length(p[field::position][i] - p[field::origin][i]));
    return comm.max(d);
}

/// Runs until the soil rests; false if it moves by more than `most` m, no longer becomes slower, or its time is over.
/// `crossing`: time_through_height().
bool come_to_rest(Simulation& sim, const RunOptions& options, double most, double crossing, Settling& s)
{
    const double slow = settled_speed(sim.scene()), weak = settled_acceleration(sim.scene());
    constexpr double period = 8; // crossings in which soil that stands becomes slower by a fifth at least
    double next = 2 * period * crossing, before = std::numeric_limits<double>::infinity();
    int calm = 0;
    bool stands = true;
    while (stands && !sim.finished() && calm < 10) {
        s.speed = sim.max_speed(), s.acceleration = sim.max_acceleration(), s.time = sim.time();
        if (sim.step({.stop = options.settling && options.settling(s)}).stop) throw SettlingStopped();
        ++s.steps;
        // at a turning point a wave stands still for a moment
        calm = sim.max_speed() < slow && sim.max_acceleration() < weak ? calm + 1 : 0;
        if (sim.steps() % 32 == 0) stands = displacement(sim.comm(), sim.particles()) <= most;
        if (sim.time() < next) continue;
        stands = stands && sim.max_speed() < 0.8 * before;
        before = sim.max_speed(), next += period * crossing;
    }
    s.speed = sim.max_speed(), s.acceleration = sim.max_acceleration(), s.time = sim.time();
    s.displacement = displacement(sim.comm(), sim.particles());
    s.at_rest = calm >= 10;
    return s.at_rest && s.displacement <= most;
}

/// Soil that rough ground held comes to rest on its friction: the spring begins with the slip that carries what the soil's own stress
/// puts on the ground, slip = h/(2 G) (sigma n - (n.sigma n) n). Without it a mass goes a few milliseconds as on ice.
void hand_over_to_friction(const Scene& scene, Particles& p)
{
    const scene::Wall* ground = scene::ground_wall(scene);
    if (!ground || ground->surface != scene::Surface::Coulomb || scene.accuracy.scheme == scene::Scheme::LeapFrog) return;
    const auto& heights = *std::get<scene::Ground>(ground->shape).field;
    p.require(field::wall_slip);
    const auto soils = materials_of(scene);
    const Index count = p.size();
#pragma omp parallel for schedule(static)
    for (Index i = 0; i < count; ++i) {
        const auto near = heights.nearest(p[field::position][i]);
        if (!(near.distance < scene.support())) continue;
        const Vector t = p[field::stress][i] * near.normal;
        p[field::wall_slip].set(
            i, slip_under(t - dot(t, near.normal) * near.normal, soils[p[field::soil][i]].shear, scene.smoothing_length()));
    }
}

} // namespace

double settled_speed(const Scene& s) { return 1e-3 * std::sqrt(gravity(s) * s.space.spacing); }
double settled_acceleration(const Scene& s) { return 0.02 * gravity(s); }

Particles settle(const Comm& comm, const Scene& scene, const scene::Filling& filling, const RunOptions& options, Settling& s)
{
    // Soil that stands sinks by its elastic strain under its own weight and loads at most, (rho g H + p) H/E, from zero stress.
    double most = scene.space.spacing;
    const double height = filling.soil_height();
    for (const auto& b : scene.bodies)
        if (scene::rests(b)) {
            const auto& soil = scene.soils[std::size_t(b.soil)];
            most = std::max(most, scene.space.spacing +
                                      (soil.density * gravity(scene) * height + scene::largest_load(scene)) * height / soil.young);
        }
    RunOptions inner{options.arithmetic, options.recut_every, options.blocks_per_rank};
    inner.settles = true;
    std::optional<Simulation> sim;
    try {
        const double crossing = time_through_height(scene, filling), end = 100 * crossing;
        try {
            sim.emplace(comm, settling_scene(scene, end, false), inner);
            s.held = !come_to_rest(*sim, options, most, crossing, s);
        } catch (const NumbersFailed&) { // on its way down a slope that does not carry it
            s.held = true;
        }
        if (s.held) {
            sim.emplace(comm, settling_scene(scene, end, true), inner);
            come_to_rest(*sim, options, std::numeric_limits<double>::infinity(), crossing, s);
        }
    } catch (const NumbersFailed& e) {
        throw NumbersFailed(fmt::format("while the soil settled, before t = 0: {}", e.what()));
    }
    Particles p = sim->particles();
    sim.reset();
    const Ids ids(scene, filling);
    for (Index i = 0; i < p.size(); ++i) {
        const auto found = ids(p[field::id][i]);
        p[field::id].set(i, found.id), p[field::velocity].set(i, start_velocity(scene, scene.bodies[std::size_t(found.body)])),
            p[field::plastic_strain].set(i, 0.0);
        p[field::origin].set(i, p[field::position][i]), p[field::sorted_position].set(i, p[field::position][i]);
        if (p.has(field::load)) p[field::load].set(i, 0);
        if (s.held && p.has(field::opened_volume)) p[field::opened_volume].set(i, 0.0);
    }
    hand_over_to_friction(scene, p);
    return p;
}

} // namespace kuzure
