#pragma once
// The pass over pairs, written. Included by variant.cpp only, so that each model is compiled once, in its own object.
//
// V: number type of the pair sums (lanes of float in mixed precision), U: of the update, always double. Cluster by
// cluster: every few steps prune the list to what is in reach soon, geometry of each entry, sums, then constitutive law and
// leap-frog, while the sums are in the first-level cache. Sums are centred on i, which owns a lane; j is broadcast to all lanes and comes
// in the global order. What lies beyond the support adds exact zeros, so the bits do not depend on list or cluster.
#include "solver/kernels/step.hpp"
#include "solver/physics/drucker_prager.hpp"
#include "solver/physics/model.hpp"
#include "solver/scene/shape.hpp"
#include <bit>
#include <omp.h>

namespace kuzure {

namespace pass {

template <class V> inline constexpr bool single = std::is_same_v<number<V>, float>;
template <class V> using Update = std::conditional_t<width<V> == 1, double, Native<double>>;

/// Positions of the particles of a cluster, and their difference to one neighbour.
template <class V, bool Fixed = single<V>> struct Positions {
    Vec3<V> x;
    template <class T> KUZURE_INLINE Vec3<V> minus(const Record<T>& j) const { return {x.x - j.x, x.y - j.y, x.z - j.z}; }
    KUZURE_INLINE Vec3<V> minus(Place<double> jx, Place<double> jy, Place<double> jz) const { return {x.x - jx, x.y - jy, x.z - jz}; }
};
template <class V> struct Positions<V, true> {
    static constexpr int W = width<V>;
    using Int = typename detail::VectorOf<std::uint32_t, (W < 2 ? 2 : W)>::type;
    using Signed = typename detail::VectorOf<std::int32_t, (W < 2 ? 2 : W)>::type;
    Int x, y, z;
    template <class T> KUZURE_INLINE Vec3<V> minus(const Record<T>& j) const { return minus(j.x, j.y, j.z); }
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
template <class V> struct Here {
    Positions<V> position;
    Vec3<V> v;
    V rho, c;
    Index first;
    int count;
    unsigned owned, moving; // a bit for each lane that holds a particle of this cluster, and one that is not asleep
};

/// Keeps of a list, in its order, what is nearer than `reach` to any particle of the cluster; returns how many.
template <class V, class T>
KUZURE_INLINE Index prune(const Here<V>& i, std::span<const Index> list, const Record<T>* records, double reach, Index* kept)
{
    const V reach2(T(reach * reach));
    Index n = 0;
    for (const Index k : list) {
        const Vec3<V> r = i.position.minus(records[k]);
        kept[n] = k;
        n += (bits(less(dot(r, r), reach2)) & i.owned) != 0;
    }
    return n;
}

/// Lanes that have a restless particle within the support; `support` in the records' unit.
template <class V, class T> unsigned restless_near(const Here<V>& i, std::span<const Index> near, const Record<T>* records, double support)
{
    const V support2(T(support * support));
    unsigned lanes = 0;
    for (const Index k : near) {
        if (records[k].restless == T(0)) continue;
        const Vec3<V> r = i.position.minus(records[k]);
        lanes |= bits(less(dot(r, r), support2));
    }
    return lanes;
}

/// Sums of one cluster, in double, ready for the update: rows of W lanes.
template <int W, class Model> struct alignas(64) Sums {
    double grad_v[9][W];                           // sum V_j (v_j - v_i) (x) shape r
    double force[3][W];                            // sum V_j (sigma_j - rho_i rho_j Pi) . shape r
    double grad_one[3][W];                         // sum V_j shape r
    double power[W];                               // sum V_j rho_i rho_j Pi approach shape
    double close[Model::tensile ? 3 : 1][W];       // sum V_j f^n shape r
    double pushed[Model::tensile ? 3 : 1][W];      // sum V_j f^n tau_j . shape r
    double diffusion[Model::diffusive ? 8 : 1][W]; // sum q sigma_j, sum q, sum q g.r;  q = V_j shape r^2/(r^2 + 0.01 h^2)
    double moment[Model::corrected ? 6 : 1][W];    // sum V_j shape r (x) r
    double walled[W];                              // 1 for a particle that feels a wall
};

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

template <class V, class T> Positions<V> positions_of(const Record<T>* records, Index first)
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

/// The pair sums of one cluster with its soil neighbours; returns the pairs inside the support. Entries of the list beyond
/// it add exact zeros.
template <class Model, class V, class T>
KUZURE_INLINE std::int64_t sum_over_soil(const Model& model, const Here<V>& i, std::span<const Index> near, const Record<T>* records,
                                         const Tension<T>* tension, Sums<width<V>, Model>& out)
{
    constexpr int batch = 16;
    const V support(T(2 * model.kernel.h)), support2(T(4 * model.kernel.h * model.kernel.h));
    const V softening(T(0.01 * model.kernel.h * model.kernel.h)), tiny(T(1e-12 * model.kernel.h * model.kernel.h)), zero(T(0)), one(T(1));
    struct Terms {
        Vec3<V> grad, v, r;
        V pressure, close, q, along;
    };
    Terms terms[batch];
    Mat3<V> L{{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}};
    Vec3<V> A{zero, zero, zero}, G = A, F = A, B = A;
    Sym3<V> S{zero, zero, zero, zero, zero, zero}, M = S;
    V power = zero, Q = zero, Qg = zero, inside = zero;
    const int n = int(near.size());
    for (int b = 0; b < n; b += batch) {
        const int m = std::min(batch, n - b);
        // ---- geometry: gradient of W, approach, viscosity
        for (int k = 0; k < m; ++k) {
            const Record<T>& j = records[near[b + k]];
            const Vec3<V> r = i.position.minus(j);
            const Vec3<V> v{j.vx - i.v.x, j.vy - i.v.y, j.vz - i.v.z};
            const V r2 = max(dot(r, r), tiny);
            inside = inside + select(less(r2, support2), one, zero);
            const V rho_sum = i.rho + j.density;
            const auto inv = roots<Model::Kernel::divides>(r2, (r2 + softening) * rho_sum);
            const V t = max(support - inv.root, zero);
            const V w = model.kernel.shape(t, inv.root, inv.inverse_root) * j.volume;
            terms[k].grad = w * r;
            terms[k].v = v;
            if constexpr (Model::viscous) {
                // rho_i rho_j Pi > 0 where the two approach
                const V approach = max(dot(v, r), zero);
                const Pair<V> pair{approach, inv.inverse, rho_sum, i.rho, V(j.density), i.c, V(j.sound_speed)};
                const V pressure = model.viscosity(pair);
                terms[k].pressure = pressure;
                power = fma(pressure * w, approach, power);
            }
            if constexpr (Model::tensile) terms[k].close = model.kernel.value(t);
            if constexpr (Model::diffusive) {
                terms[k].q = w * (r2 * (inv.inverse * rho_sum));
                const Vector g = model.stress_diffusion.gravity;
                terms[k].along = dot(Vec3<V>{V(T(g.x)), V(T(g.y)), V(T(g.z))}, r);
            }
            if constexpr (Model::corrected) terms[k].r = r;
        }
        // ---- grad v = sum_j V_j (v_j - v_i) (x) grad W
        // (unrolled in full, GCC 12 would keep five of the nine sums in memory)
#pragma GCC unroll 1
        for (int k = 0; k < m; ++k) {
            const Vec3<V> g = terms[k].grad, v = terms[k].v;
            L.x = fma(v.x, g, L.x);
            L.y = fma(v.y, g, L.y);
            L.z = fma(v.z, g, L.z);
        }
        // ---- rho_i dv/dt = sum_j V_j [ sigma_i + sigma_j - rho_i rho_j Pi + f^n (tau_i + tau_j) ] . grad W
        for (int k = 0; k < m; ++k) {
            const Record<T>& j = records[near[b + k]];
            const Vec3<V> g = terms[k].grad;
            Sym3<V> s{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)};
            if constexpr (Model::viscous) s = plus_isotropic(s, -terms[k].pressure);
            if constexpr (Model::tensile) {
                const Tension<T>& tj = tension[near[b + k]];
                bool any = tj.any != 0;
                for (int l = 0; l < i.count && !any; ++l) any = tension[i.first + l].any != 0;
                if (any) {
                    const V f = model.artificial_stress.closeness(terms[k].close);
                    const Vec3<V> near_j = f * g;
                    B = B + Sym3<V>{V(tj.xx), V(tj.yy), V(tj.zz), V(tj.xy), V(tj.yz), V(tj.xz)} * near_j;
                    F = F + near_j;
                }
            }
            A = A + s * g;
            G = G + g;
        }
        // ---- stress diffusion: sum_j V_j (sigma_i - sigma_j - static part) x_ij . grad W/(r^2 + 0.01 h^2)
        if constexpr (Model::diffusive)
            for (int k = 0; k < m; ++k) {
                const Record<T>& j = records[near[b + k]];
                const V q = terms[k].q;
                S = fma(q, Sym3<V>{V(j.xx), V(j.yy), V(j.zz), V(j.xy), V(j.yz), V(j.xz)}, S);
                Q = Q + q;
                Qg = fma(q, terms[k].along, Qg);
            }
        // ---- M = sum_j V_j (x_j - x_i) (x) grad W
        if constexpr (Model::corrected)
            for (int k = 0; k < m; ++k) {
                const Vec3<V> g = terms[k].grad, r = terms[k].r;
                M = {fma(g.x, r.x, M.xx), fma(g.y, r.y, M.yy), fma(g.z, r.z, M.zz),
                     fma(g.x, r.y, M.xy), fma(g.y, r.z, M.yz), fma(g.x, r.z, M.xz)};
            }
    }
    std::fill_n(out.walled, width<V>, 0.0);
    const V* rows[] = {&L.x.x, &L.x.y, &L.x.z, &L.y.x, &L.y.y, &L.y.z, &L.z.x, &L.z.y, &L.z.z};
    for (int k = 0; k < 9; ++k) store_wide(out.grad_v[k], *rows[k]);
    store_wide(out.force[0], A.x), store_wide(out.force[1], A.y), store_wide(out.force[2], A.z);
    store_wide(out.grad_one[0], G.x), store_wide(out.grad_one[1], G.y), store_wide(out.grad_one[2], G.z);
    store_wide(out.power, power);
    if constexpr (Model::tensile) {
        store_wide(out.close[0], F.x), store_wide(out.close[1], F.y), store_wide(out.close[2], F.z);
        store_wide(out.pushed[0], B.x), store_wide(out.pushed[1], B.y), store_wide(out.pushed[2], B.z);
    }
    if constexpr (Model::diffusive) {
        const V* sums[] = {&S.xx, &S.yy, &S.zz, &S.xy, &S.yz, &S.xz, &Q, &Qg};
        for (int k = 0; k < 8; ++k) store_wide(out.diffusion[k], *sums[k]);
    }
    if constexpr (Model::corrected) {
        const V* sums[] = {&M.xx, &M.yy, &M.zz, &M.xy, &M.yz, &M.xz};
        for (int k = 0; k < 6; ++k) store_wide(out.moment[k], *sums[k]);
    }
    T in_lane[width<V>];
    store(in_lane, inside);
    std::int64_t pairs = 0;
#pragma GCC unroll 1 // GCC 12 would take lanes out of the register by an instruction that Knights Landing lacks
    for (int k = 0; k < i.count; ++k) pairs += std::int64_t(in_lane[k]) & -std::int64_t(i.moving >> k & 1);
    return pairs;
}

/// How one particle feels one wall: the surface's distance and normal, and what its velocity and stress look like there.
struct WallContact {
    double distance;
    Vector normal, mirrored; // m, 1, m/s: the velocity that the wall mirrors,
    Vector colliding;        // m/s: and its part that viscosity acts on
    Stress stress;           // the stress that both sides of the surface carry
};

inline WallContact wall_contact(const scene::Wall& wall, Vector x, Vector v, const Stress& s, int dimensions)
{
    const auto c = scene::contact(wall.shape, x, dimensions);
    WallContact w{c.distance, c.normal, v, v, s};
    if (wall.surface == scene::Surface::Rough) return w;
    const Vector n = c.normal;
    w.colliding = dot(v, n) * n;
    if (wall.surface == scene::Surface::Coulomb) return w;
    // Free slip: no shear crosses the surface, sigma - (tau (x) n + n (x) tau) with tau = sigma.n - (n.sigma.n) n
    w.mirrored = w.colliding;
    const Vector traction = s * n;
    const Vector tau = traction - dot(n, traction) * n;
    w.stress = s - Stress{2 * tau.x * n.x,           2 * tau.y * n.y,           2 * tau.z * n.z,
                          tau.x * n.y + tau.y * n.x, tau.y * n.z + tau.z * n.y, tau.x * n.z + tau.z * n.x};
    return w;
}

/// Coulomb's law for the force density (N/m^3) a particle gets from a surface: along the surface at most tan(delta) times
/// the force along the normal; a surface that would pull gives none. Where the soil slips, friction opposes the slip v_t;
/// where it sticks, the stress of the no-slip wall holds it. Between the two the soil's impedance rho c_p decides: slip
/// counts as sliding once rho c_p v_t alone would need the whole friction.
struct WallFriction {
    Vector force;
    double drag; // share of the no-slip wall's velocity gradient: slip along a surface is no strain of the soil
    bool pulls;  // then the soil does not feel the surface at all: strain without force would make energy
};
inline WallFriction limit_to_friction(Vector force, Vector normal, double friction_angle, Vector slip, double impedance)
{
    const double pressing = dot(force, normal);
    if (!(pressing > 0)) return {{}, 0, true};
    const double limit = std::tan(friction_angle) * pressing;
    const Vector sticking = force - pressing * normal, opposing = -impedance * slip;
    const double needed = length(opposing), sliding = needed < limit ? needed / limit : 1.0;
    Vector shear = (needed > limit ? limit / needed : 1.0) * opposing + (1 - sliding) * sticking;
    if (const double size = length(shear); size > limit) shear = (limit / size) * shear;
    return {pressing * normal + shear, 1 - sliding, false};
}

/// Adds the walls' share to the sums of a cluster; returns the pairs inside the support and the power that walls take.
/// A wall particle takes the soil particle's density and stress and the mirrored velocity -(d_B/d_A) v (Morris et al.
/// 1997; Bui et al. 2008, eq. 45), the factor 1 + d_B/d_A capped at 1.5.
template <class Model, class V, class T>
[[gnu::noinline]] std::int64_t sum_over_walls(const Model& model, const Here<V>& i, const Pass<T>& pass, std::span<const Index> runs,
                                              double unit, int dimensions, double scale, Sums<width<V>, Model>& out, double* wall_power)
{
    constexpr int W = width<V>;
    const auto& p = *pass.particles;
    const auto x = p[field::position], v = p[field::velocity];
    const auto sigma = p[field::stress];
    const V support(T(2 * model.kernel.h)), support2(T(4 * model.kernel.h * model.kernel.h));
    const V softening(T(0.01 * model.kernel.h * model.kernel.h)), tiny(T(1e-12 * model.kernel.h * model.kernel.h)), zero(T(0));
    std::int64_t pairs = 0;
    while (!runs.empty()) {
        const WallRecords<T>& wall = pass.walls[runs[0]];
        const auto list = runs.subspan(2, runs[1]);
        runs = runs.subspan(2 + runs[1]);
        WallContact contact[W];
        T normal[3][W], colliding[3][W], inverse_distance[W];
        for (int k = 0; k < W; ++k) {
            const Index at = i.first + std::min(k, i.count - 1);
            contact[k] = wall_contact(*wall.wall, x[at], v[at], sigma[at], dimensions);
            const auto& c = contact[k];
            normal[0][k] = T(c.normal.x), normal[1][k] = T(c.normal.y), normal[2][k] = T(c.normal.z);
            colliding[0][k] = T(c.colliding.x), colliding[1][k] = T(c.colliding.y), colliding[2][k] = T(c.colliding.z);
            // at or below the surface the factor is at its cap
            inverse_distance[k] = T(c.distance > 1e-9 * unit ? unit / c.distance : 1e9);
        }
        const Vec3<V> n{load<V>(normal[0]), load<V>(normal[1]), load<V>(normal[2])};
        const Vec3<V> vc{load<V>(colliding[0]), load<V>(colliding[1]), load<V>(colliding[2])};
        const V inverse_d = load<V>(inverse_distance);
        Vec3<V> G{zero, zero, zero}, B = G, P = G;
        for (const Index point : list) {
            const Vec3<V> r = i.position.minus(wall.x[point], wall.y[point], wall.z[point]);
            const V r2_exact = dot(r, r), r2 = max(r2_exact, tiny);
            const unsigned hits = bits(less(r2_exact, support2)) & i.owned;
            if (!hits) continue;
            pairs += std::popcount(hits & i.moving);
            const V rho_sum = i.rho + i.rho;
            const auto inv = roots<Model::Kernel::divides>(r2, (r2 + softening) * rho_sum);
            const V w = model.kernel.shape(max(support - inv.root, zero), inv.root, inv.inverse_root);
            const Vec3<V> g = w * r;
            // 1 + d_B/d_A = r.n/d_A, between 1 and 1.5
            const V factor = min(max(dot(r, n) * inverse_d, V(T(1))), V(T(1.5)));
            G = G + g;
            B = fma(factor, g, B);
            if constexpr (Model::viscous) {
                const V approach = max(-(factor * dot(vc, r)), zero);
                const V pressure = model.viscosity(Pair<V>{approach, inv.inverse, rho_sum, i.rho, i.rho, i.c, i.c});
                P = fma(pressure, g, P);
            }
        }
        double sums[9][W];
        const V* rows[] = {&G.x, &G.y, &G.z, &B.x, &B.y, &B.z, &P.x, &P.y, &P.z};
        for (int k = 0; k < 9; ++k) store_wide(sums[k], *rows[k]);
        for (int k = 0; k < i.count; ++k) {
            const WallContact& c = contact[k];
            const Index at = i.first + k;
            const Vector g{pass.volume * sums[0][k], pass.volume * sums[1][k], pass.volume * sums[2][k]};
            Vector b{pass.volume * sums[3][k], pass.volume * sums[4][k], pass.volume * sums[5][k]};
            const Vector q{pass.volume * sums[6][k], pass.volume * sums[7][k], pass.volume * sums[8][k]};
            Vector force = 2.0 * (c.stress * g) - q, mirrored = c.mirrored;
            if (wall.wall->surface == scene::Surface::Coulomb) {
                // scale, the kernel's constant, is negative: the force on the particle points along scale * force
                const Vector slip = mirrored - c.colliding;
                const double impedance = p[field::density][at] * pass.records[at].sound_speed * length(scale * g);
                const auto limited = limit_to_friction(scale * force, c.normal, wall.wall->friction_angle, slip, impedance);
                force = (1 / scale) * limited.force;
                mirrored = c.colliding + limited.drag * slip;
                if (limited.pulls) b = {};
            }
            out.force[0][k] += force.x, out.force[1][k] += force.y, out.force[2][k] += force.z;
            const double vk[3] = {-mirrored.x, -mirrored.y, -mirrored.z};
            for (int a = 0; a < 3; ++a) {
                out.grad_v[3 * a][k] = fma(vk[a], b.x, out.grad_v[3 * a][k]);
                out.grad_v[3 * a + 1][k] = fma(vk[a], b.y, out.grad_v[3 * a + 1][k]);
                out.grad_v[3 * a + 2][k] = fma(vk[a], b.z, out.grad_v[3 * a + 2][k]);
            }
            if (g.x != 0 || g.y != 0 || g.z != 0) out.walled[k] = 1;
            // taken by the wall per unit of rho_i V_i/m_i: -(v.f + sigma : L_wall); viscous: v.q
            const Stress s = sigma[at];
            const Vector sb = s * b;
            const double stress_power = -(mirrored.x * sb.x + mirrored.y * sb.y + mirrored.z * sb.z);
            wall_power[k] -= scale * (dot(v[at], force) + stress_power);
        }
    }
    return pairs;
}

/// Energies and extremes of the clusters one thread has done, a lane each.
template <class U> struct Accumulated {
    U plastic{0.0}, viscous{0.0}, wall{0.0}, damping{0.0};
    U acceleration2{0.0}, signal{0.0}, moved2{0.0}, speed2{0.0}, drift2{0.0}, strained{0.0};
    U not_finite{0.0}; // zero, or not a number
    double outside = 0;
    std::int64_t pairs = 0, asleep = 0;
    PassResult result() const
    {
        // exact sums: their order does not count
        return {{sum(plastic), sum(viscous), sum(wall), sum(damping)},
                {largest(acceleration2), largest(signal), largest(moved2), largest(speed2), largest(drift2),
                 sum(not_finite) == 0 ? 0.0 : 1.0, outside, largest(strained)},
                pairs,
                asleep};
    }
};

/// One number a lane, or one struct of lanes, from what `of(lane)` gives for each.
template <class U, class Of> KUZURE_INLINE U lane_by_lane(Of of)
{
    double row[width<U>];
    for (int k = 0; k < width<U>; ++k) row[k] = of(k);
    return load<U>(row);
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

/// Rounds to a multiple of the unit that `magic` stands for (1.5 * 2^52 units): what is summed then is summed exactly.
template <class U> KUZURE_INLINE U quantized(U x, U magic) { return (x + magic) - magic; }

/// The constitutive law and the leap-frog of the first n lanes at particle `at`; `row` is the lane offset in the sums.
/// Legend: half-step values carry _h; those at the step's end are predicted from them with half a step of the rates.
/// `moving`, `restless`: a bit for each lane of the cluster that is not asleep, and that has a restless neighbour.
template <class U, class Model, class T, int W>
KUZURE_INLINE void advance(const Pass<T>& pass, const Model& model, const Sums<W, Model>& sums, const double* wall_power, int row, Index at,
                           int n, unsigned moving, unsigned restless, double scale, double unit, int dimensions, const Places<T>& place,
                           Accumulated<U>& total)
{
    auto& p = *pass.particles;
    const auto vx = p[field::velocity], vh = p[field::half_velocity], xx = p[field::position], x_sorted = p[field::sorted_position];
    const auto sp = p[field::stress], sh = p[field::half_stress];
    const auto rp = p[field::density], rh = p[field::half_density];
    const auto plastic = p[field::plastic_strain];
    const auto soil_of = p[field::soil];
    const U one(1.0), half(0.5), zero(0.0), factor(scale), dt(pass.dt), kick(pass.kick), half_dt = half * dt;

    // ---- material of each lane
    Elastoplastic<U> soil;
    U c, rho0;
    const auto material = [&](int k) -> const Material& {
        return pass.soils.size() == 1 ? pass.soils[0] : pass.soils[soil_of[at + std::min(k, n - 1)]];
    };
    if (pass.soils.size() == 1) {
        soil = Elastoplastic<U>::from(pass.soils[0]);
        c = U(pass.soils[0].sound_speed), rho0 = U(pass.soils[0].density);
    } else {
        soil = lane_by_lane<Elastoplastic, U>([&](int k) { return Elastoplastic<double>::from(material(k)); });
        c = lane_by_lane<U>([&](int k) { return material(k).sound_speed; });
        rho0 = lane_by_lane<U>([&](int k) { return material(k).density; });
    }

    const Sym3<U> sigma = sp.template load<U>(at);
    const U rho = rp.template load<U>(at);
    const U inverse_rho = one / rho;
    const auto sum = [&](const double(&rows)[W]) { return load<U>(rows + row); };
    Mat3<U> L{{factor * sum(sums.grad_v[0]), factor * sum(sums.grad_v[1]), factor * sum(sums.grad_v[2])},
              {factor * sum(sums.grad_v[3]), factor * sum(sums.grad_v[4]), factor * sum(sums.grad_v[5])},
              {factor * sum(sums.grad_v[6]), factor * sum(sums.grad_v[7]), factor * sum(sums.grad_v[8])}};
    const Vec3<U> A{sum(sums.force[0]), sum(sums.force[1]), sum(sums.force[2])};
    const Vec3<U> G{sum(sums.grad_one[0]), sum(sums.grad_one[1]), sum(sums.grad_one[2])};
    const Vec3<U> v = vx.template load<U>(at);
    Vec3<U> f = A + sigma * G;
    U stressed = zero; // power of the artificial stress, W/m^3
    if constexpr (Model::tensile) {
        const Vec3<U> F{sum(sums.close[0]), sum(sums.close[1]), sum(sums.close[2])};
        double tau[6][width<U>];
        for (int k = 0; k < width<U>; ++k) {
            const Tension<T>& t = pass.tension[at + std::min(k, n - 1)];
            const double of[6] = {t.xx, t.yy, t.zz, t.xy, t.yz, t.xz};
            for (int q = 0; q < 6; ++q) tau[q][k] = of[q];
        }
        const Vec3<U> own =
            Sym3<U>{load<U>(tau[0]), load<U>(tau[1]), load<U>(tau[2]), load<U>(tau[3]), load<U>(tau[4]), load<U>(tau[5])} * F;
        const Vec3<U> theirs{sum(sums.pushed[0]), sum(sums.pushed[1]), sum(sums.pushed[2])};
        f = f + (own + theirs);
        stressed = factor * dot(v, own + theirs);
    }

    // ---- effects of the particle alone
    if constexpr (Model::corrected)
        if (model.correct) {
            const U to_m = U(-unit) * factor; // the sums hold r = x_i - x_j in `unit`
            Sym3<U> M{to_m * sum(sums.moment[0]), to_m * sum(sums.moment[1]), to_m * sum(sums.moment[2]),
                      to_m * sum(sums.moment[3]), to_m * sum(sums.moment[4]), to_m * sum(sums.moment[5])};
            const Sym3<U> correction = GradientCorrection::inverse(M, dimensions, one - sum(sums.walled));
            L = {correction * L.x, correction * L.y, correction * L.z};
        }
    // Stress rate of the diffusion, Pa/s
    Sym3<U> diffusion{zero, zero, zero, zero, zero, zero};
    U diffused = zero; // its power, W/m^3
    if constexpr (Model::diffusive) {
        const U speed = lane_by_lane<U>([&](int k) { return material(k).rod_speed; });
        const U K0 = lane_by_lane<U>([&](int k) { return material(k).at_rest; });
        const U strength = U(2 * model.stress_diffusion.zeta * pass.h * scale / unit) * speed;
        const Sym3<U> S{sum(sums.diffusion[0]), sum(sums.diffusion[1]), sum(sums.diffusion[2]),
                        sum(sums.diffusion[3]), sum(sums.diffusion[4]), sum(sums.diffusion[5])};
        const Sym3<U> rest = model.stress_diffusion.at_rest(K0);
        const U along = U(unit) * sum(sums.diffusion[7]);
        diffusion = strength * fma(rho0 * along, rest, sum(sums.diffusion[6]) * sigma - S);
        // sigma : C^-1 : D = s : dev(D)/(2 G) + I1 tr(D)/(9 K)
        const Sym3<U> s = deviator(sigma);
        diffused = contract(s, diffusion) / (soil.shear + soil.shear) + trace(sigma) * trace(diffusion) / (U(9.0) * soil.bulk);
    }
    Vec3<U> body{U(pass.forces.gravity.x), U(pass.forces.gravity.y), U(pass.forces.gravity.z)};
    if (pass.water) {
        // rho_0 a = -grad p_w: with the reference density the force has the potential V_0 p_w
        const auto pressure = [&](int k) { return pass.water->at(xx[at + std::min(k, n - 1)]).gradient; };
        body.x = body.x - lane_by_lane<U>([&](int k) { return pressure(k).x; }) / rho0;
        body.z = body.z - lane_by_lane<U>([&](int k) { return pressure(k).z; }) / rho0;
    }

    // dv/dt = f/rho + g - mu_d v
    const U mu_d(pass.forces.damping);
    const Vec3<U> a{fnma(mu_d, v.x, fma(factor * inverse_rho, f.x, body.x)), fnma(mu_d, v.y, fma(factor * inverse_rho, f.y, body.y)),
                    fnma(mu_d, v.z, fma(factor * inverse_rho, f.z, body.z))};
    // drho/dt = -rho tr L
    const U rho_rate = -(rho * trace(L));
    const Sym3<U> D = symmetric_part(L);
    if (pass.evolving) {
        const auto evolution = lane_by_lane<Evolution, U>([&](int k) { return Evolution<double>::from(material(k), pass.h); });
        const Sym3<U> sheared = deviator(D);
        const U shear_rate = sqrt(U(4.0) * J2(sheared));
        soil = evolved(soil, evolution, plastic.template load<U>(at), shear_rate, trace(sigma) * U(-1.0 / 3));
    }

    // ---- half-step values: one whole kick. The stress rotates with the material, then the strain loads it.
    Vec3<U> v_h = fma(kick, a, vh.template load<U>(at));
    U rho_h = fma(kick, rho_rate, rh.template load<U>(at));
    const Sym3<U> loading = half * (hooke(kick * D, soil) + kick * diffusion); // half before the turn and half after: second order in time
    auto mapped = return_to_cone(rotate(spin_increment(L, kick), sh.template load<U>(at) + loading) + loading, soil);

    // ---- values at the end of the step: half a step on from there
    Vec3<U> x = fma(dt, v_h, xx.template load<U>(at));
    Vec3<U> v_end = fma(half_dt, a, v_h);
    U rho_end = fma(half_dt, rho_rate, rho_h);
    Sym3<U> s_end =
        return_to_cone(mapped.sigma + spin(spin_increment(L, half_dt), mapped.sigma) + hooke(half_dt * D, soil) + half_dt * diffusion, soil)
            .sigma;
    // ---- lanes beyond the n-th hold other clusters' particles, or nothing; sleepers keep their state
    double number_of[width<U>];
    for (int k = 0; k < width<U>; ++k) number_of[k] = moving >> (row + k) & 1 ? k : width<U>;
    const auto mine = less(load<U>(number_of), U(double(n)));
    if (pass.rest == Rest::Keep) {
        const auto or_old = [&](U now, U old) { return select(mine, now, old); };
        const auto vector = [&](Vec3<U> now, Vec3<U> old) {
            return Vec3<U>{or_old(now.x, old.x), or_old(now.y, old.y), or_old(now.z, old.z)};
        };
        const auto tensor = [&](Sym3<U> now, Sym3<U> old) {
            return Sym3<U>{or_old(now.xx, old.xx), or_old(now.yy, old.yy), or_old(now.zz, old.zz),
                           or_old(now.xy, old.xy), or_old(now.yz, old.yz), or_old(now.xz, old.xz)};
        };
        x = vector(x, xx.template load<U>(at)), v_h = vector(v_h, vh.template load<U>(at)), v_end = vector(v_end, v);
        rho_h = or_old(rho_h, rh.template load<U>(at)), rho_end = or_old(rho_end, rho);
        mapped.sigma = tensor(mapped.sigma, sh.template load<U>(at)), s_end = tensor(s_end, sigma);
        mapped.shear_strain = or_old(mapped.shear_strain, zero);
    }
    const U volume_end = U(pass.volume) * rho0 / rho_end;

    xx.store(at, x, n);
    vh.store(at, v_h, n);
    vx.store(at, v_end, n);
    rh.store(at, rho_h, n);
    rp.store(at, rho_end, n);
    sh.store(at, mapped.sigma, n);
    sp.store(at, s_end, n);
    plastic.store(at, plastic.template load<U>(at) + mapped.shear_strain, n);

    // ---- records for the next step's pairs
    double rows[14][width<U>];
    const U columns[14] = {x.x,     x.y,      x.z,      v_end.x,  v_end.y,  v_end.z,  volume_end,
                           rho_end, s_end.xx, s_end.yy, s_end.zz, s_end.xy, s_end.yz, s_end.xz};
    for (int k = 0; k < 14; ++k) store(rows[k], columns[k]);
    for (int k = 0; k < n; ++k) {
        Record<T>& r = pass.next[at + k];
        r.x = place(rows[0][k]), r.y = place(rows[1][k]), r.z = place(rows[2][k]);
        r.vx = T(rows[3][k]), r.vy = T(rows[4][k]), r.vz = T(rows[5][k]);
        r.volume = T(rows[6][k]), r.density = T(rows[7][k]);
        r.xx = T(rows[8][k]), r.yy = T(rows[9][k]), r.zz = T(rows[10][k]);
        r.xy = T(rows[11][k]), r.yz = T(rows[12][k]), r.xz = T(rows[13][k]);
        r.sound_speed = T(lane(c, k)), r.restless = T(0);
        if constexpr (Model::tensile)
            pass.next_tension[at + k] = make_tension<T>(Stress{rows[8][k], rows[9][k], rows[10][k], rows[11][k], rows[12][k], rows[13][k]},
                                                        model.artificial_stress.epsilon);
    }

    // ---- who is calm
    if (pass.rest == Rest::Look || pass.rest == Rest::FallAsleep) {
        const auto activity = p[field::activity];
        double soon[width<U>];
        store(soon, fma(U(pass.nap), sqrt(dot(a, a)), sqrt(dot(v_end, v_end))));
#pragma GCC unroll 1
        for (int k = 0; k < n; ++k) {
            const bool calm = soon[k] < pass.calm_speed, alone = (restless >> (row + k) & 1) == 0;
            const auto now = !calm                     ? Activity::Moves
                             : pass.rest == Rest::Look ? Activity::Calm
                             : alone                   ? Activity::Asleep
                                                       : Activity::Moves;
            activity.set(at + k, std::int32_t(now));
            pass.next[at + k].restless = T(calm ? 0 : 1);
        }
    }

    // ---- energy: exact sums of rounded addends; extremes; both over the lanes that moved
    const U magic(pass.energy_unit * 6755399441055744.0);
    const U volume = U(pass.volume) * rho0 * inverse_rho;
    // viscous power of i's half of its pairs: V_i/2 sum_j V_j rho_i rho_j Pi approach |grad W|/r
    // and what other terms against noise take: artificial stress -V v.f, stress diffusion -V sigma : C^-1 : D
    const U viscous = quantized(volume * (half * (-factor) * sum(sums.power) - diffused - stressed) * kick, magic);
    const U worked = quantized(volume * mapped.work, magic);
    const U damped = quantized(volume * rho * mu_d * dot(v, v) * kick, magic);
    const Vec3<U> moved = x - x_sorted.template load<U>(at);
    const U a2 = dot(a, a), m2 = dot(moved, moved), v2 = dot(v_end, v_end), d2 = dot(v_h, v_h);
    const U signal = fma(U(pass.h), sqrt(contract(D, D)), c);
    const U finite = fma(zero, a2, fma(zero, v2, fma(zero, trace(s_end), zero * rho_end)));
    const U walled = quantized(volume * load<U>(wall_power + row) * kick, magic);
    total.plastic += select(mine, worked, zero);
    total.viscous += select(mine, viscous, zero);
    total.damping += select(mine, damped, zero);
    total.wall += select(mine, walled, zero);
    total.acceleration2 = max(select(mine, a2, zero), total.acceleration2);
    total.moved2 = max(select(mine, m2, zero), total.moved2);
    total.speed2 = max(select(mine, v2, zero), total.speed2);
    total.drift2 = max(select(mine, d2, zero), total.drift2);
    total.strained = max(select(mine, max(rho_end / rho0, rho0 / rho_end), zero), total.strained);
    total.signal = max(select(mine, signal, zero), total.signal);
    total.not_finite += select(mine, finite, zero);
    if (pass.low)
        for (int k = 0; k < n; ++k) {
            const Vector at_end{lane(x.x, k), lane(x.y, k), lane(x.z, k)};
            if (at_end.x < pass.low->x || at_end.y < pass.low->y || at_end.z < pass.low->z || at_end.x > pass.high->x ||
                at_end.y > pass.high->y || at_end.z > pass.high->z)
                total.outside = 1;
        }
}

} // namespace pass

/// A model compiled for one number type of the pair sums.
template <class Model, class V> class Compiled final : public PairModel {
public:
    using T = number<V>;
    explicit Compiled(const scene::Interactions& s)
        : unit_(pass::single<V> ? s.h : 1.0), dimensions_(s.dimensions), model_(Model::from(s, unit_)),
          // grad W in 1/m^(dimensions + 1) from sums in units of unit_
          scale_(model_.kernel.scale / std::pow(unit_, s.dimensions + 1)), place_(s.h)
    {
    }
    std::string name() const override;
    int cluster_width() const override { return width<V>; }
    scene::Precision precision() const override { return pass::single<V> ? scene::Precision::Mixed : scene::Precision::Double; }
    bool tensile() const override { return Model::tensile; }
    // diffusion: q 3, g.r 5, stresses 12, sums 3; correction 12.  Without: r 3, v 3, r.r 5, densities and softening 3, reciprocals 5,
    // length 1, t 2, shape and volume 8, grad W 3; grad v 18; stress times grad W 15, sums 6; viscosity: approach 6, pressure 6, on the
    // diagonal 3, power 3
    double flops_per_pair() const override
    {
        return 72 + (Model::viscous ? 18 : 0) + (Model::tensile ? 40 : 0) + (Model::diffusive ? 23 : 0) + (Model::corrected ? 12 : 0);
    }
    // scaled sums 9, force 27, rates 25, rotation 110, two strain increments 50, two returns to the cone 80, values 70
    double flops_per_particle() const override { return 494; }
    // columns read 23 and written 21, one record read and one written, four bytes a list entry
    double bytes_per_particle() const override { return 44 * 8 + 2 * sizeof(Record<T>) + 4 * 120.0 / width<V>; }

    PassResult run(const Pass<double>& p, std::span<const Index> clusters) const override
    {
        if constexpr (pass::single<V>) throw Broken("a mixed-precision model was given double records");
        else return over(p, clusters);
    }
    PassResult run(const Pass<float>& p, std::span<const Index> clusters) const override
    {
        if constexpr (pass::single<V>) return over(p, clusters);
        else throw Broken("a double-precision model was given single-precision records");
    }

private:
    PassResult over(const Pass<T>& p, std::span<const Index> clusters) const
    {
        PassResult total;
        const std::int64_t n = std::int64_t(clusters.size());
        if (n == 0) return total;
#pragma omp parallel
        {
            pass::Accumulated<pass::Update<V>> mine;
#pragma omp for schedule(dynamic, 32) nowait
            for (std::int64_t k = 0; k < n; ++k) one_cluster(p, clusters[k], mine);
#pragma omp critical
            total.add(mine.result());
        }
        return total;
    }

    KUZURE_INLINE void one_cluster(const Pass<T>& p, Index cluster, pass::Accumulated<pass::Update<V>>& total) const
    {
        using U = pass::Update<V>;
        constexpr int W = width<V>;
        const auto& store = *p.particles;
        pass::Here<V> i;
        i.first = p.lists->first(cluster);
        i.count = p.lists->count(cluster);
        i.owned = i.moving = (1u << i.count) - 1;
        if (p.rest == Rest::Keep) {
            const auto activity = store[field::activity];
            for (int k = 0; k < i.count; ++k)
                if (activity[i.first + k] == std::int32_t(Activity::Asleep)) i.moving &= ~(1u << k), ++total.asleep;
            if (i.moving == 0) return hand_on(p, cluster, i.first, i.count);
        }
        i.position = pass::positions_of<V>(p.records, i.first);
        const auto v = store[field::velocity];
        i.v = {pass::load_narrow<V>(v.column[0] + i.first), pass::load_narrow<V>(v.column[1] + i.first),
               pass::load_narrow<V>(v.column[2] + i.first)};
        i.rho = pass::load_narrow<V>(store[field::density].column[0] + i.first);
        if (p.soils.size() == 1) i.c = V(T(p.soils[0].sound_speed));
        else {
            T c[W];
            for (int k = 0; k < W; ++k) c[k] = p.records[i.first + std::min(k, i.count - 1)].sound_speed;
            i.c = load<V>(c);
        }
        pass::Sums<W, Model> sums;
        double wall_power[W + width<U>] = {};
        // every particle meets itself once in its list
        const auto pruned = p.lists->pruned(cluster);
        if (p.prune || pruned.n < 0) {
            const double reach = 2 * model_.kernel.h + p.margin / unit_;
            pruned.n = pass::prune(i, p.lists->soil(cluster), p.records, reach, pruned.entries);
        }
        const std::span<const Index> near(pruned.entries, std::size_t(pruned.n));
        total.pairs += pass::sum_over_soil(model_, i, near, p.records, p.tension, sums) - std::popcount(i.moving);
        unsigned restless = 0;
        if (p.rest == Rest::FallAsleep) restless = pass::restless_near(i, near, p.records, 2 * model_.kernel.h);
        const auto walls = p.lists->walls(cluster);
        if (!walls.empty()) total.pairs += pass::sum_over_walls(model_, i, p, walls, unit_, dimensions_, scale_, sums, wall_power);
        for (int row = 0; row < i.count; row += width<U>)
            pass::advance<U>(p, model_, sums, wall_power, row, i.first + row, std::min(width<U>, i.count - row), i.moving, restless, scale_,
                             unit_, dimensions_, place_, total);
    }

    /// The records of a cluster that sleeps as a whole; its list is pruned when it wakes.
    static void hand_on(const Pass<T>& p, Index cluster, Index first, int count)
    {
        std::copy_n(p.records + first, count, p.next + first);
        if constexpr (Model::tensile) std::copy_n(p.tension + first, count, p.next_tension + first);
        if (p.prune) p.lists->pruned(cluster).n = -1;
    }

    double unit_;
    int dimensions_;
    Model model_;
    double scale_;
    Places<T> place_;
};

template <class Model, class V> std::string Compiled<Model, V>::name() const
{
    using K = typename Model::Kernel;
    std::string s = std::is_same_v<K, CubicSpline> ? "cubic spline" : std::is_same_v<K, WendlandC2> ? "wendland c2" : "wendland c4";
    if (Model::viscous) s += " + viscosity";
    if (Model::tensile) s += " + artificial stress";
    if (Model::diffusive) s += " + stress diffusion";
    if (Model::corrected) s += " + gradient correction";
    return s + (pass::single<V> ? ", mixed" : ", double") + (width<V> > 1 ? " x " + std::to_string(width<V>) : ", plain");
}

} // namespace kuzure
