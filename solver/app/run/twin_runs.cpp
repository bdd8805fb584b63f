#include "solver/app/run/twin_runs.hpp"
#include "io/json.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/check.hpp"
#include <fmt/format.h>

namespace kuzure {

namespace {

/// How an earlier leg's twin ended: as summary.json says, "killed" where a checkpoint alone is left, empty where there is nothing of this
/// scene. Of this rank alone.
std::string earlier_status(const study::TwinRun& t)
{
    std::error_code ignored;
    if (std::filesystem::exists(t.directory / "summary.json", ignored)) {
        const auto j = io::parse_json(io::read_text(t.directory / "summary.json"), false);
        if (j.is_object() && j.contains("status") && j["status"].is_string() && j.contains("scene_hash") &&
            j["scene_hash"] == io::scene_hash(t.twin.scene))
            return j["status"];
    }
    return std::filesystem::exists(t.directory / "checkpoint.h5", ignored) ? "killed" : "";
}

} // namespace

std::optional<std::vector<study::TwinRun>> run_twins(const Comm& comm, const RunArguments& args, const Scene& scene,
                                                     const io::ResultDirectory& directory, Messages& messages, double start,
                                                     const std::function<Exit(const RunArguments&, scene::CheckedScene)>& run)
{
    std::vector<study::TwinRun> twins;
    for (const int factor : study::twin_factors) {
        study::TwinRun t;
        t.twin.factor = factor;
        t.directory = directory.path() / "twins" / fmt::format("x{}", factor);
        try {
            t.twin = study::coarsened(scene, factor);
            std::string status;
            if (args.restart && comm.rank() == 0) status = earlier_status(t);
            status = comm.broadcast(status);
            if (status != "finished") {
                RunArguments a = args;
                a.output = t.directory.string(), a.twins = false, a.quiet = true, a.force = true;
                a.began = start, a.also_stop = directory.stop().path();
                if (status.empty()) a.restart.reset();
                else a.restart = ""; // its own newest checkpoint
                messages.say(fmt::format("twin of {} times the spacing, in {}", factor, t.directory.string()));
                scene::Issues issues; // coarsened() threw where one is an error
                if (run(a, scene::check_and_fill(t.twin.scene, scene::StepLimit::Force, issues).value()) == Exit::Stopped)
                    return std::nullopt;
            }
        } catch (const BadInput& e) {
            t.failed = e.what();
        } catch (const NumbersFailed& e) {
            t.failed = e.what();
        }
        if (!t.failed.empty()) messages.say(fmt::format("the twin of {} times the spacing failed: {}", factor, t.failed));
        twins.push_back(std::move(t));
    }
    return twins;
}

} // namespace kuzure
