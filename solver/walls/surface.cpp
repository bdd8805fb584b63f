#include "solver/walls/surface.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/shape.hpp"
#include <algorithm>
#include <limits>
#include <numbers>
#include <omp.h>

namespace kuzure {

/// A point of a face, the face's own normal there, and whether the face may end there.
struct FaceCandidate {
    Vector point, normal;
    bool at_end = false;
};

namespace {

/// Where faces of two walls meet in one edge, that with more grip counts.
double grip(const scene::Wall& w)
{
    if (w.surface == scene::Surface::Rough) return std::numbers::pi;
    return w.surface == scene::Surface::Coulomb ? w.friction_angle : -1; // below pi/2
}

/// What is no farther from the end of a face may be at it, in tolerances.
constexpr double near_end = 1e3;

double clamped(double x, double low, double high) { return std::min(std::max(x, low), high); }
/// True where a point is no farther than so much outside of a box.
bool within(const scene::Box& b, Vector x, double margin)
{
    return x.x >= b.low.x - margin && x.z >= b.low.z - margin && x.x <= b.high.x + margin && x.z <= b.high.z + margin &&
           x.y >= b.low.y - margin && x.y <= b.high.y + margin;
}
/// True within `near` of an end of an interval, or beyond.
bool ends(double x, double low, double high, double near) { return x < low + near || x > high - near; }

/// Calls visit(candidate) with the closest point of every face of a shape. `near`: what is no farther from a face's end may be at it, m.
template <class Visit> void for_each_face(const scene::Box& b, Vector x, int dimensions, double near, Visit visit)
{
    const Vector in{clamped(x.x, b.low.x, b.high.x), clamped(x.y, b.low.y, b.high.y), clamped(x.z, b.low.z, b.high.z)};
    const bool ex = ends(x.x, b.low.x, b.high.x, near), ey = dimensions == 3 && ends(x.y, b.low.y, b.high.y, near),
               ez = ends(x.z, b.low.z, b.high.z, near);
    visit(FaceCandidate{{in.x, in.y, b.high.z}, {0, 0, 1}, ex || ey}), visit(FaceCandidate{{in.x, in.y, b.low.z}, {0, 0, -1}, ex || ey});
    visit(FaceCandidate{{b.high.x, in.y, in.z}, {1, 0, 0}, ey || ez}), visit(FaceCandidate{{b.low.x, in.y, in.z}, {-1, 0, 0}, ey || ez});
    if (dimensions == 3)
        visit(FaceCandidate{{in.x, b.high.y, in.z}, {0, 1, 0}, ex || ez}),
            visit(FaceCandidate{{in.x, b.low.y, in.z}, {0, -1, 0}, ex || ez});
}
template <class Visit> void for_each_face(const scene::Sphere& s, Vector x, int dimensions, double, Visit visit)
{
    const auto c = scene::contact(s, x, dimensions);
    visit(FaceCandidate{x - c.distance * c.normal, c.normal});
}
template <class Visit> void for_each_face(const scene::Cylinder& c, Vector x, int, double near, Visit visit)
{
    const double dx = x.x - c.base.x, dy = x.y - c.base.y, r = std::hypot(dx, dy);
    const Vector out = r > 0 ? Vector{dx / r, dy / r, 0} : Vector{1, 0, 0};
    const double z = clamped(x.z, c.base.z, c.base.z + c.height), in = std::min(r, c.radius);
    const bool rim = r > c.radius - near;
    visit(
        FaceCandidate{{c.base.x + c.radius * out.x, c.base.y + c.radius * out.y, z}, out, ends(x.z, c.base.z, c.base.z + c.height, near)});
    visit(FaceCandidate{{c.base.x + in * out.x, c.base.y + in * out.y, c.base.z + c.height}, {0, 0, 1}, rim});
    visit(FaceCandidate{{c.base.x + in * out.x, c.base.y + in * out.y, c.base.z}, {0, 0, -1}, rim});
}
template <class Visit> void for_each_face(const scene::Polygon& p, Vector x, int dimensions, double near, Visit visit)
{
    const std::size_t n = p.points.size();
    const double turn = scene::area(p) >= 0 ? 1 : -1, y = dimensions == 3 ? clamped(x.y, p.y[0], p.y[1]) : x.y;
    const bool ey = dimensions == 3 && ends(x.y, p.y[0], p.y[1], near);
    for (std::size_t k = 0; k < n; ++k) {
        const auto &a = p.points[k], &b = p.points[k + 1 < n ? k + 1 : 0];
        const double ex = b[0] - a[0], ez = b[1] - a[1], l = std::hypot(ex, ez);
        const double at = ((x.x - a[0]) * ex + (x.z - a[1]) * ez) / (l * l), t = clamped(at, 0, 1);
        visit(FaceCandidate{{a[0] + t * ex, y, a[1] + t * ez}, {turn * ez / l, 0, -turn * ex / l}, ey || ends(at * l, 0, l, near)});
    }
    if (dimensions == 2) return;
    const double in = scene::signed_distance(p, {x.x, 0, x.z}, 2);
    if (in > 1e-3 * near) return;
    visit(FaceCandidate{{x.x, p.y[1], x.z}, {0, 1, 0}, in > -near}), visit(FaceCandidate{{x.x, p.y[0], x.z}, {0, -1, 0}, in > -near});
}
template <class Visit> void for_each_face(const scene::Ground& g, Vector x, int, double, Visit visit)
{
    const auto n = g.field->nearest(x);
    if (!std::isfinite(n.distance)) return;
    // The way itself is the normal: so also at the focus of a hollow, where many points are as near.
    const Vector way = x - n.point;
    const bool far = std::fabs(n.distance) > 1e-6 * g.field->grid().cell;
    visit(FaceCandidate{n.point, far ? (1 / n.distance) * way : n.normal});
}
/// Releases are soil, never walls.
template <class Visit> void for_each_face(const scene::Release&, Vector, int, double, Visit) {}

/// Directions of the plane across a way.
struct Across {
    Vector a, b;
    int dimensions;
    Across(Vector way, int dimensions) : dimensions(dimensions)
    {
        if (dimensions == 2) {
            a = {-way.z, 0, way.x}, b = {};
            return;
        }
        const Vector c = cross(way, std::fabs(way.z) < 0.8 ? Vector{0, 0, 1} : Vector{1, 0, 0});
        a = (1 / length(c)) * c, b = cross(way, a);
    }
    /// True where test(direction) is of one of so many directions around, in 2-D of one of the two; none is along the axes, as edges are.
    template <class Test> bool any(int around, Test test) const
    {
        if (dimensions == 2) return test(a) || test(-1.0 * a);
        for (int k = 0; k < around; ++k) {
            const double turn = (2 * k + 1) * std::numbers::pi / around;
            if (test(std::cos(turn) * a + std::sin(turn) * b)) return true;
        }
        return false;
    }
};

/// Nearest first; of equally near ones that which faces up, then along x, then y.
void in_order(std::vector<Face>& faces, double tolerance)
{
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.depth < b.depth; });
    for (auto first = faces.begin(); first != faces.end();) {
        const auto last = std::find_if(first, faces.end(), [&](const Face& f) { return f.depth > first->depth + tolerance; });
        const auto up = [](const Face& f) { return dot(f.normal, {0.1, 0.01, 1}); };
        std::sort(first, last, [&](const Face& a, const Face& b) { return up(a) > up(b); });
        for (auto f = first; f != last; ++f) f->tied = f != first;
        first = last;
    }
}

} // namespace

