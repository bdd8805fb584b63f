#pragma once
// Generated ground, drawn in many ways: one ground and soil from a seed, and the same again split into other pieces, joined, with the
// period's faces elsewhere, mirrored, turned, with another list skin. What is drawn otherwise must act alike (drawing_test.cpp).
//
// Ground is either a profile in x-z (slopes, steps, flats; drawn out along y in 3-D) or a heap of bricks on the lattice. Soil is placed by
// the test: its bodies are boxes far from any ground that only say how many particles there are.
// Beyond 400 lines: the generator of ground and what is asked of it belong together.
#include "solver/scene/check.hpp"
#include "tests/validation/case.hpp"
#include <random>

namespace kuzure::validation {

constexpr double spacing = 0.05; // m

/// Numbers from a seed, the same with every library.
class Draw {
public:
    explicit Draw(unsigned seed) : g_(seed) { g_.discard(8); }
    double between(double a, double b) { return a + (b - a) * double(g_() >> 11) * 0x1p-53; }
    int whole(int a, int b) { return a + int(g_() % std::uint64_t(b - a + 1)); }
    bool chance(double p) { return between(0, 1) < p; }

private:
    std::mt19937_64 g_;
};

// ---- mirror, turn, shift ---------------------------------------------------------------------------------------------
/// x -> -x if mirrored, then a quarter turn about z, then a shift.
struct Motion {
    bool mirrored = false, turned = false;
    Vector shift{};
    Vector turn(Vector a) const
    {
        if (mirrored) a.x = -a.x;
        return turned ? Vector{-a.y, a.x, a.z} : a;
    }
    Vector operator()(Vector x) const { return turn(x) + shift; }
    Stress turn(Stress s) const
    {
        if (mirrored) s.xy = -s.xy, s.xz = -s.xz;
        return turned ? Stress{s.yy, s.xx, s.zz, -s.xy, s.xz, -s.yz} : s;
    }
    /// Polygons are not turned.
    scene::Shape operator()(scene::Shape shape) const
    {
        if (auto* b = std::get_if<scene::Box>(&shape)) {
            const Vector a = (*this)(b->low), c = (*this)(b->high);
            b->low = {std::min(a.x, c.x), std::min(a.y, c.y), a.z}, b->high = {std::max(a.x, c.x), std::max(a.y, c.y), c.z};
        } else if (auto* c = std::get_if<scene::Cylinder>(&shape)) c->base = (*this)(c->base);
        else if (auto* s = std::get_if<scene::Sphere>(&shape)) s->center = (*this)(s->center);
        else {
            auto& p = std::get<scene::Polygon>(shape);
            for (auto& corner : p.points) {
                const Vector to = (*this)({corner[0], 0, corner[1]});
                corner = {to.x, to.z};
            }
            p.y = {p.y[0] + shift.y, p.y[1] + shift.y};
        }
        return shape;
    }
};

// ---- ground as a profile -----------------------------------------------------------------------------------------------
using Corner = std::array<double, 2>;

/// Heights over x, piecewise straight; two corners at one x are a step. What lies left and right of `border` may be of two surfaces.
struct Profile {
    std::vector<Corner> top;
    double foot, border; // m
    scene::Wall left, right;
    double depth = 0; // m along y; 0 in 2-D
    double height(double x) const
    {
        double z = -1e9;
        for (std::size_t k = 0; k + 1 < top.size(); ++k) {
            const auto &a = top[k], &b = top[k + 1];
            if (x < a[0] || x > b[0]) continue;
            z = std::max(z, b[0] > a[0] ? a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]) : std::max(a[1], b[1]));
        }
        return z;
    }
};
inline double snapped(double x) { return std::round(x / spacing) * spacing; }

