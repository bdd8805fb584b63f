#include "solver/app/run/sound_state.hpp"
#include "solver/scene/events.hpp"
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

namespace kuzure {
namespace {

/// The first thing wrong with this rank's rows; empty if nothing is.
std::string first_fault(const Particles& p, const Scene& scene, std::int64_t count)
{
    const auto id = p[field::id];
    for (Index i = 0; i < p.size(); ++i)
        if (id[i] < 0 || id[i] >= count) return fmt::format("a particle has id {}, expected 0 to {}", id[i], count - 1);
    if (p.has(field::soil))
        for (Index i = 0; i < p.size(); ++i)
            if (const auto s = p[field::soil][i]; s < 0 || std::size_t(s) >= scene.soils.size())
                return fmt::format("particle {} is of soil {}, the scene has {} soils", id[i], s, scene.soils.size());
    if (p.has(field::activity))
        for (Index i = 0; i < p.size(); ++i)
            if (const auto a = p[field::activity][i]; a < std::int32_t(Activity::Moves) || a > std::int32_t(Activity::Asleep))
                return fmt::format("particle {} has activity {}, expected 0 to 2", id[i], a);
    if (p.has(field::load))
        for (Index i = 0; i < p.size(); ++i)
            if (const auto l = p[field::load][i]; l < 0 || std::size_t(l) > scene.loads.size())
                return fmt::format("particle {} is pushed by load {}, the scene has {} loads", id[i], l, scene.loads.size());
    std::string fault;
    p.for_each_present([&](auto f) {
        if constexpr (std::is_same_v<typename decltype(f)::Number, double>) {
            const auto view = p[f];
            for (int c = 0; c < f.components && fault.empty(); ++c)
                for (Index i = 0; i < p.size(); ++i)
                    if (!std::isfinite(view.column[c][i])) {
                        fault = fmt::format("{} of particle {} is not a finite number", f.name, id[i]);
                        break;
                    }
        }
    });
    if (!fault.empty()) return fault;
    if (p.has(field::density))
        for (Index i = 0; i < p.size(); ++i)
            if (!(p[field::density][i] > 0)) return fmt::format("particle {} has density {:g}", id[i], p[field::density][i]);
    // Where there is no box, what the whole numbers of columns and blocks hold.
    const double far = 1e9 * scene.space.spacing;
    for (Index i = 0; i < p.size(); ++i) {
        const Vector x = p[field::position][i];
        const double at[3] = {x.x, x.y, x.z};
        for (int a = 0; a < 3; ++a) {
            if (a == 1 && scene.dimensions == 2) continue;
            double low = -far, high = far;
            if (scene.space.low && scene.space.high) {
                const auto component = [a](const Vector& v) { return a == 0 ? v.x : a == 1 ? v.y : v.z; };
                low = component(*scene.space.low), high = component(*scene.space.high);
                // Across a period they are brought back at list rebuilds only.
                const double period = scene.space.periodic[a] ? high - low : 0;
                low -= period, high += period;
            }
            if (at[a] < low || at[a] > high)
                return fmt::format("particle {} lies at ({:g}, {:g}, {:g}) m, outside the box", id[i], x.x, x.y, x.z);
        }
    }
    return {};
}

/// An id that this rank received twice; -1 if there is none. Each rank checks a range of ids.
std::int64_t doubled(const Comm& comm, const Particles& p, std::int64_t count)
{
    const std::int64_t ranks = comm.size(), share = std::max<std::int64_t>(1, (count + ranks - 1) / ranks);
    std::vector<MessageOf<std::int64_t>> out;
    for (int r = 0; r < comm.size(); ++r) out.push_back({r, {}});
    const auto id = p[field::id];
    for (Index i = 0; i < p.size(); ++i) out[std::size_t(id[i] / share)].items.push_back(id[i]);
    std::erase_if(out, [](const auto& message) { return message.items.empty(); });
    std::vector<bool> seen(std::size_t(share), false);
    for (const auto& message : comm.exchange(out))
        for (const auto k : message.items) {
            const auto at = std::size_t(k - share * comm.rank());
            if (seen[at]) return k;
            seen[at] = true;
        }
    return -1;
}

} // namespace

void require_sound_state(const Comm& comm, const io::Checkpoint& from, const Particles& p, const Scene& scene,
                         const scene::Filling& filling, const Clock& clock)
{
    const auto refuse = [&](const std::string& fault) {
        io::agree(comm, fault.empty() ? ""
                                      : fmt::format("{}: this checkpoint does not fit its scene: {}. Remedy: an older checkpoint "
                                                    "(--restart=FILE), or from the start with --force",
                                                    from.file.string(), fault));
    };
    const std::int64_t count = filling.soil_count();
    if (std::size_t(clock.events) > scene.events.size())
        refuse(fmt::format("{} events have begun in it, the scene has {}", clock.events, scene.events.size()));
    const Scene stage = scene::stage_of(scene, clock.events, clock.time);
    const std::int64_t present = scene::soil_present(stage, filling);
    // Soil that has left real ground is taken out.
    if (scene.terrain ? from.particles > present : from.particles != present)
        refuse(fmt::format("it holds {} particles, the scene has {}", from.particles, present));
    auto fault = first_fault(p, scene, count);
    for (Index i = 0; i < p.size() && fault.empty(); ++i)
        if (const int body = filling.body_of(p[field::id][i]); !stage.bodies[std::size_t(body)].present)
            fault = fmt::format("particle {} is of {}, which is not there then", p[field::id][i], scene::name_of_body(scene, body));
    refuse(fault);
    // So many, in range and none twice: each is there, or has left.
    const auto twice = doubled(comm, p, count);
    refuse(twice < 0 ? "" : fmt::format("id {} is there twice", twice));
}

std::vector<std::string_view> field_names(const Particles& p)
{
    std::vector<std::string_view> names;
    p.for_each_present([&](auto f) { names.push_back(f.name); });
    return names;
}

void require_fields(const Comm& comm, const io::Checkpoint& from, const std::vector<std::string_view>& read, const Particles& now)
{
    std::string fault;
    for (const auto name : field_names(now))
        if (fault.empty() && std::ranges::find(read, name) == read.end())
            fault = fmt::format("{}: this checkpoint lacks the field '{}', which its scene needs: it was not written by this program",
                                from.file.string(), name);
    io::agree(comm, fault);
}

} // namespace kuzure
