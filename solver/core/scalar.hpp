#pragma once
// Number types: `double` (or `float`), one particle, the plain reference; or lanes of a register, `Simd<T, W>` of simd.hpp. Here is what
// code of one number needs, without the compiler's intrinsics, which cost every file that includes them half a second of its time.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace kuzure {

using Index = std::int32_t;

#define KUZURE_INLINE inline __attribute__((always_inline))

namespace detail {
template <class T, int W> struct Lanes; // the lanes of a register one by one: simd.hpp
template <class V> struct NumberOf {
    using type = typename V::Number;
    static constexpr int lanes = V::lanes;
};
template <> struct NumberOf<double> {
    using type = double;
    static constexpr int lanes = 1;
};
template <> struct NumberOf<float> {
    using type = float;
    static constexpr int lanes = 1;
};
} // namespace detail

template <class V> using number = typename detail::NumberOf<V>::type;
template <class V> inline constexpr int width = detail::NumberOf<V>::lanes;

// ---- arithmetic --------------------------------------------------------------------------------------------------
/// a * b + c with one rounding, on every instruction set: the bits do not depend on what the compiler would contract.
KUZURE_INLINE double fma(double a, double b, double c) { return __builtin_fma(a, b, c); }
KUZURE_INLINE float fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
/// c - a * b with one rounding.
template <class V> KUZURE_INLINE V fnma(V a, V b, V c) { return fma(-a, b, c); }

KUZURE_INLINE double min(double a, double b) { return a < b ? a : b; }
KUZURE_INLINE double max(double a, double b) { return a > b ? a : b; }
KUZURE_INLINE float min(float a, float b) { return a < b ? a : b; }
KUZURE_INLINE float max(float a, float b) { return a > b ? a : b; }
KUZURE_INLINE double sqrt(double a) { return __builtin_sqrt(a); }
KUZURE_INLINE float sqrt(float a) { return __builtin_sqrtf(a); }
KUZURE_INLINE double abs(double a) { return __builtin_fabs(a); }

// ---- comparison --------------------------------------------------------------------------------------------------
/// True where a < b.
KUZURE_INLINE bool less(double a, double b) { return a < b; }
KUZURE_INLINE bool less(float a, float b) { return a < b; }
/// One bit a lane, lane 0 lowest.
KUZURE_INLINE unsigned bits(bool m) { return m; }
/// yes where the mask is set, no elsewhere.
KUZURE_INLINE double select(bool m, double yes, double no) { return m ? yes : no; }
KUZURE_INLINE float select(bool m, float yes, float no) { return m ? yes : no; }

// ---- memory ------------------------------------------------------------------------------------------------------
/// W consecutive numbers, at any address.
template <class V> KUZURE_INLINE V load(const number<V>* p)
{
    if constexpr (width<V> == 1) return *p;
    else {
        V r;
        std::memcpy(&r.v, p, sizeof r.v);
        return r;
    }
}
template <class V> KUZURE_INLINE void store(number<V>* p, V a)
{
    if constexpr (width<V> == 1) *p = a;
    else std::memcpy(p, &a.v, sizeof a.v);
}
/// The first n lanes only; nothing beyond is touched.
template <class V> KUZURE_INLINE void store_first(number<V>* p, V a, int n)
{
    if (n >= width<V>) return store(p, a);
    if constexpr (width < V >> 1) {
        const detail::Lanes lanes(a);
        for (int k = 0; k < n; ++k) p[k] = lanes[k];
    }
}
/// table[index[lane]] in each lane.
template <class V> KUZURE_INLINE V gather(const number<V>* table, const std::int32_t* index)
{
    if constexpr (width<V> == 1) return table[*index];
    else {
        V r;
        for (int k = 0; k < width<V>; ++k) r.v[k] = table[index[k]];
        return r;
    }
}
KUZURE_INLINE double lane(double a, int) { return a; }
KUZURE_INLINE float lane(float a, int) { return a; }

KUZURE_INLINE double sum(double a) { return a; }
KUZURE_INLINE double largest(double a) { return a; }

} // namespace kuzure
