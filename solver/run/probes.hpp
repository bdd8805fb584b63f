#pragma once
// What the probes of a scene read.
#include "solver/core/particles.hpp"
#include "solver/core/team.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

/// Of a point: the mean of the soil in reach, by volume and kernel; of a particle: its own; of a body: the mean of its particles by mass.
/// Not numbers where there is none.
struct Reading {
    std::string name;
    std::int64_t particles = 0;
    Vector position, velocity; // m, m/s
    double density = 0;        // kg/m^3
    Stress stress;             // Pa
    double plastic_strain = 0; // 1
};

/// Collective; the same bits on any ranks.
std::vector<Reading> read_probes(const Team&, const Scene&, const scene::Filling&, std::span<const Material>, const Particles&);

} // namespace kuzure
