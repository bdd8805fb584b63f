// What events do to a run: the part of Simulation that changes its scene.
#include "solver/run/loads.hpp"
#include "solver/run/simulation.hpp"
#include "solver/run/start.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/shape.hpp"
#include <fmt/format.h>
#include <numeric>

namespace kuzure {

void Simulation::begin_events()
{
    if (start_scene_.events.empty()) return;
    const int begun = events_begun(start_scene_, clock_);
    if (begun <= clock_.events) return; // fewer: steps that a retry has halved have boundaries before the one at which the last began
    const auto order = scene::order_of_events(start_scene_);
    const auto news = std::span(order).subspan(std::size_t(clock_.events), std::size_t(begun - clock_.events));
    // Also where something only begins to change: a restart from an end at that time finds the same.
    const double before = ledger(clock_.step > 0 ? clock_.dt : clock_.next).sum();
    const Scene scene_before = scene_;
    clock_.events = begun;
    enter_stage(clock_.time);
    change_bodies(scene_before);
    layout_.forget();
    if (particles_.has(field::activity)) { // all that slept is looked at
        const auto activity = particles_[field::activity];
        for (Index i = 0; i < particles_.size(); ++i) activity.set(i, std::int32_t(Activity::Moves));
    }
    for (const auto& m : soils_) clock_.extremes.signal = std::max(clock_.extremes.signal, m.c_p);
    if (model_->moves_first()) begin_loads(scene_before), evaluate_anew();
    else rebuild(true, clock_.time);
    require_room(scene_before);
    const double taken = before - ledger(clock_.next).sum(); // with the half kick to come before it, as at the start
    take(taken);
    for (const int k : news) happened_.push_back({k, clock_.time, clock_.step, taken});
}

void Simulation::take_out_what_left()
{
    constexpr std::int64_t interval = 64; // steps
    if (!scene_.terrain || clock_.step == 0 || clock_.step % interval != 0) return;
    std::vector<Index> stay;
    for (Index i = 0; i < particles_.size(); ++i)
        if (!scene::has_left(scene_, std::as_const(particles_)[field::position][i])) stay.push_back(i);
    if (comm_.max(std::int64_t(particles_.size()) - std::int64_t(stay.size())) == 0) return;
    const double before = ledger(clock_.dt).sum();
    particles_.gather(stay);
    layout_.forget();
    if (model_->moves_first()) evaluate_anew();
    else rebuild(true, clock_.time);
    take(before - ledger(clock_.next).sum());
}

void Simulation::enter_stage(double time)
{
    scene_ = scene::stage_of(start_scene_, clock_.events, time);
    std::ranges::copy(materials_of(scene_), soils_.begin()); // others look at them where they are
    water_ = PoreWater::from(scene_.effects);
    loads_ = loads_now(scene_);
    model_->renew(scene_.interactions());
}

void Simulation::begin_loads(const Scene& before)
{
    if (scene_.loads.empty()) return;
    take_from_loads(loads_come(scene_, before), particles_);
    const auto fresh = loads_come(before, scene_);
    if (fresh.empty()) return;
    give_to_loads(comm_, scene_, filling_, fresh, clock_.time, options_.settles, particles_);
    std::ranges::fill(loads_, LoadNow{});
    for (const int l : fresh) loads_[std::size_t(l)] = {.pressure = unit_pressure(scene_), .measured = true};
    evaluate_anew();
    set_pushes(comm_, scene_, fresh, particles_);
    if (any_plate(scene_)) join_plates(comm_, scene_, soils_, particles_);
    loads_ = loads_now(scene_);
}

void Simulation::change_bodies(const Scene& before)
{
    std::vector<bool> goes, comes;
    for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
        const bool was = before.bodies[b].present, is = scene_.bodies[b].present;
        goes.push_back(was && !is), comes.push_back(!was && is);
    }
    const auto any = [](const std::vector<bool>& which) { return std::ranges::count(which, true) > 0; };
    if (any(goes)) {
        std::vector<Index> stay;
        for (Index i = 0; i < particles_.size(); ++i)
            if (!goes[std::size_t(filling_.body_of(particles_[field::id][i]))]) stay.push_back(i);
        particles_.gather(stay);
    }
    if (any(comes)) {
        Particles fresh;
        particles_.for_each_present([&](auto f) { fresh.require(f); });
        add_bodies(comm_, scene_, filling_, soils_, fresh,
                   [&](const scene::Body& b) { return comes[std::size_t(&b - scene_.bodies.data())]; });
        model_->start(fresh);
        std::vector<Index> all(std::size_t(fresh.size()));
        std::iota(all.begin(), all.end(), 0);
        std::vector<std::byte> bytes;
        fresh.pack(all, bytes);
        particles_.unpack(bytes);
    }
    if (any(goes) || any(comes)) balance_.cut_state(scene_, particles_, layout_, false, [] {});
}