inline Profile draw_profile(Draw& draw, double width, bool periodic)
{
    Profile p;
    p.foot = -6 * spacing;
    double x = 0, z = 0;
    p.top.push_back({0, 0});
    while (x < width) {
        const double next = std::min(snapped(x + draw.whole(3, 8) * spacing), width);
        const int kind = draw.whole(0, 3);
        const bool last = next > width - 2 * spacing;
        if (kind == 0 && x > 0) { // a step
            const double to = draw.whole(-2, 3) * spacing;
            if (to != z) z = to, p.top.push_back({x, z});
        }
        double to = z; // flat
        if (kind == 1) to = draw.between(-2, 3) * spacing;
        if (kind == 2) to = draw.whole(-2, 3) * spacing;
        x = last ? width : next;
        if (last && periodic) to = 0;
        z = to;
        p.top.push_back({x, z});
    }
    return p;
}
/// One line from the foot to the top; the ground left and right of it is drawn apart.
struct Divider {
    double foot, top; // x, m
};
inline std::vector<scene::Wall> pieces(const Profile& p, const std::vector<Divider>& dividers, Draw& draw, bool as_boxes)
{
    std::vector<scene::Wall> walls;
    const auto lattice = [](double a) { return std::fabs(a - snapped(a)) < 1e-9; };
    const auto add = [&](std::vector<Corner> points, double y0, double y1) {
        scene::Wall wall = 0.5 * (points[0][0] + points[1][0]) < p.border ? p.left : p.right;
        bool box = as_boxes && points.size() == 4 && points[0][0] == points[3][0] && points[1][0] == points[2][0] &&
                   points[2][1] == points[3][1] && points[2][1] > points[1][1];
        for (const auto& c : points) box = box && lattice(c[0]) && lattice(c[1]);
        if (box) wall.shape = scene::Box{{points[0][0], y0, points[0][1]}, {points[2][0], y1, points[2][1]}};
        else wall.shape = scene::Polygon{points, {y0, y1}};
        walls.push_back(wall);
    };
    for (std::size_t k = 0; k + 1 < dividers.size(); ++k) {
        const auto &a = dividers[k], &b = dividers[k + 1];
        std::vector<Corner> points{{a.foot, p.foot}, {b.foot, p.foot}};
        // corners of the top from b back to a; at a step in a divider the near side's
        std::vector<Corner> top;
        for (const auto& c : p.top)
            if (c[0] > a.top + 1e-9 && c[0] < b.top - 1e-9) top.push_back(c);
        const auto side = [&](double x, double inwards) { return Corner{x, p.height(x + inwards * 1e-7)}; };
        const auto exactly = [&](double x, double inwards) { // a corner of the profile where the divider is
            Corner c = side(x, inwards);
            for (const auto& q : p.top)
                if (std::fabs(q[0] - x) < 1e-9 && std::fabs(q[1] - c[1]) < 1e-5) c = q;
            return c;
        };
        const auto end = [&](double x, double inwards) {
            for (const auto& q : p.top)
                if (std::fabs(q[0] - x) < 1e-9) return exactly(x, inwards);
            return Corner{x, p.height(x)};
        };
        points.push_back(end(b.top, -1));
        points.insert(points.end(), top.rbegin(), top.rend());
        points.push_back(end(a.top, 1));
        double lowest = 1e9;
        for (std::size_t q = 2; q < points.size(); ++q) lowest = std::min(lowest, points[q][1]);
        std::vector<double> y{0, p.depth};
        if (p.depth > 0 && draw.chance(0.5)) y = {0, snapped(draw.between(0.2, 0.8) * p.depth), p.depth};
        const bool upright = a.foot == a.top && b.foot == b.top;
        for (std::size_t s = 0; s + 1 < y.size(); ++s) {
            if (upright && dividers.size() > 2 && draw.chance(0.5)) {
                double level = draw.between(p.foot + 0.6 * spacing, lowest - 0.6 * spacing);
                if (draw.chance(0.5)) level = snapped(level);
                if (level < p.foot + 0.5 * spacing || level > lowest - 0.5 * spacing) level = p.foot + 2 * spacing;
                add({{a.foot, p.foot}, {b.foot, p.foot}, {b.foot, level}, {a.foot, level}}, y[s], y[s + 1]);
                auto upper = points;
                upper[0][1] = upper[1][1] = level;
                add(upper, y[s], y[s + 1]);
            } else add(points, y[s], y[s + 1]);
        }
    }
    return walls;
}
/// The ground in as few pieces as its surfaces allow, or in many.
inline std::vector<scene::Wall> draw_ground(const Profile& p, Draw& draw, bool many, double seam = 0)
{
    const double width = p.top.back()[0];
    std::vector<Divider> dividers{{0, 0}, {width, width}};
    const bool two = p.border > 0 && p.border < width;
    if (two) dividers.push_back({p.border, p.border});
    if (seam > 0 && !(two && std::fabs(seam - p.border) < 1e-9)) dividers.push_back({seam, seam});
    if (many)
        for (int k = draw.whole(1, 6); k > 0; --k) {
            double top = draw.between(2 * spacing, width - 2 * spacing), foot = top;
            const int kind = draw.whole(0, 2);
            if (kind == 0) foot = top = snapped(top);
            if (kind == 1) foot = top + draw.between(-1.5, 1.5) * spacing;
            bool inside = true; // and clear of the others
            for (double t = 0.02; t < 0.99; t += 0.02)
                inside = inside && p.foot + t * (p.height(top) - p.foot) < p.height(foot + t * (top - foot)) - 0.02 * spacing;
            if (!inside) foot = top;
            const bool clear = std::ranges::all_of(dividers, [&](const Divider& c) {
                const double a = c.top - top, b = c.foot - foot;
                return a * b > 0 && std::min(std::fabs(a), std::fabs(b)) > 1.2 * spacing;
            });
            const bool near_corner = std::ranges::any_of(
                p.top, [&](const Corner& c) { return std::fabs(c[0] - top) < 0.05 * spacing && std::fabs(c[0] - top) > 1e-9; });
            if (clear && !near_corner) dividers.push_back({foot, top});
        }
    std::ranges::sort(dividers, {}, [](const Divider& c) { return c.top; });
    auto walls = pieces(p, dividers, draw, many);
    if (many) // in any order
        for (std::size_t k = walls.size(); k > 1; --k) std::swap(walls[k - 1], walls[std::size_t(draw.whole(0, int(k) - 1))]);
    return walls;
}

