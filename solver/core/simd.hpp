#pragma once
// The only file that knows a SIMD type or an intrinsic. Everything else is written once for a number type V that is
// `double` (or `float`): one particle, the plain reference; or `Simd<T, W>`: W particles in one register. A width that
// the machine has no register for still works (the compiler splits it), so eight lanes can be tested on AVX2.
#include "solver/core/scalar.hpp"
#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#if defined(__ARM_FEATURE_SVE_BITS) && __ARM_FEATURE_SVE_BITS > 128
#define KUZURE_SVE 1 // of a length that is fixed as this is compiled (-msve-vector-bits): its registers are vectors like any other
#include <arm_sve.h>
#endif
#endif

namespace kuzure {

namespace detail {
template <class T, int W> struct VectorOf {
    typedef T type __attribute__((vector_size(W * sizeof(T))));
};
} // namespace detail

/// W numbers of type T in one register (or several, where the machine's are shorter).
template <class T, int W> struct Simd {
    using Vec = typename detail::VectorOf<T, W>::type;
    using Number = T;
    static constexpr int lanes = W;
    Vec v;
    KUZURE_INLINE Simd() = default;
    KUZURE_INLINE Simd(Vec a) : v(a) {}
    KUZURE_INLINE Simd(T a) : v(a - Vec{}) {}
    KUZURE_INLINE T operator[](int lane) const { return v[lane]; }
};

#if defined(__AVX512F__)
inline constexpr int register_bytes = 64;
#elif defined(__AVX2__)
inline constexpr int register_bytes = 32;
#elif defined(KUZURE_SVE)
inline constexpr int register_bytes = __ARM_FEATURE_SVE_BITS / 8;
#else
inline constexpr int register_bytes = 16;
#endif
/// The register of this instruction set.
template <class T> using Native = Simd<T, register_bytes / int(sizeof(T))>;

/// Name of the instruction set the lanes were compiled for.
inline const char* instruction_set()
{
#if defined(__AVX512ER__) || (defined(__AVX512F__) && !defined(__AVX512VL__))
    return "avx512-knl";
#elif defined(__AVX512F__)
    return "avx512";
#elif defined(__AVX2__)
    return "avx2";
#elif defined(__x86_64__)
    return "x86-64";
#elif defined(KUZURE_SVE)
    return register_bytes == 64 ? "sve-512" : register_bytes == 32 ? "sve-256" : "sve";
#elif defined(__aarch64__)
    return "neon";
#else
    return "unknown";
#endif
}

namespace detail {
/// The lanes of a register one by one. Through memory for Knights Landing: GCC 12 takes a lane of a 512-bit register by
/// vextractf64x2, which that machine does not have.
template <class T, int W> struct Lanes {
#if defined(__AVX512F__) && !defined(__AVX512DQ__)
    T at[W];
    KUZURE_INLINE explicit Lanes(Simd<T, W> a)
    {
        std::memcpy(at, &a.v, sizeof at);
        asm("" : "+m"(at));
    }
    KUZURE_INLINE T operator[](int k) const { return at[k]; }
#else
    typename Simd<T, W>::Vec v;
    KUZURE_INLINE explicit Lanes(Simd<T, W> a) : v(a.v) {}
    KUZURE_INLINE T operator[](int k) const { return v[k]; }
#endif
};

#if defined(KUZURE_SVE)
typedef svfloat64_t Sve64 __attribute__((arm_sve_vector_bits(__ARM_FEATURE_SVE_BITS)));
typedef svfloat32_t Sve32 __attribute__((arm_sve_vector_bits(__ARM_FEATURE_SVE_BITS)));
template <class T, int W> inline constexpr bool is_sve = W * sizeof(T) == register_bytes;
#endif
} // namespace detail

// ---- arithmetic --------------------------------------------------------------------------------------------------
#define KUZURE_T template <class T, int W> KUZURE_INLINE
KUZURE_T Simd<T, W> operator+(Simd<T, W> a, Simd<T, W> b) { return a.v + b.v; }
KUZURE_T Simd<T, W> operator-(Simd<T, W> a, Simd<T, W> b) { return a.v - b.v; }
KUZURE_T Simd<T, W> operator*(Simd<T, W> a, Simd<T, W> b) { return a.v * b.v; }
KUZURE_T Simd<T, W> operator/(Simd<T, W> a, Simd<T, W> b) { return a.v / b.v; }
KUZURE_T Simd<T, W> operator-(Simd<T, W> a) { return -a.v; }
KUZURE_T Simd<T, W> operator+(Simd<T, W> a, T b) { return a + Simd<T, W>(b); }
KUZURE_T Simd<T, W> operator+(T a, Simd<T, W> b) { return Simd<T, W>(a) + b; }
KUZURE_T Simd<T, W> operator-(Simd<T, W> a, T b) { return a - Simd<T, W>(b); }
KUZURE_T Simd<T, W> operator-(T a, Simd<T, W> b) { return Simd<T, W>(a) - b; }
KUZURE_T Simd<T, W> operator*(Simd<T, W> a, T b) { return a * Simd<T, W>(b); }
KUZURE_T Simd<T, W> operator*(T a, Simd<T, W> b) { return Simd<T, W>(a) * b; }
KUZURE_T Simd<T, W> operator/(Simd<T, W> a, T b) { return a / Simd<T, W>(b); }
KUZURE_T Simd<T, W> operator/(T a, Simd<T, W> b) { return Simd<T, W>(a) / b; }
KUZURE_T Simd<T, W>& operator+=(Simd<T, W>& a, Simd<T, W> b) { return a = a + b; }
KUZURE_T Simd<T, W>& operator-=(Simd<T, W>& a, Simd<T, W> b) { return a = a - b; }
KUZURE_T Simd<T, W>& operator*=(Simd<T, W>& a, Simd<T, W> b) { return a = a * b; }

KUZURE_T Simd<T, W> fma(Simd<T, W> a, Simd<T, W> b, Simd<T, W> c)
{
#if defined(__AVX512F__)
    if constexpr (sizeof(T) == 8 && W == 8) return {_mm512_fmadd_pd(a.v, b.v, c.v)};
    if constexpr (sizeof(T) == 4 && W == 16) return {_mm512_fmadd_ps(a.v, b.v, c.v)};
#endif
#if defined(__FMA__)
    if constexpr (sizeof(T) == 8 && W == 4) return {_mm256_fmadd_pd(a.v, b.v, c.v)};
    if constexpr (sizeof(T) == 4 && W == 8) return {_mm256_fmadd_ps(a.v, b.v, c.v)};
#endif
#if defined(KUZURE_SVE)
    if constexpr (sizeof(T) == 8 && detail::is_sve<T, W>)
        return {detail::Sve64(svmad_x(svptrue_b64(), detail::Sve64(a.v), detail::Sve64(b.v), detail::Sve64(c.v)))};
    if constexpr (sizeof(T) == 4 && detail::is_sve<T, W>)
        return {detail::Sve32(svmad_x(svptrue_b32(), detail::Sve32(a.v), detail::Sve32(b.v), detail::Sve32(c.v)))};
#endif
#if defined(__aarch64__)
    if constexpr (sizeof(T) == 8 && W == 2) return {vfmaq_f64(c.v, a.v, b.v)};
    if constexpr (sizeof(T) == 4 && W == 4) return {vfmaq_f32(c.v, a.v, b.v)};
#endif
    Simd<T, W> r;
    for (int k = 0; k < W; ++k) r.v[k] = fma(T(a.v[k]), T(b.v[k]), T(c.v[k]));
    return r;
}
/// The smaller of two; the second where either is not a number, as the machine instruction does.
KUZURE_T Simd<T, W> min(Simd<T, W> a, Simd<T, W> b)
{
#if defined(__AVX512F__)
    if constexpr (sizeof(T) == 8 && W == 8) return {_mm512_min_pd(a.v, b.v)};
    if constexpr (sizeof(T) == 4 && W == 16) return {_mm512_min_ps(a.v, b.v)};
#endif
#if defined(__AVX2__)
    if constexpr (sizeof(T) == 8 && W == 4) return {_mm256_min_pd(a.v, b.v)};
    if constexpr (sizeof(T) == 4 && W == 8) return {_mm256_min_ps(a.v, b.v)};
#endif
    return {a.v < b.v ? a.v : b.v};
}
/// The larger of two; the second where either is not a number.
KUZURE_T Simd<T, W> max(Simd<T, W> a, Simd<T, W> b)
{
#if defined(__AVX512F__)
    if constexpr (sizeof(T) == 8 && W == 8) return {_mm512_max_pd(a.v, b.v)};
    if constexpr (sizeof(T) == 4 && W == 16) return {_mm512_max_ps(a.v, b.v)};
#endif
#if defined(__AVX2__)
    if constexpr (sizeof(T) == 8 && W == 4) return {_mm256_max_pd(a.v, b.v)};
    if constexpr (sizeof(T) == 4 && W == 8) return {_mm256_max_ps(a.v, b.v)};
#endif
    return {a.v > b.v ? a.v : b.v};
}
KUZURE_T Simd<T, W> sqrt(Simd<T, W> a)
{
#if defined(__AVX512F__)
    if constexpr (sizeof(T) == 8 && W == 8) return {_mm512_sqrt_pd(a.v)};
    if constexpr (sizeof(T) == 4 && W == 16) return {_mm512_sqrt_ps(a.v)};
#endif
#if defined(__AVX2__)
    if constexpr (sizeof(T) == 8 && W == 4) return {_mm256_sqrt_pd(a.v)};
    if constexpr (sizeof(T) == 4 && W == 8) return {_mm256_sqrt_ps(a.v)};
#endif
#if defined(KUZURE_SVE)
    if constexpr (sizeof(T) == 8 && detail::is_sve<T, W>) return {detail::Sve64(svsqrt_x(svptrue_b64(), detail::Sve64(a.v)))};
    if constexpr (sizeof(T) == 4 && detail::is_sve<T, W>) return {detail::Sve32(svsqrt_x(svptrue_b32(), detail::Sve32(a.v)))};
#endif
#if defined(__aarch64__)
    if constexpr (sizeof(T) == 8 && W == 2) return {vsqrtq_f64(a.v)};
    if constexpr (sizeof(T) == 4 && W == 4) return {vsqrtq_f32(a.v)};
#endif
    Simd<T, W> r;
    for (int k = 0; k < W; ++k) r.v[k] = sqrt(T(a.v[k]));
    return r;
}
KUZURE_T Simd<T, W> abs(Simd<T, W> a) { return max(a, -a); }

// ---- comparison: a Mask has one bit of truth a lane ---------------------------------------------------------------
template <class T, int W> struct Mask {
#if defined(__AVX512F__)
    static constexpr bool in_mask_register = W * sizeof(T) == 64;
#else
    static constexpr bool in_mask_register = false;
#endif
    using Int = std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>;
    using Vec = typename detail::VectorOf<Int, W>::type;
    std::conditional_t<in_mask_register, std::uint32_t, Vec> m;
};

/// True in the lanes where a < b.
KUZURE_T Mask<T, W> less(Simd<T, W> a, Simd<T, W> b)
{
#if defined(__AVX512F__)
    if constexpr (sizeof(T) == 8 && W == 8) return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_LT_OQ)};
    else if constexpr (sizeof(T) == 4 && W == 16) return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
    else
