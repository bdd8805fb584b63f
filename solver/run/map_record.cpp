#include "solver/run/map_record.hpp"
#include "solver/core/bulk_density.hpp"
#include "solver/scene/numbers.hpp"
#include <algorithm>
#include <cmath>
#include <map>

namespace kuzure {

void CellSums::add(const CellSums& o)
{
    volume += o.volume, mass += o.mass, active += o.active;
    for (std::size_t k = 0; k < 3; ++k) momentum[k] += o.momentum[k];
    low = std::min(low, o.low), high = std::max(high, o.high);
}

MapUnits map_units(const Scene& scene, const scene::Filling& filling)
{
    MapUnits u;
    double mass = 0, speed = 0;
    for (const auto& soil : scene.soils) {
        u.particle_mass.push_back(soil.density * scene.particle_volume());
        u.active.push_back((1 - std::sin(soil.friction_angle)) / (1 + std::sin(soil.friction_angle)));
        mass = std::max(mass, u.particle_mass.back()), speed = std::max(speed, Material::from(soil).c_p);
    }
    for (const auto& body : scene.bodies) speed = std::max(speed, length(body.velocity));
    const auto& all = filling.bounds();
    speed = std::max(speed, std::sqrt(2 * length(scene.effects.gravity.value_or(Vector{})) * length(all.high - all.low)));
    // All particles in one cell, each with sixteen times what is meant to be most, still fit into 63 bits.
    const auto power_above = [](double x) { return std::ilogb(x) + 1; };
    const int bits = 58 - power_above(double(filling.soil_count()));
    const int v = power_above(scene.particle_volume()), m = power_above(mass), c = power_above(speed);
    u.volume = std::ldexp(1.0, v - bits), u.mass = std::ldexp(1.0, m - bits), u.momentum = std::ldexp(1.0, m + c - bits);
    u.most_volume = std::ldexp(1.0, v + 4), u.most_speed = std::ldexp(1.0, c + 4);
    for (std::size_t k = 0; k < 2; ++k) {
        if (!scene.space.periodic[k]) continue;
        const auto along = [&](const Vector& a) { return k == 0 ? a.x : a.y; };
        u.low[k] = along(*scene.space.low), u.period[k] = along(*scene.space.high) - u.low[k];
    }
    return u;
}

namespace {

/// Sums of some cells at a time: particles come column by column, so that a cell is rarely put aside before it is complete.
class Gathering {
public:
    Gathering() : open_(256) {}
    CellSums& at(std::int64_t cell, double z)
    {
        CellSums& s = open_[std::size_t(std::uint64_t(cell) * 0x9E3779B97F4A7C15u >> 56)];
        if (s.cell != cell) {
            if (s.cell >= 0) done_.push_back(s);
            s = {.cell = cell, .low = z, .high = z};
        }
        return s;
    }
    std::vector<CellSums> take()
    {
        for (const auto& s : open_)
            if (s.cell >= 0) done_.push_back(s);
        merge(done_);
        return std::move(done_);
    }

private:
    std::vector<CellSums> open_, done_;
};

} // namespace

void merge(std::vector<CellSums>& all)
{
    std::ranges::sort(all, {}, &CellSums::cell);
    std::size_t n = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (n > 0 && all[n - 1].cell == all[k].cell) all[n - 1].add(all[k]);
        else all[n++] = all[k];
    }
    all.resize(n);
}

std::vector<CellSums> sum_over_cells(const Particles& p, const scene::MapGrid& grid, const MapUnits& u)
{
    const auto x = p[field::position], v = p[field::velocity];
    const auto soil = p[field::soil];
    const Index n = p.size();
    const double per_volume = 1 / u.volume, per_mass = 1 / u.mass, per_momentum = 1 / u.momentum; // exact
    const auto wrapped = [&](double a, std::size_t k) {
        if (u.period[k] == 0) return a;
        return a < u.low[k] ? a + u.period[k] : a >= u.low[k] + u.period[k] ? a - u.period[k] : a;
    };
    const auto finite = [](Vector a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); };
    std::vector<CellSums> all;
#pragma omp parallel if (n > 4096)
    {
        Gathering mine;
#pragma omp for schedule(static) nowait
        for (Index i = 0; i < n; ++i) {
            const Vector a = x[i], w = v[i];
            const double m = u.particle_mass[std::size_t(soil[i])];
            // Of numbers that have failed no map is made.
            const double rho = bulk_density(p, i);
            if (!finite(a) || !finite(w) || !std::isfinite(rho)) continue;
            if (rho * u.most_volume <= m || std::max({std::abs(w.x), std::abs(w.y), std::abs(w.z)}) >= u.most_speed) continue;
            const double volume = m / rho;
            const std::int64_t at = grid.at(wrapped(a.x, 0), wrapped(a.y, 1));
            CellSums& s = mine.at(at < 0 ? grid.count() : at, a.z);
            s.volume += std::lrint(volume * per_volume), s.mass += std::lrint(m * per_mass);
            s.active += std::lrint(volume * u.active[std::size_t(soil[i])] * per_volume);
            s.momentum[0] += std::lrint(m * w.x * per_momentum);
            s.momentum[1] += std::lrint(m * w.y * per_momentum);
            s.momentum[2] += std::lrint(m * w.z * per_momentum);
            s.low = std::min(s.low, a.z), s.high = std::max(s.high, a.z);
        }
        const auto part = mine.take();
#pragma omp critical
        all.insert(all.end(), part.begin(), part.end());
    }
    merge(all);
    return all;
}