// ---- ground of bricks --------------------------------------------------------------------------------------------------
/// Columns of bricks a few spacings wide, of whole spacings' height over the foot.
struct Bricks {
    int nx, ny, wide;         // columns along x and y (1 in 2-D), spacings
    int foot = -5;            // spacings
    std::vector<int> heights; // of the tops, spacings
    scene::Wall kind;
    int dimensions;
    int top(int i, int j) const { return heights[std::size_t(j * nx + i)]; }
};
inline Bricks draw_bricks(Draw& draw, int dimensions, bool periodic)
{
    Bricks b;
    b.dimensions = dimensions, b.wide = dimensions == 3 ? 4 : draw.whole(3, 5);
    b.nx = dimensions == 3 ? 4 : 8, b.ny = dimensions == 3 ? 3 : 1;
    for (int k = 0; k < b.nx * b.ny; ++k) b.heights.push_back(draw.chance(0.6) ? 0 : draw.whole(-1, 3));
    if (periodic && draw.chance(0.5)) b.heights.back() = b.heights.front();
    return b;
}
/// Splits a block until every piece is full or empty, and sometimes further.
inline void split(const Bricks& b, std::array<int, 3> low, std::array<int, 3> high, Draw& draw, bool many, std::vector<scene::Wall>& walls)
{
    bool full = true, empty = true;
    for (int i = low[0]; i < high[0]; ++i)
        for (int j = low[1]; j < high[1]; ++j) {
            const int top = b.top(i / b.wide, b.dimensions == 3 ? j / b.wide : 0);
            full = full && top >= high[2], empty = empty && top <= low[2];
        }
    if (empty) return;
    const int size = (high[0] - low[0]) * (high[2] - low[2]);
    if (full && (!many || size < 8 || draw.chance(0.4))) {
        scene::Wall wall = b.kind;
        wall.shape =
            scene::Box{{low[0] * spacing, low[1] * spacing, low[2] * spacing}, {high[0] * spacing, high[1] * spacing, high[2] * spacing}};
        walls.push_back(wall);
        return;
    }
    // where: few pieces at the columns' sides, many anywhere
    for (int tries = 0;; ++tries) {
        const int axis = many || tries > 20 ? draw.whole(0, 2) : tries % 2 ? 0 : 1;
        if (axis == 1 && b.dimensions == 2) continue;
        if (high[std::size_t(axis)] - low[std::size_t(axis)] < 2) continue;
        int at = draw.whole(low[std::size_t(axis)] + 1, high[std::size_t(axis)] - 1);
        if (!many && axis < 2) at = at / b.wide * b.wide;
        if (at <= low[std::size_t(axis)]) continue;
        auto middle_high = high, middle_low = low;
        middle_high[std::size_t(axis)] = middle_low[std::size_t(axis)] = at;
        split(b, low, middle_high, draw, many, walls), split(b, middle_low, high, draw, many, walls);
        return;
    }
}
inline std::vector<scene::Wall> draw_ground(const Bricks& b, Draw& draw, bool many, double seam = 0)
{
    std::vector<scene::Wall> walls;
    const int highest = *std::ranges::max_element(b.heights);
    const int between = int(std::round(seam / spacing)), wide = b.nx * b.wide, deep = b.dimensions == 3 ? b.ny * b.wide : 1;
    if (between > 0) split(b, {0, 0, b.foot}, {between, deep, highest}, draw, many, walls);
    split(b, {between, 0, b.foot}, {wide, deep, highest}, draw, many, walls);
    return walls;
}