WallSurface::WallSurface(const Scene& scene)
    : scene_(scene), dimensions_(scene.dimensions), tolerance_(1e-6 * scene.space.spacing), rounding_(1e-5 * tolerance_)
{
    for (const auto& w : scene.walls) rounding_ = std::min(std::max(rounding_, scene::rounding_of(w.shape, dimensions_)), 0.1 * tolerance_);
    const auto& s = scene.space;
    const Vector period = s.low ? *s.high - *s.low : Vector{};
    const int px = s.periodic[0], py = s.periodic[1], pz = s.periodic[2];
    for (int w = 0; w < int(scene.walls.size()); ++w) {
        if (!scene.walls[w].present) continue;
        auto b = scene::bounds(scene.walls[w]);
        const bool moved = scene.walls[w].pose != scene::Pose{};
        if (dimensions_ == 2) b.low.y = -std::numeric_limits<double>::infinity(), b.high.y = std::numeric_limits<double>::infinity();
        for (int i = -px; i <= px; ++i)
            for (int j = -py; j <= py; ++j)
                for (int k = -pz; k <= pz; ++k) {
                    const Vector shift{i * period.x, j * period.y, k * period.z};
                    parts_.push_back({w, shift, {b.low + shift, b.high + shift}, moved});
                }
    }
}

