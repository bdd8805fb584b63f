#include "solver/scene/fill.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/box.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/lines_of_shape.hpp"
#include "solver/scene/nearby.hpp"
#include <fmt/format.h>

namespace kuzure::scene {
namespace {

/// Side of the thinnest common part of two boxes along the axes that count; negative if they are apart.
double common(const Box& a, const Box& b, int dimensions)
{
    double least = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
        if (axis != 1 || dimensions == 3)
            least = std::min(least, std::min(at(a.high, axis), at(b.high, axis)) - std::max(at(a.low, axis), at(b.low, axis)));
    return least;
}

bool on_ground(const Shape& shape) { return std::holds_alternative<Ground>(shape) || std::holds_alternative<Release>(shape); }

/// True if particles of one shape lie inside another, either way. Particles draped over the ground lie where it is: soil on top of it, the
/// ground below.
bool reaches_into(const Points& a, const Shape& of_a, const Points& b, const Shape& of_b, const Scene& scene)
{
    if (a.lattice() && b.lattice()) return a.lattice()->reaches_into(of_b) || b.lattice()->reaches_into(of_a);
    if (std::holds_alternative<Ground>(of_a) || std::holds_alternative<Ground>(of_b))
        if (std::holds_alternative<Release>(of_a) || std::holds_alternative<Release>(of_b)) return false;
    const double depth = std::max(slack(of_a, scene.space.spacing, scene.dimensions), slack(of_b, scene.space.spacing, scene.dimensions));
    const auto inside = [&](const Points& points, const Shape& other) {
        bool found = false;
        points.for_each_in(bounds(other), [&](std::int64_t, Vector x) { found = found || signed_distance(other, x) < -depth; });
        return found;
    };
    return inside(a, of_b) || inside(b, of_a);
}

/// A body or wall that is to be filled.
struct Piece {
    std::string name, key;
    const Shape* shape;
    std::vector<std::array<double, 2>> times; // s, from which and to which it is there
    std::string problem;
    std::optional<Points> points;
};

/// Bodies, then walls.
std::vector<Piece> pieces_of(const Scene& scene)
{
    std::vector<Piece> pieces;
    const auto add = [&](const std::string& key, const auto& part) {
        pieces.push_back({key, key + "." + name_of(part.shape), &part.shape, presence(scene, part.name), {}, {}});
    };
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) add(fmt::format("body.{}", b), scene.bodies[b]);
    for (std::size_t w = 0; w < scene.walls.size(); ++w) add(fmt::format("wall.{}", w), scene.walls[w]);
    return pieces;
}

bool ever_together(const Piece& a, const Piece& b)
{
    for (const auto& s : a.times)
        for (const auto& t : b.times)
            if (s[0] < t[1] && t[0] < s[1]) return true;
    return false;
}

/// Finds the problem of each piece, and the one with which all of them become too much: then true.
bool too_much(const Scene& scene, std::vector<Piece>& pieces, Issues& issues)
{
    double lines = 0, edge_tests = 0;
    for (auto& p : pieces) {
        p.problem = on_ground(*p.shape) ? Draped::problem(*p.shape, scene.space.spacing, scene.dimensions)
                                        : Lattice::problem(*p.shape, scene.space.spacing, scene.dimensions);
        if (!p.problem.empty()) continue;
        if (!on_ground(*p.shape)) lines += Lattice::lines(*p.shape, scene.space.spacing, scene.dimensions);
        if (const auto* polygon = std::get_if<Polygon>(p.shape)) edge_tests += scene::edge_tests(*polygon, scene.space.spacing);
        if (lines <= most_lines && edge_tests <= most_edge_tests) continue;
        issues.push_back({Severity::Error,
                          p.key,
                          fmt::format("expected shapes that a computer can hold together, found {:.3g} rows of particles up to this one at "
                                      "a spacing of {} m{}; is space.spacing in metres?",
                                      lines, scene.space.spacing, edge_tests > most_edge_tests ? ", with too many corners" : ""),
                          {}});
        return true;
    }
    return false;
}

Points points_of(const Scene& scene, const Shape& shape, bool body)
{
    if (const auto* ground = std::get_if<Ground>(&shape)) return Draped(*ground, scene.space.spacing);
    if (const auto* release = std::get_if<Release>(&shape)) return Draped(*release, scene.space.spacing);
    // Bodies lie within the space, walls within its periods: no point of theirs may lie on the other side by rounding.
    Vector least = Lattice::nowhere;
    if (scene.space.low) {
        const auto& periodic = scene.space.periodic;
        if (body || periodic[0]) least.x = scene.space.low->x;
        if (body || periodic[1]) least.y = scene.space.low->y;
        if (body || periodic[2]) least.z = scene.space.low->z;
    }
    return Lattice(shape, scene.space.spacing, scene.dimensions, least);
}

void fill(const Scene& scene, std::vector<Piece>& pieces, Issues& issues)
{
    for (std::size_t k = 0; k < pieces.size(); ++k) {
        Piece& p = pieces[k];
        if (!p.problem.empty()) {
            issues.push_back({Severity::Error, p.key, std::move(p.problem), {}});
            continue;
        }
        p.points.emplace(points_of(scene, *p.shape, k < scene.bodies.size()));
        if (p.points->size() == 0)
            issues.push_back({Severity::Error,
                              p.key,
                              fmt::format("expected particles inside, found none at a spacing of {} m; make "
                                          "the shape larger or space.spacing smaller",
                                          scene.space.spacing),
                              {}});
    }
}

void find_overlaps(const Scene& scene, const std::vector<Piece>& pieces, Issues& issues)
{
    // One mistake may make every shape overlap every other: a million lines are of no use.
    const std::size_t enough = 100;
    std::vector<Box> around;
    for (const auto& p : pieces) around.push_back(scene::bounds(*p.shape));
    const Nearby near(around, scene.dimensions);
    const auto slack_of = [&](const Piece& p) { return slack(*p.shape, scene.space.spacing, scene.dimensions); };
    for (std::size_t i = 0; i < pieces.size() && issues.size() < enough; ++i)
        for (const std::size_t j : near.meeting(around[i])) {
            const auto &a = pieces[i], &b = pieces[j];
            if (j <= i || issues.size() >= enough || !a.points || !b.points || !ever_together(a, b)) continue;
            const double depth = common(around[i], around[j], scene.dimensions);
            if (depth <= std::max(slack_of(a), slack_of(b))) continue;
            const bool boxes = std::holds_alternative<Box>(*a.shape) && std::holds_alternative<Box>(*b.shape);
            // Points of one shape outside another are half a spacing from a box's points, and shapes other
            // than boxes share one lattice: no points strictly inside means no points too close.
            if (boxes || reaches_into(*a.points, *a.shape, *b.points, *b.shape, scene))
                issues.push_back({Severity::Error, b.name,
                                  fmt::format("expected shapes that at most touch, found an overlap of {} with {}{}; "
                                              "move or cut one of them",
                                              b.name, a.name, boxes ? fmt::format(" by {:.6g} m", depth) : ""),
                                  a.name});
        }
}

} // namespace