#endif
        return {a.v < b.v};
}
/// One bit a lane, lane 0 lowest.
KUZURE_T unsigned bits(Mask<T, W> m)
{
    if constexpr (Mask<T, W>::in_mask_register) return m.m;
    else {
#if defined(__AVX2__)
        if constexpr (sizeof(T) == 8 && W == 4) return unsigned(_mm256_movemask_pd((__m256d)m.m));
        if constexpr (sizeof(T) == 4 && W == 8) return unsigned(_mm256_movemask_ps((__m256)m.m));
#endif
        unsigned r = 0;
        for (int k = 0; k < W; ++k) r |= unsigned(m.m[k] != 0) << k;
        return r;
    }
}
/// yes where the mask is set, no elsewhere.
KUZURE_T Simd<T, W> select(Mask<T, W> m, Simd<T, W> yes, Simd<T, W> no)
{
#if defined(__AVX512F__)
    if constexpr (sizeof(T) == 8 && W == 8) return {_mm512_mask_blend_pd(__mmask8(m.m), no.v, yes.v)};
    else if constexpr (sizeof(T) == 4 && W == 16) return {_mm512_mask_blend_ps(__mmask16(m.m), no.v, yes.v)};
    else
#endif
        return {m.m ? yes.v : no.v};
}

// ---- single lanes ------------------------------------------------------------------------------------------------
KUZURE_T T lane(Simd<T, W> a, int k) { return detail::Lanes<T, W>(a)[k]; }

