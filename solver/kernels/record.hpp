#pragma once
// What the pair loop reads of a neighbour j: one packed record of one or two cache lines, made from the store's columns
// by the update. The same bytes travel to other ranks as ghosts.
#include "solver/core/tensor.hpp"
#include <type_traits>

namespace kuzure {

/// Positions as the pair loop subtracts them: metres in double; in mixed precision whole numbers of h/2^20, so that a
/// difference is exact in float wherever the particle is.
template <class T> using Place = std::conditional_t<std::is_same_v<T, double>, double, std::int32_t>;

/// State of one particle at time t: x [m or units of h/2^20], v [m/s], volume [m^3], rho [kg/m^3], sigma [Pa], c_p [m/s].
template <class T> struct alignas(16 * sizeof(T)) Record {
    Place<T> x, y, z;
    T vx, vy, vz;
    T volume, density;
    T xx, yy, zz, xy, yz, xz;
    T sound_speed;
    T restless; // 1 where soil that may sleep was not calm at the last look, else 0
};
static_assert(sizeof(Record<double>) == 128 && sizeof(Record<float>) == 64);

/// Turns metres into Place<T> and back; the same arithmetic wherever a record is made.
template <class T> struct Places {
    double unit; // m
    double per_unit;
    explicit Places(double h) : unit(std::is_same_v<T, double> ? 1.0 : h / 1048576), per_unit(1 / unit) {}
    Place<T> operator()(double x) const
    {
        if constexpr (std::is_same_v<T, double>) return x;
        else return Place<T>(std::uint32_t(std::int64_t(std::llrint(x * per_unit)))); // wraps: only differences count
    }
};

} // namespace kuzure
