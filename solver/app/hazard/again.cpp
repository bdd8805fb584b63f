// kuzure hazard --members-from: the maps of the runs that an answer lists, once more.
#include "io/owner.hpp"
#include "solver/app/hazard/kept.hpp"
#include "solver/app/hazard/page.hpp"
#include "solver/app/hazard/queue.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {

Exit answer_again(Base base, const Arguments& args, const std::vector<io::NamedPoint>& points, const io::Path& out)
{
    const io::Path file = args.members_from, folder = std::filesystem::absolute(file).parent_path();
    KeptRuns kept;
    try {
        std::string text;
        try {
            text = io::read_text(file);
        } catch (const IoFailed& e) {
            throw BadInput(e.what());
        }
        std::vector<std::string> varied;
        for (const auto& input : inputs_of(base.uncertain)) varied.push_back(input.name);
        kept = runs_from_text(text, varied);
    } catch (const BadInput&) {
        throw;
    } catch (const std::runtime_error& e) {
        throw BadInput(fmt::format("{}: expected a hazard.json of this scene, found something else ({}). Remedy: the file of an earlier "
                                   "kuzure hazard",
                                   file.string(), e.what()));
    }
    base.coarsest = kept.coarsest;
    auto& all = kept.runs;
    for (auto& r : all)
        if (r.finished())
            r.maps = std::make_shared<const RunMaps>(read_maps(folder / r.directory, base, maps_of_runs(base).wet, r.spacing));
    if (std::ranges::none_of(all, &Run::finished)) throw BadInput(fmt::format("{}: expected finished runs, found none", file.string()));
    std::error_code error;
    if (!std::filesystem::equivalent(out, folder, error) && std::filesystem::exists(out, error) && !std::filesystem::is_empty(out, error))
        throw BadInput(
            fmt::format("{}: expected a new directory, found one with other things in it; choose another with -o DIR", out.string()));
    std::filesystem::create_directories(out, error);
    const io::Ownership owner(io::hold(out), complain);
    Answer answer = answer_of(base, all);
    write_maps(base, answer, points, out);
    const State state{base, args.scene.file, all, kept.deadline, kept.ended, kept.group, true, {}, not_modelled(base)};
    io::write_atomically(out / "report.html", html(state, answer, out));
    if (!std::filesystem::equivalent(out, folder, error)) io::write_atomically(out / "hazard.json", to_json(state, answer).dump(1) + "\n");
    say(fmt::format("the answer of {} runs listed in {}: {}", answer.counted.size(), file.string(), (out / "report.html").string()));
    return Exit::Ok;
}

} // namespace kuzure::hazard
