#pragma once
// What maps are made of: exact sums of the soil over cells in plan, and what each cell remembers of the run.
#include "decomposition/comm.hpp"
#include "solver/core/particles.hpp"
#include "solver/scene/map_grid.hpp"
#include "solver/scene/material.hpp"
#include <unordered_map>

namespace kuzure {

/// The soil in one cell at one time, in whole units: the same whatever the order in which it is added up.
struct CellSums {
    std::int64_t cell = -1;
    std::int64_t volume = 0, mass = 0, active = 0; // active: volume times the coefficient of active earth pressure
    std::array<std::int64_t, 3> momentum{};
    double low = 0, high = 0; // m, lowest and highest particle centre
    void add(const CellSums&);
};

/// What the sums count in, and what is left out of them.
struct MapUnits {
    double volume, mass, momentum;             // m^3, kg, kg m/s: powers of two
    double most_volume, most_speed;            // m^3, m/s: a particle beyond has failed, and would not fit
    std::vector<double> particle_mass, active; // of each soil: kg, 1
    std::array<double, 2> low{}, period{};     // m, along x and y; a period of 0: none
};
MapUnits map_units(const Scene&, const scene::Filling&);

/// The sums of these particles by rising cell. Soil beyond the grid is in the cell after the last.
std::vector<CellSums> sum_over_cells(const Particles&, const scene::MapGrid&, const MapUnits&);
/// Brings the sums of equal cells together, by rising cell.
void merge(std::vector<CellSums>&);

/// The soil of a cell as its sums tell it: mean over its depth along z.
struct CellSoil {
    double thickness = 0;     // m: volume over area
    double density = 0;       // kg/m^3
    double speed = 0;         // m/s: of all momentum over all mass
    double active = 0;        // 1, coefficient of active earth pressure
    double low = 0, high = 0; // m, lowest and highest particle centre
};
CellSoil soil_of(const CellSums&, const MapUnits&, double area);

/// What a cell remembers. Speeds, fluxes, pressures and times count only while the soil is as thick as maps.wet.
struct CellMemory {
    double start = 0;               // m, thickness at t = 0
    double thickness = 0;           // m, greatest; as the following
    double speed = 0, flux = 0;     // m/s, m^2/s
    double pressure = 0;            // Pa, density times the square of the speed
    double arrival = -1, stop = -1; // s: first time at maps.wet, last time faster than scene::resting_speed(); -1: never
};

/// A cell in which there is or was soil.
struct MapCell {
    std::int64_t cell;
    CellMemory memory;
    CellSoil now;
};

/// A row of a map record in a checkpoint: the cell, then its memory.
using MapRow = std::array<double, 8>;

/// The memory of all cells, each kept by one rank. It samples the soil when some of it may have moved by a quarter of a cell, and at least
/// once in the time in which soil falls by half a cell; both are known to all ranks alike, so that the maps are the same on any of them.
class MapRecord {
public:
    /// Of a scene with maps.
    MapRecord(const Comm&, const Scene&, const scene::Filling&);
    const scene::MapGrid& grid() const { return grid_; }
    double wet() const { return wet_; }

    /// Collective: t = 0.
    void begin(const Particles&);
    /// Collective: after a step of this length (s) that led to `time`; `max_speed` (m/s) is that of all soil on all ranks.
    void after_step(const Particles&, double time, double dt, double max_speed);
    /// Collective: every cell with soil, now or before, as if the run ended here; by rising cell, on rank 0. What is remembered stays as it
    /// is. `beyond`: volume (m^3) outside the grid, on rank 0.
    std::vector<MapCell> cells(const Particles&, double time, double& beyond) const;

    /// All that a restart needs. The cells are those of this rank; on reading, any ranks may bring them.
    struct State {
        double way = 0;  // m, since it last sampled
        double last = 0; // s, when that was
        std::unordered_map<std::int64_t, CellMemory> cells;
    };
    const State& state() const { return state_; }
    void set(State s) { state_ = std::move(s); }
    std::vector<MapRow> rows() const;
    /// Collective. False, on all ranks, where a row is none of this grid.
    bool set(double way, double last, std::span<const MapRow>);

private:
    void sample(const Particles&, double time);
    /// Collective: the sums of the cells that this rank keeps.
    std::vector<CellSums> sums_here(const Particles&) const;
    int keeper(std::int64_t cell) const;
    void remember(CellMemory&, const CellSoil&, double time) const;

    const Comm& comm_;
    scene::MapGrid grid_;
    MapUnits units_;
    double wet_, slow_, pause_; // m, m/s, s
    State state_;
};

} // namespace kuzure
