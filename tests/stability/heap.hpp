#pragma once
// H13: a heap of dry soil that should stand still.
#include "tests/stability/hard.hpp"

namespace kuzure::validation {

struct HeapResult {
    double drift = 0, kinetic = 0, early = 0,
           late = 0; // D in dx; greatest KE/PE_0 of the last quarter; creep of the first and last quarter, dx
    double calm = 0; // KE/PE_0 at the end
    int moved = 0;   // particles with a drift above 0.1 dx
};
/// Watches what stands still from `settled` s to the scene's end; kinetic energies over `potential` J.
inline HeapResult watch(Simulation& sim, double settled, double potential)
{
    const double spacing = sim.scene().space.spacing, span = sim.scene().time.end - settled;
    const auto apart = [&](const Positions& from) {
        double most = 0;
        each_way(sim, from, [&](double way) { most = std::max(most, way); });
        return most / spacing;
    };
    const auto kinetic = [&] {
        double sum = 0;
        each(sim, [&](Index i) { sum += 0.5 * particle_mass(sim, i) * dot(velocity(sim, i), velocity(sim, i)); });
        return sum / potential;
    };
    HeapResult r;
    run_to(sim, settled);
    const auto start = positions(sim);
    run_to(sim, settled + 0.25 * span);
    r.early = apart(start);
    run_to(sim, settled + 0.75 * span);
    const auto third = positions(sim);
    while (!sim.finished()) {
        sim.step();
        if (sim.steps() % 20 == 0) r.kinetic = std::max(r.kinetic, kinetic());
    }
    r.calm = kinetic(), r.drift = apart(start), r.late = apart(third);
    each_way(sim, start, [&](double way) { r.moved += way > 0.1 * spacing; });
    return r;
}
/// m g z of all particles, J.
inline double potential_energy(const Simulation& sim)
{
    double sum = 0;
    each(sim, [&](Index i) { sum += particle_mass(sim, i) * gravity * position(sim, i).z; });
    return sum;
}
/// A heap with a factor of safety `fos`, settled with damping for 10 sqrt(H/g), then watched for `times` sqrt(H/g).
inline HeapResult heap(double spacing, double fos, double times, const std::string& kernel, double h, const std::string& more = mild)
{
    SceneText t;
    t.spacing = spacing, t.h = h, t.accuracy = "kernel = \"" + kernel + "\"";
    t.strength = "friction_angle = 25.0\ncone = \"plane strain\"";
    const double tangent = std::tan(25 * pi / 180), slope = std::tan(std::asin(3 * tangent / std::sqrt(9 + 12 * tangent * tangent))) / fos;
    const double half = 0.8, high = half * slope, unit = std::sqrt(high / gravity), settle = 10 * unit;
    t.bodies = polygon("body", {{-half, 0}, {half, 0}, {0, high}}, "soil = \"s\"\nstress = \"at rest\"");
    const double wide = std::ceil(1.6 / spacing) * spacing;
    t.walls = box("wall", {-wide, 0, -4 * spacing}, {wide, 0, 0}, "");
    t.effects = weight + more + fmt::format("damping = {{ ratio = 0.5, until = {} }}\n", settle);
    t.end = settle + times * unit;
    Simulation sim(Comm::world(), t.scene());
    run_to(sim, settle);
    return watch(sim, settle, potential_energy(sim));
}

} // namespace kuzure::validation
