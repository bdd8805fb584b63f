// Maps: exact sums of the soil over cells, on any ranks in any order, and a memory that misses no front.
#include "io/scene_file.hpp"
#include "solver/run/map_record.hpp"
#include <algorithm>
#include <gtest/gtest.h>
#include <numeric>
#include <random>

using namespace kuzure;

namespace {

const char* text = R"(title = "maps"
dimensions = 3
[space]
spacing = 0.1
[time]
end = 1.0
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
friction_angle = 30.0
[soil.clay]
density = 1600.0
young = 1.8e6
poisson = 0.3
cohesion = 1e4
friction_angle = 10.0
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [2.0, 1.0, 0.5] }
[[body]]
soil = "clay"
box = { low = [2.0, 0.0, 0.0], high = [3.0, 1.0, 0.5] }
[[wall]]
box = { low = [-3.0, -3.0, -0.4], high = [20.0, 4.0, 0.0] }
[effects]
gravity = [0.0, 0.0, -9.81]
[maps]
cell = 0.2
wet = 0.1
)";

/// Scattered soil: the particles of the scene somewhere in the plan, some of them beyond it.
struct Soil {
    scene::CheckedScene checked = io::parse_checked_scene(text, "maps.toml", {}, scene::StepLimit::Enforce);
    const Scene& scene = checked.scene;
    scene::MapGrid grid = scene::map_grid(scene, checked.filling);
    MapUnits units = map_units(scene, checked.filling);
    Particles p;

    /// The particles for which keep(id) holds, in an order that `seed` decides.
    template <class Keep> Soil(unsigned seed, Keep keep)
    {
        p.require(field::velocity, field::density, field::soil);
        const auto n = checked.filling.soil_count();
        std::vector<std::int64_t> ids(static_cast<std::size_t>(n));
        std::iota(ids.begin(), ids.end(), 0);
        std::shuffle(ids.begin(), ids.end(), std::mt19937(seed));
        std::erase_if(ids, [&](std::int64_t id) { return !keep(id); });
        p.resize(Index(ids.size()));
        for (Index i = 0; i < p.size(); ++i) {
            const auto id = ids[std::size_t(i)];
            std::mt19937_64 random(std::uint64_t(id) + 1);
            const auto u = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
            p[field::id].set(i, id);
            p[field::position].set(i, Vector{u(-1, 6), u(-2, id % 50 == 0 ? 12.0 : 3.5), u(0, 2)});
            p[field::velocity].set(i, Vector{u(-3, 3), u(-3, 3), u(-1, 1)});
            const int soil = checked.scene.bodies[std::size_t(checked.filling.body_of(id))].soil;
            p[field::soil].set(i, soil);
            p[field::density].set(i, checked.scene.soils[std::size_t(soil)].density * u(0.9, 1.1));
        }
    }
};
bool all(std::int64_t) { return true; }

bool same(const std::vector<CellSums>& a, const std::vector<CellSums>& b)
{
    return std::ranges::equal(a, b, [](const CellSums& x, const CellSums& y) {
        return x.cell == y.cell && x.volume == y.volume && x.mass == y.mass && x.active == y.active && x.momentum == y.momentum &&
               x.low == y.low && x.high == y.high;
    });
}
bool same(const std::vector<MapCell>& a, const std::vector<MapCell>& b)
{
    return a.size() == b.size() && std::ranges::equal(a, b, [](const MapCell& x, const MapCell& y) {
               const auto bits = [](const MapCell& c) {
                   return std::array{c.memory.start,   c.memory.thickness, c.memory.speed,  c.memory.flux, c.memory.pressure,
                                     c.memory.arrival, c.memory.stop,      c.now.thickness, c.now.density, c.now.speed,
                                     c.now.active,     c.now.low,          c.now.high};
               };
               return x.cell == y.cell && bits(x) == bits(y);
           });
}

/// Every particle moved along its velocity.
void drift(Particles& p, double dt)
{
    for (Index i = 0; i < p.size(); ++i) p[field::position].set(i, p[field::position][i] + dt * p[field::velocity][i]);
}

} // namespace