/// Sum over the lanes, lane 0 first. Only for sums that are exact in any order, or for tests.
KUZURE_T T sum(Simd<T, W> a)
{
    const detail::Lanes lanes(a);
    T s = lanes[0];
    for (int k = 1; k < W; ++k) s += lanes[k];
    return s;
}
KUZURE_T T largest(Simd<T, W> a)
{
    const detail::Lanes lanes(a);
    T s = lanes[0];
    for (int k = 1; k < W; ++k) s = s > lanes[k] ? s : lanes[k];
    return s;
}

// ---- roots and reciprocals -----------------------------------------------------------------------------------------
/// {sqrt(a), 1/sqrt(a), 1/b}: an IEEE square root and one division, which serves both reciprocals where both are wanted, so that
/// every instruction set gives the same bits.
template <class V> struct Roots {
    V root, inverse_root, inverse;
};
/// Without InverseRoot the second is left undefined.
template <bool InverseRoot, class V> KUZURE_INLINE Roots<V> roots(V a, V b)
{
    using T = number<V>;
    const V s = sqrt(a);
    if constexpr (!InverseRoot) return {s, s, V(T(1)) / b};
    const V r = V(T(1)) / (s * b);
    return {s, r * b, r * s};
}
/// The same without the last.
template <bool InverseRoot, class V> KUZURE_INLINE Roots<V> root(V a)
{
    const V s = sqrt(a);
    if constexpr (!InverseRoot) return {s, s, s};
    return {s, V(number<V>(1)) / s, s};
}

/// Tell the processor of this thread to take denormal numbers as zero: they cost 60 to 70 times a normal operation.
inline void flush_denormals()
{
#if defined(__x86_64__)
    _mm_setcsr(_mm_getcsr() | 0x8040);
#elif defined(__aarch64__)
    std::uint64_t control;
    asm volatile("mrs %0, fpcr" : "=r"(control));
    asm volatile("msr fpcr, %0" : : "r"(control | std::uint64_t(1) << 24));
#endif
}
inline void prefetch(const void* p) { __builtin_prefetch(p); }

#undef KUZURE_T
} // namespace kuzure
