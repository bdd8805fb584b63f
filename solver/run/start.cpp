#include "solver/run/start.hpp"
#include "solver/run/blocks.hpp"
#include "solver/run/initial_stress.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/loads.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/shape.hpp"

namespace kuzure {
namespace {

/// Makes slot i of the store the particle of a body as the scene starts it, without stress.
void place(const Scene& scene, std::span<const Material> soils, Particles& p, Index i, std::int64_t id, Vector x, int body)
{
    const auto& of = scene.bodies[std::size_t(body)];
    p[field::position].set(i, x), p[field::origin].set(i, x), p[field::sorted_position].set(i, x);
    p[field::velocity].set(i, start_velocity(scene, of));
    p[field::density].set(i, soils[std::size_t(of.soil)].density);
    p[field::id].set(i, id), p[field::soil].set(i, std::int32_t(of.soil));
}

} // namespace

std::vector<Material> materials_of(const Scene& scene)
{
    std::vector<Material> m;
    for (const auto& s : scene.soils) m.push_back(Material::from(s));
    return m;
}

Vector start_velocity(const Scene& scene, const scene::Body& body)
{
    Vector v = body.velocity;
    if (scene.dimensions == 2) v.y = 0;
    return v;
}

void fill_start(const Comm& comm, Domain& domain, const Scene& scene, const scene::Filling& filling, std::span<const Material> soils,
                Particles& p)
{
    struct Start {
        std::int64_t id;
        Vector x;
        int body;
    };
    std::vector<Start> start;
    for (std::size_t k = 0; k < domain.blocks().size(); ++k) {
        if (domain.owners()[k] != comm.rank()) continue;
        const Block b = domain.blocks()[k];
        filling.for_each_soil_in(box_of(domain.space(), b, 1e-6 * scene.space.spacing), [&](std::int64_t id, Vector x, int body) {
            if (scene.bodies[std::size_t(body)].present && domain.block_of(x) == b) start.push_back({id, x, body});
        });
    }
    domain.keep_neighbourhood();
    p.resize(Index(start.size()));
    ensure(comm.sum(std::int64_t(start.size())) == scene::soil_present(scene, filling), "the ranks together do not hold the scene's soil");
    const InitialStress at_rest(scene, filling, soils);
    const Index n = p.size();
#pragma omp parallel for schedule(static)
    for (Index i = 0; i < n; ++i) {
        const auto& s = start[i];
        place(scene, soils, p, i, s.id, s.x, s.body);
        if (scene::rests(scene.bodies[s.body])) p[field::stress].set(i, at_rest(s.x, s.body, scene.bodies[s.body].soil));
    }
}

void add_bodies(const Comm& comm, const Scene& scene, const scene::Filling& filling, std::span<const Material> soils, Particles& p,
                const std::function<bool(const scene::Body&)>& wanted)
{
    std::int64_t first = 0;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const std::int64_t n = filling.body_count(int(b)), r = comm.rank(), ranks = comm.size();
        if (wanted(scene.bodies[b])) {
            const std::int64_t begin = first + n * r / ranks, end = first + n * (r + 1) / ranks;
            const Index at = p.size();
            p.resize(at + Index(end - begin));
            for (std::int64_t id = begin; id < end; ++id)
                place(scene, soils, p, at + Index(id - begin), id, filling.soil_position(id), int(b));
        }
        first += n;
    }
}

double energy_scale(const Scene& scene, const scene::Filling& filling, std::span<const Material> soils)
{
    // Soil may fall as far as the whole scene reaches; beyond its walls energy_unit() leaves room.
    scene::Box b = filling.soil_bounds();
    for (const auto& wall : scene.walls) {
        const scene::Box w = scene::bounds(wall.shape);
        b.low = {std::min(b.low.x, w.low.x), b.low.y, std::min(b.low.z, w.low.z)};
        b.high = {std::max(b.high.x, w.high.x), b.high.y, std::max(b.high.z, w.high.z)};
    }
    double g = length(scene.effects.gravity.value_or(Vector{}));
    for (const auto& e : scene.events)
        if (e.gravity) g = std::max(g, length(*e.gravity));
    const double shoved = scene::fastest_wall(scene);
    double scale = scene::largest_load(scene) * scene.particle_volume() * double(filling.soil_count());
    for (std::size_t k = 0; k < scene.bodies.size(); ++k) {
        const auto& body = scene.bodies[k];
        const Material& m = soils[body.soil];
        const double mass = m.density * scene.particle_volume() * double(filling.body_count(int(k)));
        const double size = std::max({b.high.x - b.low.x, b.high.z - b.low.z, scene.space.spacing});
        scale += mass * (g * size + 0.5 * (dot(body.velocity, body.velocity) + shoved * shoved) + 1e-6 * m.c_p * m.c_p);
    }
    return scale;
}

double energy_unit(double scale) { return std::exp2(std::floor(std::log2(scale))) / energy_units_per_scale; }

} // namespace kuzure
