#include "solver/app/safety/trial.hpp"
#include "io/snapshot.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/strength.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <numbers>
#include <unordered_map>

namespace kuzure::safety {
namespace {

constexpr double first_leg = 16;     // units
constexpr double slid = 0.05;        // of the height: too far for soil that holds
constexpr double never_ending = 0.5; // of the rate is left when the time has doubled: displacement grows like the logarithm of time
constexpr double quiet_h = 1.5;      // spacings, of Wendland C2
constexpr double block_side = 4;     // spacings

} // namespace

Setting setting_of(Scene base, const scene::Filling& filling, const std::string& file)
{
    Setting s;
    s.gravity = length(base.effects.gravity.value_or(Vector{}));
    if (!(s.gravity > 0))
        throw BadInput(fmt::format("{}: effects.gravity: expected gravity, under which soil can fail, found none. Remedy: gravity = [0.0, "
                                   "0.0, -9.81]",
                                   file));
    s.height = filling.soil_height();
    double slowest = std::numeric_limits<double>::infinity(), sinks = 0;
    for (const auto& soil : base.soils) {
        slowest = std::min(slowest, Material::from(soil).c_p);
        sinks = std::max(sinks, soil.density * s.gravity * s.height * s.height / soil.young);
    }
    s.unit = s.height / slowest;
    s.damping = std::numbers::pi / s.unit;
    s.limit = slid * s.height + sinks;
    s.base = std::move(base);
    return s;
}

Scene scene_at(const Scene& scene, double time, const io::Path& state)
{
    const auto order = scene::order_of_events(scene);
    // What happens at this very time has not happened in the state that is written then.
    const auto begun = std::ranges::count_if(order, [&](int k) { return scene::begin_of(scene.events[std::size_t(k)]) < time; });
    Scene s = scene::stage_of(scene, int(begun), time);
    s.events.clear();
    std::erase_if(s.walls, [](const scene::Wall& w) { return !w.present; });
    std::erase_if(s.loads, [](const scene::Load& l) { return !l.present; });
    for (const auto& w : s.walls)
        if (w.pose != scene::Pose{})
            throw BadInput(fmt::format("--at {:g}: wall {} has been moved by then, and a trial's walls stand as they are drawn. Remedy: an "
                                       "earlier time, or a scene with the wall where it stands then and start.from of this one's run",
                                       time, w.name));
    scene::Event later;
    for (auto& b : s.bodies)
        if (!b.present) later.add.push_back(b.name), b.stress = scene::InitialStress::None; // what comes carries nothing
    if (!later.add.empty()) s.events.push_back(later);                                      // trial_scene() says when
    s.start.from = state.string();
    return s;
}

double end_of_leg(const Setting& s, int leg) { return first_leg * std::exp2(leg) * s.unit; }

Scene trial_scene(const Setting& setting, double factor, const io::Path& start)
{
    Scene s = setting.base;
    const double end = end_of_leg(setting, legs - 1);
    s.title = fmt::format("{}, strength over {:g}", setting.base.title, factor);
    double fastest = 0;
    for (auto& soil : s.soils) {
        fastest = std::max(fastest, Material::from(soil).c_p);
        scene::scale_strength(soil, 1 / factor);
        soil.dilation_angle = scene::with_tangent_times(soil.dilation_angle, 1 / factor);
    }
    // The joint between soil and wall is strength too.
    for (auto& wall : s.walls)
        if (wall.surface == scene::Surface::Coulomb) wall.friction_angle = scene::with_tangent_times(wall.friction_angle, 1 / factor);
    if (s.terrain && s.terrain->surface == scene::Surface::Coulomb)
        s.terrain->friction_angle = scene::with_tangent_times(s.terrain->friction_angle, 1 / factor);
    for (auto& body : s.bodies) body.velocity = {};
    for (auto& e : s.events) e.at = 2 * end;
    // Its ratio counts by the fastest soil.
    s.effects.damping = scene::Damping{setting.damping * setting.height / (std::numbers::pi * fastest), 2 * end};
    // What is on in the scene is on in every trial, whatever the strength.
    s.effects.artificial_stress_decision = s.effects.stress_diffusion_decision = scene::Decision::AsWritten;
    s.accuracy.precision = scene::Precision::Double; // creep is slow
    s.accuracy.sleep_below = 0;
    // With less a zero-energy mode grows in soil that rests under pressure for long (docs/verification.md).
    if (s.accuracy.kernel == scene::Kernel::WendlandC2) s.space.h = std::max(s.space.h, quiet_h);
    s.time.end = end;
    s.maps.reset(), s.probes.clear();
    s.output = {};
    s.output.every = end, s.output.history = 0.25 * first_leg * setting.unit;
    s.output.fields = {"velocity", "stress", "plastic_strain", "displacement"};
    if (!start.empty()) s.start.from = start.string();
    return s;
}

Seen inspect(const Setting& s, const io::Path& results, double before, double end)
{
    const auto at = [&](double time) {
        auto state = io::read_snapshot(io::snapshot_next_to(results, time));
        if (std::fabs(state.time - time) > 1e-3 * end_of_leg(s, 0))
            throw IoFailed(fmt::format("{}: expected a snapshot at {:g} s, found none. Remedy: remove this directory; the same command "
                                       "makes it again",
                                       results.string(), time));
        return state;
    };
    // Blocks of the soil as it stood when the trial began. In a mean grains do not count, nor rows that go to and fro in turn.
    const auto first = at(0);
    using Block = std::array<std::int64_t, 3>;
    const double side = block_side * s.base.space.spacing;
    std::map<Block, std::size_t> numbers;
    std::unordered_map<std::int64_t, std::size_t> block_of;
    std::vector<double> members;
    for (std::size_t i = 0; i < first.id.size(); ++i) {
        const Vector x = first.position[i];
        const Block b{std::int64_t(std::floor(x.x / side)), std::int64_t(std::floor(x.y / side)), std::int64_t(std::floor(x.z / side))};
        const auto [found, fresh] = numbers.try_emplace(b, numbers.size());
        if (fresh) members.push_back(0);
        block_of[first.id[i]] = found->second, members[found->second] += 1;
    }
    const double full = s.base.dimensions == 3 ? std::pow(block_side, 3) : std::pow(block_side, 2);
    const double most = members.empty() ? 0 : *std::ranges::max_element(members);
    const auto means = [&](const io::SoilSnapshot& state) {
        std::vector<Vector> sum(members.size());
        std::vector<double> there(members.size());
        for (std::size_t i = 0; i < state.id.size(); ++i)
            if (const auto b = block_of.find(state.id[i]); b != block_of.end())
                sum[b->second] = sum[b->second] + state.displacement[i], there[b->second] += 1;
        for (std::size_t b = 0; b < sum.size(); ++b) sum[b] = (1 / std::max(1.0, there[b])) * sum[b];
        return sum;
    };
    const auto last = at(end), earlier = at(before);
    if (last.id.empty()) throw NumbersFailed(fmt::format("{}: no soil is left: all of it has left the ground", results.string()));
    const auto now = means(last), was = means(earlier);
    Seen seen;
    seen.time = last.time;
    for (std::size_t b = 0; b < now.size(); ++b) {
        if (members[b] < 0.5 * std::min(full, most)) continue;
        seen.displacement = std::max(seen.displacement, length(now[b]));
        seen.creep = std::max(seen.creep, length(now[b] - was[b]) / (last.time - earlier.time));
    }
    seen.unbalanced = s.damping * seen.creep / s.gravity;
    return seen;
}

const char* word(Outcome o) { return o == Outcome::Holds ? "holds" : o == Outcome::Fails ? "fails" : "open"; }

Outcome judge(const Setting& s, const std::vector<Seen>& seen)
{
    const auto goes_on = [&](std::size_t leg) { return seen[leg].creep > never_ending * seen[leg - 1].creep; };
    // What has been decided stays, though a trial may go on for its picture.
    for (std::size_t n = 1; n <= seen.size(); ++n) {
        const auto& last = seen[n - 1];
        if (last.displacement > s.limit) return Outcome::Fails;
        if (last.unbalanced < at_rest) return Outcome::Holds;
        if (n == legs) return goes_on(n - 1) ? Outcome::Fails : Outcome::Holds;
        if (n >= 4 && goes_on(n - 1) && goes_on(n - 2)) return Outcome::Fails; // the first leg has no doubling before it
    }
    return Outcome::Open;
}

std::vector<std::string> criterion(const Setting& s)
{
    return {
        fmt::format("A trial has cohesion, tan(friction angle), tan(dilation angle), tension cut-off and the friction of Coulomb walls "
                    "over F, starts from the state settled at the least F, and moves under damping that is critical for the lowest mode "
                    "of the soil ({:.4g} 1/s). Speed under damping tells the unbalanced force.",
                    s.damping),
        fmt::format("It is looked at after 16, 32, 64 ... {:g} times {:.4g} s, the time of a P-wave through {:.4g} m of soil. What counts "
                    "is the mean of that block of soil, {:g} spacings wide, which moves most: grains do not.",
                    first_leg * std::exp2(legs - 1), s.unit, s.height, block_side),
        fmt::format("It holds once the creep since the last look needs less than {:g} of gravity, and fails once it has moved {:.4g} m or "
                    "once in two "
                    "doublings of the time, one after the other, the creep keeps more than {:g} of its rate: with half of it, displacement "
                    "grows like the logarithm of time, without end. At the last look the last doubling decides.",
                    at_rest, s.limit, never_ending),
    };
}

} // namespace kuzure::safety
