#pragma once
// The staggered scheme by the book: what its two stages make of one particle, over all pairs, in plain loops and doubles. Terms of a pair
// are those of by_the_book.hpp; what is its own are the moments at which they are taken, and walls as one surface.
// Beyond 400 lines: all equations of a step on one page, to be read and compared as a whole.
//
//     strain   x, v, rho, sigma after the move; all distances half a step back, r_ij = x_ij - dt/2 (v_ij + w_ij):
//              L_i = sum_j V_j (v_j - v_i) (x) grad W - sum_w V_w 2 P_w v_i (x) grad W,  w points of walls,
//              b_i = -1/rho_i sum_j V_j rho_i rho_j Pi_ij grad W  (of walls: v_iw = 2 P_w v_i, and of the force P_w)
//              D_i = sym L_i - epsilon N_i sym[sum_j V_j f_ij (v_j - v_i) (x) grad W] N_i in tension, of effects/artificial_stress.hpp
//              sigma, rho by a whole step: half of the loading before the turn and half after
//              where particles are shifted, w_i = -n C h^2 gamma' k_i grad C_i of effects/shifting.hpp for the step to come, in one of n =
//              8
//     force    a_i = b_i + g + 1/rho_i sum_j V_j [sigma_i + sigma_j + f_ij (tau_i + tau_j)] . grad W
//                    + 1/rho_i sum_w V_w 2 P_w (sigma_i . grad W) + friction;  v_i += dt/2 a_i
//              a_i += L_i w_i of the step before; sum_j V_j (sigma_j - sigma_i) (w_i . grad W) is a stress rate of the next strain
//              of soil behind the face of real ground that its nearest point there mirrors it at, by a depth of d: also
//              a spring n omega^2 d, omega = 0.3 c_p/h
//
// A wall point mirrors the particle at one exposed face of the ground, the union of all walls and their images across the periods: the
// nearest one that has the particle in front; near its plane the normal turns to the next such face's. P_w = 1 at rough faces, n (x) n at
// smooth ones and Coulomb's. Where the wall of that face moves, v_i less the velocity of the face stands for v_i, and its power counts
// apart.
#include "solver/kernels/by_the_book.hpp"
#include "solver/physics/drucker_prager.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/height_field.hpp"
#include <algorithm>

