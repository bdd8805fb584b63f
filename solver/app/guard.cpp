#include "solver/app/guard.hpp"
#include "solver/scene/shape.hpp"
#include <limits>
#include <numbers>

namespace kuzure {

namespace {
/// Largest value over the ranks, and the lowest id among the particles that reach it.
struct Worst {
    double value = 0;
    std::int64_t id = std::numeric_limits<std::int64_t>::max();
    void meet(double v, std::int64_t i)
    {
        if (v > value || (v == value && i < id)) value = v, id = i;
    }
    std::int64_t combine(const Team& team)
    {
        const double largest = team.max(value);
        if (value < largest) id = std::numeric_limits<std::int64_t>::max();
        value = largest;
        team.min(std::span<std::int64_t>(&id, 1));
        return value > 0 ? id : -1;
    }
};
} // namespace

Neighbourhoods inspect_neighbours(const Team& team, const Scene& scene, std::int64_t soil_count, const Particles& p,
                                  const ClusterLists& lists, const double* ghost_x, const double* ghost_y, const double* ghost_z)
{
    const double dx = scene.space.spacing, support2 = scene.support() * scene.support(), near2 = limit::near * dx * limit::near * dx;
    const double reach = 2 * scene.space.h, pi = std::numbers::pi;
    const double lattice = scene.dimensions == 3 ? 4 * pi / 3 * reach * reach * reach : pi * reach * reach;
    const auto x = p[field::sorted_position];
    const double *px = x.column[0], *py = x.column[1], *pz = x.column[2];
    const auto* id = p[field::id].column[0];
    const Index n = p.size(), clusters = lists.size();
    Worst crowded, sunk;
    std::int64_t clumped = 0;
#pragma omp parallel
    {
        Worst my_crowded, my_sunk;
        std::int64_t my_clumped = 0;
#pragma omp for schedule(static) nowait
        for (Index c = 0; c < clusters; ++c)
            for (Index i = lists.first(c); i < lists.first(c) + lists.count(c); ++i) {
                const Vector at{px[i], py[i], pz[i]};
                int neighbours = 0, near = 0;
                for (const Index j : lists.soil(c)) {
                    const Vector r = j < n ? at - Vector{px[j], py[j], pz[j]} : at - Vector{ghost_x[j - n], ghost_y[j - n], ghost_z[j - n]};
                    const double r2 = dot(r, r);
                    neighbours += r2 < support2, near += r2 < near2;
                }
                my_clumped += near > 1; // every particle meets itself
                my_crowded.meet((neighbours - 1) / lattice, id[i]);
                for (auto walls = lists.walls(c); !walls.empty(); walls = walls.subspan(2 + walls[1]))
                    my_sunk.meet(-scene::contact(scene.walls[walls[0]].shape, at, scene.dimensions).distance / dx, id[i]);
            }
#pragma omp critical
        {
            crowded.meet(my_crowded.value, my_crowded.id), sunk.meet(my_sunk.value, my_sunk.id);
            clumped += my_clumped;
        }
    }
    Neighbourhoods all;
    all.clumped = double(team.sum(clumped)) / double(std::max<std::int64_t>(1, soil_count));
    all.crowded_id = crowded.combine(team), all.most_neighbours = crowded.value;
    all.sunk_id = sunk.combine(team), all.deepest = sunk.value;
    return all;
}

} // namespace kuzure