Vector WallSurface::as_drawn(const Part& part, Vector x) const
{
    const Vector unshifted = x - part.shift;
    return part.moved ? scene::as_drawn(scene_.walls[part.wall].pose, unshifted) : unshifted;
}

WallSurface::Side WallSurface::side(Vector x) const
{
    bool touches = false;
    for (const Part& part : parts_) {
        if (!within(part.bounds, x, tolerance_)) continue;
        const double distance = scene::signed_distance(scene_.walls[part.wall].shape, as_drawn(part, x), dimensions_);
        if (distance < -rounding_) return Side::In;
        touches = touches || distance <= rounding_;
    }
    return touches ? Side::On : Side::Out;
}

bool WallSurface::air_around(Vector beyond, Vector way) const
{
    return Across(way, dimensions_).any(8, [&](Vector along) { return side(beyond + tolerance_ * along) == Side::Out; });
}

bool WallSurface::goes_on(Vector end, Vector normal, const Part* part) const
{
    return Across(normal, dimensions_).any(8, [&](Vector along) {
        const Vector at = end + near_end * tolerance_ * along, over = 2 * tolerance_ * normal;
        if (side(at + over) != Side::Out) return false;
        if (!part) return side(at - over) == Side::In;
        return scene::signed_distance(scene_.walls[part->wall].shape, as_drawn(*part, at - over), dimensions_) < -rounding_;
    });
}

void WallSurface::take_grip(Face& f, Vector edge) const
{
    for (const Part& part : parts_) {
        const scene::Wall& wall = scene_.walls[part.wall];
        if (grip(wall) <= grip(scene_.walls[f.wall]) || !within(part.bounds, edge, tolerance_)) continue;
        const Vector x = as_drawn(part, edge);
        const auto meets = [&](const FaceCandidate& c) {
            Vector off = c.point - x;
            if (dimensions_ == 2) off.y = 0;
            const Vector normal = part.moved ? scene::turned(wall.pose, c.normal) : c.normal;
            if (length(off) <= 2 * tolerance_ && goes_on(edge, normal, &part)) f.wall = part.wall, f.side = normal;
        };
        std::visit([&](const auto& shape) { for_each_face(shape, x, dimensions_, near_end * tolerance_, meets); }, wall.shape);
    }
}

bool WallSurface::continued(Vector edge, Vector way) const
{
    // Air beside the edge, across the way to it: along the axes, in which most pieces end, and around.
    const Vector from = edge - 5 * tolerance_ * way;
    const auto air = [&](Vector along) {
        const Vector across = along - dot(along, way) * way;
        const double l = length(across);
        return l > 1e-3 && side(from + (1e4 * tolerance_ / l) * across) == Side::Out;
    };
    for (const double side : {-1.0, 1.0})
        if (air({side, 0, 0}) || air({0, 0, side}) || (dimensions_ == 3 && air({0, side, 0}))) return true;
    return dimensions_ == 3 && Across(way, 3).any(16, air);
}

