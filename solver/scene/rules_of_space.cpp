// The rules of space, bodies and walls.
#include "solver/scene/at_rest.hpp"
#include "solver/scene/box.hpp"
#include "solver/scene/nearby.hpp"
#include "solver/scene/rules.hpp"
#include "solver/scene/shape.hpp"
#include <algorithm>
#include <cmath>

namespace kuzure::scene {
namespace {

void check_shape(const Scene& scene, const Shape& shape, const std::string& key, Rules& rules)
{
    const bool flat = scene.dimensions == 2;
    if (flat && std::holds_alternative<Cylinder>(shape))
        rules.error(key + ".cylinder", "expected a box, sphere (a disc) or polygon in 2-D, found a cylinder; use dimensions = 3");
    if (const auto* p = std::get_if<Polygon>(&shape)) {
        const std::size_t most_corners = 10000;
        if (p->points.size() < 3) rules.error(key + ".polygon.points", text("expected at least 3 corners, found {}", p->points.size()));
        else if (p->points.size() > most_corners)
            rules.error(key + ".polygon.points",
                        text("expected at most {} corners, found {}; leave out some", most_corners, p->points.size()));
        else if (crosses_itself(*p))
            rules.error(key + ".polygon.points", "expected a polygon whose edges meet at their corners only, found one that crosses "
                                                 "or repeats itself; name the corners in order, the first not again at the end");
        if (!flat && !(p->y[0] < p->y[1]))
            rules.error(key + ".polygon.y",
                        p->y[0] == 0 && p->y[1] == 0
                            ? std::string("expected y = [from, to] in 3-D, found none; give the polygon's extent along y")
                            : text("expected y = [from, to] with from < to, found [{}, {}]; exchange them", p->y[0], p->y[1]));
    }
}

} // namespace

void check_space(const Scene& scene, Rules& rules)
{
    const Space& space = scene.space;
    const char* names = "xyz";
    const bool flat = scene.dimensions == 2;
    if (space.low.has_value() != space.high.has_value())
        rules.error(
            space.low ? "space.low" : "space.high",
            text("expected space.low and space.high together, found only space.{}; give both or neither", space.low ? "low" : "high"));
    if (space.low && space.high)
        for (int axis = 0; axis < 3; ++axis)
            if (!(flat && axis == 1) && !(at(*space.low, axis) < at(*space.high, axis)))
                rules.error("space.high", text("expected high above low along {}, found {} and {}; exchange them", names[axis],
                                               at(*space.low, axis), at(*space.high, axis)));
    if (flat && space.periodic[1])
        rules.error("space.periodic", "expected no periodic y in 2-D, which has no y; leave it out or use dimensions = 3");
    for (int axis = 0; axis < 3; ++axis) {
        if (!space.periodic[std::size_t(axis)] || (flat && axis == 1)) continue;
        if (!space.low || !space.high) {
            rules.error("space.periodic", text("expected space.low and space.high with periodic {}, found none; their "
                                               "distance is the period",
                                               names[axis]));
            continue;
        }
        const double period = at(*space.high, axis) - at(*space.low, axis), n = period / space.spacing;
        const double least = 2 * scene.support() * (1 + scene.accuracy.skin);
        if (!(period > 0)) continue;
        const double largest = std::max(std::abs(at(*space.low, axis)), std::abs(at(*space.high, axis)));
        if (std::abs(n - std::round(n)) > std::max(1e-6, rounding_of(largest) / space.spacing))
            rules.error("space.periodic", text("expected a period of whole spacings along {}, found {:.9g} spacings of {} m; "
                                               "change space.high",
                                               names[axis], n, space.spacing));
        if (period < least)
            rules.error("space.periodic", text("expected a period of at least {:.6g} m along {} (two supports and skin, so "
                                               "that no particle meets itself), found {:.6g} m; widen it",
                                               least, names[axis], period));
    }
    if (scene.accuracy.kernel == Kernel::CubicSpline && space.h > 1.25)
        rules.warning("space.h", text("with the cubic spline, soil at rest swings in rows of alternating velocity above h = 1.25 "
                                      "spacings, and pairs up above 1.5; found {}. Use 1.2, or a wendland kernel, which does neither{}",
                                      space.h, scene.accuracy.hourglass > 0 ? "" : "; or accuracy.hourglass = 0.1, against the rows"));
}

void check_bodies(const Scene& scene, Rules& rules)
{
    const bool flat = scene.dimensions == 2;
    if (scene.bodies.empty()) rules.error("body", "expected at least one [[body]], found none");
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const Body& body = scene.bodies[b];
        const std::string key = text("body.{}", b);
        check_shape(scene, body.shape, key, rules);
        if (flat && body.velocity.y != 0)
            rules.error(key + ".velocity", text("expected no velocity along y in 2-D, found {}; set it to 0", body.velocity.y));
        if (rests(body)) {
            const auto& g = scene.effects.gravity;
            if (!g || !(g->z < 0))
                rules.error(key + ".stress",
                            text("expected gravity that points down for a stress \"at rest\", found {}; let effects.gravity "
                                 "be [0, 0, -9.81] or the stress \"none\"",
                                 g ? text("[{}, {}, {}]", g->x, g->y, g->z) : std::string("none")));
        }
    }
    for (std::size_t w = 0; w < scene.walls.size(); ++w) {
        const std::string key = text("wall.{}", w);
        const Shape& shape = scene.walls[w].shape;
        check_shape(scene, shape, key, rules);
        if (std::holds_alternative<Ground>(shape)) continue; // as deep as soil can feel it
        const Box box = bounds(shape);
        double thickness = std::min(box.high.x - box.low.x, box.high.z - box.low.z);
        if (!flat) thickness = std::min(thickness, box.high.y - box.low.y);
        if (thickness < scene.support() * (1 - 1e-9))
            rules.warning(key, text("the wall is {:.6g} m thick, thinner than the support of {:.6g} m: soil at its face feels "
                                    "only a part of it; make it {} spacings thick",
                                    thickness, scene.support(), int(std::ceil(2 * scene.space.h - 1e-9))));
    }
}

