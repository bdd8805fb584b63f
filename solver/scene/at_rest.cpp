#include "solver/scene/at_rest.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/loads.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/step_limits.hpp"
#include <algorithm>
#include <fmt/format.h>

namespace kuzure::scene {
namespace {

/// Shares of a column, and distances in spacings, that are nothing but rounding.
double least_share(const Scene& scene, const Filling& filling)
{
    return std::max(1e-6, 4 * rounding_of(Shape(filling.soil_bounds()), scene.dimensions) / scene.space.spacing);
}

/// A stack that a column carries.
struct Part {
    int body;
    double foot, top, share;
};

/// Width (m) of an air gap of less than a spacing between a particle's body and a wall in one direction, or 0.
double gap_to_a_wall(const Scene& scene, Vector x, int body, Vector direction)
{
    const double dx = scene.space.spacing, tolerance = 1e-9 * dx, step = 0.02 * dx;
    const Shape& own = scene.bodies[std::size_t(body)].shape;
    double end = 0; // of its body
    for (double t = 0; t <= end + dx; t += step) {
        const Vector at = x + t * direction;
        if (holds(own, at, scene.dimensions, tolerance)) end = t;
        for (const Wall& w : scene.walls)
            if (w.present && holds(w.shape, at, scene.dimensions, tolerance)) return t - end > 2.5 * step ? t - end : 0;
    }
    return 0;
}

} // namespace

Columns::Columns(const Scene& scene, const Filling& filling) : scene_(scene), filling_(filling), nothing_(least_share(scene, filling)) {}

/// Calls visit(shift) for the shifts (m) by which images across a period come within reach of a point, none the first.
template <class Visit> void Columns::for_each_image(Vector x, double reach, Visit visit) const
{
    const Space& space = scene_.space;
    const auto shifts = [&](int axis, double at, double low, double high, std::array<double, 3>& all) {
        int n = 1;
        all[0] = 0;
        if (!space.periodic[std::size_t(axis)] || (axis == 1 && scene_.dimensions == 2)) return n;
        if (at - reach < low) all[std::size_t(n++)] = high - low;
        if (at + reach > high) all[std::size_t(n++)] = low - high;
        return n;
    };
    std::array<double, 3> along_x{}, along_y{};
    const Vector low = space.low.value_or(Vector{}), high = space.high.value_or(Vector{});
    const int nx = shifts(0, x.x, low.x, high.x, along_x), ny = shifts(1, x.y, low.y, high.y, along_y);
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j) visit(Vector{along_x[std::size_t(i)], along_y[std::size_t(j)], 0});
}

/// True if a stack stands on another at x, its foot above or below the other's top (m). Cells end at a box's faces; at other shapes' they
/// end up to half a spacing before or behind, and a thin wall of such a shape may stand in what remains.
bool Columns::stands_on(int upper, double foot, int lower, double top, Vector x) const
{
    const double dx = scene_.space.spacing, gap = foot - top;
    const auto is_box = [&](int body) { return std::holds_alternative<Box>(scene_.bodies[std::size_t(body)].shape); };
    const double most = lower == upper || (is_box(lower) && is_box(upper)) ? nothing_ * dx : (0.5 + nothing_) * dx;
    if (gap < -(0.5 + nothing_) * dx || gap > most) return false;
    const double half = (0.5 - nothing_) * dx;
    return gap < nothing_ * dx ||
           filling_.wall_count_in({{x.x - half, x.y - half, top - half}, {x.x + half, x.y + half, foot + half}}) == 0;
}

Columns::Above Columns::above(Vector x, int body) const
{
    const double dx = scene_.space.spacing, reach = (1 - nothing_) * dx;
    const double top = filling_.soil_bounds().high.z;
    const auto density = [&](int b) { return scene_.soils[std::size_t(scene_.bodies[std::size_t(b)].soil)].density; };
    const auto share = [&](double distance) {
        const double s = 1 - std::abs(distance) / dx;
        return s > 1 - nothing_ ? 1 : s;
    };
    Part own{body, x.z, x.z + 0.5 * dx, 1};
    std::vector<Part> others, parts;
    for_each_image(x, reach, [&](Vector shift) {
        const Vector at = x + shift;
        const Box region{{at.x - reach, at.y - reach, x.z - (0.5 - nothing_) * dx}, {at.x + reach, at.y + reach, top + dx}};
        filling_.for_each_soil_stack_in(region, [&](const Stack& s, int b) {
            if (!scene_.bodies[std::size_t(b)].present) return;
            const double part = share(s.x - at.x) * (scene_.dimensions == 2 ? 1 : share(s.y - at.y));
            if (b == body && part == 1 && s.foot < x.z && s.top > x.z) own.top = s.top;
            else if (part > nothing_) others.push_back({b, s.foot, s.top, part});
        });
    });
    parts.push_back(own);
    std::sort(others.begin(), others.end(), [](const Part& a, const Part& b) { return a.foot < b.foot; });
    for (Part p : others) {
        const auto carries = [&](const Part& q) { return stands_on(p.body, p.foot, q.body, q.top, x); };
        if (std::none_of(parts.begin(), parts.end(), carries)) continue;
        // Side by side they share the column's width, whose cells on shifted lattices may overlap.
        const double lowest = p.foot + 0.5 * dx;
        double taken = 0;
        for (const Part& q : parts)
            if (q.foot < lowest && lowest < q.top) taken += q.share;
        p.share = std::min(p.share, 1 - taken);
        if (p.share > nothing_) parts.push_back(p);
    }
    Above sum{0, x.z};
    for (const Part& p : parts) {
        sum.mass += p.share * density(p.body) * (p.top - p.foot);
        sum.surface = std::max(sum.surface, p.top);
    }
    return sum;
}

