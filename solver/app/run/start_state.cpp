#include "solver/app/run/start_state.hpp"
#include "io/checkpoint.hpp"
#include "io/scene_file.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/run/checkpoints.hpp"
#include "solver/app/run/clock_text.hpp"
#include "solver/app/run/sound_state.hpp"
#include "solver/scene/events.hpp"
#include <filesystem>
#include <fmt/format.h>

namespace kuzure {
namespace {

/// What keeps the soil of one scene from being that of another; empty if nothing does.
std::string other_soil(const Scene& then, const Scene& now)
{
    if (then.dimensions != now.dimensions)
        return fmt::format("it is of a scene in {}-D, this one is in {}-D", then.dimensions, now.dimensions);
    if (then.space.spacing != now.space.spacing)
        return fmt::format("its space.spacing is {} m, here it is {} m", then.space.spacing, now.space.spacing);
    if (then.bodies.size() != now.bodies.size())
        return fmt::format("it has {} bodies, this scene has {}", then.bodies.size(), now.bodies.size());
    for (std::size_t b = 0; b < now.bodies.size(); ++b)
        if (!(then.bodies[b].shape == now.bodies[b].shape)) return fmt::format("its body.{} has another shape or place than here", b);
    return {};
}

} // namespace

StartState start_state(const Comm& comm, const Scene& scene, const scene::Filling& filling)
{
    const io::Path path = scene.start.from;
    const auto refuse = [&](const std::string& what, const std::string& remedy) -> void {
        throw BadInput(fmt::format("start.from: {}: {}. Remedy: {}", path.string(), what, remedy));
    };
    std::error_code error;
    const auto there = [&] { return std::filesystem::is_directory(path, error) || std::filesystem::is_regular_file(path, error); };
    if (!comm.any(comm.rank() == 0 && there()))
        refuse("expected the result directory of a run, or a checkpoint; found nothing there", "run that scene first");
    const auto found = checkpoint_at(comm, path);
    if (!found) refuse("expected a checkpoint there, found none", "let that run end, or stop it: both leave one");

    std::string differs;
    if (comm.rank() == 0) {
        const io::Path beside = io::directory_of(found->file).path() / "scene.toml";
        try {
            differs = other_soil(io::read_scene(beside, {}, scene::StepLimit::Force), scene);
        } catch (const std::runtime_error&) { // not there, or of another version: counts have to do
        }
    }
    differs = comm.broadcast(differs);
    if (const auto here = scene::soil_present(scene, filling); differs.empty() && found->particles != here)
        differs = fmt::format("it holds {} particles, the bodies here {}", found->particles, here);
    if (!differs.empty())
        refuse(differs, "the same bodies, spacing and dimensions in both scenes; walls, effects and soils' numbers may differ");

    StartState start;
    Particles all;
    io::read_checkpoint(comm, *found, all);
    require_sound_state(comm, *found, all, scene, filling, Clock{});
    start.from = found->file.string();
    start.time = clock_from_text(found->header, found->file).time;
    Particles& p = start.particles;
    p.resize(all.size());
    const auto take = [&](auto... f) {
        (..., [&] {
            if (!all.has(f)) return;
            p.require(f);
            for (int c = 0; c < f.components; ++c) std::copy_n(std::as_const(all)[f].column[c], all.size(), p[f].column[c]);
        }());
    };
    take(field::position, field::velocity, field::density, field::stress, field::plastic_strain, field::opened_volume, field::wall_slip,
         field::wall_pressure, field::wall_friction, field::stress_rate, field::id);
    p.require(field::origin, field::sorted_position, field::soil);
    for (Index i = 0; i < p.size(); ++i) {
        const Vector x = std::as_const(p)[field::position][i];
        p[field::origin].set(i, x), p[field::sorted_position].set(i, x);
        p[field::soil].set(i, std::int32_t(scene.bodies[std::size_t(filling.body_of(p[field::id][i]))].soil));
    }
    return start;
}

} // namespace kuzure
