#pragma once
// A cloud of particles without a scene file: jittered lattice with smooth fields, sorted and with lists, for benchmarks
// and for tests of the pair pass.
#include "solver/kernels/pair_model.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"
#include <numeric>
#include <random>

namespace kuzure::bench {

inline Scene dry_sand(double spacing = 0.04, double h = 1.2)
{
    Scene s;
    s.title = "cloud";
    s.space.spacing = spacing, s.space.h = h;
    s.time = {1.0, 1e-4};
    s.soils.push_back({"sand", 1850, 1.8e6, 0.3, 0, 25 * std::numbers::pi / 180, 0, scene::Cone::Compression, {}});
    s.effects.gravity = Vector{0, 0, -9.81};
    s.effects.viscosity = scene::Viscosity{0.1, 0};
    return s;
}

/// n^3 particles jittered by +-jitter spacings, with smooth velocities and near-geostatic stress; beside them all points of
/// the scene's walls, which may reach into the cloud.
struct Cloud {
    Scene scene;
    Columns columns;
    Particles particles;
    ColumnSort sorted;
    ClusterLists lists;
    std::vector<WallPoints> walls;
    std::vector<Material> soils;

    Cloud(int n, double jitter, const Scene& s = dry_sand(), unsigned seed = 1) : scene(s)
    {
        const double dx = s.space.spacing;
        columns = Columns::of(scene, {0, 0, 0});
        for (const auto& soil : s.soils) soils.push_back(Material::from(soil));
        auto& p = particles;
        p.require(field::velocity, field::density, field::stress, field::plastic_strain, field::sorted_position, field::soil, field::id);
        const int ny = s.dimensions == 2 ? 1 : n;
        p.resize(n * ny * n);
        std::mt19937_64 g(seed);
        std::uniform_real_distribution<double> u(-1, 1);
        Index i = 0;
        for (int a = 0; a < n; ++a)
            for (int b = 0; b < ny; ++b)
                for (int c = 0; c < n; ++c, ++i) {
                    const double x = (a + .5 + jitter * u(g)) * dx, z = (c + .5 + jitter * u(g)) * dx;
                    const double y = s.dimensions == 2 ? 0 : (b + .5 + jitter * u(g)) * dx;
                    p[field::position].set(i, Vector{x, y, z});
                    const Vector v{0.8 * std::sin(2 * x) + 0.02 * u(g), s.dimensions == 2 ? 0 : 0.5 * std::cos(3 * y + z) + 0.02 * u(g),
                                   -0.7 * z * std::cos(x) + 0.02 * u(g)};
                    p[field::velocity].set(i, v);
                    const double rho = s.soils[0].density * (1 + 0.002 * u(g));
                    p[field::density].set(i, rho);
                    const double depth = s.soils[0].density * 9.81 * (n * dx - z);
                    const Stress sigma{
                        -0.5 * depth + 50 * u(g), -0.5 * depth + 50 * u(g), -depth + 50 * u(g), 100 * u(g), 100 * u(g), 100 * u(g)};
                    p[field::stress].set(i, sigma);
                    p[field::id].set(i, std::int64_t(i));
                }
        for (int w = 0; w < int(s.walls.size()); ++w) {
            const auto& shape = s.walls[std::size_t(w)].shape;
            const auto* ground = std::get_if<scene::Ground>(&shape);
            const auto lattice =
                ground ? scene::Points(scene::Draped(*ground, dx)) : scene::Points(scene::Lattice(shape, dx, s.dimensions));
            auto& points = walls.emplace_back();
            points.wall = w;
            for (std::int64_t k = 0; k < lattice.size(); ++k) {
                const Vector x = lattice.position(k);
                points.x.push_back(x.x), points.y.push_back(x.y), points.z.push_back(x.z), points.id.push_back(k);
            }
            points.sort(columns);
        }
    }

    void sort()
    {
        auto x = particles[field::position];
        sorted = sort_into_columns(columns, x.column[0], x.column[1], x.column[2], particles[field::id].column[0], particles.size());
        particles.gather(sorted.order);
        for (Index i = 0; i < particles.size(); ++i) particles[field::sorted_position].set(i, particles[field::position][i]);
    }
    void build(int width, double skin)
    {
        const auto x = std::as_const(particles)[field::position];
        const SortedPoints owned{x.column[0], x.column[1],     x.column[2], std::as_const(particles)[field::id].column[0],
                                 &sorted,     particles.size()};
        static const ColumnSort none{.start = {0}};
        const SortedPoints ghosts{.columns = &none};
        lists.build(columns, owned, ghosts, walls, scene.support() * (1 + skin), width);
    }

    /// What a step of length dt asks of a model; the kick alike.
    StepInput input(double dt)
    {
        StepInput in{.particles = &particles, .lists = &lists, .soils = soils, .dt = dt, .kick = dt, .next = dt, .energy_unit = 1e-12};
        in.forces.gravity = scene.effects.gravity.value_or(Vector{});
        // a scheme may read half a step back from the positions its lists are pruned at
        double fastest = 0;
        for (Index i = 0; i < particles.size(); ++i) {
            const Vector v = std::as_const(particles)[field::velocity][i];
            const Vector w = particles.has(field::shift) ? std::as_const(particles)[field::shift][i] : Vector{};
            fastest = std::max(fastest, length(v) + length(w));
        }
        in.margin = 2 * dt * fastest;
        for (const auto& m : soils) in.evolving = in.evolving || m.evolves(), in.remembering = in.remembering || m.remembers > 0;
        in.shifts = in.shifted = scene.accuracy.shifting > 0;
        return in;
    }
    /// Sorted, with lists for a model, its records and walls; the cloud may not move while the model is used.
    void prepare(PairModel& model, double skin)
    {
        const auto coulomb = [](const scene::Wall& w) { return w.surface == scene::Surface::Coulomb; };
        model.require_fields(particles, std::ranges::any_of(scene.walls, coulomb));
        if (std::ranges::any_of(soils, [](const Material& m) { return m.remembers > 0; })) particles.require(field::opened_volume);
        model.start(particles);
        sort();
        model.set_walls(scene, walls);
        build(model.cluster_width(), skin);
        model.make_records(particles, soils, {});
    }
    /// One whole step over all clusters.
    PassResult step(PairModel& model, const StepInput& in)
    {
        model.move(in);
        std::vector<Index> all(lists.size());
        std::iota(all.begin(), all.end(), 0);
        PassResult result;
        for (int stage = 0; stage < int(model.stages().size()); ++stage) {
            result.add(model.run(stage, in, all));
            model.end_stage(stage);
        }
        return result;
    }
};

} // namespace kuzure::bench