TEST(Maps, GridCoversWallsAndSoilOnMultiplesOfItsCell)
{
    const Soil s(1, all);
    EXPECT_EQ(s.grid.x, -3.0);
    EXPECT_EQ(s.grid.y, -3.0);
    EXPECT_EQ(s.grid.columns, 115);
    EXPECT_EQ(s.grid.rows, 35);
    EXPECT_EQ(s.grid.at(-3.0, -3.0), 0);
    EXPECT_EQ(s.grid.at(19.999, 3.999), s.grid.count() - 1);
    EXPECT_EQ(s.grid.at(20.0, 0.0), -1);
    EXPECT_EQ(s.grid.at(0.0, -3.0001), -1);
    EXPECT_DOUBLE_EQ(s.grid.middle_x(1), -2.7);
    EXPECT_DOUBLE_EQ(s.grid.middle_y(s.grid.columns), -2.7);
}

TEST(Maps, SumsAreThoseOfParticlesAddedByHand)
{
    const Soil s(1, all);
    const auto sums = sum_over_cells(s.p, s.grid, s.units);
    double map_volume = 0, soil_volume = 0, beyond = 0;
    for (const auto& c : sums) {
        double volume = 0, mass = 0, active = 0;
        Vector momentum{};
        for (Index i = 0; i < s.p.size(); ++i) {
            const Vector x = s.p[field::position][i];
            const auto at = s.grid.at(x.x, x.y);
            if ((at < 0 ? s.grid.count() : at) != c.cell) continue;
            const auto& soil = s.scene.soils[std::size_t(s.p[field::soil][i])];
            const double m = soil.density * 1e-3, v = m / s.p[field::density][i];
            volume += v, mass += m, momentum = momentum + m * s.p[field::velocity][i];
            active += v * (1 - std::sin(soil.friction_angle)) / (1 + std::sin(soil.friction_angle));
        }
        const auto cell = soil_of(c, s.units, s.grid.area());
        EXPECT_NEAR(cell.thickness, volume / 0.04, 1e-9 * cell.thickness);
        EXPECT_NEAR(cell.density, mass / volume, 1e-9 * cell.density);
        EXPECT_NEAR(cell.speed, length(momentum) / mass, 1e-7);
        EXPECT_NEAR(cell.active, active / volume, 1e-9);
        map_volume += cell.thickness * s.grid.area();
        if (c.cell == s.grid.count()) beyond = volume;
    }
    for (Index i = 0; i < s.p.size(); ++i)
        soil_volume += s.scene.soils[std::size_t(s.p[field::soil][i])].density * 1e-3 / s.p[field::density][i];
    EXPECT_NEAR(map_volume, soil_volume, 1e-9 * soil_volume);
    EXPECT_GT(beyond, 0);
}

TEST(Maps, AnyOrderAndAnySplitGiveTheSameBits)
{
    const Soil once(1, all), shuffled(2, all);
    const auto want = sum_over_cells(once.p, once.grid, once.units);
    EXPECT_TRUE(same(want, sum_over_cells(shuffled.p, once.grid, once.units)));
    for (const int parts : {2, 3, 7}) {
        std::vector<CellSums> put_together;
        for (int k = parts; k-- > 0;) {
            const Soil part(unsigned(k), [&](std::int64_t id) { return id % parts == k; });
            for (const auto& c : sum_over_cells(part.p, once.grid, once.units)) put_together.push_back(c);
        }
        merge(put_together);
        EXPECT_TRUE(same(want, put_together)) << parts;
    }
}

TEST(Maps, FailedNumbersAreLeftOut)
{
    Soil s(1, all);
    const auto clean = sum_over_cells(Soil(1, [](std::int64_t id) { return id > 3; }).p, s.grid, s.units);
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < s.p.size(); ++i) {
        if (s.p[field::id][i] == 0) s.p[field::position].set(i, Vector{nan, 0, 0});
        if (s.p[field::id][i] == 1) s.p[field::velocity].set(i, Vector{0, inf, 0});
        if (s.p[field::id][i] == 2) s.p[field::density].set(i, 0.0);
        if (s.p[field::id][i] == 3) s.p[field::velocity].set(i, Vector{0, 0, 1e30});
    }
    EXPECT_TRUE(same(clean, sum_over_cells(s.p, s.grid, s.units)));
}

