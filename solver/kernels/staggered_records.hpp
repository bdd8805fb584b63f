#pragma once
// Records of the staggered scheme: what the pair loops of its stages read of a neighbour, their ghosts and the walls. A stage reads
// of neighbours only what the other one wrote, strain the kinematics and force the stresses beside positions, so no record is
// buffered twice.
#include "solver/kernels/cluster_pass.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/scene.hpp"
#include "solver/walls/adjoint.hpp"

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
    std::size_t bytes() const override
    {
        return kinematics_.capacity() * sizeof(Kinematics<T>) + stresses_.capacity() * sizeof(Stresses<T>) +
               tension_.capacity() * sizeof(Tension<T>) + shifts_.capacity() * sizeof(ShiftOf<T>) +
               tractions_.capacity() * sizeof(Traction<T>) + affine_.capacity() * sizeof(Affine<T>) + speed_.capacity() * sizeof(T) +
               wall_bytes();
    }

    void make_records(const Particles& p, std::span<const Material> soils, std::span<const std::int32_t> ghost_soil) override
    {
        const Index n = n_ = p.size();
        const std::size_t count = std::size_t(n) + ghost_soil.size() + Particles::padding + 1;
        kinematics_.resize(count), stresses_.resize(count);
        if (M::tensile) tension_.resize(count);
        if (shifting()) shifts_.resize(count);
        if (adjoint()) tractions_.resize(count);
        if (controls()) affine_.assign(count, {}); // the strain of each step writes them
        if (soils.size() > 1) speed_.resize(count);
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
    void set_walls(const Scene& scene, std::span<const WallPoints> points) override
    {
        const WallSurface surface(scene);
        walls_.assign(points.size(), {}), moving_points_.clear(), moving_faces_.clear();
        std::vector<bool> moves(scene.walls.size());
        for (const int w : scene::moving_walls(scene)) moves[std::size_t(w)] = true;
        for (std::size_t w = 0; w < points.size(); ++w) {
            auto& to = walls_[w];
            const Index n = Index(points[w].x.size());
            to.x.resize(n), to.y.resize(n), to.z.resize(n), to.first.assign(std::size_t(n) + 1, 0);
            std::vector<std::vector<Face>> found(n);
#pragma omp parallel for schedule(dynamic, 256)
            for (Index k = 0; k < n; ++k) {
                to.x[k] = fixed_(points[w].x[k]), to.y[k] = fixed_(points[w].y[k]), to.z[k] = fixed_(points[w].z[k]);
                surface.faces({points[w].x[k], points[w].y[k], points[w].z[k]}, 2 * h_, found[k]);
            }
            for (Index k = 0; k < n; ++k) {
                const Vector at{points[w].x[k], points[w].y[k], points[w].z[k]};
                const int own = points[w].wall;
                if (moves[std::size_t(own)]) moving_points_.push_back({w, k, own, at});
                for (const Face& f : found[k]) {
                    const scene::Wall& wall = scene.walls[f.wall];
                    if (moves[std::size_t(own)] || moves[std::size_t(f.wall)])
                        moving_faces_.push_back({w, to.faces.size(), own, f.wall, at, f});
                    const bool coulomb = wall.surface == scene::Surface::Coulomb && wall.friction_angle > 0; // else it is smooth
                    to.faces.push_back({T(f.normal.x), T(f.normal.y), T(f.normal.z), T(f.depth / unit_),
                                        T(wall.surface == scene::Surface::Rough), T(coulomb),
                                        T(coulomb ? std::tan(scene::friction_angle_at(wall, f.foot(at))) : 0), T(0),
                                        T(std::holds_alternative<scene::Ground>(wall.shape)), T(wall.drag)});
                }
                to.first[k + 1] = Index(to.faces.size());
                if (to.first[k + 1] > to.first[k]) to.faces.back().last = T(1);
            }
        }
        if (scene::any_wall_moves(scene))
            for (auto& w : walls_) w.motion.assign(w.faces.size(), {});
    }
    void place_walls(const WallStep& step) override
    {
        for (const auto& p : moving_points_) {
            const Vector x = step.position(p.wall, p.x);
            auto& to = walls_[p.record];
            to.x[p.point] = fixed_(x.x), to.y[p.point] = fixed_(x.y), to.z[p.point] = fixed_(x.z);
        }
        for (const auto& f : moving_faces_) {
            const Vector x = step.position(f.own, f.x), foot = step.position(f.wall, f.face.foot(f.x)),
                         n = step.turned(f.wall, f.face.normal);
            const Vector v = velocity_of(f.face, f.own, f.x, [&](int w, Vector at) { return step.velocity(w, at); });
            const Vector next = velocity_of(f.face, f.own, f.x, [&](int w, Vector at) { return step.next_velocity(w, at); });
            auto& to = walls_[f.record].faces[f.number];
            to.nx = T(n.x), to.ny = T(n.y), to.nz = T(n.z), to.depth = T(dot(foot - x, n) / unit_);
            walls_[f.record].motion[f.number] = {T(v.x), T(v.y), T(v.z), T(next.x), T(next.y), T(next.z)};
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
    std::size_t wall_bytes() const
    {
        std::size_t b = 0;
        for (const auto& w : walls_)
            b += w.x.size() * 3 * sizeof(w.x[0]) + w.first.size() * sizeof(Index) + w.faces.size() * sizeof(FaceRecord<T>);
        return b;
    }

    /// Visits the wall points inside the support: visit(r, r^2, lanes that they hit, mirror); `back` is taken off the positions.
    template <bool moving, class Visit>
    KUZURE_INLINE void for_each_wall_pair(const Cluster<V>& i, std::span<const Index> runs, Vec3<V> back, Visit visit) const
    {
        const auto [support, support2, softening, tiny] = Base::lengths();
        while (!runs.empty()) {
            const WallRecords<T>& wall = walls_[runs[0]];
            const auto list = runs.subspan(2, runs[1]);
            runs = runs.subspan(2 + runs[1]);
            for (const Index point : list) {
                const Vec3<V> r = i.position.minus(wall.x[point], wall.y[point], wall.z[point]) - back;
                const V r2 = dot(r, r);
                const unsigned hits = bits(less(r2, support2)) & i.owned;
                if (!hits || wall.first[point] == wall.first[point + 1]) continue;
                const FaceMotion<T>* motion = nullptr;
                if constexpr (moving) motion = &wall.motion[wall.first[point]];
                visit(r, max(r2, tiny), hits, mirror<moving>(Law{}, r, &wall.faces[wall.first[point]], motion));
            }
        }
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
