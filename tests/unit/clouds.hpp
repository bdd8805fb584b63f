#pragma once
// Scenes, walls and clouds on which fast passes are held against the physics in plain loops: one scene for every compiled model, walls of
// every shape and surface, arrangements from a lattice to disorder.
#include "perf/bench/cloud.hpp"
#include "solver/kernels/variants.hpp"

namespace kuzure::measured {

using bench::Cloud;

// ---- scenes: one for every compiled model ----------------------------------------------------------------------------
template <int I> Scene scene_of(int dimensions, scene::Scheme scheme)
{
    using M = std::tuple_element_t<I, Variants>;
    using K = typename M::Kernel;
    Scene s = bench::dry_sand();
    s.accuracy.scheme = scheme;
    s.dimensions = dimensions;
    s.accuracy.kernel = std::is_same_v<K, CubicSpline>  ? scene::Kernel::CubicSpline
                        : std::is_same_v<K, WendlandC2> ? scene::Kernel::WendlandC2
                                                        : scene::Kernel::WendlandC4;
    const bool linear = std::is_same_v<decltype(M::viscosity), LinearViscosity>;
    s.effects.viscosity.reset();
    if (M::viscous) s.effects.viscosity = scene::Viscosity{0.1, linear ? 0 : 0.5};
    if (M::tensile) s.effects.artificial_stress = scene::ArtificialStress{0.5, 2.55};
    if (M::diffusive) s.effects.stress_diffusion = scene::StressDiffusion{0.1};
    if (M::corrected) s.accuracy.correction = scene::Correction::Gradient;
    if (M::shifts && scheme == scene::Scheme::Staggered) s.accuracy.shifting = 1.5;
    return s;
}
/// True if the scene gets this very model.
template <int I> bool first_to_cover(const Scene& s)
{
    return [&]<int... J>(std::integer_sequence<int, J...>) { return !(std::tuple_element_t<J, Variants>::covers(s.interactions()) || ...); }
    (std::make_integer_sequence<int, I>{}) && std::tuple_element_t<I, Variants>::covers(s.interactions());
}
/// A model that shifts particles and has not everything else.
template <int I> inline constexpr bool lean_shifting = std::tuple_element_t<I, Variants>::shifts && !has_leap_frog(I);
/// Throws Broken where a compiled model gets no scene here.
inline std::vector<Scene> scenes(scene::Scheme scheme)
{
    std::vector<Scene> all;
    [&]<int... I>(std::integer_sequence<int, I...>)
    {
        const auto add = [&](const Scene& s, bool its_own) {
            ensure(its_own, "a compiled model that no scene here gets");
            all.push_back(s);
        };
        const auto add_one = [&]<int V>(std::integral_constant<int, V>, int dimensions, bool shifting) {
            if (shifting == lean_shifting<V>) add(scene_of<V>(dimensions, scheme), first_to_cover<V>(scene_of<V>(dimensions, scheme)));
        };
        const auto add_all = [&](bool shifting) {
            for (const int dimensions : {3, 2}) (add_one(std::integral_constant<int, I>{}, dimensions, shifting), ...);
        };
        add_all(false);
        // one pass shifts nothing, so what differs by that alone has no scene of its own there
        if (scheme == scene::Scheme::Staggered) add_all(true);
    }
    (std::make_integer_sequence<int, KUZURE_VARIANTS>{});
    return all;
}
/// A scene with every term, in Wendland C2, and pore water whose table bends over the cloud.
inline Scene everything(int dimensions, scene::Scheme scheme)
{
    Scene s = scene_of<KUZURE_VARIANTS - 2>(dimensions, scheme);
    s.effects.pore_pressure = scene::PorePressure{{{0.05, 0.2}, {0.2, 0.1}}, 1000};
    return s;
}

// ---- walls beside the cloud, which fills 0 .. edge() -------------------------------------------------------------------
constexpr double dx = 0.04;
inline int count(int dimensions) { return dimensions == 2 ? 13 : 6; }
inline double edge(int dimensions) { return count(dimensions) * dx; }

inline const char* const shapes[] = {"box", "cylinder", "sphere", "polygon"};
inline scene::Shape shape(int kind, int dimensions)
{
    const double e = edge(dimensions), middle = e / 2;
    switch (kind) {
    case 0: // a floor that ends in the middle
        return scene::Box{{-2 * dx, -dx, -3 * dx}, {e - 2 * dx, e + dx, 0}};
    case 1: // upright beside the cloud and as high as half of it
        return scene::Cylinder{{-3.1 * dx, middle, -2 * dx}, 4.2 * dx, 5 * dx};
    case 2: // reaches in from below
        return scene::Sphere{{middle, middle, -4.3 * dx}, 5 * dx};
    default: // a slope with a corner inwards and one outwards, whose end face stands in the cloud
        return scene::Polygon{{{-4 * dx, -4 * dx}, {e, -4 * dx}, {e, 2 * dx}, {0.7 * e, 1.7 * dx}, {0.4 * e, 0}, {0, 0}, {-4 * dx, 2 * dx}},
                              {-3 * dx, 0.6 * e}};
    }
}
inline const char* const surfaces[] = {"rough", "smooth", "Coulomb"};
inline scene::Wall wall(int kind, int surface, int dimensions)
{
    return {shape(kind, dimensions), scene::Surface(surface), surface == 2 ? 0.35 : 0};
}
inline std::vector<scene::Wall> corner(int dimensions)
{
    const double e = edge(dimensions);
    return {{scene::Box{{-3 * dx, -dx, -3 * dx}, {e, e + dx, 0}}, scene::Surface::Coulomb, 0.4},
            {scene::Box{{-3 * dx, -dx, 0}, {0, e + dx, e}}, scene::Surface::Smooth, 0}};
}

// ---- clouds ------------------------------------------------------------------------------------------------------------
enum Arrangement { Lattice, Jitter, Disorder, Hard, Creep, Soils };
inline const char* const arrangements[] = {"lattice", "jitter", "disorder", "hard", "creep", "two soils"};
/// A sorted cloud. Hard: lonely, coincident and tensile particles. Creep: so slow that it sticks to a Coulomb wall.
inline Cloud cloud(Arrangement kind, Scene s)
{
    if (kind == Soils) s.soils.push_back({"clay", 1500, 4e6, 0.25, 3e3, 0.35, 0.1, scene::Cone::Compression, {}, {}, {}, {}});
    Cloud c(count(s.dimensions), kind == Lattice ? 0.0 : kind == Disorder ? 1.5 : 0.3, s, 7);
    auto& p = c.particles;
    if (kind == Hard) {
        p[field::position].set(3, Vector{50, s.dimensions == 2 ? 0.0 : 50, 50});
        p[field::position].set(5, p[field::position][4]);
        for (Index i = 20; i < 100; ++i) p[field::stress].set(i, Stress{300, -50, 20, s.dimensions == 2 ? 0.0 : 10, -40, 5});
    }
    for (Index i = 0; i < p.size(); ++i) {
        if (kind == Creep) p[field::velocity].set(i, 3e-4 * p[field::velocity][i]);
        if (kind == Soils && i % 3 == 0) p[field::soil].set(i, 1), p[field::density].set(i, 1500.0 / 1850 * p[field::density][i]);
    }
    c.sort();
    return c;
}

/// Calls planted(name, change of a scene of everything()) for faults that a comparison with the plain loops has to notice.
template <class Planted> void plant_faults(Planted planted)
{
    planted("kernel", [](Scene& m) { m.accuracy.kernel = scene::Kernel::WendlandC4; });
    planted("the kernel's norm", [](Scene& m) { m.accuracy.kernel_norm = scene::KernelNorm::Continuum; });
    planted("alpha", [](Scene& m) { m.effects.viscosity->alpha *= 1.05; });
    planted("beta", [](Scene& m) { m.effects.viscosity->beta *= -1; });
    planted("artificial stress", [](Scene& m) { m.effects.artificial_stress->epsilon *= -1; });
    planted("its exponent", [](Scene& m) { m.effects.artificial_stress->exponent = 2; });
    planted("stress diffusion", [](Scene& m) { m.effects.stress_diffusion->zeta *= 1.01; });
    planted("gradient correction", [](Scene& m) { m.accuracy.correction = scene::Correction::None; });
    planted("gravity", [](Scene& m) { m.effects.gravity->z *= 1.01; });
    planted("water table", [](Scene& m) { m.effects.pore_pressure->table[1][1] += 0.01; });
}

} // namespace kuzure::measured
