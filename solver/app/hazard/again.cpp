// kuzure hazard --members-from: the maps of the runs that an answer lists, once more.
#include "io/owner.hpp"
#include "solver/app/hazard/page.hpp"
#include "solver/app/hazard/queue.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure::hazard {

Exit answer_again(Base base, const Arguments& args, const std::vector<io::NamedPoint>& points, const io::Path& out)
{
    using Json = nlohmann::ordered_json;
    const io::Path file = args.members_from, folder = std::filesystem::absolute(file).parent_path();
    std::vector<Run> all;
    double deadline = 0, ended = 0;
    int group = 0;
    try {
        std::string text;
        try {
            text = io::read_text(file);
        } catch (const IoFailed& e) {
            throw BadInput(e.what());
        }
        const auto j = Json::parse(text);
        base.coarsest = j.at("coarsest_spacing"), group = j.at("group");
        deadline = j.at("deadline_seconds"), ended = j.at("ended_seconds");
        for (const char* list : {"likely_runs", "members"})
            for (const auto& m : j.at(list)) {
                Run r;
                const std::string part = m.at("part"), status = m.at("status");
                for (const Part p : {Part::Preliminary, Part::Likely, Part::Member, Part::Finer})
                    if (part == word(p)) r.part = p;
                for (const Status s : {Status::NotRun, Status::Finished, Status::Failed, Status::Refused, Status::Stopped})
                    if (status == word(s)) r.status = s;
                r.member.number = m.at("number"), r.layers = m.at("layers"), r.spacing = m.at("spacing");
                r.directory = m.at("directory").get<std::string>(), r.seconds = m.at("seconds");
                r.message = m.value("message", std::string());
                for (const auto& input : inputs_of(base.uncertain)) r.member.values.push_back(m.at("settings").at(input.name));
                if (r.finished()) r.maps = std::make_shared<const RunMaps>(read_maps(folder / r.directory, base, maps_of_runs(base).wet));
                all.push_back(std::move(r));
            }
    } catch (const Json::exception& e) {
        throw BadInput(fmt::format("{}: expected a hazard.json of this scene, found something else ({}). Remedy: the file of an earlier "
                                   "kuzure hazard",
                                   file.string(), e.what()));
    }
    if (std::ranges::none_of(all, &Run::finished)) throw BadInput(fmt::format("{}: expected finished runs, found none", file.string()));
    std::error_code error;
    if (!std::filesystem::equivalent(out, folder, error) && std::filesystem::exists(out, error) && !std::filesystem::is_empty(out, error))
        throw BadInput(
            fmt::format("{}: expected a new directory, found one with other things in it; choose another with -o DIR", out.string()));
    std::filesystem::create_directories(out, error);
    const io::Ownership owner(io::hold(out), complain);
    Answer answer = answer_of(base, all);
    write_maps(base, answer, points, out);
    const State state{base, args.scene.file, all, deadline, ended, group, true, {}, not_modelled(base)};
    io::write_atomically(out / "report.html", html(state, answer, out));
    if (!std::filesystem::equivalent(out, folder, error)) io::write_atomically(out / "hazard.json", to_json(state, answer).dump(1) + "\n");
    say(fmt::format("the answer of {} runs listed in {}: {}", answer.counted.size(), file.string(), (out / "report.html").string()));
    return Exit::Ok;
}

} // namespace kuzure::hazard