namespace kuzure::book {

// ---- the ground ----------------------------------------------------------------------------------------------------
/// Walls and their images across the periods.
struct Ground {
    struct Part {
        scene::Shape shape;
        int wall;
    };
    std::vector<Part> parts;
    int dimensions;
    double spacing; // m
    /// -1 in the ground, 0 on its surface or where two parts of it touch, 1 in the air.
    int side(Vector x) const
    {
        double depth = -std::numeric_limits<double>::infinity();
        for (const Part& p : parts) depth = std::max(depth, -scene::signed_distance(p.shape, x, dimensions));
        return depth > 1e-11 * spacing ? -1 : depth >= -1e-11 * spacing ? 0 : 1;
    }
};
/// So many directions around a way, none along the axes, as edges are; in 2-D the two across it.
inline std::vector<Vector> directions_across(Vector way, int dimensions, int around)
{
    if (dimensions == 2) return {{-way.z, 0, way.x}, {way.z, 0, -way.x}};
    const Vector c = cross(way, std::fabs(way.z) < 0.8 ? Vector{0, 0, 1} : Vector{1, 0, 0}), a = (1 / length(c)) * c, b = cross(way, a);
    std::vector<Vector> all;
    for (int k = 0; k < around; ++k) {
        const double turn = (2 * k + 1) * std::numbers::pi / around;
        all.push_back(std::cos(turn) * a + std::sin(turn) * b);
    }
    return all;
}
inline scene::Shape shifted(scene::Shape shape, Vector by)
{
    if (auto* b = std::get_if<scene::Box>(&shape)) b->low = b->low + by, b->high = b->high + by;
    if (auto* c = std::get_if<scene::Cylinder>(&shape)) c->base = c->base + by;
    if (auto* s = std::get_if<scene::Sphere>(&shape)) s->center = s->center + by;
    if (auto* p = std::get_if<scene::Polygon>(&shape)) {
        for (auto& corner : p->points) corner = {corner[0] + by.x, corner[1] + by.z};
        p->y = {p->y[0] + by.y, p->y[1] + by.y};
    }
    return shape;
}
/// `period`: m, 0 along an axis that does not repeat.
inline Ground ground(std::span<const scene::Wall> walls, Vector period, int dimensions, double spacing)
{
    Ground g{{}, dimensions, spacing};
    const auto turns = [](double length) { return length > 0 ? std::vector{-1.0, 0.0, 1.0} : std::vector{0.0}; };
    for (int w = 0; w < int(walls.size()); ++w)
        for (const double a : turns(period.x))
            for (const double b : turns(period.y))
                for (const double c : turns(period.z))
                    g.parts.push_back({shifted(walls[std::size_t(w)].shape, {a * period.x, b * period.y, c * period.z}), w});
    return g;
}

/// The point of one face of a shape that is nearest to x, and the face's normal.
struct OnFace {
    Vector point, normal;
};
inline std::vector<OnFace> nearest_on_each_face(const scene::Shape& shape, Vector x, int dimensions)
{
    std::vector<OnFace> all;
    const auto between = [](double a, double low, double high) { return std::clamp(a, low, high); };
    if (const auto* b = std::get_if<scene::Box>(&shape)) {
        const double low[3]{b->low.x, b->low.y, b->low.z}, high[3]{b->high.x, b->high.y, b->high.z}, at[3]{x.x, x.y, x.z};
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {-1.0, 1.0}) {
                if (dimensions == 2 && axis == 1) continue;
                double p[3], n[3]{};
                for (int k = 0; k < 3; ++k) p[k] = between(at[k], low[k], high[k]);
                p[axis] = side > 0 ? high[axis] : low[axis], n[axis] = side;
                all.push_back({{p[0], dimensions == 2 ? x.y : p[1], p[2]}, {n[0], n[1], n[2]}});
            }
    } else if (const auto* s = std::get_if<scene::Sphere>(&shape)) {
        Vector d = x - s->center;
        if (dimensions == 2) d.y = 0;
        const double r = length(d);
        const Vector n = r > 0 ? (1 / r) * d : Vector{0, 0, 1};
        all.push_back({x + (s->radius - r) * n, n});
    } else if (const auto* c = std::get_if<scene::Cylinder>(&shape)) {
        const Vector axis{c->base.x, c->base.y, x.z}, d = x - axis;
        const double r = length(d), top = c->base.z + c->height;
        const Vector n = r > 0 ? (1 / r) * d : Vector{1, 0, 0};
        const auto at_height = [](Vector p, double z) { return Vector{p.x, p.y, z}; };
        all.push_back({at_height(axis + c->radius * n, between(x.z, c->base.z, top)), n});
        const Vector within = axis + std::min(r, c->radius) * n;
        all.push_back({at_height(within, top), {0, 0, 1}}), all.push_back({at_height(within, c->base.z), {0, 0, -1}});
    } else if (const auto* p = std::get_if<scene::Polygon>(&shape)) {
        const std::size_t corners = p->points.size();
        for (std::size_t k = 0; k < corners; ++k) {
            const Vector a{p->points[k][0], 0, p->points[k][1]}, b{p->points[(k + 1) % corners][0], 0, p->points[(k + 1) % corners][1]};
            const Vector edge = b - a, from_a = Vector{x.x, 0, x.z} - a;
            Vector on = a + between(dot(from_a, edge) / dot(edge, edge), 0, 1) * edge;
            on.y = dimensions == 2 ? x.y : between(x.y, p->y[0], p->y[1]);
            // corners run from x towards z where the area is positive: outside is on the right
            const double right = scene::area(*p) >= 0 ? 1 : -1;
            all.push_back({on, (right / length(edge)) * Vector{edge.z, 0, -edge.x}});
        }
        if (dimensions == 3 && scene::signed_distance(*p, {x.x, (p->y[0] + p->y[1]) / 2, x.z}, 2) < 1e-12)
            for (const int end : {0, 1}) all.push_back({{x.x, p->y[std::size_t(end)], x.z}, {0, end ? 1.0 : -1.0, 0}});
    } else if (const auto* g = std::get_if<scene::Ground>(&shape)) {
        const auto nearest = g->field->nearest(x);
        if (std::isfinite(nearest.distance)) all.push_back({nearest.point, (1 / nearest.distance) * (x - nearest.point)});
    }
    return all;
}

