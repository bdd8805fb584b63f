#include "solver/scene/motion.hpp"
#include "solver/scene/events.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace kuzure::scene {
namespace {

/// Turn by an angle about an axis through the origin. Rodrigues' formula.
Pose turn_about(Vector axis, double angle)
{
    const Vector n = (1 / length(axis)) * axis;
    const double c = std::cos(angle), s = std::sin(angle);
    const auto row = [&](Vector e) { return c * e + ((1 - c) * dot(n, e)) * n - s * cross(n, e); };
    // The rows of a turn are the axes turned back.
    return {{row({1, 0, 0}), row({0, 1, 0}), row({0, 0, 1})}, {}};
}
/// Seconds at full speed that go as far as a move of `whole` seconds has gone after so many, whose speed grows and ends in `ramp`.
double at_full_speed(double seconds, double whole, double ramp)
{
    if (ramp == 0) return seconds;
    const double left = whole - seconds;
    if (left < ramp) return whole - ramp - left * left / (2 * ramp);
    return seconds < ramp ? seconds * seconds / (2 * ramp) : seconds - ramp / 2;
}
/// What an event's move has done at a time (s): turned about its center, then carried along with it.
Pose done(const Event& e, const WallMove& m, double time)
{
    const double whole = end_of(e) - begin_of(e), gone = std::clamp(time - begin_of(e), 0.0, whole);
    Pose p;
    if (m.path.rows) {
        p.shift = value_at(m.path, gone);
        return p;
    }
    const double seconds = at_full_speed(gone, whole, m.ramp);
    if (m.turn && seconds > 0) {
        p = turn_about(m.turn->axis, seconds * m.turn->rate);
        p.shift = m.turn->center - turned(p, m.turn->center);
    }
    p.shift = p.shift + seconds * m.velocity;
    return p;
}

template <class Visit> void for_each_move(const Scene& s, int wall, int begun, Visit visit)
{
    const auto order = order_of_events(s);
    for (int k = 0; k < begun; ++k) {
        const Event& e = s.events[std::size_t(order[std::size_t(k)])];
        if (e.move && e.move->wall == s.walls[std::size_t(wall)].name) visit(e, *e.move);
    }
}
template <class Visit> void for_each_corner(const Shape& shape, Visit visit)
{
    const Box b = bounds(shape);
    for (const double x : {b.low.x, b.high.x})
        for (const double y : {b.low.y, b.high.y})
            for (const double z : {b.low.z, b.high.z}) visit(Vector{x, y, z});
}

} // namespace

bool moves(const Scene& s, int wall)
{
    const auto& name = s.walls[std::size_t(wall)].name;
    return !name.empty() && std::ranges::any_of(s.events, [&](const Event& e) { return e.move && e.move->wall == name; });
}
bool any_wall_moves(const Scene& s)
{
    return std::ranges::any_of(s.events, [](const Event& e) { return e.move.has_value(); });
}
bool walls_change(const Scene& s)
{
    const auto names_a_wall = [&](const std::vector<std::string>& names) {
        return std::ranges::any_of(s.walls, [&](const Wall& w) { return !w.name.empty() && std::ranges::count(names, w.name) > 0; });
    };
    return std::ranges::any_of(s.events, [&](const Event& e) { return e.move || names_a_wall(e.add) || names_a_wall(e.remove); });
}
std::vector<int> moving_walls(const Scene& s)
{
    std::vector<int> all;
    for (int w = 0; w < int(s.walls.size()); ++w)
        if (moves(s, w)) all.push_back(w);
    return all;
}

Pose pose_at(const Scene& s, int wall, int begun, double time)
{
    Pose p;
    for_each_move(s, wall, begun, [&](const Event& e, const WallMove& m) { p = then(p, done(e, m, time)); });
    return p;
}

double farthest_way(const Shape& shape, const Pose& a, const Pose& b)
{
    double most = 0;
    for_each_corner(shape, [&](Vector x) { most = std::max(most, length(placed(b, x) - placed(a, x))); });
    return most;
}

double fastest_wall(const Scene& s)
{
    double most = 0;
    const int all = int(s.events.size());
    for (const int w : moving_walls(s))
        for (const Event& e : s.events)
            if (e.move && e.move->wall == s.walls[std::size_t(w)].name) {
                const auto meet = [&](double from, double to) {
                    const double way = farthest_way(s.walls[std::size_t(w)].shape, pose_at(s, w, all, from), pose_at(s, w, all, to));
                    most = std::max(most, way / (to - from));
                };
                const double begin = begin_of(e), middle = (begin + end_of(e)) / 2; // where it is fastest
                if (const auto& rows = e.move->path.rows)
                    for (std::size_t k = 1; k < rows->size(); ++k) meet(begin + (*rows)[k - 1][0], begin + (*rows)[k][0]);
                else meet(middle, middle + 1e-3 * (end_of(e) - begin));
            }
    return most;
}

Contact contact(const Wall& w, Vector x, int dimensions)
{
    if (w.pose == Pose{}) return contact(w.shape, x, dimensions);
    const Contact c = contact(w.shape, as_drawn(w.pose, x), dimensions);
    return {c.distance, turned(w.pose, c.normal)};
}
Box bounds(const Wall& w)
{
    if (w.pose == Pose{}) return bounds(w.shape);
    const double all = std::numeric_limits<double>::max();
    Box b{{all, all, all}, {-all, -all, -all}};
    for_each_corner(w.shape, [&](Vector drawn) {
        const Vector x = placed(w.pose, drawn);
        b.low = {std::min(b.low.x, x.x), std::min(b.low.y, x.y), std::min(b.low.z, x.z)};
        b.high = {std::max(b.high.x, x.x), std::max(b.high.y, x.y), std::max(b.high.z, x.z)};
    });
    return b;
}

