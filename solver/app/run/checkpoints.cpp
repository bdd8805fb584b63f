#include "solver/app/run/checkpoints.hpp"
#include "io/json.hpp"
#include "io/scene_file.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/run/clock_text.hpp"
#include "solver/core/ensure.hpp"
#include <fmt/format.h>

namespace kuzure {

std::optional<io::Checkpoint> checkpoint_at(const Comm& comm, const io::Path& path)
{
    std::error_code error;
    const bool directory = comm.any(comm.rank() == 0 && std::filesystem::is_directory(path, error));
    if (directory) return io::newest_good(comm, path, complain);
    return io::verify_checkpoint(comm, path);
}

std::string other_writer(const io::Checkpoint& from)
{
    const auto header = io::parse_json(from.header, false);
    const bool named = header.is_object() && header.contains("version") && header["version"].is_string();
    const std::string writer = named ? header["version"].get<std::string>() : "an unnamed program";
    return writer == version_text() ? "" : writer;
}

void require_same_scene(const Comm& comm, const io::Checkpoint& from, const Scene& scene)
{
    const std::string hash = io::scene_hash(scene);
    if (from.scene_hash == hash) return;
    const io::Place beside = io::directory_of(from.file) / "scene.toml";
    std::string differs;
    try {
        if (comm.rank() == 0) differs = io::physics_difference(io::read_scene(beside.path(), {}, scene::StepLimit::Force), scene);
    } catch (const std::runtime_error&) { // not there, or not readable any more: the hashes have to do
    }
    differs = comm.broadcast(differs);
    std::string text = fmt::format("{}: this checkpoint belongs to another scene (hash {}, the scene given has {}). Expected: the same "
                                   "physics; only title, time.end and [output] may change on a restart. ",
                                   from.file.string(), from.scene_hash, hash);
    const std::string writer = other_writer(from);
    if (!differs.empty()) text += fmt::format("Different from {}: {}. Remedy: run with that scene.toml", beside.string(), differs);
    else if (writer.empty()) text += "Remedy: the scene.toml beside the checkpoint";
    else
        text += fmt::format("It was written by {}; this is {}, which may know other keys. Remedy: go on with the program that wrote it",
                            writer, version_text());
    throw BadInput(text);
}

void require_room_for(const Comm& comm, const io::Checkpoint& from, const io::Path& where, const std::string& scene_hash)
{
    io::on_root(comm, [&] {
        std::error_code error;
        if (!std::filesystem::exists(where, error) || std::filesystem::is_empty(where, error)) return;
        std::string found = "no scene.toml";
        if (std::filesystem::exists(where / "scene.toml", error)) {
            found = "the results of another scene";
            try {
                if (io::scene_hash(io::read_scene(where / "scene.toml", {}, scene::StepLimit::Force)) == scene_hash) return;
            } catch (const std::runtime_error&) { // of another version: not this run's
            }
        }
        throw BadInput(fmt::format("{}: expected nothing, or results of this scene, to go on from {}; found {}. Choose another with -o",
                                   where.string(), from.file.string(), found));
    });
}

double peak_speed_of(const io::Checkpoint& from)
{
    const auto j = io::parse_json(from.header, false);
    return j.is_object() && j.contains("peak_speed") && j["peak_speed"].is_number() ? j["peak_speed"].get<double>() : 0;
}

void Checkpoints::write(const Simulation& sim, double peak_speed, const Maps* maps)
{
    directory_.require_owned();
    auto header = nlohmann::ordered_json::parse(clock_text(sim));
    header["peak_speed"] = peak_speed;
    std::vector<io::CheckpointTable> tables;
    if (maps) header["maps"] = maps->header(), tables.push_back(maps->table());
    last_ = io::write_checkpoint(comm_, directory_.place(), sim.particles(), hash_, header.dump(), tables);
}

std::string Checkpoints::last_in_words() const
{
    return last_.empty() ? ". No checkpoint had been written" : ". The last good checkpoint is " + last_.string();
}

} // namespace kuzure