// ---- a whole scene -----------------------------------------------------------------------------------------------------
/// One way to draw the same.
struct Drawing {
    std::vector<scene::Wall> walls;
    Motion motion{};
    double skin = 0.2;
    double low = 0; // m, where the period's faces lie along x
    std::string what = "the fewest pieces";
    double cfl = 1;
};
struct Generated {
    unsigned seed;
    int dimensions;
    bool periodic;
    double width, depth; // m
    double foot, top;    // m, of the ground
    scene::Surface surface;
    bool mixed = false;            // two surfaces
    std::vector<Drawing> drawings; // the first is the measure
    std::string what;
};

/// How many wall points there are, and where, rounded to a thousandth of a spacing.
inline Vector middle(const Generated& g, const Drawing& d)
{
    Vector sum{};
    double points = 0;
    for (const auto& w : d.walls) {
        const scene::Lattice lattice(w.shape, spacing, g.dimensions);
        for (std::int64_t k = 0; k < lattice.size(); ++k) sum = sum + lattice.position(k), points += 1;
    }
    const auto rounded = [](double x) { return std::round(1e3 * x / spacing); };
    return {rounded(sum.x), rounded(points), rounded(sum.z)};
}
inline scene::Wall wall_of(int surface, double friction_angle)
{
    return {scene::Box{}, scene::Surface(surface), surface == 2 ? friction_angle : 0};
}
inline Generated generate(unsigned seed)
{
    Draw draw(seed);
    Generated g;
    g.seed = seed, g.dimensions = seed % 3 == 2 ? 3 : 2, g.periodic = draw.chance(0.5);
    const int surface = int(seed / 3 % 3);
    g.surface = scene::Surface(surface);
    const bool bricks = draw.chance(g.dimensions == 3 ? 0.7 : 0.4);
    const double friction = draw.between(0.2, 0.6);
    const auto draw_all = [&](const auto& ground) {
        g.drawings.push_back({draw_ground(ground, draw, false)});
        g.drawings.push_back({draw_ground(ground, draw, true), {}, draw.between(0.05, 0.5), 0, "cut"});
        const bool turned = g.dimensions == 3 && bricks && draw.chance(0.5);
        Drawing again{{}, {}, draw.between(0.05, 0.5), 0, "cut"};
        if (g.periodic)
            again.low = draw.whole(1, int(g.width / spacing + 0.5) - 1) * spacing, again.what += ", faces of the period elsewhere";
        else if (turned) again.motion.turned = true, again.what += ", turned";
        else again.motion.mirrored = true, again.what += ", mirrored";
        again.walls = draw_ground(ground, draw, true, again.low);
        for (auto& w : again.walls) {
            const auto bounds = scene::bounds(w.shape);
            const Motion beyond{.shift = {bounds.low.x < again.low - 1e-9 ? g.width : 0, 0, 0}};
            w.shape = again.motion(beyond(w.shape));
        }
        // A lattice point on a face belongs to the side of greater coordinates: mirrored, such ground is another.
        if (again.motion.mirrored && middle(g, again) != Motion{.mirrored = true}.turn(middle(g, g.drawings[0])))
            again = g.drawings[1], again.skin = 0.01;
        g.drawings.push_back(again);
    };
    if (bricks) {
        Bricks b = draw_bricks(draw, g.dimensions, g.periodic);
        b.kind = wall_of(surface, friction);
        g.width = b.nx * b.wide * spacing, g.depth = g.dimensions == 3 ? b.ny * b.wide * spacing : 0;
        g.foot = b.foot * spacing, g.top = *std::ranges::max_element(b.heights) * spacing;
        draw_all(b);
    } else {
        g.width = draw.whole(20, 30) * spacing, g.depth = g.dimensions == 3 ? 8 * spacing : 0;
        Profile p = draw_profile(draw, g.width, g.periodic);
        p.depth = g.depth, p.left = p.right = wall_of(surface, friction), p.border = 0;
        if (draw.chance(0.25)) p.right = wall_of((surface + 1) % 3, friction), p.border = snapped(0.5 * g.width), g.mixed = true;
        g.foot = p.foot, g.top = 0;
        for (const auto& c : p.top) g.top = std::max(g.top, c[1]);
        draw_all(p);
    }
    g.what = fmt::format("seed {}: {}-D, {}{}, {}{}", seed, g.dimensions, bricks ? "bricks" : "profile", g.periodic ? ", periodic" : "",
                         surface == 0   ? "rough"
                         : surface == 1 ? "smooth"
                                        : "Coulomb",
                         g.mixed ? " and another surface" : "");
    return g;
}

