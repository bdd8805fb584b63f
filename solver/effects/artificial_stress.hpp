#pragma once
// Artificial stress between particles of which one is in tension.
#include "solver/pairs/batch.hpp"
#include "solver/pairs/record.hpp"
#include "solver/physics/smoothing.hpp"
#include "solver/scene/parts.hpp"
#include <algorithm>
#include <cmath>
#include <numbers>

namespace kuzure {

/// A smooth function of t in 0..support: polynomials of fifth degree through six points of each of 256 intervals, their ends among them.
class PowerOfKernel {
public:
    template <class F> PowerOfKernel(double support, F f) : per_interval_(intervals / support)
    {
        double node[degree + 1], inverse[degree + 1][degree + 1];
        for (int k = 0; k <= degree; ++k) node[k] = -0.5 * std::cos(std::numbers::pi * k / degree);
        interpolation(node, inverse);
        for (int i = 0; i < intervals; ++i) {
            double value[degree + 1];
            for (int j = 0; j <= degree; ++j) value[j] = f((i + 0.5 + node[j]) / per_interval_);
            for (int k = 0; k <= degree; ++k) {
                double c = 0;
                for (int j = 0; j <= degree; ++j) c += inverse[k][j] * value[j];
                of_[k][i] = c;
            }
        }
    }
    KUZURE_INLINE double at(double t) const
    {
        const double x = t * per_interval_;
        const int i = std::min(int(x), intervals - 1);
        const double u = x - (i + 0.5);
        return fma(fma(fma(fma(fma(of_[5][i], u, of_[4][i]), u, of_[3][i]), u, of_[2][i]), u, of_[1][i]), u, of_[0][i]);
    }

private:
    static constexpr int intervals = 256, degree = 5;
    /// Coefficients from values at the nodes: those of Lagrange's polynomials.
    static void interpolation(const double (&node)[degree + 1], double (&inverse)[degree + 1][degree + 1])
    {
        for (int j = 0; j <= degree; ++j) {
            double c[degree + 2] = {1}; // product of (u - node)/(node_j - node)
            int n = 0;
            for (int k = 0; k <= degree; ++k) {
                if (k == j) continue;
                const double per = 1 / (node[j] - node[k]);
                for (int q = ++n; q >= 0; --q) c[q] = per * ((q > 0 ? c[q - 1] : 0) - node[k] * c[q]);
            }
            for (int q = 0; q <= degree; ++q) inverse[q][j] = c[q];
        }
    }
    double per_interval_;
    alignas(64) double of_[degree + 1][intervals];
};

/// Artificial stress f (tau_i + tau_j) against clumping under tension: tau = -epsilon sum_k <sigma_k> n_k n_k over the tensile principal
/// stresses. As published (leap-frog): f = (W(r)/W(spacing))^n, Monaghan (2000), Gray et al. (2001), Bui et al. (2008), eq. 34. That is a
/// spring of negative stiffness, which does not take back what it gives. The staggered scheme has a conservative form:
///     f = [(W(r)/W(spacing))^n - m]/(1 - epsilon m),  m the mean on the lattice, sum V (f - m) x dW/dx = 0,
/// so that stretched soil keeps its stiffness: 1 - epsilon f is the published 1 - epsilon (W/W(spacing))^n but for a constant; and
///     D_i -= epsilon N_i [sum_j V_j f (v_j - v_i) (x) grad W] N_i,  N_i = sum n_k n_k: the strain is adjoint to the force.
struct ArtificialStress {
    double epsilon, mean, adjoint_epsilon; // epsilon, m, epsilon/(1 - epsilon m)
    PowerOfKernel power;
    template <class Kernel> static ArtificialStress from(const scene::Effects& e, const Kernel& kernel, double spacing, int dimensions)
    {
        const auto a = e.artificial_stress.value_or(scene::ArtificialStress{0, 1});
        const double at_spacing = kernel.value(2 * kernel.h - spacing);
        const auto power = [&](double t) { return std::pow(kernel.value(t) / at_spacing, a.exponent); };
        ArtificialStress of{a.epsilon, 0, 0, PowerOfKernel(2 * kernel.h, power)};
        double near = 0, all = 0;
        for_each_on_lattice(int(2 * kernel.h / spacing) + 1, dimensions, [&](int x, double spacings) {
            const double r = spacing * spacings, t = std::max(2 * kernel.h - r, 0.0);
            if (t <= 0) return;
            const double weight = kernel.F(t, r, 1 / r) * x * x;
            near += weight * power(t), all += weight;
        });
        of.mean = near / all, of.adjoint_epsilon = of.epsilon / (1 - of.epsilon * of.mean);
        return of;
    }
    /// (W(r)/W(spacing))^n from t = 2h - r, to 1e-11 of its largest value: a power of each lane would cost more than all else of a pair.
    template <class V> KUZURE_INLINE V closeness(V t) const
    {
        using T = number<V>;
        if constexpr (width<V> == 1) return T(power.at(double(t)));
        else {
            alignas(64) T in[width<V>], out[width<V>];
            store(in, t);
#pragma omp simd
            for (int k = 0; k < width<V>; ++k) out[k] = T(power.at(double(in[k])));
            return load<V>(out);
        }
    }

    template <class V> struct Sums {
        Vec3<V> closeness_grad; // sum V_j f grad W
        Vec3<V> art_stress_j;   // sum V_j f tau_j . grad W
    };
    static constexpr double flops = 40;
    /// Pairs of which neither is in tension are passed over; `own`: one of the cluster's particles is. f = (W/W(spacing))^n - less.
    template <class V, class T>
    KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const Tension<T>* tension, bool own, double less) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const Tension<T>& j = tension[batch.neighbour[k]];
            if (!own && j.any == 0) continue;
            const Vec3<V> near_j = (closeness(batch.at[k].t) - V(T(less))) * batch.at[k].grad;
            to.art_stress_j = to.art_stress_j + Sym3<V>{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)} * near_j;
            to.closeness_grad = to.closeness_grad + near_j;
        }
    }
};
/// sum_j V_j f (v_j - v_i) (x) grad W of particles in tension, of the strain stage.
struct StrainOfTension {
    template <class V> struct Sums {
        Mat3<V> near_grad_v;
    };
    template <class V> KUZURE_INLINE void add(Sums<V>& to, const Batch<V>& batch, const ArtificialStress& of) const
    {
        for (int k = 0; k < batch.size; ++k) {
            const Entry<V>& e = batch.at[k];
            const Vec3<V> g = (of.closeness(e.t) - V(number<V>(of.mean))) * e.grad;
            to.near_grad_v = {fma(e.v.x, g, to.near_grad_v.x), fma(e.v.y, g, to.near_grad_v.y), fma(e.v.z, g, to.near_grad_v.z)};
        }
    }
};
struct NoStrainOfTension {
    template <class V> struct Sums {
    };
};
struct NoArtificialStress {
    template <class Kernel> static NoArtificialStress from(const scene::Effects&, const Kernel&, double, int) { return {}; }
    template <class V> struct Sums {
    };
    static constexpr double flops = 0;
    template <class V, class T> KUZURE_INLINE void add(Sums<V>&, const Batch<V>&, const Tension<T>*, bool) const {}
};

/// tau of one particle: zero unless a principal stress is tensile.
Stress tension(const Stress& sigma, double epsilon);
/// N a N, N = sum n_k n_k over the tensile principal stresses of sigma.
Stress tensile_part(const Stress& sigma, const Stress& a);
/// tau as a record.
template <class T> Tension<T> make_tension(const Stress&, double epsilon);

} // namespace kuzure