void check_inside(const Scene& scene, Rules& rules)
{
    const Space& space = scene.space;
    if (!space.low || !space.high) return;
    const auto outside = [&](const Shape& shape, const std::string& key, bool only_periodic) {
        const Box box = bounds(shape);
        for (int axis = 0; axis < 3; ++axis) {
            if ((axis == 1 && scene.dimensions == 2) || (only_periodic && !space.periodic[std::size_t(axis)])) continue;
            const double low = at(*space.low, axis), high = at(*space.high, axis),
                         slack = std::max(1e-6 * space.spacing, rounding_of(std::max(std::abs(low), std::abs(high))));
            if (at(box.low, axis) < low - slack || at(box.high, axis) > high + slack)
                return rules.error(key,
                                   text("expected it inside space.low .. space.high = {:.6g} .. {:.6g} m along {}, found {:.6g} "
                                        ".. {:.6g} m; move it or widen the space",
                                        low, high, "xyz"[axis], at(box.low, axis), at(box.high, axis)),
                                   "space.low");
        }
    };
    for (std::size_t b = 0; b < scene.bodies.size(); ++b)
        outside(scene.bodies[b].shape, text("body.{}.{}", b, name_of(scene.bodies[b].shape)), false);
    for (std::size_t w = 0; w < scene.walls.size(); ++w)
        outside(scene.walls[w].shape, text("wall.{}.{}", w, name_of(scene.walls[w].shape)), true);
}

void check_edges(const Scene& scene, Rules& rules)
{
    if (!scene.effects.gravity || !(scene.effects.gravity->z < 0) || scene.walls.empty()) return;
    const double dx = scene.space.spacing, reach = scene.support();
    const bool flat = scene.dimensions == 2;
    const Nearby walls = nearby(scene.walls, scene.dimensions), bodies = nearby(scene.bodies, scene.dimensions);
    const auto in_wall = [&](Vector x) {
        return walls.any(x, [&](std::size_t w) { return signed_distance(scene.walls[w].shape, x, scene.dimensions) <= 0; });
    };
    const auto in_body = [&](Vector x) {
        return bodies.any(x, [&](std::size_t k) { return contains(scene.bodies[k].shape, x, scene.dimensions); });
    };
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (std::holds_alternative<Release>(scene.bodies[b].shape)) continue; // its rim is the ground's
        const Box body = bounds(scene.bodies[b].shape);
        const double floor = body.low.z - 0.5 * dx, foot = body.low.z + 0.5 * dx;
        std::string sides;
        for (const int axis : {0, 1})
            for (const bool high : {false, true}) {
                if ((axis == 1 && flat) || scene.space.periodic[std::size_t(axis)]) continue;
                const double low_end = axis == 0 ? body.low.x : body.low.y, high_end = axis == 0 ? body.high.x : body.high.y;
                const double edge = high ? high_end : low_end, out = high ? 1 : -1;
                const auto at = [&](double beyond, double along, double z) {
                    const double x = edge + out * beyond;
                    return axis == 0 ? Vector{x, body.low.y + along * (body.high.y - body.low.y), z}
                                     : Vector{body.low.x + along * (body.high.x - body.low.x), x, z};
                };
                bool open = false;
                for (const double along : {0.5, 0.25, 0.75}) {
                    if (!in_wall(at(-0.5 * dx, along, floor)) || in_wall(at(reach, along, floor))) continue;
                    bool held = false;
                    for (double beyond = 0.5 * dx; beyond <= reach && !held; beyond += 0.5 * dx) {
                        const Vector x = at(beyond, along, foot);
                        held = in_wall(x) || in_body(x);
                    }
                    open = open || !held;
                }
                if (open) sides += fmt::format("{}{} {}", sides.empty() ? "" : ", ", high ? "high" : "low", axis == 0 ? "x" : "y");
            }
        if (!sides.empty())
            rules.warning(text("body.{}", b), text("the soil stands at an open edge of its floor (at {}): what runs over it falls without "
                                                   "end; make the floor wider, or stand a wall there",
                                                   sides));
    }
}

} // namespace kuzure::scene