void Simulation::require_room(const Scene& before)
{
    double deepest = 0;
    std::int64_t id = -1;
    std::string piece;
    const auto find_deepest = [&](const auto& part, int own_body, const std::string& name) {
        for (Index i = 0; i < particles_.size(); ++i) {
            const std::int64_t particle = std::as_const(particles_)[field::id][i];
            const double depth = -scene::signed_distance(part, std::as_const(particles_)[field::position][i], scene_.dimensions);
            if (!(depth > deepest) || (own_body >= 0 && !before.bodies[std::size_t(filling_.body_of(particle))].present)) continue;
            deepest = depth, id = particle, piece = name;
        }
    };
    for (std::size_t w = 0; w < scene_.walls.size(); ++w)
        if (!before.walls[w].present && scene_.walls[w].present) find_deepest(scene_.walls[w], -1, scene::name_of_wall(scene_, int(w)));
    for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
        if (!before.bodies[b].present && scene_.bodies[b].present)
            find_deepest(scene_.bodies[b].shape, int(b), scene::name_of_body(scene_, int(b)));
    const double all = comm_.max(deepest);
    if (all <= limit::in_new_piece * scene_.space.spacing) return;
    const int root = int(comm_.max(std::int64_t(deepest == all ? comm_.rank() : -1)));
    throw NumbersFailed(comm_.broadcast(
        fmt::format(
            "{} is added at t = {:.6g} s where soil stands: particle {} lies {:.3g} m inside it. Remedy: a place that is free then, "
            "or remove the soil there first",
            piece, clock_.time, id, deepest),
        root));
}

std::optional<Scene> Simulation::follow_courses(double dt)
{
    const auto order = scene::order_of_events(start_scene_);
    const bool goes_on = std::any_of(order.begin(), order.begin() + clock_.events, [&](int k) {
        const auto& e = start_scene_.events[std::size_t(k)];
        return scene::has_course(e) && clock_.time < scene::end_of(e);
    });
    if (!goes_on) return {};
    Scene before = scene_;
    const StateEnergy was = state(before, clock_.dt);
    enter_stage(time_after(scene_, clock_, dt));
    const StateEnergy is = state(scene_, clock_.dt);
    take((was.elastic - is.elastic) + 0.5 * (was.potential - is.potential));
    return before;
}

/// Forces of both ends of a step work in the mean: with D the displacements, (g0 + g1)/2 (D1 - D0), and the potential -g D changes by
/// minus that and by -(g1 - g0) (D0 + D1)/2, which the event gives.
void Simulation::end_course(const Scene& before) { take(0.5 * (state(before, clock_.dt).potential - state(scene_, clock_.dt).potential)); }

scene::Pose Simulation::pose(int wall, double time) const { return scene::pose_at(start_scene_, wall, clock_.events, time); }

void Simulation::move_walls(double time)
{
    for (const int w : moving_) scene_.walls[std::size_t(w)].pose = pose(w, time);
}

void Simulation::place_walls(const StepInput& in, bool midway)
{
    const double begin = clock_.time, end = begin + in.dt;
    std::vector<WallPoses> poses(scene_.walls.size());
    for (const int w : moving_) {
        const auto since = [&](double time) { return scene::then(scene::inverse(pose(w, clock_.sorted_time)), pose(w, time)); };
        poses[std::size_t(w)] = {since(begin), since(end), since(end + in.next)};
    }
    model_->place_walls({poses, in.dt, in.next, midway});
    if (!midway) move_walls(end);
}

void Simulation::meet_walls()
{
    if (!(clock_.next > 0)) return;
    const double end = clock_.time + clock_.next;
    for (const int w : moving_) {
        const scene::Wall& wall = scene_.walls[std::size_t(w)];
        if (!wall.present) continue;
        const double way = scene::farthest_way(wall.shape, pose(w, clock_.sorted_time), pose(w, end));
        const double speed = scene::farthest_way(wall.shape, pose(w, clock_.time), pose(w, end)) / clock_.next;
        clock_.extremes.displacement2 = std::max(clock_.extremes.displacement2, way * way);
        clock_.extremes.half_step_speed2 = std::max(clock_.extremes.half_step_speed2, speed * speed);
    }
}

void Simulation::take(double joules)
{
    if (!(std::fabs(joules) < 0x1p62 * clock_.energy_unit)) {
        clock_.extremes.not_finite = 1;
        return;
    }
    clock_.taken = sum_of_units(clock_.taken, joules / clock_.energy_unit);
}

} // namespace kuzure
