#pragma once
// Smoothing kernels W(r, h) with support 2h. Legend: q = r/h, t = 2h - r where positive, else 0.
// A kernel gives F(t, r, 1/r), (1/r) dW/dr without its constant, with
//
//     grad_i W_ij = scale * F * (x_i - x_j)
//
// so that the constant is taken out of the sums. F is exactly zero beyond the support. Only a kernel that `divides` is given 1/r.
#include "solver/core/scalar.hpp"
#include "solver/scene/parts.hpp"
#include <cmath>
#include <numbers>

namespace kuzure {

/// Cubic B-spline (Monaghan & Lattanzio 1985): W = A (1 - 3/2 q^2 + 3/4 q^3) for q < 1, A/4 (2 - q)^3 for q < 2.
struct CubicSpline {
    static constexpr bool divides = true;
    double h, a;
    double scale;
    CubicSpline(double h, int dimensions)
        : h(h), a(dimensions == 3 ? 1 / (std::numbers::pi * h * h * h) : 10 / (7 * std::numbers::pi * h * h)),
          scale(-0.75 * a / (h * h * h))
    {
    }
    // dW/dr = -3/4 A/h [ (2 - q)+^2 - 4 (1 - q)+^2 ]
    template <class V> KUZURE_INLINE V F(V t, V, V inverse_r) const
    {
        const V u = max(fma(t, V(2), V(number<V>(-2 * h))), V(0)); // 2 h (1 - q)+
        return fnma(u, u, t * t) * inverse_r;
    }
    /// W(r), 1/m^3 (1/m^2 in 2-D).
    template <class V> KUZURE_INLINE V value(V t) const
    {
        const V u = max(t - V(number<V>(h)), V(0)); // h (1 - q)+
        return V(number<V>(0.25 * a / (h * h * h))) * fnma(V(4) * u, u * u, t * t * t);
    }
};

/// Wendland C2 (Wendland 1995): W = A (1 - q/2)^4 (2 q + 1).
struct WendlandC2 {
    static constexpr bool divides = false;
    double h, a;
    double scale;
    WendlandC2(double h, int dimensions)
        : h(h), a(dimensions == 3 ? 21 / (16 * std::numbers::pi * h * h * h) : 7 / (4 * std::numbers::pi * h * h)),
          scale(-5 * a / (8 * h * h * h * h * h))
    {
    }
    // (dW/dr)/r = -5 A/h^2 (1 - q/2)^3
    template <class V> KUZURE_INLINE V F(V t, V, V) const { return t * t * t; }
    /// W(r), 1/m^3 (1/m^2 in 2-D).
    template <class V> KUZURE_INLINE V value(V t) const
    {
        const V f = t * V(number<V>(0.5 / h)), f2 = f * f;
        return V(number<V>(a)) * (f2 * f2) * fnma(V(4), f, V(5));
    }
};

/// Wendland C4 (Wendland 1995): W = A (1 - q/2)^6 (35/12 q^2 + 3 q + 1).
struct WendlandC4 {
    static constexpr bool divides = false;
    double h, a;
    double scale;
    WendlandC4(double h, int dimensions)
        : h(h), a(dimensions == 3 ? 495 / (256 * std::numbers::pi * h * h * h) : 9 / (4 * std::numbers::pi * h * h)),
          scale(-14.0 / 3 * a / (32 * h * h * h * h * h * h * h))
    {
    }
    // (dW/dr)/r = -14/3 A/h^2 (1 - q/2)^5 (1 + 5/2 q)
    template <class V> KUZURE_INLINE V F(V t, V r, V) const
    {
        const V t2 = t * t;
        return t2 * t2 * t * fma(r, V(number<V>(2.5 / h)), V(1));
    }
    /// W(r), 1/m^3 (1/m^2 in 2-D).
    template <class V> KUZURE_INLINE V value(V t) const
    {
        const V f = t * V(number<V>(0.5 / h)), q = fnma(f, V(2), V(2)), f2 = f * f;
        return V(number<V>(a)) * (f2 * f2 * f2) * fma(q, fma(q, V(number<V>(35.0 / 12)), V(3)), V(1));
    }
};

/// Calls visit(x, r) for the points of a cubic (square) lattice of spacing 1 around one of its points, out to `reach` along each axis.
template <class Visit> void for_each_on_lattice(int reach, int dimensions, Visit visit)
{
    const int across = dimensions == 3 ? reach : 0;
    for (int x = -reach; x <= reach; ++x)
        for (int y = -reach; y <= reach; ++y)
            for (int z = -across; z <= across; ++z)
                if (const int r2 = x * x + y * y + z * z; r2 > 0) visit(x, std::sqrt(double(r2)));
}
/// -sum_j V_j x_ij dW/dx over a cubic (square) lattice of spacing 1 around one of its points, for a kernel of h in spacings: what its
/// gradients make of a linear field, 1 of infinitely many neighbours.
template <class Kernel> double lattice_moment(const Kernel& kernel, int dimensions)
{
    double sum = 0;
    for_each_on_lattice(int(2 * kernel.h) + 1, dimensions,
                        [&](int x, double r) { sum -= kernel.scale * kernel.F(std::max(2 * kernel.h - r, 0.0), r, 1 / r) * x * x; });
    return sum;
}
/// What gradients are multiplied by: 1/lattice_moment, by which those of linear fields are exact on the lattice (in soil that has flowed
/// to 0.4 %: docs/theory.md), or 1.
template <class Kernel> double gradient_norm(scene::KernelNorm norm, int dimensions, double h_in_spacings)
{
    return norm == scene::KernelNorm::Continuum ? 1.0 : 1 / lattice_moment(Kernel(h_in_spacings, dimensions), dimensions);
}

} // namespace kuzure