CellSoil soil_of(const CellSums& s, const MapUnits& u, double area)
{
    CellSoil c;
    const double volume = double(s.volume) * u.volume, mass = double(s.mass) * u.mass;
    if (!(volume > 0)) return c;
    c.thickness = volume / area, c.density = mass / volume, c.active = double(s.active) / double(s.volume);
    c.speed = length(Vector{double(s.momentum[0]), double(s.momentum[1]), double(s.momentum[2])}) * u.momentum / mass;
    c.low = s.low, c.high = s.high;
    return c;
}

MapRecord::MapRecord(const Comm& comm, const Scene& scene, const scene::Filling& filling)
    : comm_(comm), grid_(scene::map_grid(scene, filling)), units_(map_units(scene, filling)), wet_(scene.maps->wet),
      slow_(scene::resting_speed(scene))
{
    const double g = length(scene.effects.gravity.value_or(Vector{}));
    pause_ = g > 0 ? std::sqrt(grid_.cell / g) : std::numeric_limits<double>::infinity();
}

int MapRecord::keeper(std::int64_t cell) const
{
    // Squares of cells by one rank.
    const auto square = std::uint64_t(cell % grid_.columns) >> 5 | std::uint64_t(cell / grid_.columns) >> 5 << 32;
    return int((square * 0x9E3779B97F4A7C15u >> 32) % std::uint64_t(comm_.size()));
}

std::vector<CellSums> MapRecord::sums_here(const Particles& p) const
{
    auto sums = sum_over_cells(p, grid_, units_);
    if (comm_.size() == 1) return sums;
    std::map<int, std::vector<CellSums>> to;
    for (const auto& s : sums) to[keeper(s.cell)].push_back(s);
    std::vector<MessageOf<CellSums>> out;
    for (auto& [rank, which] : to) out.push_back({rank, std::move(which)});
    sums.clear();
    for (const auto& part : comm_.exchange(out)) sums.insert(sums.end(), part.items.begin(), part.items.end());
    merge(sums);
    return sums;
}

void MapRecord::remember(CellMemory& m, const CellSoil& s, double time) const
{
    m.thickness = std::max(m.thickness, s.thickness);
    if (s.thickness < wet_ * (1 - 1e-6)) return; // a whole layer counts, whatever its last digits
    if (m.arrival < 0) m.arrival = time;
    if (s.speed > slow_) m.stop = time;
    m.speed = std::max(m.speed, s.speed), m.flux = std::max(m.flux, s.thickness * s.speed);
    m.pressure = std::max(m.pressure, s.density * s.speed * s.speed);
}

void MapRecord::sample(const Particles& p, double time)
{
    for (const auto& s : sums_here(p))
        if (s.cell < grid_.count()) remember(state_.cells[s.cell], soil_of(s, units_, grid_.area()), time);
    state_.way = 0, state_.last = time;
}

void MapRecord::begin(const Particles& p)
{
    sample(p, 0);
    for (auto& [cell, memory] : state_.cells) memory.start = memory.thickness;
}

void MapRecord::after_step(const Particles& p, double time, double dt, double max_speed)
{
    state_.way += dt * max_speed;
    if (state_.way >= 0.25 * grid_.cell || time - state_.last >= pause_) sample(p, time);
}

std::vector<MapCell> MapRecord::cells(const Particles& p, double time, double& beyond) const
{
    std::unordered_map<std::int64_t, CellSoil> now;
    for (const auto& s : sums_here(p)) now.emplace(s.cell, soil_of(s, units_, grid_.area()));
    std::vector<MapCell> mine;
    mine.reserve(std::max(now.size(), state_.cells.size()));
    for (const auto& [cell, memory] : state_.cells) mine.push_back({cell, memory, {}});
    for (const auto& [cell, soil] : now)
        if (!state_.cells.contains(cell)) mine.push_back({cell, {}, {}});
    for (auto& c : mine) {
        const auto found = now.find(c.cell);
        if (found == now.end()) continue;
        c.now = found->second;
        remember(c.memory, c.now, time);
    }
    std::vector<MapCell> all;
    for (const auto& part : comm_.gather(std::as_bytes(std::span(mine)))) {
        const auto first = all.size();
        all.resize(first + part.size() / sizeof(MapCell));
        if (!part.empty()) std::memcpy(&all[first], part.data(), part.size());
    }
    std::ranges::sort(all, {}, &MapCell::cell);
    beyond = 0;
    if (!all.empty() && all.back().cell == grid_.count()) {
        beyond = all.back().now.thickness * grid_.area();
        all.pop_back();
    }
    return all;
}

std::vector<MapRow> MapRecord::rows() const
{
    std::vector<MapRow> rows;
    rows.reserve(state_.cells.size());
    for (const auto& [cell, m] : state_.cells)
        rows.push_back({double(cell), m.start, m.thickness, m.speed, m.flux, m.pressure, m.arrival, m.stop});
    return rows;
}

bool MapRecord::set(double way, double last, std::span<const MapRow> rows)
{
    bool good = way >= 0 && last >= 0;
    std::map<int, std::vector<MapRow>> to;
    for (const auto& r : rows) {
        const bool fits = r[0] >= 0 && r[0] < double(grid_.count()) && r[0] == std::floor(r[0]) &&
                          std::ranges::all_of(r, [](double x) { return std::isfinite(x); });
        good = good && fits;
        if (fits) to[keeper(std::int64_t(r[0]))].push_back(r);
    }
    if (!comm_.all(good)) return false;
    std::vector<MessageOf<MapRow>> out;
    for (auto& [rank, which] : to) out.push_back({rank, std::move(which)});
    state_ = {way, last, {}};
    for (const auto& part : comm_.exchange(out))
        for (const auto& r : part.items) state_.cells[std::int64_t(r[0])] = {r[1], r[2], r[3], r[4], r[5], r[6], r[7]};
    return true;
}

} // namespace kuzure
