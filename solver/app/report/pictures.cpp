#include "solver/app/report/pictures.hpp"
#include "io/soil_color.hpp"
#include "solver/core/ensure.hpp"
#include <fmt/format.h>

namespace kuzure {

namespace {

constexpr std::uint64_t most_scene_bytes = (std::uint64_t(1) << 20) + 4096; // what a run adds included

} // namespace

std::pair<io::Place, Scene> open_results(const Comm& comm, const io::Path& results)
{
    io::Place held;
    std::string text, complaint;
    io::on_root(comm, [&] {
        std::error_code error;
        if (!std::filesystem::is_directory(results, error))
            throw BadInput(fmt::format("{}: expected the result directory of a run, found {}", results.string(),
                                       std::filesystem::exists(results, error) ? "a file" : "nothing"));
        held = io::hold(results);
        if (!io::exists(held / "scene.toml"))
            throw BadInput(fmt::format("{}: expected the result directory of a run, found no scene.toml in it", results.string()));
        text = io::read_text(held / "scene.toml", most_scene_bytes);
    });
    try {
        if (!held.held()) held = io::hold(results);
    } catch (const IoFailed& e) {
        complaint = e.what();
    }
    io::agree(comm, complaint);
    return {held, io::parse_scene(comm.broadcast(text), (results / "scene.toml").string(), {}, scene::StepLimit::Force)};
}

io::PictureTask picture_task(const Scene& scene, const io::Place& results)
{
    const scene::Picture settings = scene.output.picture.value_or(scene::Picture{});
    io::PictureTask task;
    task.results = results;
    task.color = io::name_of(settings.color);
    task.view = settings.view, task.range = settings.range;
    task.dimensions = scene.dimensions, task.spacing = scene.space.spacing, task.title = scene.title;
    return task;
}

} // namespace kuzure
