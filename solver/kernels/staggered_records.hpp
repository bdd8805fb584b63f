#pragma once
// Records of the staggered scheme: what the pair loops of its stages read of a neighbour, their ghosts and the walls. A stage reads
// of neighbours only what the other one wrote, strain the kinematics and force the stresses beside positions, so no record is
// buffered twice.
#include "solver/core/mix.hpp"
#include "solver/kernels/cluster_pass.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/scene.hpp"
#include "solver/walls/adjoint.hpp"
#include <unordered_map>

namespace kuzure {

/// Where a particle is and how it moves: x [m or units of h/2^20], v [m/s], volume [m^3], rho [kg/m^3].
template <class T> struct alignas(8 * sizeof(T)) Kinematics {
    Coordinate<T> x, y, z;
    T vx, vy, vz;
    T volume, density;
};
/// What pushes its neighbours: sigma [Pa], volume [m^3]; awake as in Record.
template <class T> struct alignas(8 * sizeof(T)) Stresses {
    T xx, yy, zz, xy, yz, xz;
    T volume, awake;
};
/// sigma K, K the correction of its gradients; only models that correct pair forces read and write it. Pa.
template <class T> struct alignas(4 * sizeof(T)) Traction {
    T xx, xy, xz, yx, yy, yz, zx, zy, zz, spare[3];
};
template <class T> Traction<T> make_traction(const Stress& s, const Stress& K)
{
    const Vector x = K * Vector{s.xx, s.xy, s.xz}, y = K * Vector{s.xy, s.yy, s.yz}, z = K * Vector{s.xz, s.yz, s.zz};
    return {T(x.x), T(x.y), T(x.z), T(y.x), T(y.y), T(y.z), T(z.x), T(z.y), T(z.z), {}};
}
/// Velocity gradient of its strain, 1/s, and its weight in the hourglass control; only runs with that read and write it.
template <class T> struct alignas(4 * sizeof(T)) Affine {
    T xx, xy, xz, yx, yy, yz, zx, zy, zz, weight, spare[2];
};
/// How it is shifted beside that, m/s; only models that shift particles read and write it.
template <class T> struct alignas(4 * sizeof(T)) ShiftOf {
    T x, y, z, spare;
};
static_assert(sizeof(Kinematics<double>) == 64 && sizeof(Stresses<float>) == 32);

/// Stages are layers over this class: each adds one pass (strain.hpp, force.hpp), a scheme puts them together (staggered.hpp).
template <class M, class V, class Law = MirrorImage> class StaggeredRecords : public ClusterPass<M, V> {
    using Base = ClusterPass<M, V>;

public:
    using Model = M;
    using LaneType = V;
    explicit StaggeredRecords(const scene::Interactions& s) : Base(s) {}
    bool moves_first() const override { return true; }
    void require_fields(Particles& p, bool coulomb) const override
    {
        p.require(field::acceleration);
        if (M::diffusive || shifting()) p.require(field::stress_rate);
        if (adjoint()) p.require(field::gradient_matrix, field::strain_matrix);
        if (shifting()) p.require(field::shift, field::shift_acceleration);
        if (coulomb) p.require(field::wall_slip, field::wall_pressure, field::wall_friction);
    }
    void start(Particles&) const override {}
    std::size_t record_memory() const override
    {
        return kinematics_.capacity() * sizeof(Kinematics<T>) + stresses_.capacity() * sizeof(Stresses<T>) +
               tension_.capacity() * sizeof(Tension<T>) + shifts_.capacity() * sizeof(ShiftOf<T>) +
               tractions_.capacity() * sizeof(Traction<T>) + affine_.capacity() * sizeof(Affine<T>) + speed_.capacity() * sizeof(T);
    }
    std::size_t wall_memory() const override
    {
        std::size_t b = moving_points_.capacity() * sizeof(MovingPoint) + moving_faces_.capacity() * sizeof(MovingFace);
        for (const auto& w : walls_) b += w.bytes();
        return b;
    }

    void make_records(const Particles& p, std::span<const Material> soils, std::span<const std::int32_t> ghost_soil) override
    {
        const Index n = n_ = p.size();
        const std::size_t count = std::size_t(n) + ghost_soil.size() + Particles::padding + 1;
        resize_anew(kinematics_, count), resize_anew(stresses_, count);
        if (M::tensile) resize_anew(tension_, count);
        if (shifting()) resize_anew(shifts_, count);
        if (adjoint()) resize_anew(tractions_, count);
        if (controls()) affine_.assign(count, {}); // the strain of each step writes them
        if (soils.size() > 1) resize_anew(speed_, count);
        const bool sleepy = p.has(field::activity);
#pragma omp parallel for schedule(static)
        for (Index i = 0; i < n; ++i) {
            const Material& m = soils[p[field::soil][i]];
            const Vector x = p[field::position][i], v = p[field::velocity][i];
            const Stress s = p[field::stress][i];
            const double rho = p[field::density][i], volume = volume_ * m.density / rho;
            kinematics_[i] = {fixed_(x.x), fixed_(x.y), fixed_(x.z), T(v.x), T(v.y), T(v.z), T(volume), T(rho)};
            const bool awake = sleepy && p[field::activity][i] == std::int32_t(Activity::Moves);
            stresses_[i] = {T(s.xx), T(s.yy), T(s.zz), T(s.xy), T(s.yz), T(s.xz), T(volume), T(awake)};
            if constexpr (M::tensile) tension_[i] = make_tension<T>(s, model_.artificial_stress.adjoint_epsilon);
            if (shifting()) shifts_[i] = shift_of(p[field::shift][i]);
            if (adjoint()) tractions_[i] = make_traction<T>(s, p[field::gradient_matrix][i]);
        }
        for (std::size_t k = n; k < count; ++k) {
            kinematics_[k] = far_away<T, Kinematics>();
            stresses_[k] = {};
            if (M::tensile) tension_[k] = {};
            if (shifting()) shifts_[k] = {};
            if (adjoint()) tractions_[k] = {};
        }
        if (soils.size() > 1) {
            for (Index i = 0; i < n; ++i) speed_[i] = T(soils[p[field::soil][i]].c_p);
            for (std::size_t k = 0; k < ghost_soil.size(); ++k) speed_[n + k] = T(soils[ghost_soil[k]].c_p);
            std::fill(speed_.begin() + n + ghost_soil.size(), speed_.end(), T(1));
        }
    }
    void set_walls(const Scene& scene, std::span<WallPoints> points) override
    {
        const WallSurface surface(scene);
        walls_.clear(), walls_.resize(points.size()), moving_points_.clear(), moving_faces_.clear();
        std::vector<bool> moves(scene.walls.size());
        for (const int w : scene::moving_walls(scene)) moves[std::size_t(w)] = true;
        for (std::size_t w = 0; w < points.size(); ++w) {
            take_faces(scene, moves, w, points[w], surface);
            take_positions(points[w], moves[std::size_t(points[w].wall)], walls_[w]);
        }
        if (scene::any_wall_moves(scene))
            for (auto& w : walls_) w.motion.assign(w.faces.size(), {});
    }
    void place_walls(const WallStep& step) override
    {
        for (const auto& p : moving_points_) {
            const Vector x = step.position(p.wall, p.x);
            auto& to = walls_[p.record].made;
            to[0][p.point] = fixed_(x.x), to[1][p.point] = fixed_(x.y), to[2][p.point] = fixed_(x.z);
        }
        for (const auto& f : moving_faces_) {
            const Vector x = step.position(f.own, f.x), foot = step.position(f.wall, f.face.foot(f.x)),
                         n = step.turned(f.wall, f.face.normal);
            const Vector v = velocity_of(f.face, f.own, f.x, [&](int w, Vector at) { return step.velocity(w, at); });
            const Vector next = velocity_of(f.face, f.own, f.x, [&](int w, Vector at) { return step.next_velocity(w, at); });
            auto& to = walls_[f.record];
            auto& kind = to.kinds[std::size_t(to.faces[f.number].kind)]; // its own
            kind.nx = T(n.x), kind.ny = T(n.y), kind.nz = T(n.z), to.faces[f.number].depth = T(dot(foot - x, n) / unit_);
            to.motion[f.number] = {T(v.x), T(v.y), T(v.z), T(next.x), T(next.y), T(next.z)};
        }
    }
    void pack(int stage, Index owned, Vector shift, std::byte* to) const override
    {
        if (stage == 0) {
            Kinematics<T> r = kinematics_[owned];
            r.x = fixed_.sum(r.x, fixed_(shift.x)), r.y = fixed_.sum(r.y, fixed_(shift.y)), r.z = fixed_.sum(r.z, fixed_(shift.z));
            std::memcpy(to, &r, sizeof r);
            if (shifting()) std::memcpy(to + sizeof r, &shifts_[owned], sizeof(ShiftOf<T>));
            return;
        }
        std::memcpy(to, &stresses_[owned], sizeof(Stresses<T>)), to += sizeof(Stresses<T>);
        if (adjoint()) std::memcpy(to, &tractions_[owned], sizeof(Traction<T>)), to += sizeof(Traction<T>);
        if (controls()) std::memcpy(to, &affine_[owned], sizeof(Affine<T>)), to += sizeof(Affine<T>);
        if constexpr (M::tensile) std::memcpy(to, &tension_[owned], sizeof(Tension<T>));
    }
    void unpack(int stage, Index slot, const std::byte* from) override
    {
        if (stage == 0) {
            std::memcpy(&kinematics_[n_ + slot], from, sizeof(Kinematics<T>));
            if (shifting()) std::memcpy(&shifts_[n_ + slot], from + sizeof(Kinematics<T>), sizeof(ShiftOf<T>));
            return;
        }
        std::memcpy(&stresses_[n_ + slot], from, sizeof(Stresses<T>)), from += sizeof(Stresses<T>);
        if (adjoint()) std::memcpy(&tractions_[n_ + slot], from, sizeof(Traction<T>)), from += sizeof(Traction<T>);
        if (controls()) std::memcpy(&affine_[n_ + slot], from, sizeof(Affine<T>)), from += sizeof(Affine<T>);
        if constexpr (M::tensile) std::memcpy(&tension_[n_ + slot], from, sizeof(Tension<T>));
    }
    void end_stage(int) override {}

    /// Half a kick and the whole way of a step, and the kinematics for its strain.
    void move(const StepInput& in) override
    {
        auto& p = *in.particles;
        const Index n = p.size();
        const U dt(in.dt), half_dt = U(0.5) * dt;
        const bool shifted = in.shifted;
        const auto x = p[field::position], v = p[field::velocity];
        const auto a = std::as_const(p)[field::acceleration];
        const auto rho = std::as_const(p)[field::density];
        const auto soil = std::as_const(p)[field::soil];
        const std::int32_t* activity = in.sleep == SleepStage::Frozen ? std::as_const(p)[field::activity].column[0] : nullptr;
        const bool built = Index(kinematics_.size()) > n; // else the lists come next, and the records with them
#pragma omp parallel for schedule(static)
        for (Index at = 0; at < n; at += width<U>) {
            const int lanes = std::min<Index>(width<U>, n - at);
            const Vec3<U> x0 = x.template load<U>(at), v0 = v.template load<U>(at);
            Vec3<U> u = fma(half_dt, a.template load<U>(at), v0), way = u;
            if (shifted) way = way + std::as_const(p)[field::shift].template load<U>(at);
            Vec3<U> x1 = fma(dt, way, x0);
            if (activity) {
                double awake[width<U>];
                for (int k = 0; k < width<U>; ++k) awake[k] = k < lanes && activity[at + k] != std::int32_t(Activity::Asleep);
                const auto moves = less(U(0.5), load<U>(awake));
                u = select(moves, u, v0), x1 = select(moves, x1, x0);
            }
            x.store(at, x1, lanes), v.store(at, u, lanes);
            if (!built) continue;
            for (int k = 0; k < lanes; ++k) {
                const double density = rho[at + k];
                const Material& m = in.soils[in.soils.size() == 1 ? 0 : soil[at + k]];
                const Vector here = x[at + k], moving = v[at + k];
                kinematics_[at + k] = {
                    fixed_(here.x), fixed_(here.y), fixed_(here.z), T(moving.x), T(moving.y), T(moving.z), T(volume_ * m.density / density),
                    T(density)};
                if (shifted) shifts_[at + k] = shift_of(std::as_const(p)[field::shift][at + k]);
            }
        }
    }

protected:
    using Base::unit_, Base::h_, Base::volume_, Base::model_, Base::fixed_;
    using typename Base::T, typename Base::U;

    /// True where this run's pair forces are by corrected gradients.
    bool adjoint() const
    {
        if constexpr (M::corrected) return model_.adjoint;
        else return false;
    }
    /// True where this run controls hourglass motion.
    bool controls() const
    {
        if constexpr (M::corrected) return model_.hourglass.strength > 0;
        else return false;
    }
    /// True where this run shifts particles: a model that can also serves scenes without.
    bool shifting() const
    {
        if constexpr (M::shifts) return model_.shifting.constant > 0;
        else return false;
    }
    /// Velocities at which lanes are shifted; none but where `counts`.
    KUZURE_INLINE Vec3<V> shift_of(const StepInput& in, const Cluster<V>& i, bool counts) const
    {
        const V none(T(0));
        if (!counts) return {none, none, none};
        const auto s = std::as_const(*in.particles)[field::shift];
        const auto narrow = [&](int k) { return load_narrow<V>(s.column[k] + i.first); };
        return {narrow(0), narrow(1), narrow(2)};
    }
    static ShiftOf<T> shift_of(Vector w) { return {T(w.x), T(w.y), T(w.z), T(0)}; }
    void take_positions(const WallPoints& points, bool moves, WallRecords<T>& to) const
    {
        if constexpr (!single<V>)
            if (!moves) { // in metres they are what the run has
                to.x = points.x.data(), to.y = points.y.data(), to.z = points.z.data();
                return;
            }
        const Array<double>* from[] = {&points.x, &points.y, &points.z};
        for (int a = 0; a < 3; ++a) {
            to.made[a].resize(from[a]->size());
            for (std::size_t k = 0; k < from[a]->size(); ++k) to.made[a][k] = fixed_((*from[a])[k]);
        }
        to.x = to.made[0].data(), to.y = to.made[1].data(), to.z = to.made[2].data();
    }
    /// The faces of a wall's points; those without any, deep in the wall, are taken away.
    void take_faces(const Scene& scene, const std::vector<bool>& moves, std::size_t number, WallPoints& points, const WallSurface& surface)
    {
        auto& to = walls_[number];
        const int own = points.wall;
        const PointFaces found(surface, points.x, points.y, points.z, 2 * h_);
        std::vector<bool> exposed(found.size());
        for (std::size_t k = 0; k < found.size(); ++k) exposed[k] = !found[k].empty();
        to.faces.reserve(found.faces());
        to.first.reserve(std::size_t(std::ranges::count(exposed, true)) + 1);
        to.first.push_back(0);
        std::unordered_map<std::uint64_t, Index> known; // kinds by what they are mixed to; two that share it are two of each
        for (std::size_t k = 0; k < found.size(); ++k) {
            if (!exposed[k]) continue;
            const Vector at{points.x[k], points.y[k], points.z[k]};
            if (moves[std::size_t(own)]) moving_points_.push_back({number, Index(to.first.size() - 1), own, at});
            for (const Face& f : found[k]) {
                const scene::Wall& wall = scene.walls[f.wall];
                const bool moving = moves[std::size_t(own)] || moves[std::size_t(f.wall)];
                if (moving) moving_faces_.push_back({number, to.faces.size(), own, f.wall, at, f});
                const bool coulomb = wall.surface == scene::Surface::Coulomb && wall.friction_angle > 0; // else it is smooth
                const FaceKind<T> kind{T(f.normal.x),
                                       T(f.normal.y),
                                       T(f.normal.z),
                                       T(wall.surface == scene::Surface::Rough),
                                       T(coulomb),
                                       T(coulomb ? std::tan(scene::friction_angle_at(wall, f.foot(at))) : 0),
                                       T(std::holds_alternative<scene::Ground>(wall.shape)),
                                       T(wall.drag)};
                to.faces.push_back({T(f.depth / unit_), moving ? add_kind(to, kind) : kind_like(to, kind, known), 0, f.tied});
            }
            to.first.push_back(Index(to.faces.size()));
            to.faces.back().last = 1;
        }
        to.kinds.shrink_to_fit();
        points.keep(exposed);
    }
    static Index add_kind(WallRecords<T>& to, const FaceKind<T>& kind)
    {
        to.kinds.push_back(kind);
        return Index(to.kinds.size() - 1);
    }
    static Index kind_like(WallRecords<T>& to, const FaceKind<T>& kind, std::unordered_map<std::uint64_t, Index>& known)
    {
        std::uint64_t bits[sizeof kind / 8], key = 0; // by bits: zeros have signs
        static_assert(sizeof bits == sizeof kind);
        std::memcpy(bits, &kind, sizeof kind);
        for (const std::uint64_t b : bits) key = mix(key ^ b);
        const auto [at, fresh] = known.try_emplace(key, Index(to.kinds.size()));
        if (!fresh && std::memcmp(&to.kinds[std::size_t(at->second)], &kind, sizeof kind) == 0) return at->second;
        return add_kind(to, kind);
    }

    /// Visits the wall points inside the support: visit(r, r^2, lanes that they hit, mirror); `back` is taken off the positions.
    template <bool moving, class Visit>
    KUZURE_INLINE void for_each_wall_pair(const Cluster<V>& i, const WallList& near, Vec3<V> back, Visit visit) const
    {
        const auto [support, support2, softening, tiny] = Base::lengths();
        const V ramp(T(face_ramp * h_ / unit_));
        near.for_each([&](int number, const PointSet& points) __attribute__((always_inline)) {
            const WallRecords<T>& wall = walls_[number];
            points.for_each([&](std::size_t point) __attribute__((always_inline)) {
                const Vec3<V> r = i.position.minus(wall.x[point], wall.y[point], wall.z[point]) - back;
                const V r2 = dot(r, r);
                const unsigned hits = bits(less(r2, support2)) & i.owned;
                if (!hits) return;
                const FaceMotion<T>* motion = nullptr;
                if constexpr (moving) motion = &wall.motion[wall.first[point]];
                visit(r, max(r2, tiny), hits, mirror<moving>(Law{}, r, &wall.faces[wall.first[point]], wall.kinds.data(), ramp, motion));
            });
        });
    }
    /// Work of moving walls on soil that goes through `account`, from its power (W) in the half step before and in the one to come: what
    /// they give is no part of what that took.
    static void book_work_of_walls(const StepInput& in, const Lanes& lanes, U before, U coming, U& account, U& later, Tally<U>& tally)
    {
        const U zero(0.0), magic(magic_of(in.energy_unit));
        const auto mine = written<U>(lanes);
        const U done = select(mine, quantized(U(0.5 * in.dt) * before, magic), zero);
        const U then = select(mine, quantized(U(0.5 * in.next) * coming, magic), zero);
        account += done, tally.energy.moved_wall -= done;
        later += then, tally.later.moved_wall -= then;
    }
    /// True where some wall near this rank's soil moves.
    bool walls_move() const { return !moving_faces_.empty(); }

    std::vector<WallRecords<T>> walls_;
    struct MovingPoint {
        std::size_t record; // in walls_
        Index point;
        int wall;
        Vector x; // m, where it was when walls were set
    };
    struct MovingFace {
        std::size_t record, number; // in walls_, in its faces
        int own, wall;              // of the point behind it, and whose face it is
        Vector x;                   // of the point, m, and the face, when walls were set
        Face face;
    };
    std::vector<MovingPoint> moving_points_;
    std::vector<MovingFace> moving_faces_;
    Index n_ = 0;
    Array<Kinematics<T>> kinematics_;
    Array<Stresses<T>> stresses_;
    Array<Tension<T>> tension_;
    Array<ShiftOf<T>> shifts_;
    Array<Traction<T>> tractions_;
    Array<Affine<T>> affine_;
    Array<T> speed_; // c_p by record, where there are several soils
};

} // namespace kuzure
