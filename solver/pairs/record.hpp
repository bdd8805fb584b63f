#pragma once
// What the pair loop reads of a neighbour j: one packed record of one or two cache lines, made from the store's columns.
// The same bytes travel to other ranks as ghosts.
#include "solver/core/tensor.hpp"
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace kuzure {

/// Coordinates as the pair loop subtracts them: metres in double; in mixed precision whole numbers of h/2^20, so that a
/// difference is exact in float wherever the particle is.
template <class T> using Coordinate = std::conditional_t<std::is_same_v<T, double>, double, std::int32_t>;

/// State of one particle at time t: x [m or units of h/2^20], v [m/s], volume [m^3], rho [kg/m^3], sigma [Pa], c_p [m/s].
template <class T> struct alignas(16 * sizeof(T)) Record {
    Coordinate<T> x, y, z;
    T vx, vy, vz;
    T volume, density;
    T xx, yy, zz, xy, yz, xz;
    T c_p;
    T awake; // 1 where soil that may sleep was not calm when last detected, else 0
};
static_assert(sizeof(Record<double>) == 128 && sizeof(Record<float>) == 64);

/// Tension tensors tau of one particle beside its record; only models with artificial stress read and write them.
template <class T> struct alignas(8 * sizeof(T)) Tension {
    T xx, yy, zz, xy, yz, xz, any, spare; // Pa; any != 0 where tau is not zero
};

/// Turns metres into Coordinate<T>; the same arithmetic wherever a record is made.
template <class T> struct FixedPoint {
    double unit; // m
    double per_unit;
    explicit FixedPoint(double h) : unit(std::is_same_v<T, double> ? 1.0 : h / 1048576), per_unit(1 / unit) {}
    Coordinate<T> operator()(double x) const
    {
        if constexpr (std::is_same_v<T, double>) return x;
        else return Coordinate<T>(std::uint32_t(std::int64_t(std::llrint(x * per_unit)))); // wraps: only differences count
    }
    /// a + b as they are subtracted: wraps in fixed point.
    static Coordinate<T> sum(Coordinate<T> a, Coordinate<T> b)
    {
        if constexpr (std::is_same_v<T, double>) return a + b;
        else return Coordinate<T>(std::uint32_t(a) + std::uint32_t(b));
    }
};

/// A record so far from all soil that it adds exact zeros.
template <class T, template <class> class Kind> Kind<T> far_away()
{
    Kind<T> r{};
    if constexpr (std::is_same_v<T, double>) r.x = r.y = r.z = 1e12;
    else r.x = r.y = r.z = 1 << 30;
    r.density = T(1000);
    return r;
}

/// One record of a particle at its present state.
template <class T> Record<T> make_record(const FixedPoint<T>&, Vector x, Vector v, double volume, double density, const Stress&, double c);
} // namespace kuzure
