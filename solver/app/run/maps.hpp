#pragma once
// The maps of a run: rasters of what happened, outlines, what came to named points, how far the front got.
#include "io/checkpoint.hpp"
#include "io/map_picture.hpp"
#include "io/named_points.hpp"
#include "io/result_directory.hpp"
#include "io/rows.hpp"
#include "solver/run/map_record.hpp"
#include "solver/run/simulation.hpp"
#include <nlohmann/json.hpp>

namespace kuzure {

/// Collective: the named points of a scene with maps. Throws BadInput where this build has no maps, where the file is wrong, or where none
/// of its points lies on the maps; `warn` gets, on rank 0, a sentence on points that do not.
std::vector<io::NamedPoint> points_of_maps(const Comm&, const Scene&, const scene::Filling&,
                                           const std::function<void(const std::string&)>& warn);

/// What a checkpoint keeps of maps.
struct KeptMaps {
    double way = 0, last = 0; // as MapRecord::State
    std::vector<MapRow> rows; // this rank's
};
/// Collective: of a checkpoint from which a run with maps goes on. Throws BadInput where it was written without maps or with others.
KeptMaps maps_of(const Comm&, const io::Checkpoint&, const Scene&, const scene::Filling&);

class Maps {
public:
    /// Collective. `kept`: of the checkpoint from which the run goes on.
    Maps(const Comm&, const Scene&, const io::ResultDirectory&, Simulation&, std::vector<io::NamedPoint>,
         const std::optional<KeptMaps>& kept, std::optional<double> restart_time);
    /// Collective: after every step.
    void after_step(Simulation&);
    /// Collective: the simulation went back to the last good state.
    void take_back(double time);
    /// Collective: all files of maps as if the run ended here; pictures where they are drawn. Readers see old ones or new ones, each whole.
    enum class Pictures { Draw, Leave };
    void write(Simulation&, Pictures);
    /// Collective: a row of front.csv, where there is none of this time.
    void write_front(Simulation&);
    /// For summary.json, of the last write().
    const nlohmann::ordered_json& summary() const { return summary_; }
    /// For a checkpoint: its table and what its header says of maps.
    io::CheckpointTable table() const;
    nlohmann::ordered_json header() const;

private:
    void open_front(std::optional<double> restart_time);
    void write_files(const std::vector<MapCell>&, double time, double beyond, Pictures);
    void write_rasters(const io::Place& folder, const std::vector<MapCell>&);
    std::vector<io::MapPicture::Outline> outlines(const std::vector<MapCell>&) const;
    void write_outlines(const io::Place& folder, const std::vector<io::MapPicture::Outline>&);
    void write_pictures(const io::Place& folder, const std::vector<MapCell>&, const std::vector<io::MapPicture::Outline>&);
    void write_points(const std::vector<MapCell>&);

    const Comm& comm_;
    const Scene& scene_;
    const io::ResultDirectory& directory_;
    std::vector<io::NamedPoint> points_;
    MapRecord record_;
    std::optional<MapRecord::State> good_; // of the simulation's last good state, for time.retry
    Vector centre_{};                      // m, of the soil at t = 0
    double gravity_ = 0;                   // m/s^2
    std::optional<io::Rows> front_;
    nlohmann::ordered_json summary_;
};

} // namespace kuzure