// ---- soil, placed by hand ----------------------------------------------------------------------------------------------
struct Placed {
    std::vector<Vector> x, v;
    std::vector<Stress> stress;
};
/// Distance from the ground and its images, m.
inline double above(const Generated& g, Vector x)
{
    double least = 1e9;
    for (const auto& w : g.drawings[0].walls)
        for (int turn = -int(g.periodic); turn <= int(g.periodic); ++turn)
            least = std::min(least, scene::signed_distance(w.shape, x - Vector{turn * g.width, 0, 0}, g.dimensions));
    return least;
}
/// The scene of a drawing, with room for so many particles.
inline Scene scene_of(const Generated& g, const Drawing& d, std::size_t particles, SceneText t)
{
    t.dimensions = g.dimensions, t.spacing = spacing, t.h = 1.3;
    const double far = 100, e = spacing;
    if (g.periodic) t.space = fmt::format("low = [{}, -50, -50]\nhigh = [{}, 50, 250]\nperiodic = [\"x\"]", d.low, d.low + g.width);
    t.bodies = box("body", {d.low, 0, far}, {d.low + e, e, far + double(particles) * e});
    t.accuracy = fmt::format("skin = {}\ncfl = {}", d.skin, d.cfl);
    Scene s = t.scene();
    s.walls = d.walls;
    for (const auto& issue : scene::check(s))
        if (issue.severity == scene::Severity::Error) ADD_FAILURE() << g.what << ", " << d.what << ": " << scene::in_words(issue);
    return s;
}
inline RunOptions placed(const Generated& g, const Drawing& d, const Placed& soil)
{
    RunOptions options;
    options.guard = false; // what walls give is judged by the tests
    options.initial = [&g, &d, &soil](Particles& p) {
        for (Index i = 0; i < p.size(); ++i) {
            const auto k = std::size_t(p[field::id][i]);
            Vector x = d.motion(soil.x[k]);
            if (g.periodic) x.x -= std::floor((x.x - d.low) / g.width) * g.width;
            set_position(p, i, x), set_velocity(p, i, d.motion.turn(soil.v[k])), set_stress(p, i, d.motion.turn(soil.stress[k]));
        }
    };
    return options;
}

} // namespace kuzure::validation

