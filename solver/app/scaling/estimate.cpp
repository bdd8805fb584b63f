#include "solver/app/scaling/estimate.hpp"
#include "io/checkpoint.hpp"
#include "io/snapshot.hpp"
#include "solver/run/blocks.hpp"
#include "solver/scene/column_bytes.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/nearby.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <numbers>
#include <unistd.h>

namespace kuzure {

double neighbours_at_start(const Scene& s, const scene::Filling& f)
{
    const double d = s.space.spacing, reach = s.support();
    const int n = int(std::ceil(reach / d));
    std::vector<Vector> offsets;
    for (int a = -n; a <= n; ++a)
        for (int b = s.dimensions == 3 ? -n : 0; b <= (s.dimensions == 3 ? n : 0); ++b)
            for (int c = -n; c <= n; ++c) {
                const Vector o{a * d, b * d, c * d};
                if (const double r = length(o); r > 0 && r < reach) offsets.push_back(o);
            }
    const std::int64_t all = f.soil_count(), samples = std::min<std::int64_t>(all, 3001);
    const auto wrapped = [&](Vector x) {
        if (!s.space.low) return x;
        const auto wrap = [](double v, double low, double high) { return v - (high - low) * std::floor((v - low) / (high - low)); };
        if (s.space.periodic[0]) x.x = wrap(x.x, s.space.low->x, s.space.high->x);
        if (s.space.periodic[1]) x.y = wrap(x.y, s.space.low->y, s.space.high->y);
        if (s.space.periodic[2]) x.z = wrap(x.z, s.space.low->z, s.space.high->z);
        return x;
    };
    const auto bodies = scene::nearby(s.bodies, s.dimensions), walls = scene::nearby(s.walls, s.dimensions);
    const auto holds = [&](const auto& parts, Vector x) {
        return [&parts, &s, x](std::size_t k) { return scene::contains(parts[k].shape, x, s.dimensions); };
    };
    std::int64_t pairs = 0;
#pragma omp parallel for reduction(+ : pairs) schedule(static)
    for (std::int64_t k = 0; k < samples; ++k) {
        const Vector at = f.soil_position(k * all / samples);
        for (const Vector& o : offsets) {
            const Vector x = wrapped(at + o);
            pairs += bodies.any(x, holds(s.bodies, x)) || walls.any(x, holds(s.walls, x));
        }
    }
    return samples > 0 ? double(pairs) / double(samples) : 0;
}

namespace {

/// Bytes of a soil particle in what the run makes of soil at spacings as they begin; lengths in spacings.
struct ListBytes {
    double whole, pruned;
};
ListBytes list_bytes(const Scene& s, int width)
{
    const double support = 2 * s.space.h, reach = support * (1 + s.accuracy.skin), pi = std::numbers::pi, W = width;
    const bool flat = s.dimensions == 2;
    // Columns are two spacings wide; a cluster fills most of its own. Of each column around it has the heights in reach, in words of 32
    // points.
    const double layer = flat ? 2 : 4, edge = 1.4, tall = std::max(0.0, W / layer - 1);
    const int n = int(std::ceil(reach / 2));
    double words = 0;
    for (int a = -n; a <= n; ++a)
        for (int b = flat ? 0 : -n; b <= (flat ? 0 : n); ++b) {
            const auto gap = [&](int k) { return k == 0 ? 0 : 2 * std::abs(k) - 0.5 * (2 + edge); };
            const double left = reach * reach - gap(a) * gap(a) - gap(b) * gap(b);
            if (left > 0) words += std::ceil(layer * (2 * std::sqrt(left) + tall) / 32);
        }
    // What is nearer than the support, and half of the way to the next pruning, to any of its particles: nearly a box with rounded edges.
    const double r = support * (1 + 0.03), side = flat ? 0 : edge;
    const double near = flat ? edge * tall + 2 * r * (edge + tall) + pi * r * r
                             : edge * side * tall + 2 * r * (edge * side + (edge + side) * tall) + pi * r * r * (edge + side + tall) +
                                   4 * pi / 3 * r * r * r;
    constexpr double of_cluster = 37; // first, counts, pointers, interior or rim
    return {(8 * words + of_cluster) / W, 4 * near / W};
}

/// Wall points that a run holds, and their bytes: those that soil may come near, of which lists need what lies no deeper than the support.
double wall_bytes(const Scene& s, const scene::Filling& f, bool mixed)
{
    if (f.wall_count() == 0) return 0;
    // Soil that falls comes about as far beyond its sides as it is high.
    const double far = 4 * list_reach(s) + f.soil_height(), below = 4 * list_reach(s) + s.support();
    scene::Box near = f.soil_bounds();
    near.low = near.low - Vector{far, far, below}, near.high = near.high + Vector{far, far, below};
    const double points = double(f.wall_count_in(near));
    const bool one_pass = s.accuracy.scheme == scene::Scheme::LeapFrog;
    // Position, in the records' form too where that is another; faces, and what they are like where that is no plane.
    const double kept = 24 + (one_pass || mixed ? (mixed ? 12 : 24) : 0) + (one_pass ? 0 : 20) + (scene::ground_of(s) ? 64 : 0);
    return points * kept;
}

} // namespace

Estimate estimate(const Scene& s, const scene::Filling& f, const PairModel& model)
{
    Estimate e{};
    e.soil = f.soil_count(), e.walls = f.wall_count(), e.shown = f.shown_wall_count();
    double c = 0;
    for (const auto& soil : s.soils) c = std::max(c, Material::from(soil).c_p);
    const double h = s.smoothing_length();
    const double g = s.effects.gravity ? length(*s.effects.gravity) : 0;
    // A collapse moves at about sqrt(g H): the signal speed that shortens a step which follows the motion.
    const double fall = std::sqrt(g * f.soil_height());
    e.dt = s.time.step ? *s.time.step : s.accuracy.cfl * h / (c + 0.25 * fall);
    e.steps = std::int64_t(std::llround(s.time.end / e.dt));

    const double k = 2 * s.space.h;
    const bool mixed = model.precision() == scene::Precision::Mixed;
    e.mixed = mixed;
    e.support = k;
    e.record = double(ghost_bytes(model));
    const double records = double(model.record_bytes());
    const ListBytes lists = list_bytes(s, model.cluster_width());
    const double columns = scene::column_bytes(s, f);
    const auto& box = f.soil_bounds();
    const auto across = [&](double low, double high) { return std::floor((high - low) / (2 * s.space.spacing)) + 1; };
    e.columns = across(box.low.x, box.high.x) * (s.dimensions == 3 ? across(box.low.y, box.high.y) : 1);
    e.longest =
        std::max({box.high.x - box.low.x, s.dimensions == 3 ? box.high.y - box.low.y : 0.0, box.high.z - box.low.z}) / s.space.spacing;
    constexpr double sorting = 8 + 36; // a column beside the others; heights and numbers while they are sorted
    e.memory = 12 * e.columns + columns + double(e.soil) * (records + lists.whole + lists.pruned + sorting) + wall_bytes(s, f, mixed) +
               40.0 * double(e.shown) + 48.0 * double(e.soil + e.shown); // walls as shown, and one table of a snapshot
    // Outputs come at steps: never more of them than steps.
    const auto times = [&](double every) { return std::min(std::floor(s.time.end / every), double(e.steps)); };
    e.snapshots = s.output.every ? times(*s.output.every) + 2 : 2;
    e.snapshot = double(io::snapshot_bytes(e.soil, s.output.fields));
    if (scene::walls_change(s)) e.snapshot += double(io::snapshot_bytes(e.shown, s.output.fields));
    e.wall_files = e.shown > 0 ? 2 * double(io::snapshot_bytes(e.shown, s.output.fields)) : 0;
    e.checkpoint = double(io::checkpoint_bytes(e.soil, std::size_t(columns / std::max<double>(1, double(e.soil)))));
    e.history_rows = s.output.history ? times(*s.output.history) + 1 : 1;
    e.history = e.history_rows * 320;
    e.scheme = s.accuracy.scheme;
    // A collapse presses the soil together and spreads it: over the runs of docs/performance.md the one outweighs the other.
    e.pairs = double(e.steps) * double(e.soil) * neighbours_at_start(s, f) * 1.03;
    return e;
}

double step_price(scene::Scheme scheme)
{
    // The cube's study, standard against the seed's kernel in one pass (docs/accuracy.md), lists and updates included. By kernel and
    // size of the run it is 1.1 to 1.9.
    return scheme == scene::Scheme::Staggered ? 1.4 : 1;
}

double work(const Estimate& e)
{
    const double mixed = 0.76; // time of a pair in mixed precision over that in double (docs/performance.md)
    return step_price(e.scheme) * ((e.mixed ? mixed : 1) * e.pairs + StepWork::particle * double(e.soil) * double(e.steps));
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
    const double here = comm.node_position().size, have = machine_memory();
    const double need = e.memory * here / comm.size() + bytes_per_process * here;
    const double worst = comm.max(need / have);
    std::string why;
    io::on_root(comm, [&] {
        if (worst > 1)
            why = fmt::format("{} soil and {} wall particles need about {} of memory in all, {:.3g} times what a machine of this run has "
                              "({} with {} of the {} ranks). Remedy: more machines, or a larger space.spacing",
                              e.soil, e.walls, bytes_text(e.memory + bytes_per_process * comm.size()), worst, bytes_text(have), here,
                              comm.size());
        if (e.columns > most_columns || e.longest > longest_box)
            why +=
                fmt::format("{}the bodies lie so far apart that the box around them has {:.3g} columns of two spacings and is {:.3g} "
                            "spacings long, more than the {:.3g} and {:.3g} that can be. Remedy: bodies nearer to each other, or each in a "
                            "scene of its own",
                            why.empty() ? "" : "; ", e.columns, e.longest, most_columns, longest_box);
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
