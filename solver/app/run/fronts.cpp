#include "solver/app/run/fronts.hpp"
#include "solver/core/bulk_density.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/numbers.hpp"
#include <algorithm>
#include <limits>
#include <map>
#include <unordered_map>

namespace kuzure {

namespace {
struct Column {
    std::int32_t x, y;
    std::int32_t count;
    double top; // m, highest particle centre
};

/// Share of all soil that is below the lowest wall or beyond the outermost ones, or was taken out of the run when it had been there.
double share_off_ground(const Comm& comm, const Particles& p, const Scene& s, const scene::Filling& filling)
{
    if (s.walls.empty()) return 0;
    const auto x = p[field::position];
    scene::Box all = scene::bounds(s.walls.front().shape);
    for (const auto& wall : s.walls) {
        const auto b = scene::bounds(wall.shape);
        all.low = {std::min(all.low.x, b.low.x), std::min(all.low.y, b.low.y), std::min(all.low.z, b.low.z)};
        all.high = {std::max(all.high.x, b.high.x), std::max(all.high.y, b.high.y), std::max(all.high.z, b.high.z)};
    }
    // Along a period nothing is beyond anything.
    const bool along_x = !s.space.periodic[0], along_y = s.dimensions == 3 && !s.space.periodic[1], along_z = !s.space.periodic[2];
    std::int64_t left = 0;
    for (Index i = 0; i < p.size(); ++i) {
        const Vector a = x[i];
        left += (along_x && (a.x < all.low.x || a.x > all.high.x)) || (along_y && (a.y < all.low.y || a.y > all.high.y)) ||
                (along_z && a.z < all.low.z);
    }
    const double gone = double(comm.sum(left) + taken_out(comm, p, s, filling));
    return gone / double(std::max<std::int64_t>(1, filling.soil_count()));
}
} // namespace

Fronts measure_fronts(const Comm& comm, const Particles& p, const Scene& s, const scene::Filling& filling)
{
    const double dx = s.space.spacing;
    const auto& start = filling.soil_bounds();
    const Vector corner{start.low.x - 0.5 * dx, s.dimensions == 3 ? start.low.y - 0.5 * dx : 0, start.low.z - 0.5 * dx};
    const auto x = p[field::position];

    std::unordered_map<std::int64_t, Column> mine;
    mine.reserve(std::size_t(p.size()) / 4 + 16);
    for (Index i = 0; i < p.size(); ++i) {
        const Vector a = x[i];
        const auto cx = std::int32_t(std::floor((a.x - corner.x) / dx));
        const auto cy = s.dimensions == 3 ? std::int32_t(std::floor((a.y - corner.y) / dx)) : 0;
        auto& c = mine.try_emplace(std::int64_t(cx) << 32 | std::uint32_t(cy), Column{cx, cy, 0, a.z}).first->second;
        ++c.count;
        c.top = std::max(c.top, a.z);
    }
    std::vector<Column> columns;
    columns.reserve(mine.size());
    for (const auto& [key, c] : mine) columns.push_back(c);
    if (comm.size() > 1) {
        // Columns that several ranks share are put together by a rank that their position decides, squares of them by one, so
        // that no rank ever holds them all.
        std::map<int, std::vector<Column>> to;
        for (const Column& c : columns) {
            const std::uint64_t square = (std::uint64_t(std::uint32_t(c.x >> 5)) << 32 | std::uint32_t(c.y >> 5)) * 0x9E3779B97F4A7C15u;
            to[int((square >> 32) % std::uint64_t(comm.size()))].push_back(c);
        }
        std::vector<MessageOf<Column>> typed;
        for (auto& [rank, which] : to) typed.push_back({rank, std::move(which)});
        std::unordered_map<std::int64_t, Column> all;
        for (const auto& part : comm.exchange(typed))
            for (const Column& c : part.items) {
                auto& sum = all.try_emplace(std::int64_t(c.x) << 32 | std::uint32_t(c.y), Column{c.x, c.y, 0, c.top}).first->second;
                sum.count += c.count;
                sum.top = std::max(sum.top, c.top);
            }
        columns.clear();
        for (const auto& [key, c] : all) columns.push_back(c);
    }
    // A column of n particles stands n spacings high: volume spacing^3 each over spacing^2.
    const double grain = s.output.grain.value_or(dx);
    double e[5] = {-1e300, -1e300, -1e300, -1e300, -1e300}; // top, -min_x, max_x, -min_y, max_y
    for (const Column& c : columns) {
        if (c.count * dx < grain * (1 - 1e-9)) continue;
        e[0] = std::max(e[0], c.top + 0.5 * dx - corner.z);
        e[1] = std::max(e[1], -(corner.x + c.x * dx)), e[2] = std::max(e[2], corner.x + (c.x + 1) * dx);
        e[3] = std::max(e[3], -(corner.y + c.y * dx)), e[4] = std::max(e[4], corner.y + (c.y + 1) * dx);
    }
    comm.max(std::span<double>(e));
    const double off = share_off_ground(comm, p, s, filling);
    if (e[0] < -1e299) return {.off_ground = off};
    if (s.dimensions == 2) e[3] = e[4] = 0;
    return {e[0], -e[1], e[2], -e[3], e[4], off};
}

std::int64_t taken_out(const Comm& comm, const Particles& p, const Scene& s, const scene::Filling& filling)
{
    return scene::soil_present(s, filling) - comm.sum(std::int64_t(p.size()));
}

double resting_volume_ratio(const Comm& comm, const Particles& p, const Scene& scene, const scene::Filling& filling)
{
    const double slow = scene::resting_speed(scene);
    // In whole units of 2^-32: the same sum on any ranks.
    std::int64_t count = 0, sum = 0;
    for (Index i = 0; i < p.size(); ++i) {
        if (length(p[field::velocity][i]) > slow) continue;
        const auto& body = scene.bodies[std::size_t(filling.body_of(p[field::id][i]))];
        ++count, sum += std::llround(scene.soils[std::size_t(body.soil)].density / bulk_density(p, i) * 0x1p32);
    }
    count = comm.sum(count);
    const double total = double(comm.sum(sum)) * 0x1p-32;
    return count > 0 ? total / double(count) : 0;
}

} // namespace kuzure