void WallSurface::add(const Part& part, Vector x, const FaceCandidate& c, double reach, std::vector<Face>& found) const
{
    Vector way = c.point - x;
    if (dimensions_ == 2) way.y = 0;
    // Beside the foot of the perpendicular an edge is closest: the surface faces the way to it.
    const double away = length(way), along = std::fabs(dot(way, c.normal));
    const bool straight = away - along <= tolerance_;
    const double depth = straight ? along : away;
    if (depth > reach) return;
    Face f{straight ? c.normal : (1 / depth) * way, depth, part.wall, c.normal, false};
    if (depth > tolerance_ && dot(way, f.normal) < 0) return; // the face of another wall, seen from behind
    Vector foot = c.point;
    if (part.moved) {
        const scene::Pose& pose = scene_.walls[part.wall].pose;
        f.normal = scene::turned(pose, f.normal), f.side = scene::turned(pose, f.side), foot = scene::placed(pose, foot);
    }
    foot = foot + part.shift;
    const Vector beyond = foot + tolerance_ * f.normal;
    const Side there = side(beyond);
    if (there == Side::In || (there == Side::On && !air_around(beyond, f.normal))) return;
    if (straight ? c.at_end && !goes_on(foot, f.normal) : continued(foot, f.normal)) return;
    if (!straight || there == Side::On) take_grip(f, foot);
    const auto same = std::find_if(found.begin(), found.end(), [&](const Face& other) {
        return std::fabs(other.depth - depth) <= tolerance_ && dot(other.normal, f.normal) > 1 - 1e-9;
    });
    if (same == found.end()) found.push_back(f);
    else if (grip(scene_.walls[f.wall]) > grip(scene_.walls[same->wall])) same->wall = f.wall, same->side = f.side;
}

void WallSurface::faces(Vector point, double reach, std::vector<Face>& found) const
{
    found.clear();
    for (const Part& part : parts_) {
        if (!within(part.bounds, point, reach)) continue;
        const Vector x = as_drawn(part, point);
        std::visit(
            [&](const auto& shape) {
                for_each_face(shape, x, dimensions_, near_end * tolerance_, [&](const FaceCandidate& c) { add(part, x, c, reach, found); });
            },
            scene_.walls[part.wall].shape);
    }
    in_order(found, tolerance_);
}

double WallSurface::depth(Vector point, double reach) const
{
    if (side(point) != Side::In) return 0;
    std::vector<Face> found;
    faces(point, reach, found);
    return found.empty() ? reach : found.front().depth;
}

PointFaces::PointFaces(const WallSurface& surface, std::span<const double> x, std::span<const double> y, std::span<const double> z,
                       double reach)
    : n_(x.size())
{
    constexpr std::size_t enough = 256; // points for a thread
    const std::size_t parts = std::clamp<std::size_t>(4 * std::size_t(omp_get_max_threads()), 1, 1 + n_ / enough);
    share_ = std::max<std::size_t>(1, (n_ + parts - 1) / parts);
    parts_.resize((n_ + share_ - 1) / share_);
#pragma omp parallel for schedule(dynamic, 1)
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        auto& to = parts_[p];
        to.first.reserve(std::min(share_, n_ - p * share_) + 1);
        to.first.push_back(0);
        std::vector<Face> found;
        for (std::size_t k = p * share_; k < std::min(n_, (p + 1) * share_); ++k) {
            found.clear();
            surface.faces({x[k], y[k], z[k]}, reach, found);
            to.faces.insert(to.faces.end(), found.begin(), found.end());
            to.first.push_back(Index(to.faces.size()));
        }
        to.faces.shrink_to_fit();
    }
}

std::size_t PointFaces::faces() const
{
    std::size_t n = 0;
    for (const auto& p : parts_) n += p.faces.size();
    return n;
}

std::size_t PointFaces::bytes() const
{
    std::size_t b = 0;
    for (const auto& p : parts_) b += p.first.capacity() * sizeof(Index) + p.faces.capacity() * sizeof(Face);
    return b;
}

} // namespace kuzure
