// kuzure reference, kuzure schema: every key of a scene, for people and for editors.
#include "solver/app/cli/command.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace kuzure {

void add_reference(CLI::App& app, Action& chosen)
{
    const auto add = [&](const char* name, const char* about, std::string (*text)()) {
        app.add_subcommand(name, about)->callback([&chosen, text] {
            chosen = [text](const Comm& comm) {
                if (comm.rank() == 0) fmt::print("{}", text());
                return Exit::Ok;
            };
        });
    };
    add("reference", "every key of a scene, as Markdown (docs/scene.md)", io::scene_reference);
    add("schema", "every key of a scene, as a JSON Schema by which editors complete and check scenes", io::scene_schema);
}

} // namespace kuzure