TEST(Maps, AnyRanksRememberTheSame)
{
    const Comm& comm = Comm::world();
    const auto history = [&](const auto& keep, const Comm& on, bool through_rows) {
        Soil s(unsigned(on.rank()), keep);
        std::optional<MapRecord> record(std::in_place, on, s.scene, s.checked.filling);
        record->begin(s.p);
        for (int step = 1; step <= 40; ++step) {
            drift(s.p, 0.01);
            record->after_step(s.p, 0.01 * step, 0.01, 4.4);
            if (!through_rows || step != 17) continue;
            // As a restart does: the rows come to other ranks than those that wrote them.
            const auto mine = record->rows();
            const auto everything = on.allgather(std::span<const MapRow>(mine));
            std::vector<MapRow> share;
            for (std::size_t k = std::size_t(on.rank()); k < everything.size(); k += std::size_t(on.size())) share.push_back(everything[k]);
            const double way = record->state().way, last = record->state().last;
            record.emplace(on, s.scene, s.checked.filling);
            EXPECT_TRUE(record->set(way, last, share));
        }
        double beyond = 0;
        auto cells = record->cells(s.p, 0.4, beyond);
        EXPECT_TRUE(on.rank() != 0 || beyond > 0);
        return cells;
    };
    // On one rank: all soil is on rank 0, the others have none.
    const auto alone = history([&](std::int64_t) { return comm.rank() == 0; }, comm, false);
    const auto together = history([&](std::int64_t id) { return id % comm.size() == comm.rank(); }, comm, false);
    const auto restarted = history([&](std::int64_t id) { return (id / 7) % comm.size() == comm.rank(); }, comm, true);
    if (comm.rank() != 0) return;
    EXPECT_GT(alone.size(), 500u);
    EXPECT_TRUE(same(alone, together));
    EXPECT_TRUE(same(alone, restarted));
}

TEST(Maps, RowsOfAnotherGridAreRefused)
{
    const Soil s(1, all);
    MapRecord record(Comm::world(), s.scene, s.checked.filling);
    const std::vector<MapRow> good{{5, 0, 1, 1, 1, 1, 0, 0}}, beyond{{double(s.grid.count()), 0, 1, 1, 1, 1, 0, 0}},
        fraction{{0.5, 0, 1, 1, 1, 1, 0, 0}}, none{{5, 0, std::nan(""), 1, 1, 1, 0, 0}};
    EXPECT_TRUE(record.set(0, 0, good));
    for (const auto& bad : {beyond, fraction, none}) EXPECT_FALSE(record.set(0, 0, bad));
}

TEST(Maps, AFastFrontPassesNoCellUnseen)
{
    // A heap that flies along x at 40 m/s, 1/16 of a cell a step: each cell on its way has it at full thickness, and its front and its
    // rear to within a cell.
    const Comm& comm = Comm::world();
    Soil s(1, [&](std::int64_t id) { return comm.rank() == 0 && id < 1000; });
    for (Index i = 0; i < s.p.size(); ++i) {
        const auto id = s.p[field::id][i];
        s.p[field::position].set(i,
                                 Vector{0.053 + 0.1 * double(id % 10), 0.05 + 0.1 * double(id / 10 % 10), 0.05 + 0.1 * double(id / 100)});
        s.p[field::velocity].set(i, Vector{40, 0, 0});
        s.p[field::soil].set(i, 0), s.p[field::density].set(i, 1850.0);
    }
    MapRecord record(comm, s.scene, s.checked.filling);
    record.begin(s.p);
    const double dt = 0.2 / 16 / 40;
    double time = 0;
    while (time < 0.4) {
        drift(s.p, dt), time += dt;
        record.after_step(s.p, time, dt, 40.0);
    }
    double beyond = 0;
    const auto cells = record.cells(s.p, time, beyond);
    if (comm.rank() != 0) return;
    int seen = 0;
    for (const auto& c : cells) {
        const double x = s.grid.middle_x(c.cell), y = s.grid.middle_y(c.cell);
        if (x < 1 || x > 14 || y < 0.25 || y > 0.75) continue;
        ++seen;
        EXPECT_NEAR(c.memory.thickness, 1.0, 1e-6) << x;
        EXPECT_NEAR(c.memory.speed, 40, 1e-6) << x;
        EXPECT_NEAR(c.memory.pressure, 1850.0 * 1600, 1) << x;
        const double front = (x - 1) / 40, cell = 0.2 / 40; // its front at the middle of the cell; a cell's way, s
        EXPECT_NEAR(c.memory.arrival, front, cell) << x;
        EXPECT_NEAR(c.memory.stop, front + 1.0 / 40, cell) << x;
    }
    EXPECT_EQ(seen, 3 * 65);
}