Filling::Survey Filling::survey(const Scene& scene)
{
    Survey all;
    std::vector<Piece> pieces = pieces_of(scene);
    if (too_much(scene, pieces, all.issues)) return all;
    fill(scene, pieces, all.issues);
    find_overlaps(scene, pieces, all.issues);
    for (auto& p : pieces) all.points.push_back(std::move(p.points));
    return all;
}

Issues Filling::problems(const Scene& scene) { return survey(scene).issues; }

std::optional<Filling> Filling::of(const Scene& scene, Issues& problems)
{
    Survey found = survey(scene);
    problems = std::move(found.issues);
    if (!problems.empty()) return {};
    return Filling(scene, std::move(found));
}

Filling::Filling(const Scene& scene) : Filling(scene, survey(scene)) {}

Filling::Filling(const Scene& scene, Survey found) : n_bodies_(scene.bodies.size())
{
    std::string errors;
    for (const auto& issue : found.issues) errors += (errors.empty() ? "" : "\n") + in_words(issue);
    if (!errors.empty()) throw BadInput(errors);

    first_id_ = {0};
    for (auto& points : found.points) {
        points_.push_back(std::move(*points));
        first_id_.push_back(first_id_.back() + points_.back().size());
        const Box& box = points_.back().bounds();
        bounds_ = points_.size() == 1 ? box : united(bounds_, box);
        if (points_.size() == n_bodies_) soil_bounds_ = bounds_;
    }
    const bool draped =
        std::any_of(points_.begin(), points_.begin() + std::ptrdiff_t(n_bodies_), [](const Points& p) { return p.draped(); });
    if (!draped) soil_height_ = soil_bounds_.high.z - soil_bounds_.low.z + scene.space.spacing;
    else
        for (std::size_t b = 0; b < n_bodies_; ++b) {
            const Box& box = points_[b].bounds();
            soil_height_ = std::max(soil_height_,
                                    points_[b].draped() ? points_[b].draped()->thickest() : box.high.z - box.low.z + scene.space.spacing);
        }
}

std::int64_t Filling::soil_count_in(const Box& region) const
{
    std::int64_t sum = 0;
    for (std::size_t b = 0; b < n_bodies_; ++b) sum += points_[b].count_in(region);
    return sum;
}
std::int64_t Filling::wall_count_in(const Box& region) const
{
    std::int64_t sum = 0;
    for (std::size_t w = n_bodies_; w < points_.size(); ++w) sum += points_[w].count_in(region);
    return sum;
}

std::optional<std::vector<GridPart>> Filling::grids_in(const Box& region) const
{
    std::vector<GridPart> parts;
    for (std::size_t k = 0; k < points_.size(); ++k) {
        auto part = points_[k].grid_in(region);
        if (!part) {
            if (points_[k].count_in(region) > 0) return std::nullopt;
            continue;
        }
        if (part->n[0] * part->n[1] * part->n[2] == 0) continue;
        part->soil = k < n_bodies_;
        parts.push_back(*part);
    }
    return parts;
}

std::size_t Filling::owner(std::int64_t id) const
{
    ensure(id >= 0 && id < first_id_.back(), "a particle is asked for whose id does not exist");
    return std::size_t(std::upper_bound(first_id_.begin(), first_id_.end(), id) - first_id_.begin() - 1);
}
Vector Filling::soil_position(std::int64_t id) const
{
    ensure(id < soil_count(), "a wall's id is used as soil");
    const std::size_t b = owner(id);
    return points_[b].position(id - first_id_[b]);
}
int Filling::body_of(std::int64_t id) const
{
    ensure(id < soil_count(), "a wall's id is used as soil");
    return int(owner(id));
}
Vector Filling::wall_position(std::int64_t id) const
{
    ensure(id >= soil_count(), "a soil particle's id is used as a wall");
    const std::size_t w = owner(id);
    return points_[w].position(id - first_id_[w]);
}
int Filling::wall_of(std::int64_t id) const
{
    ensure(id >= soil_count(), "a soil particle's id is used as a wall");
    return int(owner(id) - n_bodies_);
}

} // namespace kuzure::scene
