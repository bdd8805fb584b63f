#include "solver/run/wall_forces.hpp"
#include "solver/run/exact_sums.hpp"
#include "solver/scene/check.hpp"
#include <algorithm>

namespace kuzure {

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

template <class Visit> void WallForces::for_each_force(const Particles& p, Index cluster, Visit visit) const
{
    const ClusterLists& lists = layout_.lists();
    const auto all = lists.walls(cluster);
    if (all.empty()) return;
    struct Seen {
        int number;        // in walls_
        double area = 0;   // of its kernel gradients
        Vector traction{}; // of the particle's stress on its faces
    };
    std::vector<Seen> seen;
    const double support = scene_.support(), volume = scene_.particle_volume();
    for (Index i = lists.first(cluster); i < lists.first(cluster) + lists.count(cluster); ++i) {
        const Vector a = p[field::wall_force][i];
        if (a == Vector{}) continue;
        const Vector x = p[field::position][i];
        const Vector force = (-soils_[std::size_t(p[field::soil][i])].density * volume) * a;
        const bool alone = std::size_t(all[1]) + 2 == all.size();
        if (alone) {
            if (const int k = number_of_[std::size_t(all[0])]; k >= 0) visit(std::size_t(k), x, force);
            continue;
        }
        seen.clear();
        const Stress sigma = p[field::stress][i];
        for (auto runs = all; !runs.empty(); runs = runs.subspan(2 + std::size_t(runs[1]))) {
            const WallPoints& w = layout_.walls()[std::size_t(runs[0])];
            Seen here{number_of_[std::size_t(runs[0])]};
            for (const Index point : runs.subspan(2, std::size_t(runs[1]))) {
                const Vector r = x - Vector{w.x[point], w.y[point], w.z[point]};
                const double t = 1 - length(r) / support;
                const auto& faces = faces_[std::size_t(runs[0])][std::size_t(point)];
                if (!(t > 0) || faces.empty()) continue;
                // the first face in front of which the particle lies, as in the pair loop
                const auto in_front = std::ranges::find_if(faces, [&](const Face& f) { return f.depth < dot(r, f.normal); });
                const Face& face = in_front == faces.end() ? faces.back() : *in_front;
                const Vector gradient = (t * t * t) * r, push = sigma * gradient;
                const bool rough = scene_.walls[std::size_t(face.wall)].surface == scene::Surface::Rough;
                here.area += length(gradient);
                here.traction = here.traction + (rough ? push : dot(push, face.normal) * face.normal);
            }
            if (here.area > 0) seen.push_back(here);
        }
        Vector together{};
        double sight = 0;
        for (const auto& s : seen) together = together + s.traction, sight += s.area;
        const double square = dot(together, together), scale = square > 0 ? dot(force, together) / square : 0;
        const Vector rest = force - scale * together;
        for (const auto& s : seen)
            if (s.number >= 0) visit(std::size_t(s.number), x, scale * s.traction + (s.area / sight) * rest);
    }
}

void WallForces::renew_faces()
{
    if (faces_of_ == layout_.wall_renewals()) return;
    faces_of_ = layout_.wall_renewals();
    const WallSurface surface(scene_);
    faces_.assign(layout_.walls().size(), {});
    for (std::size_t w = 0; w < faces_.size(); ++w) {
        const WallPoints& points = layout_.walls()[w];
        const Index n = Index(points.x.size());
        faces_[w].resize(std::size_t(n));
#pragma omp parallel for schedule(dynamic, 256)
        for (Index k = 0; k < n; ++k) surface.faces({points.x[k], points.y[k], points.z[k]}, scene_.support(), faces_[w][std::size_t(k)]);
    }
}

double WallForces::impulse_unit(const Clock& clock) const
{
    // Of weight times height in whole energy units there are 2^46; of the weight during one crossing of the smoothing length 2^46 times
    // spacings over height, so that millions of steps fit into 63 bits.
    return std::exp2(std::floor(std::log2(clock.energy_unit / scene_.space.spacing * scene::crossing_time(scene_))));
}

void WallForces::add_impulse(const Particles& p, double seconds, Clock& clock)
{
    if (!any() || !layout_.built()) return;
    renew_faces();
    clock.impulse.resize(walls_.size());
    const double per_unit = seconds / impulse_unit(clock);
    const Index clusters = layout_.lists().size();
    bool outgrown = false;
#pragma omp parallel
    {
        std::vector<std::array<std::int64_t, 3>> mine(walls_.size());
        bool too_large = false;
#pragma omp for schedule(static) nowait
        for (Index c = 0; c < clusters; ++c)
            for_each_force(p, c, [&](std::size_t k, Vector, Vector force) {
                const double units[3] = {per_unit * force.x, per_unit * force.y, per_unit * force.z};
                for (std::size_t a = 0; a < 3; ++a)
                    if (std::fabs(units[a]) < 0x1p50) mine[k][a] += std::int64_t(std::nearbyint(units[a]));
                    else too_large = true;
            });
#pragma omp critical
        {
            for (std::size_t k = 0; k < mine.size(); ++k)
                for (std::size_t a = 0; a < 3; ++a) clock.impulse[k][a] += mine[k][a];
            outgrown = outgrown || too_large;
        }
    }
    // What no wall can bear is found by the guard, which says more.
    if (outgrown) clock.extremes.not_finite = 1;
}

std::vector<WallLoad> WallForces::loads(const Team& team, const Particles& p, const Clock& clock)
{
    std::vector<WallLoad> all;
    if (!any()) return all;
    renew_faces();
    auto impulse = clock.impulse;
    impulse.resize(walls_.size());
    team.sum(std::span<std::int64_t>(impulse.front().data(), 3 * impulse.size()));
    const auto sums = exact_sums(team, 6 * walls_.size(), [&](auto add) {
        for (Index c = 0; c < layout_.lists().size(); ++c)
            for_each_force(p, c, [&](std::size_t k, Vector x, Vector f) {
                add(6 * k, f.x), add(6 * k + 1, f.y), add(6 * k + 2, f.z);
                add(6 * k + 3, x.y * f.z - x.z * f.y), add(6 * k + 4, x.z * f.x - x.x * f.z), add(6 * k + 5, x.x * f.y - x.y * f.x);
            });
    });
    const double unit = impulse_unit(clock);
    for (std::size_t k = 0; k < walls_.size(); ++k) {
        const double* s = &sums[6 * k];
        const auto& j = impulse[k];
        all.push_back({scene_.walls[std::size_t(walls_[k])].name,
                       {s[0], s[1], s[2]},
                       {s[3], s[4], s[5]},
                       {unit * double(j[0]), unit * double(j[1]), unit * double(j[2])}});
    }
    return all;
}

} // namespace kuzure
