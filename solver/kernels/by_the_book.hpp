#pragma once
// The physics by the book: what one particle feels, every equation as its paper prints it, over all pairs, in plain loops and doubles.
// Slow and short: the page to read first, and what every fast pass (solver/kernels) is held against (tests/unit/by_the_book_test.cpp).
//
//     rho_i dv_i/dt = sum_j V_j [ sigma_i + sigma_j - rho_i rho_j Pi_ij + f^n (tau_i + tau_j) ] . grad_i W_ij + rho_i g
//     L_i           = sum_j V_j (v_j - v_i) (x) grad_i W_ij
//
// j runs over soil and over the points of the walls. What a wall point stands for is three independent choices:
//     surface   the wall's shape: how far away it is, and its normal                       scene::contact
//     law       what a wall point shows to i as if it were soil: velocity, stress          WallLaw; today: mirrored()
//     contact   how much of that the surface passes on: all, no shear, or Coulomb's limit  passed_on(), limit_to_friction()
// Tension is positive. Legend: i the particle, j its neighbour, x_ij = x_i - x_j, r = |x_ij|, q = r/h, n outward normal of a wall.
#include "solver/effects/artificial_stress.hpp"
#include "solver/effects/pore_water.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/shape.hpp"
#include <functional>
#include <numbers>
#include <span>
#include <vector>