/// The tangent plane of an exposed face: the points x with (x - x_w) . normal = depth.
struct Face {
    Vector normal;
    double depth; // m
    int wall;     // whose contact counts
    Vector side;  // of that wall there: at an edge not the normal
    bool tied;    // as near as the one before it
    Vector plane; // its own normal, where that turns to another's
};
/// Where faces of two walls meet in one edge, the one with more grip counts: rough, then Coulomb by its friction, then smooth.
inline double grip(const scene::Wall& w)
{
    return w.surface == scene::Surface::Rough ? std::numbers::pi : w.surface == scene::Surface::Coulomb ? w.friction_angle : -1;
}
/// True if there is air beyond a point of a face, or, where that is on the surface of what lies beside, around it.
inline bool open(const Ground& ground, Vector foot, Vector way)
{
    const double least = 1e-6 * ground.spacing;
    const Vector beyond = foot + least * way;
    if (ground.side(beyond) != 0) return ground.side(beyond) > 0;
    return std::ranges::any_of(directions_across(way, ground.dimensions, 8),
                               [&](Vector along) { return ground.side(beyond + least * along) > 0; });
}
/// True if a face goes on from this point of it: a thousandth of a spacing along it is air before it and ground behind, of this part.
inline bool goes_on(const Ground& ground, Vector foot, Vector normal, const Ground::Part* part = nullptr)
{
    return std::ranges::any_of(directions_across(normal, ground.dimensions, 8), [&](Vector along) {
        const Vector at = foot + 1e-3 * ground.spacing * along, over = 2e-6 * ground.spacing * normal;
        return ground.side(at + over) > 0 && ground.side(at - over) < 0 &&
               (!part || scene::contains(part->shape, at - over, ground.dimensions));
    });
}
/// True if all that lies across the way to an edge is ground, a hundredth of a spacing beside it and a little back: along the axes, in
/// which most pieces end, and around.
inline bool folds(const Ground& ground, Vector edge, Vector way)
{
    std::vector<Vector> beside{{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}};
    if (ground.dimensions == 3) {
        beside.insert(beside.end(), {{0, 1, 0}, {0, -1, 0}});
        for (const Vector& along : directions_across(way, 3, 16)) beside.push_back(along);
    }
    return std::ranges::all_of(beside, [&](Vector along) {
        const Vector across = along - dot(along, way) * way;
        const double l = length(across);
        return l <= 1e-3 || ground.side(edge + ground.spacing * ((1e-2 / l) * across - 5e-6 * way)) <= 0;
    });
}
/// An edge is of the wall with most grip among those whose faces meet there, whichever of them ends there.
inline void take_grip(Face& f, const Ground& ground, std::span<const scene::Wall> walls, Vector edge)
{
    for (const auto& part : ground.parts)
        for (const OnFace& on : nearest_on_each_face(part.shape, edge, ground.dimensions))
            if (grip(walls[std::size_t(part.wall)]) > grip(walls[std::size_t(f.wall)]) &&
                length(on.point - edge) <= 2e-6 * ground.spacing && goes_on(ground, edge, on.normal, &part))
                f.wall = part.wall, f.side = on.normal;
}
/// Exposed faces no further than `reach` from x, a point inside the ground, nearest first.
inline std::vector<Face> exposed_faces(const Ground& ground, std::span<const scene::Wall> walls, Vector x, double reach)
{
    const double least = 1e-6 * ground.spacing;
    std::vector<Face> all;
    for (const auto& part : ground.parts)
        for (const OnFace& on : nearest_on_each_face(part.shape, x, ground.dimensions)) {
            const Vector way = on.point - x;
            // Beside a face its edge is nearest, and the surface faces the way to it.
            const double away = length(way), along = std::fabs(dot(way, on.normal));
            const bool straight = away - along <= least;
            const double depth = straight ? along : away;
            if (depth > reach) continue;
            const Vector normal = straight ? on.normal : (1 / depth) * way;
            if (depth > least && dot(way, normal) < 0) continue; // seen from behind
            if (!open(ground, on.point, normal)) continue;       // covered
            // An edge counts where the ground folds about it: the surface does not go on to where it is nearer.
            if (straight ? !goes_on(ground, on.point, normal) : !folds(ground, on.point, normal)) continue;
            Face face{normal, depth, part.wall, on.normal, false, normal};
            if (!straight || ground.side(on.point + least * normal) == 0) take_grip(face, ground, walls, on.point);
            const auto same = std::ranges::find_if(
                all, [&](const Face& f) { return std::fabs(f.depth - depth) <= least && dot(f.normal, normal) > 1 - 1e-9; });
            if (same == all.end()) all.push_back(face);
            else if (grip(walls[std::size_t(face.wall)]) > grip(walls[std::size_t(same->wall)]))
                same->wall = face.wall, same->side = face.side;
        }
    // Of equally near ones that which faces up, then along x, then y: the order of walls and faces does not show.
    std::ranges::sort(all, {}, &Face::depth);
    for (auto first = all.begin(); first != all.end();) {
        const auto last = std::find_if(first, all.end(), [&](const Face& f) { return f.depth > first->depth + least; });
        std::ranges::sort(first, last, {}, [](const Face& f) { return -dot(f.normal, {0.1, 0.01, 1}); });
        for (auto f = first; f != last; ++f) f->tied = f != first;
        first = last;
    }
    return all;
}
/// A point of a wall and the exposed faces that it stands behind.
struct GroundPoint {
    Vector x;
    std::vector<Face> faces;
    int wall; // its own
};
/// Coulomb's friction of a face, rad.
inline double friction_at(const GroundPoint& w, const Face& face, const scene::Wall& wall)
{
    return scene::friction_angle_at(wall, w.x + face.depth * face.plane);
}
/// The face at which a point mirrors particle i, x_ij = x_i - x_w: the nearest that has i in front, else the nearest, but with a normal
/// that turns from that of one face to that of the next:
///
///     n = sum_g c_g N_g, made a unit vector,   N_g = sum_k f_k n_k / sum_k f_k,   c_g = s_g prod_(nearer g') (1 - s_g')
///
/// over groups g of equally near faces k, f_k >= 0 how far i lies in front, s_g = min(1, sum_k f_k/(h/4)). The wall is that of the face
/// with the largest f/(f + h/4) prod (1 - s); behind all faces that of the least deep of the nearest.
inline Face mirroring(const GroundPoint& w, Vector x_ij, double h)
{
    const double ramp = h / 4;
    double left = 1, most = 0;
    Vector n{};
    const auto depth_behind = [&](const Face& f) { return f.depth - dot(x_ij, f.normal); };
    auto group = w.faces.begin();
    auto after = [&](auto first) { return std::find_if(first + 1, w.faces.end(), [](const Face& f) { return !f.tied; }); };
    Face chosen = *std::min_element(group, after(group), [&](auto& a, auto& b) { return depth_behind(a) < depth_behind(b); });
    for (; group != w.faces.end(); group = after(group)) {
        double sum = 0;
        Vector together{};
        for (auto f = group; f != after(group); ++f) {
            const double in_front = std::max(-depth_behind(*f), 0.0), counts = left * in_front / (in_front + ramp);
            sum += in_front, together = together + in_front * f->normal;
            if (counts > most) most = counts, chosen = *f;
        }
        if (sum == 0) continue;
        const double share = left * std::min(sum / ramp, 1.0);
        n = n + (share / sum) * together, left -= share;
    }
    if (length(n) > 1e-6) chosen.normal = (1 / length(n)) * n;
    return chosen;
}
/// P a.
inline Vector crossing(const scene::Wall& wall, const Face& face, Vector a)
{
    return wall.surface == scene::Surface::Rough ? a : dot(a, face.normal) * face.normal;
}