namespace kuzure::validation {

// ---- what is compared ----------------------------------------------------------------------------------------------------
/// Largest difference from the first drawing over the largest value, of each.
struct OneStep {
    double acceleration = 0, later_acceleration = 0, strain_rate = 0;
    double largest() const { return std::max({acceleration, later_acceleration, strain_rate}); }
};
/// Soil beside the ground, some of it a little inside, with any velocities and stresses.
inline Placed soil_beside(const Generated& g, Draw& draw)
{
    Placed p;
    const int nx = int(std::round(g.width / spacing)), ny = g.dimensions == 3 ? int(std::round(g.depth / spacing)) : 1;
    const int low = int(std::floor(g.foot / spacing)), high = int(std::ceil(g.top / spacing)) + 4;
    const int beyond = g.periodic ? 0 : 3;
    for (int k = low; k < high; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = -beyond; i < nx + beyond; ++i) {
                const auto jitter = [&] { return draw.between(-0.3, 0.3); };
                const Vector x{(i + 0.5 + jitter()) * spacing, g.dimensions == 3 ? (j + 0.5 + jitter()) * spacing : 0,
                               (k + 0.5 + jitter()) * spacing};
                const double distance = above(g, x) / spacing;
                if (distance < (draw.chance(0.1) ? -0.6 : 0.25) || distance > 4 || draw.chance(g.dimensions == 3 ? 0.6 : 0.1)) continue;
                const auto u = [&] { return draw.between(-1, 1); };
                const bool deep = g.dimensions == 3;
                p.x.push_back(x);
                p.v.push_back({std::sin(3 * x.z) + 0.1 * u(), deep ? 0.5 * u() : 0, std::cos(2 * x.x) + 0.1 * u()});
                p.stress.push_back(Stress{-1 + u(), -1 + u(), -1 + u(), deep ? u() : 0, deep ? u() : 0, u()});
                p.stress.back() = 3e3 * p.stress.back();
            }
    return p;
}
/// Accelerations at the start and after one step, and density and stress over it, particle by particle.
inline OneStep one_step(const Generated& g, const Placed& soil)
{
    SceneText t;
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1 }", t.young = 2e6;
    const double dt = 0.5 * 1.3 * spacing / t.p_wave();
    t.time = fmt::format("step = {}", dt), t.end = 10 * dt;
    struct Found {
        std::vector<Vector> a, later;
        std::vector<Stress> stress;
        std::vector<double> density;
    };
    const auto run = [&](const Drawing& d) {
        const std::size_t n = soil.x.size();
        Found f{std::vector<Vector>(n), std::vector<Vector>(n), std::vector<Stress>(n), std::vector<double>(n)};
        Simulation sim(Comm::world(), scene_of(g, d, n, t), placed(g, d, soil));
        const auto id = [&](Index i) { return std::size_t(sim.particles()[field::id][i]); };
        each(sim, [&](Index i) { f.a[id(i)] = sim.particles()[field::acceleration][i]; });
        sim.step();
        each(sim, [&](Index i) {
            f.later[id(i)] = sim.particles()[field::acceleration][i], f.stress[id(i)] = stress(sim, i);
            f.density[id(i)] = sim.particles()[field::density][i];
        });
        return f;
    };
    const Found measure = run(g.drawings[0]);
    double a = 0, later = 0, s = 0, rho = 0;
    const auto norm = [](const Stress& s) { return std::sqrt(contract(s, s)); };
    for (std::size_t k = 0; k < soil.x.size(); ++k) {
        a = std::max(a, length(measure.a[k])), later = std::max(later, length(measure.later[k]));
        s = std::max(s, norm(measure.stress[k] - soil.stress[k])), rho = std::max(rho, std::fabs(measure.density[k] - t.density));
    }
    OneStep worst;
    for (std::size_t q = 1; q < g.drawings.size(); ++q) {
        const Drawing& d = g.drawings[q];
        const Found f = run(d);
        for (std::size_t k = 0; k < soil.x.size(); ++k) {
            const auto note = [](double& to, double is) { to = is <= to ? to : is; };
            note(worst.acceleration, length(f.a[k] - d.motion.turn(measure.a[k])) / a);
            note(worst.later_acceleration, length(f.later[k] - d.motion.turn(measure.later[k])) / later);
            note(worst.strain_rate, norm(f.stress[k] - d.motion.turn(measure.stress[k])) / s);
            note(worst.strain_rate, std::fabs(f.density[k] - measure.density[k]) / rho);
        }
    }
    return worst;
}

