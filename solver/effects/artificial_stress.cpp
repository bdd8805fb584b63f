#include "solver/effects/artificial_stress.hpp"
#include <algorithm>

namespace kuzure {

Stress tension(const Stress& s, double epsilon)
{
    // No principal stress is tensile exactly when -sigma is positive semi-definite: all principal minors are.
    const double m1 = s.xx * s.yy - s.xy * s.xy, m2 = s.yy * s.zz - s.yz * s.yz, m3 = s.xx * s.zz - s.xz * s.xz;
    const double det = s.xx * m2 - s.xy * (s.xy * s.zz - s.yz * s.xz) + s.xz * (s.xy * s.yz - s.yy * s.xz);
    if (s.xx <= 0 && s.yy <= 0 && s.zz <= 0 && m1 >= 0 && m2 >= 0 && m3 >= 0 && det <= 0) return {};

    // Jacobi rotations: a fixed number of rounds, so that the bits depend on nothing but sigma.
    double a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    double n[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int round = 0; round < 8; ++round)
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
    Stress tau{};
    for (int k = 0; k < 3; ++k) {
        const double t = -epsilon * std::max(a[k][k], 0.0);
        tau.xx += t * n[0][k] * n[0][k], tau.yy += t * n[1][k] * n[1][k], tau.zz += t * n[2][k] * n[2][k];
        tau.xy += t * n[0][k] * n[1][k], tau.yz += t * n[1][k] * n[2][k], tau.xz += t * n[0][k] * n[2][k];
    }
    return tau;
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