namespace kuzure::book {

// ---- tensors -------------------------------------------------------------------------------------------------------
using Matrix = Mat3<double>;
/// a (x) b
inline Matrix outer(Vector a, Vector b) { return {a.x * b, a.y * b, a.z * b}; }
inline Matrix operator+(const Matrix& a, const Matrix& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Matrix operator*(double s, const Matrix& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vector operator*(const Matrix& a, Vector b) { return {dot(a.x, b), dot(a.y, b), dot(a.z, b)}; }
/// sigma : L, the stress power
inline double contract(const Stress& s, const Matrix& L) { return kuzure::contract(s, symmetric_part(L)); }

// ---- smoothing kernels ---------------------------------------------------------------------------------------------
/// W(r) and its slope; zero from r = 2 h on.
struct Kernel {
    scene::Kernel kind;
    int dimensions;
    double h;        // m
    double norm = 1; // of gradients

    /// W in 1/m^3 (1/m^2 in 2-D).
    double value(double r) const
    {
        const double q = r / h, A = factor();
        if (q >= 2) return 0;
        switch (kind) {
        case scene::Kernel::CubicSpline: // Monaghan & Lattanzio (1985)
            return q < 1 ? A * (1 - 1.5 * q * q + 0.75 * q * q * q) : A / 4 * std::pow(2 - q, 3);
        case scene::Kernel::WendlandC2: // Wendland (1995)
            return A * std::pow(1 - q / 2, 4) * (2 * q + 1);
        case scene::Kernel::WendlandC4:
            return A * std::pow(1 - q / 2, 6) * (35.0 / 12 * q * q + 3 * q + 1);
        }
        return 0;
    }
    /// dW/dr in 1/m^4 (1/m^3 in 2-D).
    double slope(double r) const
    {
        const double q = r / h, A = factor();
        if (q >= 2) return 0;
        switch (kind) {
        case scene::Kernel::CubicSpline:
            return q < 1 ? A / h * (-3 * q + 2.25 * q * q) : A / h * -0.75 * (2 - q) * (2 - q);
        case scene::Kernel::WendlandC2:
            return A / h * -5 * q * std::pow(1 - q / 2, 3);
        case scene::Kernel::WendlandC4:
            return A / h * (-14.0 / 3) * q * (1 + 2.5 * q) * std::pow(1 - q / 2, 5);
        }
        return 0;
    }
    /// grad_i W_ij; two particles on one point do not push each other.
    Vector gradient(Vector x_ij) const
    {
        const double r = length(x_ij);
        return r > 0 ? (norm * slope(r) / r) * x_ij : Vector{};
    }

private:
    /// A, such that the integral over space is one.
    double factor() const
    {
        const double pi = std::numbers::pi, h2 = h * h, h3 = h2 * h;
        const bool flat = dimensions == 2;
        switch (kind) {
        case scene::Kernel::CubicSpline:
            return flat ? 10 / (7 * pi * h2) : 1 / (pi * h3);
        case scene::Kernel::WendlandC2:
            return flat ? 7 / (4 * pi * h2) : 21 / (16 * pi * h3);
        case scene::Kernel::WendlandC4:
            return flat ? 9 / (4 * pi * h2) : 495 / (256 * pi * h3);
        }
        return 0;
    }
};

// ---- what goes in, what comes out ----------------------------------------------------------------------------------
/// State of one soil particle, or of a wall point that stands for soil: m, m/s, kg/m^3, Pa, m^3 (m^2 in 2-D), c_p in m/s.
struct Particle {
    Vector x, v;
    double density;
    Stress stress;
    double volume, c_p;
};
/// Soil as plain arrays of one length: m, m/s, kg/m^3, Pa, index into the soils.
struct Soil {
    std::span<const Vector> x, v;
    std::span<const double> density;
    std::span<const Stress> stress;
    std::span<const std::int32_t> soil;
};
/// One fixed point of a wall: m; the wall's index; the surface's normal nearest to the point, and how deep below it the point lies, m.
struct WallPoint {
    Vector x;
    int wall;
    Vector normal;
    double depth;
};
/// A point of a wall with the normal and depth that the wall's surface gives it.
inline WallPoint wall_point(Vector x, int wall, std::span<const scene::Wall> walls, int dimensions)
{
    const scene::Contact c = scene::contact(walls[std::size_t(wall)].shape, x, dimensions);
    return {x, wall, c.normal, -c.distance};
}

/// What a wall law makes of particle i and one point of a wall: the soil that the point stands for as if the wall were rough, and
/// the normal of the surface between the two.
struct Shown {
    Particle soil;
    Vector normal;
};
/// A wall law. It is given i, the point with its own normal and depth (d_A = x_ij . n_j - depth_j), where i is as seen from the wall
/// as a whole (its nearest point), and the volume of a particle at reference density. j is an element of the array of points given
/// to rates(): a law that knows more of each point finds it by its index there.
using WallLaw = std::function<Shown(const Particle& i, const WallPoint& j, const scene::Contact& nearest, double volume)>;

/// The wall point takes i's density and stress and the velocity that makes the wall's surface stand still,
///     v_j = -(d_B/d_A) v_i,  so  v_j - v_i = -(1 + d_B/d_A) v_i,
/// d_A and d_B the distances of i and j from the plane through the wall's point nearest to i. Morris et al. (1997), with their factor
/// capped as by Bui et al. (2008), eq. 45: 1 + d_B/d_A = x_ij . n/d_A between 1 and 1.5.
inline Shown mirrored(const Particle& i, const WallPoint& j, const scene::Contact& nearest, double volume)
{
    const double largest = 1.5, both = dot(i.x - j.x, nearest.normal);
    // where i touches the surface or is below it, the factor is at its cap
    const double quotient = nearest.distance > 0 ? both / nearest.distance : both > 0 ? largest : 1;
    const double factor = std::clamp(quotient, 1.0, largest);
    return {{j.x, (1 - factor) * i.v, i.density, i.stress, volume, i.c_p}, nearest.normal};
}

/// All that decides the rates besides the state: kernel and effects, soils, walls, damping -damping v (1/s), and the wall law.
struct Setting {
    scene::Interactions how;
    std::span<const Material> soils;
    std::span<const scene::Wall> walls;
    double damping = 0;
    WallLaw law = mirrored;
    std::vector<Vector> motion = {}, next_motion = {}; // m/s of each wall, in this step and the next; none: they stand still
    Kernel kernel() const
    {
        Kernel k{how.kernel, how.dimensions, how.h};
        if (how.norm == scene::KernelNorm::Continuum) return k;
        // On the lattice the gradient of x is 1: sum_j V (x_j - x_i) (x) grad W = 1
        k.norm = 1 / on_lattice(k, [](double) { return 1.0; });
        return k;
    }
    /// -sum_j V weight(r) x_ij dW/dx over the lattice.
    template <class Weight> double on_lattice(const Kernel& k, Weight weight) const
    {
        double sum = 0;
        const int reach = int(2 * how.h / how.spacing) + 1, across = how.dimensions == 3 ? reach : 0;
        for (int x = -reach; x <= reach; ++x)
            for (int y = -across; y <= across; ++y)
                for (int z = -reach; z <= reach; ++z) {
                    const Vector x_ij = how.spacing * Vector{double(x), double(y), double(z)};
                    sum -= volume() * weight(length(x_ij)) * x_ij.x * k.gradient(x_ij).x;
                }
        return sum;
    }
    double volume() const { return std::pow(how.spacing, how.dimensions); } // of a particle at reference density
};

/// What one particle feels.
struct Rates {
    Vector acceleration;      // m/s^2
    Matrix L{};               // velocity gradient, 1/s
    double density = 0;       // drho/dt = -rho tr L, kg/m^3/s
    Stress diffusion{};       // stress rate of the stress diffusion, Pa/s
    double wall_power = 0;    // taken by walls: their forces and the strain they cause, W
    double viscous_power = 0; // taken by viscosity (i's half of its pairs), artificial stress and stress diffusion, W
    double damping_power = 0; // W
    std::int64_t pairs = 0;   // neighbours and wall points within the support
    bool beside_wall = false;
};

// ---- the terms of a pair -------------------------------------------------------------------------------------------
/// Pi_ij of artificial viscosity: where v_ij . x_ij < 0,
///     Pi = (-alpha c_ij mu + beta mu^2)/rho_ij,  mu = h v_ij . x_ij/(r^2 + 0.01 h^2),  c_ij and rho_ij the means. Monaghan (1992), 4.8.
inline double viscosity(const scene::Viscosity& a, double h, const Particle& i, const Particle& j, Vector v_ij)
{
    const Vector x_ij = i.x - j.x;
    const double approach = dot(v_ij, x_ij);
    if (approach >= 0) return 0;
    const double mu = h * approach / (dot(x_ij, x_ij) + 0.01 * h * h);
    const double c = (i.c_p + j.c_p) / 2, rho = (i.density + j.density) / 2;
    return (-a.alpha * c * mu + a.beta * mu * mu) / rho;
}
/// f^n (tau_i + tau_j), f = W(r)/W(spacing). Monaghan (2000); Gray et al. (2001).
inline Stress artificial_stress(const scene::ArtificialStress& a, const Kernel& kernel, double spacing, const Particle& i,
                                const Particle& j)
{
    const double f = kernel.value(length(i.x - j.x)) / kernel.value(spacing);
    return std::pow(f, a.exponent) * (tension(i.stress, a.epsilon) + tension(j.stress, a.epsilon));
}
/// One addend of the stress diffusion,
///     2 zeta h c V_j (sigma_i - sigma_j - static part) x_ij . grad W/(r^2 + 0.01 h^2),  c = sqrt(E/rho). Feng et al. (2021), eq. 24.
/// Static part: level ground at rest carries -rho_0 (g . x_ij) along gravity and K0 times that across.
inline Stress stress_diffusion(double zeta, double h, Vector gravity, const Material& soil, const Particle& i, const Particle& j,
                               Vector grad)
{
    const Vector x_ij = i.x - j.x;
    const double size = length(gravity);
    const Vector down = size > 0 ? (1 / size) * gravity : Vector{};
    const double along = -soil.density * dot(gravity, x_ij), across = soil.K0 * along;
    const Stress down_down{down.x * down.x, down.y * down.y, down.z * down.z, down.x * down.y, down.y * down.z, down.x * down.z};
    const Stress at_rest = plus_isotropic((along - across) * down_down, across);
    const double weight = 2 * zeta * h * soil.c_bar * j.volume * dot(x_ij, grad) / (dot(x_ij, x_ij) + 0.01 * h * h);
    return weight * (i.stress - j.stress - at_rest);
}
/// sigma : C^-1 : D, the power (W/m^3) of a stress rate D (Pa/s) by Hooke's law.
inline double elastic_power(const Material& soil, const Stress& sigma, const Stress& rate)
{
    const Stress strain_rate = plus_isotropic((1 / (2 * soil.shear)) * deviator(rate), trace(rate) / (9 * soil.bulk));
    return kuzure::contract(sigma, strain_rate);
}
/// False where M is too lopsided or too empty to be trusted: det M <= 1/2 (tr M/d)^d or tr M/d <= 2/5. In 2-D y counts as the mean of x
/// and z.
inline bool trusted(Matrix M, int dimensions)
{
    if (dimensions == 2) M.y.y = (M.x.x + M.z.z) / 2;
    const double det = dot(M.x, cross(M.y, M.z)), mean = trace(M) / 3;
    return det > 0.5 * mean * mean * mean && mean > 0.4;
}
/// L M^-1 with M = sum_j V_j (x_j - x_i) (x) grad W, exact for linear velocity fields: Bonet & Lok (1999). L itself where M is not
/// to be trusted.
inline Matrix corrected(const Matrix& L, Matrix M, int dimensions)
{
    if (!trusted(M, dimensions)) return L;
    if (dimensions == 2) M.y.y = (M.x.x + M.z.z) / 2;
    const Vector c0 = cross(M.y, M.z), c1 = cross(M.z, M.x), c2 = cross(M.x, M.y); // columns of det M times M^-1
    const double det = dot(M.x, c0);
    const auto times_inverse = [&](Vector row) {
        return (1 / det) * (row.x * Vector{c0.x, c1.x, c2.x} + row.y * Vector{c0.y, c1.y, c2.y} + row.z * Vector{c0.z, c1.z, c2.z});
    };
    return {times_inverse(L.x), times_inverse(L.y), times_inverse(L.z)};
}

// ---- contact: what a surface passes on -----------------------------------------------------------------------------
/// The stress that both sides of a smooth surface carry: no shear crosses it, sigma - (t (x) n + n (x) t), t = sigma n - (n . sigma n) n.
inline Stress without_shear(const Stress& s, Vector n)
{
    const Vector traction = s * n, t = traction - dot(n, traction) * n;
    return s - Stress{2 * t.x * n.x, 2 * t.y * n.y, 2 * t.z * n.z, t.x * n.y + t.y * n.x, t.y * n.z + t.z * n.y, t.x * n.z + t.z * n.x};
}
/// What wall point j adds to i: its share of the force (N/m^3) and of L (1/s), the latter split into motion towards the surface and
/// slip along it. Rough: all of it. Smooth: no shear stress and no slip; viscosity acts on the motion towards the surface alone.
/// Coulomb: all of it, viscosity as on a smooth surface; what friction then allows is limit_to_friction()'s.
struct PassedOn {
    Vector force;
    Matrix L_towards, L_slip;
};
inline PassedOn passed_on(scene::Surface surface, const Setting& s, const Particle& i, const Shown& shown, Vector grad)
{
    const Particle& j = shown.soil;
    const Vector n = shown.normal, v_ji = j.v - i.v, towards = dot(v_ji, n) * n, slip = v_ji - towards;
    const bool rough = surface == scene::Surface::Rough, smooth = surface == scene::Surface::Smooth;
    Stress bracket = smooth ? without_shear(i.stress, n) + without_shear(j.stress, n) : i.stress + j.stress;
    if (s.how.effects.viscosity) {
        const double Pi = viscosity(*s.how.effects.viscosity, s.how.h, i, j, -1.0 * (rough ? v_ji : towards));
        bracket = plus_isotropic(bracket, -i.density * j.density * Pi);
    }
    return {j.volume * (bracket * grad), j.volume * outer(towards, grad), smooth ? Matrix{} : j.volume * outer(slip, grad)};
}
/// Coulomb's law for the force density (N/m^3) that i gets from one wall: along the surface at most tan(delta) times the force along
/// the normal. Soil that slips gets friction against its slip, soil that sticks the force of the rough wall; between the two its
/// impedance (N/m^3 per m/s) decides: it slides once impedance times slip alone would need the whole friction. `sliding` is that
/// share: of a sliding contact no slip strains the soil. A wall never pulls: then it is not felt at all.
struct Limited {
    Vector force;
    double sliding;
    bool pulls;
};
inline Limited limit_to_friction(Vector force, Vector n, double friction_angle, Vector slip, double impedance)
{
    const auto shortened = [](Vector a, double limit) { return length(a) > limit ? (limit / length(a)) * a : a; };
    const double pressing = dot(force, n);
    if (!(pressing > 0)) return {{}, 1, true};
    const double limit = std::tan(friction_angle) * pressing;
    const Vector sticking = force - pressing * n, opposing = -impedance * slip;
    const double sliding = length(opposing) < limit ? length(opposing) / limit : 1;
    const Vector shear = shortened(shortened(opposing, limit) + (1 - sliding) * sticking, limit);
    return {pressing * n + shear, sliding, false};
}

// ---- the sums ------------------------------------------------------------------------------------------------------
/// Soil particle k with volume V = m/rho.
inline Particle particle(const Soil& soil, std::size_t k, const Setting& s)
{
    const Material& m = s.soils[std::size_t(soil.soil[k])];
    return {soil.x[k], soil.v[k], soil.density[k], soil.stress[k], m.density * s.volume() / soil.density[k], m.c_p};
}

/// What one wall adds to particle i.
struct WallShare {
    Vector force; // N/m^3
    Matrix L{};   // 1/s
    std::int64_t pairs = 0;
    bool felt = false;  // a point of it is within the support
    double sliding = 0; // Coulomb
    bool pulls = false;
};
inline WallShare wall_share(int wall, std::span<const WallPoint> points, const Setting& s, const Particle& i)
{
    const Kernel kernel = s.kernel();
    const scene::Wall& w = s.walls[std::size_t(wall)];
    const scene::Contact nearest = scene::contact(w.shape, i.x, s.how.dimensions);
    WallShare share;
    Matrix L_slip{};
    Vector grad_one{}; // sum V_j grad W
    for (const WallPoint& j : points) {
        const Vector x_ij = i.x - j.x;
        if (j.wall != wall || length(x_ij) >= 2 * s.how.h) continue;
        const Vector grad = kernel.gradient(x_ij);
        const Shown shown = s.law(i, j, nearest, s.volume());
        const PassedOn of_j = passed_on(w.surface, s, i, shown, grad);
        share.force = share.force + of_j.force;
        share.L = share.L + of_j.L_towards;
        L_slip = L_slip + of_j.L_slip;
        grad_one = grad_one + shown.soil.volume * grad;
        share.felt = share.felt || grad != Vector{};
        ++share.pairs;
    }
    if (w.surface == scene::Surface::Coulomb) {
        const Vector slip = i.v - dot(i.v, nearest.normal) * nearest.normal;
        const double impedance = i.density * i.c_p * length(grad_one);
        const Limited limited = limit_to_friction(share.force, nearest.normal, w.friction_angle, slip, impedance);
        share.force = limited.force, share.sliding = limited.sliding, share.pulls = limited.pulls;
        if (limited.pulls) share.L = {};
    }
    share.L = share.L + (1 - share.sliding) * L_slip;
    return share;
}

/// What particle k feels.
inline Rates rates_of(std::size_t k, const Soil& soil, std::span<const WallPoint> points, const Setting& s)
{
    const Kernel kernel = s.kernel();
    const scene::Effects& e = s.how.effects;
    const Material& material = s.soils[std::size_t(soil.soil[k])];
    const Particle i = particle(soil, k, s);
    const Vector gravity = e.gravity.value_or(Vector{});
    Rates of_i;
    Matrix M{};
    Vector force{}, from_artificial_stress{};
    double viscous = 0; // W/m^3
    for (std::size_t l = 0; l < soil.x.size(); ++l) {
        const Vector x_ij = i.x - soil.x[l];
        if (l == k || length(x_ij) >= 2 * s.how.h) continue;
        const Particle j = particle(soil, l, s);
        const Vector grad = kernel.gradient(x_ij), v_ij = i.v - j.v;
        ++of_i.pairs;
        force = force + j.volume * ((i.stress + j.stress) * grad);
        if (e.viscosity) {
            const double pressure = i.density * j.density * viscosity(*e.viscosity, s.how.h, i, j, v_ij);
            force = force - (j.volume * pressure) * grad;
            viscous += j.volume * pressure * dot(v_ij, grad) / 2;
        }
        if (e.artificial_stress)
            from_artificial_stress =
                from_artificial_stress + j.volume * (artificial_stress(*e.artificial_stress, kernel, s.how.spacing, i, j) * grad);
        if (e.stress_diffusion)
            of_i.diffusion = of_i.diffusion + stress_diffusion(e.stress_diffusion->zeta, s.how.h, gravity, material, i, j, grad);
        of_i.L = of_i.L + j.volume * outer(j.v - i.v, grad);
        M = M + j.volume * outer(j.x - i.x, grad);
    }
    force = force + from_artificial_stress;

    for (int w = 0; w < int(s.walls.size()); ++w) {
        const WallShare share = wall_share(w, points, s, i);
        force = force + share.force;
        of_i.L = of_i.L + share.L;
        of_i.pairs += share.pairs;
        of_i.beside_wall = of_i.beside_wall || share.felt;
        of_i.wall_power -= i.volume * (dot(i.v, share.force) + contract(i.stress, share.L));
    }
    // Mirrored velocities fill the support, but are not linear: beside a wall the plain gradient is kept.
    if (s.how.correction == scene::Correction::Gradient && !of_i.beside_wall) of_i.L = corrected(of_i.L, M, s.how.dimensions);

    // Buoyancy and seepage: rho_0 a = -grad p_w. Bui et al. (2011).
    const Vector water = (-1 / material.density) * PoreWater::from(e).at(i.x).gradient;
    of_i.acceleration = (1 / i.density) * force + gravity + water - s.damping * i.v;
    of_i.density = -i.density * trace(of_i.L);
    of_i.viscous_power = i.volume * (viscous - dot(i.v, from_artificial_stress) - elastic_power(material, i.stress, of_i.diffusion));
    of_i.damping_power = i.volume * i.density * s.damping * dot(i.v, i.v);
    return of_i;
}

/// What every particle feels, in the order of the arrays.
inline std::vector<Rates> rates(const Soil& soil, std::span<const WallPoint> points, const Setting& s)
{
    std::vector<Rates> all;
    for (std::size_t k = 0; k < soil.x.size(); ++k) all.push_back(rates_of(k, soil, points, s));
    return all;
}

} // namespace kuzure::book
