#pragma once
// Small vectors and tensors over a number type V (double or lanes). Plain structs; sums are written with fma, left to
// right, so that the bits are the same for every V.
#include "solver/core/scalar.hpp"

namespace kuzure {

template <class V> struct Vec3 {
    V x{}, y{}, z{};
    bool operator==(const Vec3&) const = default;
};
/// Symmetric tensor in VTK's order xx yy zz xy yz xz.
template <class V> struct Sym3 {
    V xx{}, yy{}, zz{}, xy{}, yz{}, xz{};
    bool operator==(const Sym3&) const = default;
};
/// Rows x, y, z: for a velocity gradient L, row i holds dv_i/dx, dv_i/dy, dv_i/dz.
template <class V> struct Mat3 {
    Vec3<V> x{}, y{}, z{};
    bool operator==(const Mat3&) const = default;
};
using Vector = Vec3<double>;
using Stress = Sym3<double>;

template <class V> KUZURE_INLINE Vec3<V> operator+(Vec3<V> a, Vec3<V> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class V> KUZURE_INLINE Vec3<V> operator-(Vec3<V> a, Vec3<V> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class V> KUZURE_INLINE Vec3<V> operator*(V s, Vec3<V> a) { return {s * a.x, s * a.y, s * a.z}; }
template <class V> KUZURE_INLINE V dot(Vec3<V> a, Vec3<V> b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }
/// a + s b
template <class V> KUZURE_INLINE Vec3<V> fma(V s, Vec3<V> b, Vec3<V> a) { return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)}; }
template <class V> KUZURE_INLINE Vec3<V> cross(Vec3<V> a, Vec3<V> b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vector a) { return sqrt(dot(a, a)); }

template <class V> KUZURE_INLINE Sym3<V> operator+(Sym3<V> a, Sym3<V> b)
{
    return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.yz + b.yz, a.xz + b.xz};
}
template <class V> KUZURE_INLINE Sym3<V> operator-(Sym3<V> a, Sym3<V> b)
{
    return {a.xx - b.xx, a.yy - b.yy, a.zz - b.zz, a.xy - b.xy, a.yz - b.yz, a.xz - b.xz};
}
template <class V> KUZURE_INLINE Sym3<V> operator*(V s, Sym3<V> a) { return {s * a.xx, s * a.yy, s * a.zz, s * a.xy, s * a.yz, s * a.xz}; }
/// a + s b
template <class V> KUZURE_INLINE Sym3<V> fma(V s, Sym3<V> b, Sym3<V> a)
{
    return {fma(s, b.xx, a.xx), fma(s, b.yy, a.yy), fma(s, b.zz, a.zz), fma(s, b.xy, a.xy), fma(s, b.yz, a.yz), fma(s, b.xz, a.xz)};
}
template <class V> KUZURE_INLINE Vec3<V> operator*(Sym3<V> a, Vec3<V> b)
{
    return {fma(a.xz, b.z, fma(a.xy, b.y, a.xx * b.x)), fma(a.yz, b.z, fma(a.yy, b.y, a.xy * b.x)),
            fma(a.zz, b.z, fma(a.yz, b.y, a.xz * b.x))};
}
template <class V> KUZURE_INLINE V trace(Sym3<V> a) { return a.xx + a.yy + a.zz; }
/// a + p 1
template <class V> KUZURE_INLINE Sym3<V> plus_isotropic(Sym3<V> a, V p) { return {a.xx + p, a.yy + p, a.zz + p, a.xy, a.yz, a.xz}; }
/// s = a - tr(a)/3 1, in two and three dimensions alike.
template <class V> KUZURE_INLINE Sym3<V> deviator(Sym3<V> a) { return plus_isotropic(a, trace(a) * V(number<V>(-1.0 / 3))); }
/// a : b
template <class V> KUZURE_INLINE V contract(Sym3<V> a, Sym3<V> b)
{
    const V off = fma(a.xz, b.xz, fma(a.yz, b.yz, a.xy * b.xy));
    return fma(a.zz, b.zz, fma(a.yy, b.yy, fma(a.xx, b.xx, off + off)));
}
/// J2 = s : s / 2 of a deviator s.
template <class V> KUZURE_INLINE V J2(Sym3<V> s) { return contract(s, s) * V(number<V>(0.5)); }

template <class V> KUZURE_INLINE V trace(const Mat3<V>& a) { return a.x.x + a.y.y + a.z.z; }
/// (a + a^T)/2
template <class V> KUZURE_INLINE Sym3<V> symmetric_part(const Mat3<V>& a)
{
    const V half(number<V>(0.5));
    return {a.x.x, a.y.y, a.z.z, half * (a.x.y + a.y.x), half * (a.y.z + a.z.y), half * (a.x.z + a.z.x)};
}

} // namespace kuzure
