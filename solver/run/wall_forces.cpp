#include "solver/run/wall_forces.hpp"
#include "solver/run/exact_sums.hpp"
#include "solver/scene/step_limits.hpp"
#include <algorithm>

namespace kuzure {

namespace {
/// x of A x = b.
Vector solved(const Stress& A, Vector b)
{
    const Vector x{A.xx, A.xy, A.xz}, y{A.xy, A.yy, A.yz}, z{A.xz, A.yz, A.zz}, u = cross(y, z), v = cross(z, x), w = cross(x, y);
    return (1 / dot(x, u)) * Vector{dot(u, b), dot(v, b), dot(w, b)};
}
} // namespace

std::vector<int> WallForces::named(const Scene& scene)
{
    std::vector<int> walls;
    if (scene.accuracy.scheme == scene::Scheme::Staggered)
        for (std::size_t w = 0; w < scene.walls.size(); ++w)
            if (!scene.walls[w].name.empty()) walls.push_back(int(w));
    return walls;
}

WallForces::WallForces(const Scene& scene, std::span<const Material> soils, const Layout& layout)
    : scene_(scene), soils_(soils), layout_(layout), walls_(named(scene)), number_of_(scene.walls.size(), -1)
{
    for (std::size_t k = 0; k < walls_.size(); ++k) number_of_[std::size_t(walls_[k])] = int(k);
}

/// What a particle sees of one wall.
struct WallForces::Seen {
    int wall;
    double area = 0;   // of its kernel gradients
    Vector traction{}; // of the particle's stress on its faces
    Stress bears{};    // of the directions in which its faces bear
};

Face WallForces::face_of_now(const Face& face, Vector then, Vector now) const
{
    const auto& moved = since_[std::size_t(face.wall)];
    Face f = face;
    const Vector foot = face.foot(then);
    if (moved) f.normal = scene::turned(*moved, f.normal), f.side = scene::turned(*moved, f.side);
    f.depth = dot((moved ? scene::placed(*moved, foot) : foot) - now, f.normal);
    return f;
}

void WallForces::see(Index wall, Index point, Vector x, const Stress& sigma, std::vector<Seen>& seen) const
{
    const WallPoints& w = layout_.walls()[std::size_t(wall)];
    const auto& own = since_[std::size_t(wall)];
    const Vector then{w.x[point], w.y[point], w.z[point]}, now = own ? scene::placed(*own, then) : then, r = x - now;
    const double t = 1 - length(r) / scene_.support();
    const auto faces = faces_[std::size_t(wall)][std::size_t(point)];
    if (!(t > 0) || faces.empty()) return;
    const auto of_now = [&](const Face& f) { return own || since_[std::size_t(f.wall)] ? face_of_now(f, then, now) : f; };
    const std::size_t mirrors = mirroring_face(faces, face_ramp * scene_.smoothing_length(), [&](const Face& f) {
        const Face here = of_now(f);
        return dot(r, here.normal) - here.depth;
    });
    const Face face = of_now(faces[mirrors]);
    const scene::Wall& of = scene_.walls[std::size_t(face.wall)];
    const bool rough = of.surface == scene::Surface::Rough;
    const bool grips = rough || (of.surface == scene::Surface::Coulomb && of.friction_angle > 0); // it bears along its face too
    const Vector gradient = (t * t * t) * r, push = sigma * gradient, n = face.side;
    const Vector traction = rough ? push : dot(push, face.normal) * face.normal, its = own_share(face, traction);
    const auto feels = [&](int number, Vector force, const Stress& bears) {
        auto here = std::ranges::find(seen, number, &Seen::wall);
        if (here == seen.end()) here = seen.insert(here, {number});
        here->area += length(gradient), here->traction = here->traction + force;
        here->bears = here->bears + length(gradient) * bears;
    };
    const Stress every_way{1, 1, 1, 0, 0, 0}, along{n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.y * n.z, n.x * n.z};
    // A point may stand behind a face of another wall, which is the one that feels it; at an edge both do.
    const bool edge = face.wall != int(wall) && its != traction;
    feels(face.wall, edge ? its : traction, grips ? every_way : along);
    if (edge) feels(int(wall), traction - its, grips ? every_way : every_way - along);
}

template <class Visit> void WallForces::share(std::span<const Seen> seen, Vector x, Vector force, Visit visit) const
{
    const auto give = [&](const Seen& s, Vector f) {
        if (const int k = number_of_[std::size_t(s.wall)]; k >= 0) visit(std::size_t(k), x, f);
    };
    if (seen.size() == 1) return give(seen[0], force);
    Vector together{};
    Stress all_bear{};
    double sight = 0;
    for (const auto& s : seen) together = together + s.traction, all_bear = all_bear + s.bears, sight += s.area;
    const double square = dot(together, together), scale = square > 0 ? dot(force, together) / square : 0;
    const Vector remainder = force - scale * together, loads = solved(plus_isotropic(all_bear, 1e-9 * sight), remainder);
    const Vector left = remainder - all_bear * loads; // what none of them can bear
    for (const auto& s : seen) give(s, scale * s.traction + s.bears * loads + (s.area / sight) * left);
}

template <class Visit> void WallForces::for_each_force(const Particles& p, Index cluster, Visit visit) const
{
    const ClusterLists& lists = layout_.lists();
    const auto all = lists.walls(cluster);
    if (all.empty()) return;
    const bool alone = all.one_wall() && own_faces_[std::size_t(all.first_wall())];
    std::vector<Seen> seen;
    for (Index i = lists.first(cluster); i < lists.first(cluster) + lists.count(cluster); ++i) {
        const Vector a = p[field::wall_force][i];
        if (a == Vector{}) continue;
        const Vector x = p[field::position][i];
        seen.clear();
        if (alone) seen.push_back({all.first_wall()});
        else
            all.for_each([&](int wall, const PointSet& points) {
                points.for_each([&](Index point) { see(wall, point, x, p[field::stress][i], seen); });
            });
        share(seen, x, (-soils_[std::size_t(p[field::soil][i])].density * scene_.particle_volume()) * a, visit);
    }
}

void WallForces::place_walls()
{
    for (std::size_t w = 0; w < since_.size(); ++w) {
        const scene::Pose& now = scene_.walls[w].pose;
        if (now == poses_[w]) since_[w].reset();
        else since_[w] = scene::then(scene::inverse(poses_[w]), now);
    }
}

void WallForces::renew_faces()
{
    if (!any() || faces_of_ == layout_.wall_renewals()) return;
    faces_of_ = layout_.wall_renewals();
    poses_.clear(), since_.assign(scene_.walls.size(), {});
    for (const auto& w : scene_.walls) poses_.push_back(w.pose);
    const WallSurface surface(scene_);
    faces_.clear(), own_faces_.clear();
    for (std::size_t w = 0; w < layout_.walls().size(); ++w) {
        const WallPoints& points = layout_.walls()[w];
        const auto& faces = faces_.emplace_back(surface, points.x, points.y, points.z, scene_.support());
        bool own = true;
        for (std::size_t k = 0; k < faces.size(); ++k)
            own = own && std::ranges::all_of(faces[k], [&](const Face& f) { return f.wall == int(w); });
        own_faces_.push_back(own);
    }
}

double WallForces::impulse_unit(const Clock& clock) const
{
    // Of weight times height in whole energy units there are 2^46; of the weight during one crossing of the smoothing length 2^46 times
    // spacings over height.
    return std::exp2(std::floor(std::log2(clock.energy_unit / scene_.space.spacing * scene::crossing_time(scene_))));
}

bool WallForces::add_impulse(const Particles& p, double seconds, Clock& clock)
{
    if (!any() || !layout_.built()) return true;
    clock.impulse.resize(walls_.size());
    place_walls();
    const double per_unit = seconds / impulse_unit(clock);
    const Index clusters = layout_.lists().size();
    bool outgrown = false;
#pragma omp parallel
    {
        std::vector<std::array<WideUnits, 3>> mine(walls_.size());
        bool too_large = false;
#pragma omp for schedule(static) nowait
        for (Index c = 0; c < clusters; ++c)
            for_each_force(p, c, [&](std::size_t k, Vector, Vector force) {
                const double units[3] = {per_unit * force.x, per_unit * force.y, per_unit * force.z};
                for (std::size_t a = 0; a < 3; ++a)
                    if (std::fabs(units[a]) < 0x1p50) mine[k][a].add(std::int64_t(std::nearbyint(units[a])));
                    else too_large = true;
            });
#pragma omp critical
        {
            for (std::size_t k = 0; k < mine.size(); ++k)
                for (std::size_t a = 0; a < 3; ++a) clock.impulse[k][a].add(mine[k][a]);
            outgrown = outgrown || too_large;
        }
    }
    return !outgrown;
}

std::vector<WallLoad> WallForces::loads(const Team& team, const Particles& p, const Clock& clock)
{
    std::vector<WallLoad> all;
    if (!any()) return all;
    place_walls();
    auto impulse = clock.impulse;
    impulse.resize(walls_.size());
    add_over_ranks(team, impulse);
    const auto sums = exact_sums(team, 6 * walls_.size(), [&](auto add) {
        for (Index c = 0; c < layout_.lists().size(); ++c)
            for_each_force(p, c, [&](std::size_t k, Vector x, Vector f) {
                add(6 * k, f.x), add(6 * k + 1, f.y), add(6 * k + 2, f.z);
                const Vector moment = cross(x, f);
                add(6 * k + 3, moment.x), add(6 * k + 4, moment.y), add(6 * k + 5, moment.z);
            });
    });
    const double unit = impulse_unit(clock);
    for (std::size_t k = 0; k < walls_.size(); ++k) {
        const double* s = &sums[6 * k];
        const auto& j = impulse[k];
        all.push_back({scene_.walls[std::size_t(walls_[k])].name,
                       {s[0], s[1], s[2]},
                       {s[3], s[4], s[5]},
                       {unit * j[0].value(), unit * j[1].value(), unit * j[2].value()}});
    }
    return all;
}

} // namespace kuzure
