#include "solver/walls/surface.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/motion.hpp"
#include "solver/scene/shape.hpp"
#include <algorithm>
#include <limits>
#include <numbers>
#include <omp.h>

namespace kuzure {

namespace {

/// A point of a face and the face's own normal there.
struct Candidate {
    Vector point, normal;
};

/// Where faces of two walls meet in one edge, that with more grip counts.
double grip(const scene::Wall& w)
{
    if (w.surface == scene::Surface::Rough) return std::numbers::pi;
    return w.surface == scene::Surface::Coulomb ? w.friction_angle : -1; // below pi/2
}

double clamped(double x, double low, double high) { return std::min(std::max(x, low), high); }

/// Calls visit(candidate) with the closest point of every face of a shape.
template <class Visit> void for_each_face(const scene::Box& b, Vector x, int dimensions, Visit visit)
{
    const Vector in{clamped(x.x, b.low.x, b.high.x), clamped(x.y, b.low.y, b.high.y), clamped(x.z, b.low.z, b.high.z)};
    visit(Candidate{{in.x, in.y, b.high.z}, {0, 0, 1}}), visit(Candidate{{in.x, in.y, b.low.z}, {0, 0, -1}});
    visit(Candidate{{b.high.x, in.y, in.z}, {1, 0, 0}}), visit(Candidate{{b.low.x, in.y, in.z}, {-1, 0, 0}});
    if (dimensions == 3) visit(Candidate{{in.x, b.high.y, in.z}, {0, 1, 0}}), visit(Candidate{{in.x, b.low.y, in.z}, {0, -1, 0}});
}
template <class Visit> void for_each_face(const scene::Sphere& s, Vector x, int dimensions, Visit visit)
{
    const auto c = scene::contact(s, x, dimensions);
    visit(Candidate{x - c.distance * c.normal, c.normal});
}
template <class Visit> void for_each_face(const scene::Cylinder& c, Vector x, int, Visit visit)
{
    const double dx = x.x - c.base.x, dy = x.y - c.base.y, r = std::hypot(dx, dy);
    const Vector out = r > 0 ? Vector{dx / r, dy / r, 0} : Vector{1, 0, 0};
    const double z = clamped(x.z, c.base.z, c.base.z + c.height), in = std::min(r, c.radius);
    visit(Candidate{{c.base.x + c.radius * out.x, c.base.y + c.radius * out.y, z}, out});
    visit(Candidate{{c.base.x + in * out.x, c.base.y + in * out.y, c.base.z + c.height}, {0, 0, 1}});
    visit(Candidate{{c.base.x + in * out.x, c.base.y + in * out.y, c.base.z}, {0, 0, -1}});
}
template <class Visit> void for_each_face(const scene::Polygon& p, Vector x, int dimensions, Visit visit)
{
    const std::size_t n = p.points.size();
    const double turn = scene::area(p) >= 0 ? 1 : -1, y = dimensions == 3 ? clamped(x.y, p.y[0], p.y[1]) : x.y;
    for (std::size_t k = 0; k < n; ++k) {
        const auto &a = p.points[k], &b = p.points[k + 1 < n ? k + 1 : 0];
        const double ex = b[0] - a[0], ez = b[1] - a[1], l = std::hypot(ex, ez);
        const double t = clamped(((x.x - a[0]) * ex + (x.z - a[1]) * ez) / (l * l), 0, 1);
        visit(Candidate{{a[0] + t * ex, y, a[1] + t * ez}, {turn * ez / l, 0, -turn * ex / l}});
    }
    if (dimensions == 3 && scene::contains(p, {x.x, 0.5 * (p.y[0] + p.y[1]), x.z}))
        visit(Candidate{{x.x, p.y[1], x.z}, {0, 1, 0}}), visit(Candidate{{x.x, p.y[0], x.z}, {0, -1, 0}});
}
template <class Visit> void for_each_face(const scene::Ground& g, Vector x, int, Visit visit)
{
    const auto n = g.field->nearest(x);
    if (!std::isfinite(n.distance)) return;
    // The way itself is the normal: so also at the focus of a hollow, where many points are as near.
    const Vector way = x - n.point;
    const bool far = std::fabs(n.distance) > 1e-6 * g.field->grid().cell;
    visit(Candidate{n.point, far ? (1 / n.distance) * way : n.normal});
}
/// Releases are soil, never walls.
template <class Visit> void for_each_face(const scene::Release&, Vector, int, Visit) {}

} // namespace

WallSurface::WallSurface(const Scene& scene) : scene_(scene), dimensions_(scene.dimensions), tolerance_(1e-6 * scene.space.spacing)
{
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

bool WallSurface::covered(Vector x) const
{
    for (const Part& part : parts_) {
        const auto &lo = part.bounds.low, &hi = part.bounds.high;
        if (x.x < lo.x || x.z < lo.z || x.x > hi.x || x.z > hi.z || x.y < lo.y || x.y > hi.y) continue;
        // What touches covers: flush shapes leave no gap, whatever their last digits.
        if (scene::signed_distance(scene_.walls[part.wall].shape, as_drawn(part, x), dimensions_) < 0) return true;
    }
    return false;
}

bool WallSurface::continued(Vector edge, Vector way) const
{
    // Air beside the edge, across the way to it: along the axes, in which most pieces end, and around.
    const Vector from = edge - 5 * tolerance_ * way;
    const auto air = [&](Vector along) {
        const Vector across = along - dot(along, way) * way;
        const double l = length(across);
        return l > 1e-3 && !covered(from + (1e4 * tolerance_ / l) * across);
    };
    for (const double side : {-1.0, 1.0})
        if (air({side, 0, 0}) || air({0, 0, side}) || (dimensions_ == 3 && air({0, side, 0}))) return true;
    if (dimensions_ == 2) return false;
    const Vector any = std::fabs(way.z) < 0.8 ? Vector{0, 0, 1} : Vector{1, 0, 0};
    const Vector c = cross(way, any), a = (1 / length(c)) * c, b = cross(way, a);
    for (int k = 0; k < 16; ++k) {
        const double turn = k * std::numbers::pi / 8;
        if (air(std::cos(turn) * a + std::sin(turn) * b)) return true;
    }
    return false;
}

void WallSurface::faces(Vector point, double reach, std::vector<Face>& found) const
{
    found.clear();
    for (const Part& part : parts_) {
        const auto &lo = part.bounds.low, &hi = part.bounds.high;
        if (point.x < lo.x - reach || point.z < lo.z - reach || point.x > hi.x + reach || point.z > hi.z + reach ||
            point.y < lo.y - reach || point.y > hi.y + reach)
            continue;
        const Vector x = as_drawn(part, point);
        const scene::Pose& pose = scene_.walls[part.wall].pose;
        std::visit(
            [&](const auto& shape) {
                for_each_face(shape, x, dimensions_, [&](const Candidate& c) {
                    Vector way = c.point - x;
                    if (dimensions_ == 2) way.y = 0;
                    // Beside the foot of the perpendicular an edge is closest: the surface faces the way to it.
                    const double away = length(way), along = std::fabs(dot(way, c.normal));
                    const bool straight = away - along <= tolerance_;
                    const double depth = straight ? along : away;
                    if (depth > reach) return;
                    Vector normal = straight ? c.normal : (1 / depth) * way;
                    if (depth > tolerance_ && dot(way, normal) < 0) return; // the face of another wall, seen from behind
                    Vector foot = c.point, side = c.normal;
                    if (part.moved)
                        normal = scene::turned(pose, normal), side = scene::turned(pose, side), foot = scene::placed(pose, foot);
                    foot = foot + part.shift;
                    if (covered(foot + tolerance_ * normal)) return;
                    if (!straight && continued(foot, normal)) return;
                    for (Face& f : found)
                        if (std::fabs(f.depth - depth) <= tolerance_ && dot(f.normal, normal) > 1 - 1e-9) {
                            if (grip(scene_.walls[part.wall]) > grip(scene_.walls[f.wall])) f.wall = part.wall, f.side = side;
                            return;
                        }
                    found.push_back({normal, depth, part.wall, side});
                });
            },
            scene_.walls[part.wall].shape);
    }
    // Of equally near ones that which faces up, then along x, then y: how the ground is drawn does not show.
    const auto rank = [&](const Face& f) { return f.depth - tolerance_ * dot(f.normal, {0.1, 0.01, 1}); };
    std::sort(found.begin(), found.end(), [&](const Face& a, const Face& b) { return rank(a) < rank(b); });
}

double WallSurface::depth(Vector point, double reach) const
{
    if (!covered(point)) return 0;
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