namespace {
/// Walls move neither along a period nor out of it.
template <class Error> void check_periods(const Scene& s, const WallMove& m, Error error)
{
    const auto& periodic = s.space.periodic;
    const double along[3] = {m.velocity.x, m.velocity.y, m.velocity.z};
    for (std::size_t axis = 0; axis < 3 && m.path.rows; ++axis)
        if (periodic[axis] && std::ranges::any_of(*m.path.rows, [&](const auto& row) { return row[axis + 1] != 0; }))
            error(".path",
                  fmt::format("expected no motion along {}, along which the space repeats, found some; leave one out", axis == 0   ? "x"
                                                                                                                       : axis == 1 ? "y"
                                                                                                                                   : "z"));
    for (int axis = 0; axis < 3; ++axis) {
        if (!periodic[std::size_t(axis)]) continue;
        const char* name = axis == 0 ? "x" : axis == 1 ? "y" : "z";
        if (along[axis] != 0)
            error(".velocity", fmt::format("expected no motion along {}, along which the space repeats, found {:g} m/s; leave one out",
                                           name, along[axis]));
        if (!m.turn) continue;
        const double n[3] = {m.turn->axis.x, m.turn->axis.y, m.turn->axis.z};
        if (std::fabs(n[axis]) < length(m.turn->axis))
            error(".rotation",
                  fmt::format("expected a turn about {}, along which the space repeats, found another axis; leave one out", name));
    }
}
} // namespace

namespace {
/// What a move says of its course.
template <class Error> void check_course(const Scene& s, const Event& e, const WallMove& m, Error error)
{
    const bool has_path = !m.path.file.empty();
    if (has_path && (m.velocity != Vector{} || m.turn || m.ramp > 0))
        error(".path", "expected a path alone, found velocity, rotation or ramp as well; leave one out");
    if (has_path && e.from) error("", "expected at with a path, which brings its own times, found from and to; write at = instead");
    if (!has_path && !e.from) error("", "expected from and to, since a motion begins and ends, found at; write from = and to = instead");
    if (!has_path && m.velocity == Vector{} && !m.turn)
        error("", "expected a velocity, a rotation or a path, found none; write, for example, velocity = [0.0, 0.0, 1.5]");
    if (e.from && 2 * m.ramp > (1 + 1e-9) * (*e.to - *e.from))
        error(".ramp", fmt::format("expected at most half of the motion's {:g} s, found {:g} s: it comes to its speed and to rest in it",
                                   *e.to - *e.from, m.ramp));
    if (!m.path.rows) return;
    const auto& first = m.path.rows->front();
    if (first != std::array<double, 4>{})
        error(".path", fmt::format("expected a first row of zeros, since the wall begins where it stands, found {:g}, {:g}, {:g}, {:g}",
                                   first[0], first[1], first[2], first[3]));
    if (s.dimensions == 2 && std::ranges::any_of(*m.path.rows, [](const auto& row) { return row[2] != 0; }))
        error(".path", "expected no motion along y in two dimensions, found some; leave the column y out");
}
} // namespace

void check_move(const Scene& s, const Event& e, const std::string& key, Issues& issues)
{
    if (!e.move) return;
    const WallMove& m = *e.move;
    const auto error = [&](const std::string& where, std::string text) {
        issues.push_back({Severity::Error, key + ".move" + where, std::move(text), {}});
    };
    check_course(s, e, m, error);
    if (s.accuracy.scheme != Scheme::Staggered)
        error("", "expected accuracy.scheme = \"staggered\" where walls move, found \"leap-frog\"; leave accuracy.scheme out");
    if (s.dimensions == 2 && m.velocity.y != 0)
        error(".velocity", fmt::format("expected no motion along y in two dimensions, found {:g} m/s; write 0.0", m.velocity.y));
    if (m.turn) {
        const Vector n = m.turn->axis;
        if (!(length(n) > 1e-100)) // shorter ones have no length in double numbers
            error(".rotation.axis", fmt::format("expected a direction, found [{:g}, {:g}, {:g}]; about y: [0.0, 1.0, 0.0]", n.x, n.y, n.z));
        else if (s.dimensions == 2 && (n.x != 0 || n.z != 0))
            error(".rotation.axis", "expected the axis y in two dimensions, found another; leave it out");
    }
    const int number = wall_named(s, m.wall);
    if (number < 0) {
        std::string names;
        for (const auto& w : s.walls)
            if (!w.name.empty()) names += (names.empty() ? "" : ", ") + w.name;
        return error(".wall", fmt::format("expected the name of a wall, found \"{}\"; the names here: {}", m.wall,
                                          names.empty() ? std::string("none; give that wall a name = \"...\"") : names));
    }
    if (std::holds_alternative<Ground>(s.walls[std::size_t(number)].shape))
        error(".wall", "expected a wall of [[wall]], found real ground, which stays where it is");
    check_periods(s, m, error);
}

} // namespace kuzure::scene
