#pragma once
// A cluster as the pair loop holds it: W particles of a column, one a lane.
#include "solver/core/particles.hpp"
#include "solver/pairs/record.hpp"
#include "solver/pairs/sums.hpp"

namespace kuzure {

/// Positions of the particles of a cluster, and their difference to one neighbour.
template <class V, bool Fixed = single<V>> struct Positions {
    Vec3<V> x;
    template <class R> KUZURE_INLINE Vec3<V> minus(const R& j) const { return {x.x - j.x, x.y - j.y, x.z - j.z}; }
    KUZURE_INLINE Vec3<V> minus(double jx, double jy, double jz) const { return {x.x - jx, x.y - jy, x.z - jz}; }
};
template <class V> struct Positions<V, true> {
    static constexpr int W = width<V>;
    using Int = typename detail::VectorOf<std::uint32_t, (W < 2 ? 2 : W)>::type;
    using Signed = typename detail::VectorOf<std::int32_t, (W < 2 ? 2 : W)>::type;
    Int x, y, z;
    template <class R> KUZURE_INLINE Vec3<V> minus(const R& j) const { return minus(j.x, j.y, j.z); }
    KUZURE_INLINE Vec3<V> minus(std::int32_t jx, std::int32_t jy, std::int32_t jz) const
    {
        return {to_h(x - std::uint32_t(jx)), to_h(y - std::uint32_t(jy)), to_h(z - std::uint32_t(jz))};
    }

private:
    /// Fixed-point difference to units of h; exact below 16 h.
    static KUZURE_INLINE V to_h(Int d)
    {
        constexpr float unit = 1.0f / 1048576;
        if constexpr (W == 1) return float(std::int32_t(d[0])) * unit;
        else return V(__builtin_convertvector((Signed)d, typename V::Vec)) * unit;
    }
};

/// What the lanes of a cluster hold of their own particles.
template <class V> struct Cluster {
    Positions<V> position;
    Vec3<V> v;
    V rho, c;
    Index first;
    int count;
    unsigned owned, moving; // a bit for each lane that holds a particle of this cluster, and one that is not asleep
};

template <class V, class R> Positions<V> positions_of(const R* records, Index first)
{
    Positions<V> p;
    if constexpr (single<V>) {
        for (int k = 0; k < width<V>; ++k) {
            p.x[k] = std::uint32_t(records[first + k].x);
            p.y[k] = std::uint32_t(records[first + k].y);
            p.z[k] = std::uint32_t(records[first + k].z);
        }
    } else if constexpr (width<V> == 1) {
        p.x = {records[first].x, records[first].y, records[first].z};
    } else {
        for (int k = 0; k < width<V>; ++k) {
            p.x.x.v[k] = records[first + k].x;
            p.x.y.v[k] = records[first + k].y;
            p.x.z.v[k] = records[first + k].z;
        }
    }
    return p;
}

/// Keeps of a list, in its order, what is nearer than `reach` to any particle of the cluster; returns how many.
template <class V, class List, class R>
KUZURE_INLINE Index prune(const Cluster<V>& i, const List& list, const R* records, double reach, Index* kept)
{
    const V reach2(number<V>(reach * reach));
    std::size_t n = 0;
    list.for_each([&](std::size_t k) __attribute__((always_inline)) {
        const Vec3<V> r = i.position.minus(records[k]);
        kept[n] = Index(k);
        n += (bits(less(dot(r, r), reach2)) & i.owned) != 0;
    });
    return Index(n);
}

/// Lanes that have an awake particle within the support (in the records' unit); `awake[k].awake` tells of record k.
template <class V, class R, class A>
unsigned awake_near(const Cluster<V>& i, std::span<const Index> near, const R* records, const A* awake, double support)
{
    const V support2(number<V>(support * support));
    unsigned lanes = 0;
    for (const Index k : near) {
        if (awake[k].awake == number<V>(0)) continue;
        const Vec3<V> r = i.position.minus(records[k]);
        lanes |= bits(less(dot(r, r), support2));
    }
    return lanes;
}

} // namespace kuzure
