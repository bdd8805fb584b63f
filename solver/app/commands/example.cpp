// kuzure example: the gallery of ready scenes, and one of them to start from.
#include "io/keys.hpp"
#include "solver/app/cli/command.hpp"
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace kuzure {
namespace {

/// Where the scenes are: beside an installed program, or in the sources of one in the build tree. Throws IoFailed where neither is.
io::Path gallery()
{
    const std::vector<io::Path> folders{own_path().parent_path().parent_path() / "share/kuzure/scenes",
                                        io::Path(KUZURE_SOURCE_DIR) / "jobs/scenes"};
    std::error_code error;
    for (const auto& f : folders)
        if (std::filesystem::is_directory(f, error)) return f;
    throw IoFailed(fmt::format("no ready scenes: expected a folder {}; install kuzure anew, its data included",
                               fmt::join(std::vector<std::string>{folders[0].string(), folders[1].string()}, " or ")));
}

std::vector<std::string> names_of_scenes(const io::Path& folder)
{
    std::vector<std::string> names;
    for (const auto& name : io::names_in(folder))
        if (const io::Path file(name); file.extension() == ".toml") names.push_back(file.stem().string());
    std::sort(names.begin(), names.end());
    return names;
}

struct Arguments {
    std::string name;
    bool json = false;
};

void show(const Arguments& a)
{
    const io::Path folder = gallery();
    const auto names = names_of_scenes(folder);
    const auto text_of = [&](const std::string& name) { return io::read_text(folder / (name + ".toml")); };
    if (!a.name.empty()) {
        if (std::find(names.begin(), names.end(), a.name) == names.end())
            throw BadInput(fmt::format("example {}: expected the name of a ready scene, found none of this name{} Known: {}", a.name,
                                       io::did_you_mean(a.name, names), fmt::join(names, ", ")));
        fmt::print("{}", text_of(a.name));
        return;
    }
    const auto title_of = [&](const std::string& name) {
        return io::parse_scene(text_of(name), (folder / (name + ".toml")).string(), {}, scene::StepLimit::Force).title;
    };
    if (a.json) {
        auto list = nlohmann::ordered_json::array();
        for (const auto& name : names) list.push_back({{"name", name}, {"title", title_of(name)}});
        fmt::print("{}\n", list.dump(2));
        return;
    }
    std::size_t width = 0;
    for (const auto& name : names) width = std::max(width, name.size());
    for (const auto& name : names) fmt::print("  {:<{}}  {}\n", name, width, title_of(name));
    fmt::print("\nkuzure example {0} > {0}.toml writes one; docs/gallery.md shows them\n", names.empty() ? "NAME" : names.front());
}

} // namespace

void add_example(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("example", "the ready scenes; with a name, one of them, to standard output");
    auto a = std::make_shared<Arguments>();
    command->add_option("NAME", a->name, "the scene to write (default: list them)");
    command->add_flag("--json", a->json, "the list as JSON");
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            if (comm.rank() == 0) show(*a);
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
