#include "solver/app/estimate.hpp"
#include "io/checkpoint.hpp"
#include "io/snapshot.hpp"
#include "solver/scene/check.hpp"
#include "solver/scene/material.hpp"
#include <fmt/format.h>
#include <fstream>
#include <numbers>
#include <unistd.h>

namespace kuzure {

Estimate estimate(const Scene& s, const scene::Filling& f, const PairModel& model)
{
    Estimate e{};
    e.soil = f.soil_count(), e.walls = f.wall_count();
    double c = 0;
    for (const auto& soil : s.soils) c = std::max(c, Material::from(soil).sound_speed);
    const double h = s.smoothing_length();
    const double g = s.effects.gravity ? length(*s.effects.gravity) : 0;
    // A collapse moves at about sqrt(g H): the signal speed that shortens a step which follows the motion.
    const double fall = std::sqrt(g * (f.soil_bounds().high.z - f.soil_bounds().low.z + s.space.spacing));
    e.dt = s.time.step ? *s.time.step : s.accuracy.cfl * h / (c + 0.25 * fall);
    e.steps = std::int64_t(std::llround(s.time.end / e.dt));

    const double k = 2 * s.space.h;
    const double neighbours = s.dimensions == 3 ? 4 * std::numbers::pi / 3 * k * k * k : std::numbers::pi * k * k;
    const bool mixed = model.precision() == scene::Precision::Mixed;
    e.mixed = mixed;
    e.support = k;
    e.record = (mixed ? 64 : 128) * (model.tensile() ? 1.5 : 1.0);
    const double records = 2.0 * e.record;
    const double skin = std::pow(1 + s.accuracy.skin, 3);
    const double list = 4.0 * neighbours * skin * 2.1 / model.cluster_width();
    const double columns = scene::column_bytes(f);
    e.memory = columns + double(e.soil) * (records + list + 24) + 60.0 * double(e.walls);
    // Outputs come at steps: never more of them than steps.
    const auto times = [&](double every) { return std::min(std::floor(s.time.end / every), double(e.steps)); };
    e.snapshots = s.output.every ? times(*s.output.every) + 2 : 2;
    e.snapshot = double(io::snapshot_bytes(e.soil + e.walls, s.output.fields));
    e.checkpoint = double(io::checkpoint_bytes(e.soil, std::size_t(columns / std::max<double>(1, double(e.soil)))));
    e.history = s.output.history ? times(*s.output.history) * 320 : 0;
    e.pairs = double(e.steps) * double(e.soil) * neighbours * 0.95;
    return e;
}

double machine_memory()
{
    double bytes = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    // Control groups, version 2 and 1; "max" is no number and is passed over.
    for (const char* limit : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
        std::ifstream in(limit);
        if (double b; in >> b && b > 0) bytes = std::min(bytes, b);
    }
    return bytes;
}

std::string bytes_text(double b)
{
    return b > 1e12  ? fmt::format("{:.1f} TB", b * 1e-12)
           : b > 1e9 ? fmt::format("{:.1f} GB", b * 1e-9)
                     : fmt::format("{:.1f} MB", b * 1e-6);
}

std::string does_not_fit(const Comm& comm, const Estimate& e, const io::Path& directory, double done)
{
    // The machine that is worst off decides for all.
    const double here = comm.node_place().size, have = machine_memory();
    const double need = e.memory * here / comm.size() + bytes_per_process * here;
    const double worst = comm.max(need / have);
    std::string why;
    io::on_root(comm, [&] {
        if (worst > 1)
            why = fmt::format("{} soil and {} wall particles need about {} of memory in all, {:.3g} times what a machine of this run has "
                              "({} with {} of the {} ranks). Remedy: more machines, or a larger space.spacing",
                              e.soil, e.walls, bytes_text(e.memory + bytes_per_process * comm.size()), worst, bytes_text(have), here,
                              comm.size());
        const double left = (1 - done) * (e.disk() - 3 * e.checkpoint) + (done > 0 ? 1 : 3) * e.checkpoint;
        const auto free = double(io::free_bytes(directory));
        if (left > free)
            why += fmt::format("{}about {} will be written, {:.0f} snapshots of {} and checkpoints of {}, and {} are free for {}. Remedy: "
                               "another directory with -o, fewer output.fields, or a longer output.every",
                               why.empty() ? "" : "; ", bytes_text(left), std::ceil((1 - done) * e.snapshots), bytes_text(e.snapshot),
                               bytes_text(e.checkpoint), bytes_text(free), directory.string());
    });
    return comm.broadcast(why);
}

} // namespace kuzure