/// A block of soil above the ground, a lattice of its own.
inline Placed block_above(const Generated& g, Draw& draw, bool moving = true)
{
    const int nx = draw.whole(5, 9), nz = draw.whole(3, 5), ny = g.dimensions == 3 ? 4 : 1;
    const double from = (g.periodic ? 0 : 2 * spacing) + draw.between(0, g.width - (nx + (g.periodic ? 0 : 4)) * spacing);
    const double y = g.dimensions == 3 ? 0.5 * (g.depth - ny * spacing) : 0;
    double foot = -1e9; // the ground's highest point below the block
    for (double x = from - spacing; x < from + (nx + 1) * spacing; x += 0.05 * spacing)
        for (double at = y - spacing; at < y + (ny + 1) * spacing; at += g.dimensions == 3 ? 0.5 * spacing : 1e9) {
            double z = g.top;
            while (z > g.foot && above(g, {x, at, z}) > 0.01 * spacing) z -= 0.05 * spacing;
            foot = std::max(foot, z);
        }
    Placed p;
    const Vector v{draw.between(-1, 1), g.dimensions == 3 ? draw.between(-0.3, 0.3) : 0, draw.between(-0.5, 0)};
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                p.x.push_back({from + (i + 0.5) * spacing, g.dimensions == 3 ? y + (j + 0.5) * spacing : 0, foot + (k + 0.55) * spacing});
                p.v.push_back(moving ? v : Vector{});
                p.stress.push_back({});
            }
    return p;
}
struct Motions {
    double apart = 0;            // largest difference of a position from the first drawing's, over the block's size
    double taken = 0, given = 0; // most and least work taken by walls, over the largest energy met till then
    double moved = 0;            // m, farthest way up or down in the first drawing
};
/// Positions at the end of a run of soil that does not yield.
inline Motions motion(const Generated& g, const Placed& soil, double end, SceneText t)
{
    t.effects = "gravity = [0.0, 0.0, -9.81]\nviscosity = { alpha = 0.1 }", t.end = end;
    Motions worst;
    std::vector<Vector> measure;
    Vector low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
    for (const Vector& x : soil.x) {
        low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
        high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
    }
    const double size = length(high - low);
    for (const Drawing& d : g.drawings) {
        Simulation sim(Comm::world(), scene_of(g, d, soil.x.size(), t), placed(g, d, soil));
        double most = 1e-300;
        const auto observe = [&] {
            const Ledger l = sim.ledger();
            most = std::max(most, l.state.kinetic + l.state.elastic + std::max(0.0, -l.state.potential));
            worst.taken = std::max(worst.taken, l.dissipated.wall / most), worst.given = std::min(worst.given, l.dissipated.wall / most);
        };
        observe();
        while (!sim.finished()) sim.step(), observe();
        std::vector<Vector> at(soil.x.size());
        each(sim, [&](Index i) { at[std::size_t(sim.particles()[field::id][i])] = position(sim, i); });
        if (measure.empty()) {
            measure = at;
            for (std::size_t k = 0; k < at.size(); ++k) worst.moved = std::max(worst.moved, std::fabs(at[k].z - soil.x[k].z));
            continue;
        }
        for (std::size_t k = 0; k < at.size(); ++k) {
            Vector off = at[k] - d.motion(measure[k]);
            if (g.periodic) off.x -= std::round(off.x / g.width) * g.width;
            worst.apart = std::max(worst.apart, length(off) / size);
        }
    }
    return worst;
}

} // namespace kuzure::validation
