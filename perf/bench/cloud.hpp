#pragma once
// A cloud of particles without a scene file: jittered lattice with smooth fields, sorted and with lists, for benchmarks
// and for tests of the pair pass.
#include "solver/kernels/step.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"
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
        p.require(field::velocity, field::half_velocity, field::density, field::half_density, field::stress, field::half_stress,
                  field::plastic_strain, field::sorted_position, field::soil, field::id);
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
                    p[field::velocity].set(i, v), p[field::half_velocity].set(i, v);
                    const double rho = s.soils[0].density * (1 + 0.002 * u(g));
                    p[field::density].set(i, rho), p[field::half_density].set(i, rho);
                    const double depth = s.soils[0].density * 9.81 * (n * dx - z);
                    const Stress sigma{
                        -0.5 * depth + 50 * u(g), -0.5 * depth + 50 * u(g), -depth + 50 * u(g), 100 * u(g), 100 * u(g), 100 * u(g)};
                    p[field::stress].set(i, sigma), p[field::half_stress].set(i, sigma);
                    p[field::id].set(i, std::int64_t(i));
                }
        for (int w = 0; w < int(s.walls.size()); ++w) {
            const scene::Lattice lattice(s.walls[std::size_t(w)].shape, dx, s.dimensions);
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

    template <class T> void make_records(Array<Record<T>>& records) const
    {
        const Places<T> place(scene.smoothing_length());
        const auto& p = particles;
        records.resize(p.size() + Particles::padding + 1);
        for (Index i = 0; i < p.size(); ++i) {
            const auto& m = soils[p[field::soil][i]];
            records[i] = make_record<T>(place, p[field::position][i], p[field::velocity][i],
                                        scene.particle_volume() * m.density / p[field::density][i], p[field::density][i],
                                        p[field::stress][i], m.sound_speed);
        }
        far_away(records);
    }
    template <class T> void far_away(Array<Record<T>>& records) const
    {
        Record<T> r{};
        if constexpr (std::is_same_v<T, double>) r.x = r.y = r.z = 1e6;
        else r.x = r.y = r.z = 1 << 30;
        r.density = T(1000);
        for (Index i = particles.size(); i < Index(records.size()); ++i) records[i] = r;
    }
    /// The walls' points as the pair loop reads them; good as long as the cloud stays where it is.
    template <class T> std::vector<WallRecords<T>> wall_records() const
    {
        const Places<T> place(scene.smoothing_length());
        std::vector<WallRecords<T>> all;
        for (const auto& w : walls) {
            auto& r = all.emplace_back();
            r.wall = &scene.walls[std::size_t(w.wall)];
            for (std::size_t k = 0; k < w.x.size(); ++k)
                r.x.push_back(place(w.x[k])), r.y.push_back(place(w.y[k])), r.z.push_back(place(w.z[k]));
        }
        return all;
    }
    template <class T> Pass<T> pass(const Array<Record<T>>& records, Array<Record<T>>& next, double dt)
    {
        Pass<T> p{};
        p.particles = &particles, p.records = records.data(), p.next = next.data();
        p.lists = &lists, p.soils = soils, p.volume = scene.particle_volume(), p.h = scene.smoothing_length();
        p.dt = dt, p.kick = dt, p.forces.gravity = scene.effects.gravity.value_or(Vector{}), p.energy_unit = 1e-12;
        return p;
    }
};

} // namespace kuzure::bench
