#pragma once
// Pair sums of one cluster: a struct a term, of lanes while the loop runs, of doubles, widened, for walls and update.
#include "solver/core/simd.hpp"
#include <cstring>
#include <type_traits>

namespace kuzure {

/// Doubles in memory for W lanes: whole registers of the update, which reads beyond the lanes of a narrow cluster.
template <int W> inline constexpr int wide_length = W == 1 || W > width<Native<double>> ? W : width<Native<double>>;

/// One sum of each of W particles.
template <int W> struct alignas(8 * wide_length<W> < 64 ? 8 * wide_length<W> : 64) WideLanes {
    double at[wide_length<W>];
};

/// The sums of several terms, one member after the other.
template <class V, class... Terms> struct SumsOf : Terms::template Sums<V>... {
};

template <class V> inline constexpr bool single = std::is_same_v<number<V>, float>;

/// W numbers of the store in the type of the pair sums.
template <class V> KUZURE_INLINE V load_narrow(const double* p)
{
    if constexpr (!single<V>) return load<V>(p);
    else if constexpr (width<V> == 1) return float(*p);
    else {
        typename detail::VectorOf<double, width<V>>::type wide;
        std::memcpy(&wide, p, sizeof wide);
        return V(__builtin_convertvector(wide, typename V::Vec));
    }
}
template <class V> KUZURE_INLINE void store_wide(double* p, V a)
{
    if constexpr (!single<V>) store(p, a);
    else if constexpr (width<V> == 1) *p = double(a);
    else {
        const auto wide = __builtin_convertvector(a.v, typename detail::VectorOf<double, width<V>>::type);
        std::memcpy(p, &wide, sizeof wide);
    }
}

/// Sums of lanes as doubles in memory: member by member, whatever the terms.
template <class V, class Lanes, class Wide> KUZURE_INLINE void widen(const Lanes& from, Wide& to)
{
    constexpr int members = sizeof(Lanes) / sizeof(V);
    static_assert(sizeof(Lanes) == members * sizeof(V) && sizeof(Wide) == members * sizeof(WideLanes<width<V>>));
    const V* v = reinterpret_cast<const V*>(&from);
    auto* wide = reinterpret_cast<WideLanes<width<V>>*>(&to);
    for (int k = 0; k < members; ++k) store_wide(wide[k].at, v[k]);
}
/// Lanes `first` and on of any struct of WideLanes, as the same struct of registers.
template <class U, class Struct, class Wide, int W> KUZURE_INLINE Struct lanes_at(const Wide& wide, int first)
{
    constexpr int members = sizeof(Wide) / sizeof(WideLanes<W>);
    static_assert(sizeof(Struct) == members * sizeof(U));
    Struct s;
    const auto* from = reinterpret_cast<const WideLanes<W>*>(&wide);
    U* to = reinterpret_cast<U*>(&s);
    for (int k = 0; k < members; ++k) to[k] = load<U>(from[k].at + first);
    return s;
}

/// One number a lane, or one struct of lanes, from what `of(lane)` gives for each.
template <class U, class Of> KUZURE_INLINE U lane_by_lane(Of of)
{
    double lane[width<U>];
    for (int k = 0; k < width<U>; ++k) lane[k] = of(k);
    return load<U>(lane);
}
template <template <class> class Struct, class U, class Of> KUZURE_INLINE Struct<U> lane_by_lane(Of of)
{
    constexpr int members = sizeof(Struct<double>) / sizeof(double);
    double table[members][width<U>], one[members];
    for (int k = 0; k < width<U>; ++k) {
        const Struct<double> s = of(k);
        std::memcpy(one, &s, sizeof s);
        for (int q = 0; q < members; ++q) table[q][k] = one[q];
    }
    Struct<U> all;
    static_assert(sizeof all == sizeof table);
    std::memcpy(&all, table, sizeof table);
    return all;
}

} // namespace kuzure
