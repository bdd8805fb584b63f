#include "solver/run/probes.hpp"
#include "solver/core/bulk_density.hpp"
#include "solver/run/exact_sums.hpp"
#include <limits>

namespace kuzure {
namespace {

constexpr std::size_t numbers = 16; // of one probe: count, weight, position, velocity, density, stress, plastic strain

/// From a point to the nearest image of another, m.
Vector nearest_way(const Scene& scene, Vector from, Vector to)
{
    Vector way = to - from;
    if (!scene.space.low) return way;
    const Vector period = *scene.space.high - *scene.space.low;
    const auto wrap = [&](int axis, double& d, double p) {
        if (scene.space.periodic[std::size_t(axis)]) d -= p * std::nearbyint(d / p);
    };
    wrap(0, way.x, period.x), wrap(1, way.y, period.y), wrap(2, way.z, period.z);
    return way;
}

} // namespace

std::vector<Reading> read_probes(const Team& team, const Scene& scene, const scene::Filling& filling, std::span<const Material> soils,
                                 const Particles& p)
{
    const auto x = p[field::position], v = p[field::velocity];
    const auto rho = p[field::density], plastic = p[field::plastic_strain];
    const auto stress = p[field::stress];
    const auto id = p[field::id];
    const auto soil = p[field::soil];
    const double support = scene.support(), volume = scene.particle_volume();
    const auto sums = exact_sums(team, numbers * scene.probes.size(), [&](auto add) {
        for (std::size_t k = 0; k < scene.probes.size(); ++k) {
            const scene::Probe& probe = scene.probes[k];
            const auto take = [&](Index i, double weight) {
                const Vector at = x[i], moves = v[i];
                const Stress s = stress[i];
                const double all[numbers - 2] = {at.x, at.y, at.z, moves.x, moves.y, moves.z, bulk_density(p, i),
                                                 s.xx, s.yy, s.zz, s.xy,    s.yz,    s.xz,    plastic[i]};
                add(numbers * k, 1), add(numbers * k + 1, weight);
                for (std::size_t n = 2; n < numbers; ++n) add(numbers * k + n, weight * all[n - 2]);
            };
            std::int64_t first = -1, last = -2;
            if (probe.particle) first = last = *probe.particle;
            if (!probe.body.empty()) {
                first = 0;
                std::size_t b = 0;
                while (scene.bodies[b].name != probe.body) first += filling.body_count(int(b++));
                last = first + filling.body_count(int(b)) - 1;
            }
            for (Index i = 0; i < p.size(); ++i) {
                if (!probe.point) {
                    if (first <= id[i] && id[i] <= last) take(i, probe.particle ? 1 : soils[std::size_t(soil[i])].density * volume);
                    continue;
                }
                // the weight of Wendland's kernel C2, 1 - q/2 = t
                const double t = 1 - length(nearest_way(scene, *probe.point, x[i])) / support;
                if (t > 0) take(i, soils[std::size_t(soil[i])].density * volume / rho[i] * (t * t * t * t) * (5 - 4 * t));
            }
        }
    });
    std::vector<Reading> readings;
    for (std::size_t k = 0; k < scene.probes.size(); ++k) {
        const double* s = &sums[numbers * k];
        const auto mean = [&](std::size_t n) { return s[1] > 0 ? s[n] / s[1] : std::numeric_limits<double>::quiet_NaN(); };
        const scene::Probe& probe = scene.probes[k];
        readings.push_back({probe.name.empty() ? std::to_string(k) : probe.name,
                            std::int64_t(s[0]),
                            probe.point ? *probe.point : Vector{mean(2), mean(3), mean(4)},
                            {mean(5), mean(6), mean(7)},
                            mean(8),
                            {mean(9), mean(10), mean(11), mean(12), mean(13), mean(14)},
                            mean(15)});
    }
    return readings;
}

} // namespace kuzure
