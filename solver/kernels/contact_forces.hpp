#pragma once
// What walls do to each particle in the force stage: the adjoint force, and Coulomb's friction with the slip that it keeps.
#include "solver/kernels/staggered_records.hpp"
#include "solver/walls/friction.hpp"
#include <array>

namespace kuzure {

/// A layer below the force stage.
template <class Below> class ContactForces : public Below {
    using M = typename Below::Model;

protected:
    using Below::Below, Below::W, Below::unit_, Below::h_, Below::scale_;
    using typename Below::T, typename Below::U;
    using Wide = WideLanes<Below::W>;

    /// What walls add to the sums of a cluster; over wall points j of volume 1, f_ij the mirror factor.
    template <class S> struct ForceWalls {
        Vec3<S> held, pressing; // sum f P (sigma_i grad W); of Coulomb faces apart
        S limit;                // sum f tan(delta) n.(sigma_i grad W)
        S approach;             // sum f (n.v_i)(n.grad W) of Coulomb faces
        Vec3<S> area;           // sum f (n.grad W) n of Coulomb faces
        S dragging;             // sum f drag n.grad W of these
        S nearest, sunk, grip;  // square of the distance to the nearest wall point; how far behind its face; tan(delta) there
        Vec3<S> out;            // that face's normal
    };
    /// Power of walls that move: sum f (P (sigma_i grad W)).v_w, with v_w of this step and of the one to come, of Coulomb faces apart; of
    /// those sum f (n.grad W) v_w and sum f n.grad W.
    template <class S> struct WallPower {
        S held, held_next, pressing, pressing_next;
        Vec3<S> carried, carried_next;
        S facing;
    };
    /// Work of walls a second, W, before and to come.
    struct Watts {
        U now, next;
    };
    /// All that walls do to each lane; of viscosity the strain stage has left it.
    static void tell_of_walls(Particles& p, const Lanes& lanes, Vec3<U> wall, bool walled)
    {
        const auto told = p[field::wall_force];
        const Vec3<U> before = told.template load<U>(lanes.at);
        Vec3<U> all = wall;
        if constexpr (M::viscous)
            if (walled) all = before + wall;
        told.store(lanes.at, select(written<U>(lanes), all, before), lanes.n);
    }
    /// Soil with no wall around has none of a contact before.
    static void forget_contact(Particles& p, const Lanes& lanes)
    {
        if (!p.has(field::wall_slip)) return;
        for (Index i = lanes.at; i < lanes.at + lanes.n; ++i) forget_contact(p, i);
    }
    static void forget_contact(Particles& p, Index i)
    {
        p[field::wall_slip].set(i, Vector{}), p[field::wall_pressure].set(i, 0.0), p[field::wall_friction].set(i, 0.0);
    }
    /// Mean velocity of the faces around lane k, in this step and the next, m/s.
    static std::array<Vector, 2> carried_by(const WallPower<U>& power, int k)
    {
        const auto at = [&](U a) { return lane(a, k); };
        if (at(power.facing) == 0) return {};
        const double share = 1 / at(power.facing);
        return {share * Vector{at(power.carried.x), at(power.carried.y), at(power.carried.z)},
                share * Vector{at(power.carried_next.x), at(power.carried_next.y), at(power.carried_next.z)}};
    }
    /// What walls do to each lane, m/s^2: the adjoint force, and Coulomb's friction, whose slip it moves on. `watts`: the power of walls
    /// that move, of a unit of mass.
    KUZURE_INLINE Vec3<U> wall_acceleration(const StepInput& in, const ForceWalls<Wide>& wall_sums, const Lanes& lanes, U volume, U rho,
                                            const WallPower<Wide>* wall_power, Watts& watts) const
    {
        const auto w = lanes_at<U, ForceWalls<U>, ForceWalls<Wide>, W>(wall_sums, lanes.first);
        const U scale = U(scale_) * volume / rho;
        auto& p = *in.particles;
        const U push_out = lane_by_lane<U>([&](int k) {
            const Material& m = in.soils[in.soils.size() == 1 ? 0 : std::as_const(p)[field::soil][lanes.particle(k)]];
            return hold_out(unit_ * lane(w.sunk, k), m.c_p, h_);
        });
        const Vec3<U> held = scale * w.held + push_out * w.out;
        WallPower<U> power{};
        if (wall_power) {
            power = lanes_at<U, WallPower<U>, WallPower<Wide>, W>(*wall_power, lanes.first);
            watts = {scale * power.held, scale * power.held_next};
        }
        if (!p.has(field::wall_slip)) return held;
        const auto slip = p[field::wall_slip];
        const auto pressure = p[field::wall_pressure];
        const auto limit = p[field::wall_friction];
        const auto v = std::as_const(p)[field::velocity];
        double out[3][width<U>] = {}, worked[2][width<U>] = {};
        const auto at = [&](U a, int k) { return lane(a, k); };
        for (int k = 0; k < lanes.n; ++k) {
            if (!(lanes.moving >> (lanes.first + k) & 1)) continue;
            const Index i = lanes.at + k;
            const double s = at(scale, k);
            const Vector push{s * at(w.pressing.x, k), s * at(w.pressing.y, k), s * at(w.pressing.z, k)};
            const Vector faces = s * Vector{at(w.area.x, k), at(w.area.y, k), at(w.area.z, k)};
            const double area = length(faces), held_by = s * at(w.limit, k);
            if (!(area > 0)) {
                forget_contact(p, i);
                continue;
            }
            // scale and grad W.n have opposite signs: the face is approached where their product with v.n is positive
            const bool pressed = held_by > 0, approached = s * at(w.approach, k) > 0;
            // It acts in the half step before if the strain of this step knew of the face, in that to come if the next one will: soil that
            // is let go, or caught, is so at once in both, else the stress of half a step would be work of the wall.
            const bool counted = in.dt > 0 ? pressure[i] > 0 || approached : pressed || approached;
            const double share = 0.5 * (counted + (pressed || approached));
            const Material& m = in.soils[in.soils.size() == 1 ? 0 : std::as_const(p)[field::soil][i]];
            const double presses = share * held_by + at(push_out, k) * at(w.grip, k);
            const double most = limit[i] + lag(in.dt, m.c_p, h_).take * presses;
            const auto [carried, carried_next] = wall_power ? carried_by(power, k) : std::array<Vector, 2>{};
            // a spring of the soil's own shear stiffness across half a smoothing length
            const Vector slides = v[i] - carried, normal = (1 / area) * faces;
            // rho (g/xi) v_t^2 on the faces' area
            const double drag =
                -share * s * at(w.dragging, k) * at(rho, k) * (dot(slides, slides) - dot(slides, normal) * dot(slides, normal));
            const auto f = return_to_coulomb(slip[i], in.dt * slides, normal, most + drag, spring_stiffness(m.shear, area, h_));
            slip.set(i, f.slip), pressure.set(i, pressed ? length(push) : 0.0), limit.set(i, most);
            const Vector all = share * push + f.force;
            out[0][k] = all.x, out[1][k] = all.y, out[2][k] = all.z;
            if (!wall_power) continue;
            worked[0][k] = share * s * at(power.pressing, k) + dot(f.force, carried);
            worked[1][k] = share * s * at(power.pressing_next, k) + dot(f.force, carried_next);
        }
        if (wall_power) watts.now = watts.now + load<U>(worked[0]), watts.next = watts.next + load<U>(worked[1]);
        return held + Vec3<U>{load<U>(out[0]), load<U>(out[1]), load<U>(out[2])};
    }
};

} // namespace kuzure
