#pragma once
// What a run leaves when it ends, however it ends: pictures, summary.json, timers, report.html.
#include "io/result_directory.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/run/messages.hpp"
#include "solver/app/run/outputs.hpp"
#include "solver/app/scaling/forecast.hpp"
#include "solver/app/study/twins.hpp"
#include "solver/run/simulation.hpp"
#include <nlohmann/json.hpp>

namespace kuzure {

/// What the end needs to know of a run beside its simulation and outputs.
struct RunFacts {
    std::string scene_hash;
    int threads = 1;
    double start = 0;            // wall_clock() when it began, s
    double loop_seconds = 0;     // in steps
    std::int64_t first_step = 0; // of this leg
    double peak_speed = 0;       // m/s, over all steps of all legs
    Forecast forecast;
    std::vector<nlohmann::ordered_json> retries;
    nlohmann::ordered_json started_from; // checkpoint and time (s) of another run, or null
    bool with_twins = false;
    std::vector<study::TwinRun> twins;
};

class Ending {
public:
    Ending(const Comm& comm, const Scene& scene, const io::ResultDirectory& directory, Messages& messages, const RunFacts& facts)
        : comm_(comm), scene_(scene), directory_(directory), messages_(messages), facts_(facts)
    {
    }
    /// Collective: pictures, summary and timers, report. `status` and `message` as in summary.json. Throws IoFailed where the summary
    /// cannot be written; what people look at is done without, with a warning.
    void write(Simulation&, const Outputs&, const std::string& status, Exit code, const std::string& message = {});
    /// Collective: summary.json and the timers alone, of a run that made no step.
    void write_summary(Simulation&, const Outputs&, const std::string& status, Exit code, const std::string& message = {});
    /// What a run took against what was said before, and where its report is.
    void say_finished(const Simulation&, const Outputs&);

private:
    void draw_pictures(Simulation&);
    void warn_of_volume(double resting_volume_ratio);
    void write_timers(Simulation&);
    void write_report();

    const Comm& comm_;
    const Scene& scene_;
    const io::ResultDirectory& directory_;
    Messages& messages_;
    const RunFacts& facts_;
};

} // namespace kuzure
