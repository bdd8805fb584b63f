#pragma once
// What a set of finished runs says together: maps of probabilities, the reach with its interval, what decides it. A function of the set: no
// order of runs, no split into processes changes a byte.
#include "io/map_picture.hpp"
#include "io/named_points.hpp"
#include "solver/app/hazard/run_scene.hpp"
#include "solver/app/study/runs.hpp"
#include "solver/scene/map_grid.hpp"
#include <nlohmann/json_fwd.hpp>

namespace kuzure::hazard {

/// A sentence in English and Japanese.
struct Words {
    std::string en, ja;
};

/// What a run is for. Likely: the likely values at the ensemble's resolution; Finer: at a better one.
enum class Part { Preliminary, Likely, Member, Finer };
/// What became of it.
enum class Status { NotRun, Finished, Failed, Refused, Stopped };
const char* word(Part);
const char* word(Status);

/// The maps of a run, cropped to where soil came.
struct RunMaps {
    scene::MapGrid grid; // of all its cells, map coordinates
    std::int64_t column = 0, row = 0, columns = 0, rows = 0;
    std::vector<float> thickness, pressure, arrival; // m, kPa, s; NaN where it did not come
    double reach = 0;                                // m, from the centre of the mass to the farthest point where it was maps.wet thick
    double front = 0;                                // m, how far a layer of particles more or less moves that point
    double volume = 0;                               // m^3, on the maps at the end
};
/// Of a run's directory, whose particles stand so far apart. Throws BadInput, IoFailed.
RunMaps read_maps(const io::Path& run, const Base&, double wet, double spacing);

struct Run {
    Part part = Part::Member;
    Member member;
    double layers = 0, spacing = 0; // spacing in m
    io::Path directory;             // below that of the hazard
    Status status = Status::NotRun;
    std::string message;                 // why it failed
    int waits = study::most_waits;       // left, for a run of an earlier call in the same place
    double seconds = 0;                  // wall time, of all its starts in this call
    std::vector<std::string> notes;      // what had to be changed in its scene
    std::shared_ptr<const RunMaps> maps; // of a finished one
    bool finished() const { return status == Status::Finished; }
};

/// How much the reach may change with the resolution.
struct Discretisation {
    enum Kind { Unknown, Difference, Spread, Richardson } kind = Unknown;
    double half_width = 0;                      // m, no less than `front`
    double front = 0;                           // m: RunMaps::front of the finest run; thinner than that no resolution tells a flow
    double order = 0;                           // observed, of Richardson
    std::string how;                            // in words
    std::vector<std::array<double, 2>> samples; // layers, reach in m
    std::vector<const Run*> finest_two;         // runs of the likely values, of which samples are compared; or none
    double thickness = 0;                       // m: root mean square of their difference in greatest thickness, over the cells of either
};
struct Sensitivity {
    std::string input;
    double correlation; // with the reach; NaN where one of the two does not vary
    std::array<double, 2> interval;
};
struct NamedResult {
    io::NamedPoint at;
    double probability = 0;
    std::array<double, 3> arrival{};   // s: 10, 50, 90 % of the runs that come there; NaN: none
    std::array<double, 3> thickness{}; // m: of all runs
    double pressure = 0;               // kPa, greatest of all runs
};

struct Answer {
    std::vector<const Run*> counted;      // what the probabilities are made of, by number
    bool preliminary = true;              // they are made of what there is so far
    double low = 0, likely = 0, high = 0; // m, reach
    Discretisation discretisation;
    std::vector<Sensitivity> sensitivity;
    std::array<double, 3> volume{}; // m^3: least, mean, greatest
    std::vector<NamedResult> points;
    double area_05 = 0, area_50 = 0, area_95 = 0; // m^2 inside the outlines
};

/// From how many finished members probabilities are made of members alone; below, of all finished runs.
inline constexpr int enough_members = 3;

/// Reach, interval, sensitivity; no files. Of at least one finished run.
Answer answer_of(const Base&, const std::vector<Run>&);
/// The rasters, outlines and pictures into DIR/maps and points.csv, each whole at once; fills in what the answer says of points.
void write_maps(const Base&, Answer&, const std::vector<io::NamedPoint>&, const io::Path& directory);

} // namespace kuzure::hazard
