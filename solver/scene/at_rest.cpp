#include "solver/scene/at_rest.hpp"
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
            if (holds(w.shape, at, scene.dimensions, tolerance)) return t - end > 2.5 * step ? t - end : 0;
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

/// True if a stack rests on another at x, its foot above or below the other's top (m). Cells end at a box's faces; at other shapes' they
/// end up to half a spacing before or behind, and a thin wall of such a shape may stand in what remains.
bool Columns::rests(int upper, double foot, int lower, double top, Vector x) const
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
        filling_.for_each_soil_stack_in(region, [&](const Lattice::Stack& s, int b) {
            const double part = share(s.x - at.x) * (scene_.dimensions == 2 ? 1 : share(s.y - at.y));
            if (b == body && part == 1 && s.foot < x.z && s.top > x.z) own.top = s.top;
            else if (part > nothing_) others.push_back({b, s.foot, s.top, part});
        });
    });
    parts.push_back(own);
    std::sort(others.begin(), others.end(), [](const Part& a, const Part& b) { return a.foot < b.foot; });
    for (Part p : others) {
        const auto carries = [&](const Part& q) { return rests(p.body, p.foot, q.body, q.top, x); };
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

std::string no_closed_form(const Scene& scene, const Filling& filling)
{
    const auto rests = [](const Body& b) { return b.stress == InitialStress::AtRest; };
    if (std::none_of(scene.bodies.begin(), scene.bodies.end(), rests)) return {};
    const Effects& effects = scene.effects;
    if (const auto& g = effects.gravity; !g || g->x != 0 || g->y != 0 || !(g->z < 0)) return "gravity does not point straight down";
    if (effects.pore_pressure)
        for (const auto& corner : effects.pore_pressure->table)
            if (corner[1] != effects.pore_pressure->table.front()[1]) return "the water table is not level";

    const Columns columns(scene, filling);
    const double dx = scene.space.spacing, nothing = least_share(scene, filling), far = std::numeric_limits<double>::infinity();
    const bool flat = scene.dimensions == 2;
    std::string why;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (!rests(scene.bodies[b])) continue;
        filling.for_each_stack_of(int(b), {{-far, -far, -far}, {far, far, far}}, [&](const Lattice::Stack& s) {
            if (!why.empty()) return;
            const Vector x{s.x, s.y, s.foot + 0.5 * dx};
            const double surface = columns.above(x, int(b)).surface;
            // The next columns along x and y, at the heights of this one. Faces of shapes may end half a spacing apart on two lattices.
            const auto compare = [&](const Box& region) {
                filling.for_each_soil_stack_in(region, [&](const Lattice::Stack& n, int body) {
                    const double other = columns.above({n.x, n.y, n.foot + 0.5 * dx}, body).surface;
                    if (why.empty() && std::abs(other - surface) > 0.75 * dx)
                        why = fmt::format(
                            "the ground is not level: its surface is at z = {:.6g} m above ({:.6g}, {:.6g}) and at {:.6g} m above "
                            "({:.6g}, {:.6g})",
                            surface, x.x, x.y, other, n.x, n.y);
                });
            };
            const double low = s.foot + 0.5 * dx, high = s.top - 0.5 * dx;
            // Sideways it leans on soil or on a wall; a wall just out of reach it will lean on when it has spread.
            for (const Vector d : {Vector{1, 0, 0}, Vector{-1, 0, 0}, Vector{0, 1, 0}, Vector{0, -1, 0}}) {
                if (flat && d.y != 0) continue;
                const Vector first = x + 0.01 * dx * d, second = x + 3 * dx * d, beside = x + 1.5 * dx * d;
                const double wide = (0.5 - nothing) * dx, wx = d.x == 0 ? wide : 0, wy = d.y == 0 ? wide : 0;
                const auto between = [&](Vector a, Vector b, double from, double to) {
                    return Box{{std::min(a.x, b.x) - wx, std::min(a.y, b.y) - wy, from},
                               {std::max(a.x, b.x) + wx, std::max(a.y, b.y) + wy, to}};
                };
                if (filling.wall_count_in(between(first, second, low, high)) == 0) continue;
                for (double z = low; why.empty() && z < high + 0.5 * dx; z += dx) {
                    if (filling.soil_count_in(between(first, beside, z - wide, z + wide)) > 0) continue;
                    const double gap = gap_to_a_wall(scene, {x.x, x.y, z}, int(b), d);
                    if (gap > 0)
                        why = fmt::format(
                            "at ({:.6g}, {:.6g}, {:.6g}) the soil stands {:.2g} m off the wall beside it, on which it should lean", x.x,
                            x.y, z, gap);
                }
            }
            compare({{x.x + nothing * dx, x.y - nothing * dx, low}, {x.x + 1.25 * dx, x.y + (1 - nothing) * dx, high}});
            if (!flat) compare({{x.x - nothing * dx, x.y + nothing * dx, low}, {x.x + (1 - nothing) * dx, x.y + 1.25 * dx, high}});
        });
    }
    return why;
}

} // namespace kuzure::scene