namespace {

/// One stack of soil at rest, and what it stands next to.
struct Bystander {
    const Scene& scene;
    const Filling& filling;
    const Columns& columns;
    double nothing; // as Columns has it
    int body;
    Stack stack;

    double dx() const { return scene.space.spacing; }
    double lowest() const { return stack.foot + 0.5 * dx(); }
    double highest() const { return stack.top - 0.5 * dx(); }

    /// Why the ground is not level from here to the next columns along an axis, or empty.
    std::string step_up_or_down(bool along_x) const
    {
        // At the heights of this stack; across a period from its first column to its last. Faces of shapes may end half a spacing apart
        // on two lattices.
        const double beyond = nothing * dx(), reach = 1.25 * dx(), aside = (1 - nothing) * dx();
        const Vector from{stack.x + (along_x ? beyond : -beyond), stack.y + (along_x ? -beyond : beyond), lowest()};
        const Vector to{stack.x + (along_x ? reach : aside), stack.y + (along_x ? aside : reach), highest()};
        const double surface = columns.above({stack.x, stack.y, lowest()}, body).surface;
        std::string why;
        const auto compare = [&](Vector shift) {
            filling.for_each_soil_stack_in({from + shift, to + shift}, [&](const Stack& n, int other) {
                if (!scene.bodies[std::size_t(other)].present) return;
                const double there = columns.above({n.x, n.y, n.foot + 0.5 * dx()}, other).surface;
                if (why.empty() && std::abs(there - surface) > 0.75 * dx())
                    why =
                        fmt::format("the ground is not level: its surface is at z = {:.6g} m above ({:.6g}, {:.6g}) and at {:.6g} m above "
                                    "({:.6g}, {:.6g})",
                                    surface, stack.x, stack.y, there, n.x, n.y);
            });
        };
        compare({});
        const Space& space = scene.space;
        if (along_x && space.periodic[0] && to.x > space.high->x) compare({space.low->x - space.high->x, 0, 0});
        if (!along_x && space.periodic[1] && to.y > space.high->y) compare({0, space.low->y - space.high->y, 0});
        return why;
    }

    /// Why it does not lean on the wall beside it in one direction, just out of reach, or empty.
    std::string off_the_wall(Vector d) const
    {
        const double wide = (0.5 - nothing) * dx(), wx = d.x == 0 ? wide : 0, wy = d.y == 0 ? wide : 0;
        const auto beside = [&](double reach, double from, double to) {
            const Vector a = Vector{stack.x, stack.y, 0} + 0.01 * dx() * d, b = Vector{stack.x, stack.y, 0} + reach * dx() * d;
            return Box{{std::min(a.x, b.x) - wx, std::min(a.y, b.y) - wy, from}, {std::max(a.x, b.x) + wx, std::max(a.y, b.y) + wy, to}};
        };
        if (filling.wall_count_in(beside(3, lowest(), highest())) == 0) return {};
        for (double z = lowest(); z < highest() + 0.5 * dx(); z += dx()) {
            if (filling.soil_count_in(beside(1.5, z - wide, z + wide)) > 0) continue;
            if (const double gap = gap_to_a_wall(scene, {stack.x, stack.y, z}, body, d); gap > 0)
                return fmt::format("at ({:.6g}, {:.6g}, {:.6g}) the soil stands {:.2g} m off the wall beside it, on which it should lean",
                                   stack.x, stack.y, z, gap);
        }
        return {};
    }
};

} // namespace

std::string no_closed_form(const Scene& scene, const Filling& filling)
{
    if (std::none_of(scene.bodies.begin(), scene.bodies.end(), rests)) return {};
    const Effects& effects = scene.effects;
    if (const auto& g = effects.gravity; !g || g->x != 0 || g->y != 0 || !(g->z < 0)) return "gravity does not point straight down";
    if (loaded_at_start(scene)) return "a load acts from the start";
    if (effects.pore_pressure)
        for (const auto& corner : effects.pore_pressure->table)
            if (corner[1] != effects.pore_pressure->table.front()[1]) return "the water table is not level";

    if (ground_wall(scene)) return "the soil lies on real ground, which is not level";

    const Columns columns(scene, filling);
    const double far = std::numeric_limits<double>::infinity();
    const bool flat = scene.dimensions == 2;
    std::string why;
    for (int b = 0; b < int(scene.bodies.size()); ++b) {
        if (!rests(scene.bodies[std::size_t(b)])) continue;
        filling.for_each_stack_of(b, {{-far, -far, -far}, {far, far, far}}, [&](const Stack& stack) {
            const Bystander s{scene, filling, columns, least_share(scene, filling), b, stack};
            for (const bool along_x : {true, false})
                if (why.empty() && (along_x || !flat)) why = s.step_up_or_down(along_x);
            for (const Vector d : {Vector{1, 0, 0}, Vector{-1, 0, 0}, Vector{0, 1, 0}, Vector{0, -1, 0}})
                if (why.empty() && (d.y == 0 || !flat)) why = s.off_the_wall(d);
        });
        if (!why.empty()) break;
    }
    return why;
}

double time_through_height(const Scene& scene, const Filling& filling)
{
    double c = std::numeric_limits<double>::infinity();
    for (const Body& b : scene.bodies)
        if (rests(b)) c = std::min(c, Material::from(scene.soils[std::size_t(b.soil)]).c_p);
    return filling.soil_height() / c;
}

double steps_to_settle(const Scene& scene, const Filling& filling) { return 8 * time_through_height(scene, filling) / step_at_rest(scene); }

} // namespace kuzure::scene
