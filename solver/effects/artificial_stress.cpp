#include "solver/effects/artificial_stress.hpp"
#include <algorithm>

namespace kuzure {

namespace {

/// Principal stresses and, as columns, their directions.
struct Principal {
    double value[3], direction[3][3];
};
/// No principal stress is tensile exactly when -sigma is positive semi-definite: all principal minors are.
bool all_compressive(const Stress& s)
{
    const double m1 = s.xx * s.yy - s.xy * s.xy, m2 = s.yy * s.zz - s.yz * s.yz, m3 = s.xx * s.zz - s.xz * s.xz;
    const double det = s.xx * m2 - s.xy * (s.xy * s.zz - s.yz * s.xz) + s.xz * (s.xy * s.yz - s.yy * s.xz);
    return s.xx <= 0 && s.yy <= 0 && s.zz <= 0 && m1 >= 0 && m2 >= 0 && m3 >= 0 && det <= 0;
}
/// Jacobi rotations, until what is off the diagonal is rounding: the bits depend on nothing but sigma.
Principal principal(const Stress& s)
{
    double a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    Principal of{{}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    auto& n = of.direction;
    const double rounding = 1e-17 * (std::fabs(s.xx) + std::fabs(s.yy) + std::fabs(s.zz));
    for (int round = 0; round < 8; ++round) {
        if (std::fabs(a[0][1]) + std::fabs(a[0][2]) + std::fabs(a[1][2]) <= rounding) break;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                // Above 1e154 the angle is none, and the square of its cotangent no number.
                const double apart = a[q][q] - a[p][p];
                if (a[p][q] == 0 || std::fabs(apart) > 1.3e154 * (2 * std::fabs(a[p][q]))) continue;
                const double theta = apart / (2 * a[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), sn = t * c;
                for (int k = 0; k < 3; ++k) {
                    const double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - sn * kq, a[k][q] = sn * kp + c * kq;
                }
                for (int k = 0; k < 3; ++k) {
                    const double pk = a[p][k], qk = a[q][k];
                    a[p][k] = c * pk - sn * qk, a[q][k] = sn * pk + c * qk;
                }
                for (int k = 0; k < 3; ++k) {
                    const double kp = n[k][p], kq = n[k][q];
                    n[k][p] = c * kp - sn * kq, n[k][q] = sn * kp + c * kq;
                }
            }
    }
    for (int k = 0; k < 3; ++k) of.value[k] = a[k][k];
    return of;
}
/// sum_k t_k n_k n_k.
Stress composed(const Principal& of, const double (&t)[3])
{
    const auto& n = of.direction;
    Stress s{};
    for (int k = 0; k < 3; ++k) {
        s.xx += t[k] * n[0][k] * n[0][k], s.yy += t[k] * n[1][k] * n[1][k], s.zz += t[k] * n[2][k] * n[2][k];
        s.xy += t[k] * n[0][k] * n[1][k], s.yz += t[k] * n[1][k] * n[2][k], s.xz += t[k] * n[0][k] * n[2][k];
    }
    return s;
}

} // namespace

Stress tension(const Stress& s, double epsilon)
{
    if (all_compressive(s)) return {};
    const Principal of = principal(s);
    double t[3];
    for (int k = 0; k < 3; ++k) t[k] = -epsilon * std::max(of.value[k], 0.0);
    return composed(of, t);
}

Stress tensile_part(const Stress& sigma, const Stress& a)
{
    if (all_compressive(sigma)) return {};
    const Principal of = principal(sigma);
    double t[3];
    for (int k = 0; k < 3; ++k) t[k] = of.value[k] > 0;
    const Stress N = composed(of, t);
    const Vector x = N * Vector{a.xx, a.xy, a.xz}, y = N * Vector{a.xy, a.yy, a.yz}, z = N * Vector{a.xz, a.yz, a.zz}; // columns of N a
    // (N a) N, row by row
    const Vector row_x = N * Vector{x.x, y.x, z.x}, row_y = N * Vector{x.y, y.y, z.y}, row_z = N * Vector{x.z, y.z, z.z};
    return {row_x.x, row_y.y, row_z.z, row_x.y, row_y.z, row_x.z};
}

template <class T> Tension<T> make_tension(const Stress& s, double epsilon)
{
    const Stress t = tension(s, epsilon);
    const bool any = t != Stress{};
    return {T(t.xx), T(t.yy), T(t.zz), T(t.xy), T(t.yz), T(t.xz), T(any), T(0)};
}
template Tension<double> make_tension(const Stress&, double);
template Tension<float> make_tension(const Stress&, double);

} // namespace kuzure
