#pragma once
// Scenes on real ground made from a formula: what the terrain cases share.
#include "solver/scene/draped.hpp"
#include "solver/scene/shape.hpp"
#include "tests/validation/case.hpp"

namespace kuzure::validation {

inline double radians(double degrees) { return degrees * pi / 180; }

/// Heights z(x, y) on square cells that cover low .. high (m).
template <class Height> scene::Grid heights(Height z, std::array<double, 2> low, std::array<double, 2> high, double cell)
{
    scene::Grid g{low[0], low[1], cell, int(std::lround((high[0] - low[0]) / cell)) + 1, int(std::lround((high[1] - low[1]) / cell)) + 1,
                  {}};
    g.values.resize(std::size_t(g.columns) * std::size_t(g.rows));
    for (int j = 0; j < g.rows; ++j)
        for (int i = 0; i < g.columns; ++i) g.at(i, j) = z(g.x + i * cell, g.y + j * cell);
    return g;
}

/// Corners of a rectangle about a centre, turned by an angle (rad).
inline scene::Ring rectangle(double x, double y, double length, double width, double turn = 0)
{
    scene::Ring ring;
    for (const auto& [a, b] : {std::array{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
        const double u = a * length, v = b * width;
        ring.push_back({x + u * std::cos(turn) - v * std::sin(turn), y + u * std::sin(turn) + v * std::cos(turn)});
    }
    return ring;
}

/// A scene of SceneText whose soil lies `thickness` (m) thick on ground within an outline; friction of the ground in degrees.
struct GroundScene {
    SceneText text;
    scene::Grid ground;
    scene::Ring outline;
    double thickness = 1, friction = 20, drag = 0;
    scene::Grid frictions = {}; // rad; without values `friction` everywhere
    scene::Surface surface = scene::Surface::Coulomb;
    scene::InitialStress stress = scene::InitialStress::AtRest;
    std::shared_ptr<const scene::Grid> thicknesses = {};

    GroundScene()
    {
        text.dimensions = 3, text.h = 1.3, text.accuracy = "";
        text.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1, beta = 0.0 }";
    }
    scene::Wall wall() const
    {
        const auto field = std::make_shared<scene::HeightField>(ground);
        scene::Ground shape{field, scene::ground_depth(*field, 2 * text.h * text.spacing)};
        if (!frictions.values.empty()) shape.friction = std::make_shared<scene::Grid>(frictions);
        return {.shape = std::move(shape), .surface = surface, .friction_angle = friction * pi / 180, .drag = drag};
    }
    scene::Release release() const
    {
        scene::Release r;
        r.thickness = thickness, r.on_top = true, r.thicknesses = thicknesses;
        r.bed = std::make_shared<scene::HeightField>(ground);
        if (!outline.empty()) r.rings = {outline};
        return r;
    }
    Scene scene() const
    {
        SceneText t = text;
        const double dx = t.spacing;
        t.bodies = box("body", {0, 0, 0}, {dx, dx, dx}); // gives way to the release
        Scene s = t.scene();
        s.bodies[0].shape = release(), s.bodies[0].stress = stress;
        s.walls = {wall()};
        return s;
    }
};

/// Mean position (m) of all particles.
inline Vector centre(const Simulation& sim)
{
    Vector sum;
    each(sim, [&](Index i) { sum = sum + position(sim, i); });
    return (1 / double(sim.particles().size())) * sum;
}

} // namespace kuzure::validation
