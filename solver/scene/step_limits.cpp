#include "solver/scene/step_limits.hpp"
#include "solver/scene/material.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kuzure::scene {
namespace {

/// -dW/dr but for a factor, which the long wave gives; q = r/h.
double slope(Kernel kernel, double q)
{
    switch (kernel) {
    case Kernel::CubicSpline:
        return q < 1 ? 3 * q - 2.25 * q * q : 0.75 * (2 - q) * (2 - q);
    case Kernel::WendlandC2:
        return 5 * q * std::pow(1 - q / 2, 3);
    default:
        return 14.0 / 3 * q * std::pow(1 - q / 2, 5) * (1 + 2.5 * q);
    }
}

/// What sums over the lattice make of a wave of number k along a unit vector: its gradient, and stress diffusion.
struct Symbol {
    double wave = 0, diffusion = 0;
};
Symbol symbol(const Scene& scene, Vector unit, double k)
{
    const double dx = scene.space.spacing, h = scene.smoothing_length();
    const int n = int(std::ceil(2 * scene.space.h)), across = scene.dimensions == 3 ? n : 0;
    Symbol q;
    for (int a = -n; a <= n; ++a)
        for (int b = -across; b <= across; ++b)
            for (int c = -n; c <= n; ++c) {
                const Vector x{a * dx, b * dx, c * dx};
                const double r = length(x), along = dot(x, unit);
                if (r == 0 || r >= 2 * h) continue;
                const double steepness = slope(scene.accuracy.kernel, r / h);
                q.wave += steepness * along / r * std::sin(k * along);
                q.diffusion += steepness * r / (r * r + 0.01 * h * h) * (1 - std::cos(k * along));
            }
    return q;
}

/// 2 zeta c/c_p of the soil where it is largest, c = sqrt(E/rho).
double strength_of_diffusion(const Scene& scene)
{
    double most = 0;
    if (scene.effects.stress_diffusion)
        for (const auto& soil : scene.soils)
            most =
                std::max(most, 2 * scene.effects.stress_diffusion->zeta * std::sqrt(soil.young / soil.density) / Material::from(soil).c_p);
    return most;
}

} // namespace

double step_at_rest(const Scene& scene) { return scene.time.step.value_or(scene.accuracy.cfl * crossing_time(scene)); }
double crossing_time(const Scene& scene)
{
    double least = std::numeric_limits<double>::infinity();
    for (const auto& soil : scene.soils) least = std::min(least, scene.smoothing_length() / Material::from(soil).c_p);
    return least;
}
double courant_limit(const Scene& scene)
{
    if (scene.accuracy.scheme == Scheme::LeapFrog) return 0.6;
    // Staggered: a lattice wave has omega = c_p |q(k)|, q = sum_j V grad W sin(k.x_j), and half of the viscous operator acts on it:
    // stable for (omega dt)^2 + 2 (nu + d) dt < 4, nu h/c_p = 0.45 alpha on every lattice looked at, and d(k) of the stress diffusion,
    // which is largest where neighbours alternate and q vanishes.
    const double dx = scene.space.spacing, h = scene.smoothing_length();
    const double nu = 0.45 * (scene.effects.viscosity ? scene.effects.viscosity->alpha : 0);
    // The hourglass control acts as a diffusion of the velocities.
    const double diffusion = strength_of_diffusion(scene) + 2 * scene.accuracy.hourglass;
    double limit = std::numeric_limits<double>::infinity();
    for (const Vector way : {Vector{1, 0, 0}, Vector{1, 0, 1}, Vector{1, 1, 1}}) {
        if (scene.dimensions == 2 && way.y != 0) continue;
        const Vector unit = (1 / length(way)) * way;
        const double tiny = 1e-4 / dx, scale = tiny / symbol(scene, unit, tiny).wave;
        for (int k = 1; k <= 64; ++k) {
            const Symbol q = symbol(scene, unit, k * length(way) * std::numbers::pi / (64 * dx));
            const double kappa = scale * h * q.wave, damped = nu + scale * h * h * diffusion * q.diffusion;
            limit = std::min(limit, 4 / (std::sqrt(damped * damped + 4 * kappa * kappa) + damped));
        }
    }
    // Corrected gradients are larger at free surfaces than those of the lattice: an elastic bar stood 0.84 of its limit, 0.80 of it at
    // alpha = 1. With forces by them too, bars in 2-D and 3-D stood 0.59 to 0.65 of it.
    switch (scene.accuracy.correction) {
    case Correction::None:
        return limit;
    case Correction::Gradient:
        return 0.85 * limit;
    case Correction::Adjoint:
        break;
    }
    return 0.63 * limit;
}
double unstable_courant(const Scene& scene) { return scene.accuracy.scheme == Scheme::LeapFrog ? 0.6 : 0.93 * courant_limit(scene); }
double recommended_courant(const Scene& scene) { return scene.accuracy.scheme == Scheme::LeapFrog ? 0.3 : 0.8 * courant_limit(scene); }
double recommended_step(const Scene& scene) { return recommended_courant(scene) * crossing_time(scene); }
std::int64_t sleep_interval(const Scene& scene)
{
    // n steps after all particles were checked for calm, the first neighbours may have changed: n dt c_p <= 2 h
    const double courant = scene.time.step ? *scene.time.step / crossing_time(scene) : scene.accuracy.cfl;
    return 1 + std::int64_t(std::min(2 / courant, 1e6));
}
double stable_step(const Scene& scene) { return unstable_courant(scene) * crossing_time(scene); }

} // namespace kuzure::scene