/// Velocity of the face at which a point mirrors, m/s: at an edge that one wall makes with that of the point, of the one along its own
/// normal and of the other across it.
inline Vector velocity_of(const GroundPoint& w, const Face& face, const std::vector<Vector>& motion)
{
    if (motion.empty()) return {};
    const Vector v = motion[std::size_t(face.wall)], other = motion[std::size_t(w.wall)];
    return dot(face.side, face.plane) > 1 - 1e-9 ? v : other + dot(v - other, face.side) * face.side;
}

// ---- the state -----------------------------------------------------------------------------------------------------
/// What the staggered scheme keeps of one particle beside the soil: acceleration m/s^2, stress rate of the diffusion Pa/s, elastic slip at
/// Coulomb walls m, acceleration with which they hold it m/s^2 (0: no contact).
struct Kept {
    Vector acceleration{};
    Stress stress_rate{};
    Vector slip{};
    double pressed = 0, friction = 0; // the latter: the most that it carries
    double plastic_strain = 0, opened = 0;
    double pressure = 0;                  // of a load that follows its face, Pa
    Vector push{};                        // of one that does not, N
    Vector shift{}, shift_acceleration{}; // m/s, m/s^2
};
constexpr double mirror = 2; // (v_i - v_w)/v_i of what a wall point mirrors

// ---- stage "strain" --------------------------------------------------------------------------------------------------
struct Strain {
    Matrix L{}, L_walls{}; // 1/s; the latter is a part of the former
    Vector viscous{};      // acceleration, m/s^2
    bool beside_wall = false;
    double power = 0, next_power = 0;          // of moving walls by viscosity, in this step and the next, W/kg
    double friction = 0;                       // the most that it carries, without what this step's stress allows, m/s^2
    Matrix K{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; // correction of gradients
    Vector crowd{};                            // grad C of near neighbours, 1/m
    double inside = 0;                         // tr M/d, walls among the neighbours
    Stress near_tension{};                     // sym sum_j V_j f (v_j - v_i) (x) grad W, 1/s
    double sees_all = 0;                       // 1 where L has all of an affine motion, in part 0 near surfaces
};
/// 0.2 (W/W(spacing))^4: near neighbours count. Lind et al. (2012), eq. 26.
inline double crowding(const Kernel& kernel, double spacing, double r)
{
    return 0.2 * std::pow(kernel.value(r) / kernel.value(spacing), 4);
}
/// The conservative artificial stress: f_ij = (W/W(spacing))^n - m and tau = -epsilon' <sigma_k> n_k n_k, epsilon' = epsilon/(1 - epsilon
/// m), with m by which sum_j V_j f x dW/dx = 0 on the lattice.
struct NearTension {
    double epsilon = 0, exponent = 1, mean = 0; // epsilon', n, m
    static NearTension of(const Setting& s)
    {
        NearTension t;
        if (!s.how.effects.artificial_stress) return t;
        t.exponent = s.how.effects.artificial_stress->exponent;
        const Kernel kernel = s.kernel();
        t.mean = s.on_lattice(kernel, [&](double r) { return t.f(kernel, s.how.spacing, r); }) /
                 s.on_lattice(kernel, [](double) { return 1.0; });
        t.epsilon = s.how.effects.artificial_stress->epsilon / (1 - s.how.effects.artificial_stress->epsilon * t.mean);
        return t;
    }
    double f(const Kernel& kernel, double spacing, double r) const
    {
        return std::pow(kernel.value(r) / kernel.value(spacing), exponent) - mean;
    }
};
/// Corrects L of the soil where the scene says so, and says how much of an affine motion L then has.
inline void correct(Strain& of_i, const Matrix& M, const Setting& s)
{
    // Mirrored velocities are not linear: beside a wall the plain gradient is kept.
    if (s.how.correction != scene::Correction::None && !of_i.beside_wall)
        of_i.L = corrected(of_i.L, M, s.how.dimensions), of_i.K = corrected(of_i.K, M, s.how.dimensions);
    of_i.sees_all = s.how.correction != scene::Correction::None && !of_i.beside_wall && trusted(M, s.how.dimensions)
                        ? 1
                        : std::clamp((trace(M) / s.how.dimensions - 0.75) / 0.15, 0.0, 1.0);
}
inline Strain strain_of(std::size_t k, const Soil& soil, std::span<const Kept> kept, std::span<const GroundPoint> points, const Setting& s,
                        double dt)
{
    const Kernel kernel = s.kernel();
    const auto& viscous = s.how.effects.viscosity;
    const Particle i = particle(soil, k, s);
    // As it stands at mid-step, seen from where j stands then.
    const auto at_mid_step = [&](Particle j, Vector shift) {
        j.x = j.x - (dt / 2) * (j.v + shift);
        return j;
    };
    const Particle here = at_mid_step(i, kept[k].shift);
    const auto near = NearTension::of(s);
    Strain of_i;
    Matrix M{}, sliding{};
    Vector pressure{}; // sum V_j rho_i rho_j Pi grad W
    for (std::size_t l = 0; l < soil.x.size(); ++l) {
        if (l == k) continue;
        const Particle j = at_mid_step(particle(soil, l, s), kept[l].shift);
        const Vector x_ij = here.x - j.x, grad = kernel.gradient(x_ij);
        of_i.L = of_i.L + j.volume * outer(j.v - i.v, grad);
        M = M + j.volume * outer(j.x - here.x, grad);
        const Stress strained = j.volume * symmetric_part(outer(j.v - i.v, grad));
        if (near.epsilon > 0) of_i.near_tension = of_i.near_tension + near.f(kernel, s.how.spacing, length(x_ij)) * strained;
        of_i.crowd = of_i.crowd + (j.volume * crowding(kernel, s.how.spacing, length(x_ij))) * grad;
        if (viscous) pressure = pressure + (j.volume * i.density * j.density * viscosity(*viscous, s.how.h, here, j, i.v - j.v)) * grad;
    }
    of_i.inside = trace(M) / s.how.dimensions;
    for (const GroundPoint& w : points) {
        const Vector r = here.x - w.x, grad = kernel.gradient(r);
        if (w.faces.empty() || grad == Vector{}) continue;
        of_i.crowd = of_i.crowd + (i.volume * crowding(kernel, s.how.spacing, length(r))) * grad;
        of_i.inside -= i.volume * dot(r, grad) / s.how.dimensions;
        const Face face = mirroring(w, r, s.how.h);
        const scene::Wall& wall = s.walls[std::size_t(face.wall)];
        const Vector mirrored = mirror * crossing(wall, face, i.v - velocity_of(w, face, s.motion)); // v_iw
        Matrix& L_of_it = wall.surface == scene::Surface::Coulomb ? sliding : of_i.L_walls;
        L_of_it = L_of_it + -i.volume * outer(mirrored, grad);
        of_i.beside_wall = true;
        if (!viscous) continue;
        Particle shown = i; // the wall shows i itself
        shown.x = w.x;
        const double Pi = viscosity(*viscous, s.how.h, here, shown, mirrored);
        const Vector push = (i.volume * i.density * i.density * Pi) * crossing(wall, face, grad);
        pressure = pressure + push;
        of_i.power -= dot(push, velocity_of(w, face, s.motion)) / i.density;
        of_i.next_power -= dot(push, velocity_of(w, face, s.next_motion)) / i.density;
        if (wall.surface == scene::Surface::Coulomb)
            of_i.friction += std::tan(friction_at(w, face, wall)) * -i.volume * i.density * Pi * dot(grad, face.normal);
    }
    // The limit of friction follows what presses: d limit/dt = (tan(delta) p - limit)/lag, lag = 4 h/c_p, implicit.
    const double lag = 4 * s.how.h / s.soils[std::size_t(soil.soil[k])].c_p;
    of_i.friction = dt > 0 ? (lag * kept[k].friction + dt * of_i.friction) / (lag + dt) : of_i.friction;
    // A Coulomb face counts where it pressed on the particle at the step's start, or where it is approached.
    if (kept[k].pressed > 0 || trace(sliding) < 0) of_i.L_walls = of_i.L_walls + sliding;
    correct(of_i, M, s);
    // Wall points have the volume of mid-step, V (1 + dt/2 tr L); that of soil which has opened stays V.
    if (!(kept[k].opened > 0)) of_i.L_walls = (1 + dt / 2 * (trace(of_i.L) + trace(of_i.L_walls))) * of_i.L_walls;
    of_i.L = of_i.L + of_i.L_walls;
    of_i.viscous = (-1 / i.density) * pressure;
    return of_i;
}

/// State after a step of length dt, and what of its energy (J) left the mechanical ledger.
struct Strained {
    Stress stress;
    double density, plastic_strain, opened;
    double plastic, stabilising, wall;
    Vector shift{}, shift_acceleration{}; // m/s, m/s^2
    double weight = 0;                    // in the hourglass control, kg/(m^2 s)
};
inline Strained strained(const Particle& i, const Material& soil, const Kept& kept, const Strain& strain, const Setting& s, double dt)
{
    Stress D = symmetric_part(strain.L);
    auto law = Elastoplastic<double>::from(soil);
    if (const auto near = NearTension::of(s); tension(i.stress, near.epsilon) != Stress{})
        D = D - near.epsilon * tensile_part(i.stress + hooke((dt / 2) * D, law), strain.near_tension);
    if (soil.evolves())
        law =
            evolved(law, Evolution<double>::from(soil, s.how.h), kept.plastic_strain, std::sqrt(4 * J2(deviator(D))), -trace(i.stress) / 3);
    const Stress loading = (dt / 2) * (hooke(D, law) + kept.stress_rate);
    const auto mapped = return_to_cone(rotate(spin_increment(strain.L, dt), i.stress + loading) + loading, law, kept.opened);
    const bool holds = mapped.d_lambda <= 0 && mapped.opened <= 0;
    // d rho/dt = -rho (tr L - d opened/dt): (rho' - rho)/dt = -(tr L - d opened/dt) (rho' + rho)/2
    const double change = dt / 2 * trace(strain.L) - (mapped.opened - kept.opened) / 2;
    Strained next{mapped.sigma, i.density * (1 - change) / (1 + change), kept.plastic_strain + mapped.d_lambda, mapped.opened, 0, 0, 0};
    // The mean stress works on the strain and on the diffusion's elastic strain; what is not stored is plastic.
    const double mass = i.density * i.volume, volume = (mass / i.density + mass / next.density) / 2;
    const Stress mean = 0.5 * (i.stress + next.stress);
    const double diffused = dt * elastic_power(soil, mean, kept.stress_rate);
    const double stored = (elastic_power(soil, next.stress, next.stress) - elastic_power(soil, i.stress, i.stress)) / 2;
    next.plastic = volume * (dt * kuzure::contract(mean, D) + diffused - stored);
    next.stabilising = -volume * diffused;
    next.wall = -volume * dt * contract(mean, strain.L_walls);
    next.weight = holds ? strain.sees_all * (dt > 0 ? next.density : i.density) * soil.c_p : 0;
    if (s.how.shifting == 0) return next;
    // The way beside the velocity changes the potential energy.
    const Vector weight = s.how.effects.gravity.value_or(Vector{}) + (-1 / soil.density) * PoreWater::from(s.how.effects).at(i.x).gradient;
    next.stabilising += mass * dt * dot(weight, kept.shift);
    next.shift_acceleration = {dot(strain.L.x, kept.shift), dot(strain.L.y, kept.shift), dot(strain.L.z, kept.shift)};
    const double h = s.how.h, k = std::clamp((strain.inside - 0.75) / 0.15, 0.0, 1.0); // 0 at free surfaces, 1 inside
    next.shift = (-8 * s.how.shifting * h * h * (mapped.d_lambda / dt) * k) * strain.crowd;
    return next;
}

// ---- stage "force" -----------------------------------------------------------------------------------------------------
/// Energies taken (J) by viscosity, artificial stress, walls, damping and loads.
struct Taken {
    double viscous = 0, stabilising = 0, wall = 0, damping = 0, moved_wall = 0, loads = 0;
};
struct Forced {
    Vector acceleration, velocity;
    Stress stress_rate{};
    Vector slip{};
    double pressed = 0, friction = 0; // m/s^2; the latter: the most that it carries
    Taken before, coming;             // in the half step before and in the one to come
    std::int64_t pairs = 0;
    enum class Contact { None, Presses, Approached, LetGo } contact = Contact::None; // with Coulomb faces
    enum class Rubs { Not, Sticks, Slides } rubs = Rubs::Not;
};
/// What the hourglass control knows of a particle: its velocity gradient, 1/s, and its weight.
struct Affine {
    Matrix L;
    double weight;
};
/// Against the part of v_ij that neither velocity gradient tells of: 2 xi h min(w_i, w_j) V_j (v_ij - (L_i + L_j) x_ij/2)
/// (x_ij . grad W)/(r^2 + 0.01 h^2), N/m^3. Zhang et al. (2024).
inline Vector hourglass_force(double xi, double h, const Particle& i, const Particle& j, const Affine& of_i, const Affine& of_j,
                              Vector grad)
{
    const Vector x_ij = i.x - j.x, apart = (i.v - j.v) - 0.5 * ((of_i.L + of_j.L) * x_ij);
    return (2 * xi * h * std::min(of_i.weight, of_j.weight) * j.volume * dot(x_ij, grad) / (dot(x_ij, x_ij) + 0.01 * h * h)) * apart;
}
/// `K`: corrections of pair forces; none: they are not corrected. `affine` as K. `kept.acceleration` is the viscous one of this step; dt is
/// its length, `next` that of the one to come, s.
inline Forced force_on(std::size_t k, const Soil& soil, const Kept& kept, std::span<const Matrix> K, std::span<const Affine> affine,
                       std::span<const GroundPoint> points, const Setting& s, double dt, double next)
{
    const Kernel kernel = s.kernel();
    const scene::Effects& e = s.how.effects;
    const auto near = NearTension::of(s);
    const Material& material = s.soils[std::size_t(soil.soil[k])];
    const Particle i = particle(soil, k, s);
    const Vector gravity = e.gravity.value_or(Vector{});
    Forced of_i;
    Vector stress{}, art{}, held{}, push{}; // N/m^3; push: of Coulomb faces
    Vector inward{};                        // of a unit of pressure on free faces, 1/m
    Vector area{};                          // of Coulomb faces, along their normals, 1/m
    double limit = 0, approach = 0, dragging = 0;
    double held_power[2] = {}, push_power[2] = {}; // of walls in this step and the next, W/m^3
    Vector carried[2] = {};                        // sum of face areas times their velocities
    double all_faces = 0;
    struct {
        double distance;
        Vector push{};   // m/s^2
        double grip = 0; // tan(friction angle) of a Coulomb face
    } out{2 * s.how.h};  // of real ground, at the wall point nearest to i
    for (std::size_t l = 0; l < soil.x.size(); ++l) {
        const Vector x_ij = i.x - soil.x[l];
        if (l == k || length(x_ij) >= 2 * s.how.h) continue;
        ++of_i.pairs;
        const Particle j = particle(soil, l, s);
        const Vector grad = kernel.gradient(x_ij);
        // sigma_i K_i + sigma_j K_j, adjoint to the strain's K_i grad W
        stress = stress + j.volume * (K.empty() ? (i.stress + j.stress) * grad : i.stress * (K[k] * grad) + j.stress * (K[l] * grad));
        inward = inward + 2 * j.volume * grad;
        if (near.epsilon > 0)
            stress = stress + j.volume * near.f(kernel, s.how.spacing, length(x_ij)) *
                                  ((tension(i.stress, near.epsilon) + tension(j.stress, near.epsilon)) * grad);
        if (s.how.hourglass > 0) art = art + hourglass_force(s.how.hourglass, s.how.h, i, j, affine[k], affine[l], grad);
        if (e.stress_diffusion)
            of_i.stress_rate = of_i.stress_rate + stress_diffusion(e.stress_diffusion->zeta, s.how.h, gravity, material, i, j, grad);
        if (s.how.shifting > 0) of_i.stress_rate = of_i.stress_rate + (j.volume * dot(kept.shift, grad)) * (j.stress - i.stress);
    }
    for (const GroundPoint& w : points) {
        const Vector r = i.x - w.x, grad = kernel.gradient(r);
        if (w.faces.empty() || length(r) >= 2 * s.how.h) continue;
        ++of_i.pairs;
        const Face face = mirroring(w, r, s.how.h);
        const scene::Wall& wall = s.walls[std::size_t(face.wall)];
        if (length(r) < out.distance) {
            const double sunk = std::holds_alternative<scene::Ground>(wall.shape) ? std::max(face.depth - dot(r, face.plane), 0.0) : 0.0;
            const double omega = 0.3 * material.c_p / s.how.h;
            out = {length(r), (omega * omega * sunk) * face.normal,
                   wall.surface == scene::Surface::Coulomb ? std::tan(friction_at(w, face, wall)) : 0.0};
        }
        const Vector traction = mirror * i.volume * (i.stress * grad); // adjoint to the strain
        inward = inward + mirror * i.volume * crossing(wall, face, grad);
        const Vector v_w[2] = {velocity_of(w, face, s.motion), velocity_of(w, face, s.next_motion)};
        for (int t = 0; t < 2; ++t)
            (wall.surface == scene::Surface::Coulomb ? push_power : held_power)[t] += dot(crossing(wall, face, traction), v_w[t]);
        if (wall.surface != scene::Surface::Coulomb) {
            held = held + crossing(wall, face, traction);
            continue;
        }
        push = push + crossing(wall, face, traction);
        limit += std::tan(friction_at(w, face, wall)) * dot(traction, face.normal);
        const double facing = mirror * i.volume * dot(grad, face.normal); // negative in front of the face
        dragging -= facing * wall.drag;
        area = area - facing * face.normal, approach += facing * dot(i.v - v_w[0], face.normal);
        for (int t = 0; t < 2; ++t) carried[t] = carried[t] + facing * v_w[t];
        all_faces += facing;
    }
    Vector by_walls = (1 / i.density) * held + out.push;
    double power[2] = {held_power[0] / i.density, held_power[1] / i.density};
    // Coulomb: the wall is felt where it presses, or where the particle comes nearer; half of it by whether the strain of this step counted
    // it, half by whether the next one will. Friction is a spring of the soil's shear stiffness
    // across half a smoothing length that carries no more than the limit and keeps the slip that carries it.
    if (length(area) > 0) {
        of_i.contact = limit > 0 ? Forced::Contact::Presses : approach > 0 ? Forced::Contact::Approached : Forced::Contact::LetGo;
        const bool now = of_i.contact != Forced::Contact::LetGo, before = dt > 0 ? kept.pressed > 0 || approach > 0 : now;
        const double felt = (before ? 0.5 : 0) + (now ? 0.5 : 0);
        const double lag = 4 * s.how.h / material.c_p, presses = felt * limit / i.density + length(out.push) * out.grip;
        of_i.pressed = limit > 0 ? length(push) / i.density : 0;
        of_i.friction = kept.friction + (dt > 0 ? dt / (lag + dt) : 1) * presses;
        by_walls = by_walls + (felt / i.density) * push;
        for (int t = 0; t < 2; ++t) power[t] += felt * push_power[t] / i.density;
        if (all_faces != 0)
            for (Vector& c : carried) c = (1 / all_faces) * c; // the mean velocity of the faces
        const Vector n = (1 / length(area)) * area, along = (i.v - carried[0]) - dot(i.v - carried[0], n) * n;
        // The wall's drag, rho v_t^2 times its number, carries beside friction.
        const double most = of_i.friction + felt * dragging * dot(along, along);
        if (most > 0) {
            const double stiffness = material.shear * length(area) / (s.how.h / 2) / i.density; // 1/s^2
            Vector slip = kept.slip + dt * (i.v - carried[0]);
            slip = slip - dot(slip, n) * n;
            of_i.rubs = Forced::Rubs::Sticks;
            if (const double trial = stiffness * length(slip); trial > most) slip = (most / trial) * slip, of_i.rubs = Forced::Rubs::Slides;
            of_i.slip = slip;
            by_walls = by_walls - stiffness * slip;
            for (int t = 0; t < 2; ++t) power[t] -= stiffness * dot(slip, carried[t]);
        }
    }
    const Vector water = (-1 / material.density) * PoreWater::from(e).at(i.x).gradient;
    // A pressure on free faces is what a tension of the particle and of all around it would do.
    const double mass = i.density * i.volume;
    const Vector load = (kept.pressure / i.density) * inward + (1 / mass) * kept.push;
    if (s.how.shifting > 0) art = art + i.density * kept.shift_acceleration;
    const Vector free = (1 / i.density) * (stress + art) + kept.acceleration + by_walls + gravity + water + load;
    // Damping over the whole kick, with the mean of the velocities before and after it: a = free - mu (v- + v+)/2, v+ = v- + kick a.
    const double kick = (dt + next) / 2;
    of_i.acceleration = (1 / (1 + s.damping * kick / 2)) * (free - s.damping * i.v);
    of_i.velocity = i.v + (dt / 2) * of_i.acceleration;
    const Vector then = i.v + kick * of_i.acceleration;
    const auto taken = [&](Vector v, double time, double watts) {
        const auto by = [&](Vector a) { return -mass * time * dot(a, v); };
        const double given = mass * time * watts;
        return Taken{
            by(kept.acceleration), by((1 / i.density) * art), by(by_walls) + given, by((-s.damping / 2) * (i.v + then)), -given, by(load)};
    };
    of_i.before = taken(i.v, dt / 2, power[0]), of_i.coming = taken(then, next / 2, power[1]);
    return of_i;
}

} // namespace kuzure::book
