// kuzure picture: draws or recolours afterwards, from the snapshots of a run.
#include "io/keys.hpp"
#include "io/picture_series.hpp"
#include "io/soil_color.hpp"
#include "solver/app/cli/help.hpp"
#include "solver/app/report/pictures.hpp"
#include <CLI/CLI.hpp>
#include <cmath>
#include <fmt/format.h>

namespace kuzure {
namespace {

struct Arguments {
    std::string results, color, view, output;
    std::optional<double> at;
    std::vector<double> range;
    int threads = 0;
};

const std::vector<std::string> views{"oblique", "side", "top", "cut"}; // in the order of scene::View

Exit draw(const Comm& comm, const Arguments& a)
{
    const auto [results, scene] = open_results(comm, a.results);
    auto task = picture_task(scene, results);
    const std::string color = task.color;
    const scene::View view = task.view;
    if (!a.color.empty()) task.color = a.color;
    if (task.color != color) task.range = {};
    if (!a.view.empty()) {
        const auto at = std::find(views.begin(), views.end(), a.view);
        if (at == views.end())
            throw BadInput(
                fmt::format("--view: expected one of {}, found \"{}\"{}", fmt::join(views, ", "), a.view, io::did_you_mean(a.view, views)));
        task.view = scene::View(at - views.begin());
        if (scene.dimensions == 2 && task.view != scene::View::Side)
            throw BadInput(fmt::format("--view {}: this run is 2-D and can be seen from the side only", a.view));
    }
    if (!a.range.empty()) {
        if (!(a.range[0] < a.range[1]) || !std::isfinite(a.range[0]) || !std::isfinite(a.range[1]))
            throw BadInput(fmt::format("--range: expected the least value and a larger one, found {:g} {:g}", a.range[0], a.range[1]));
        task.range = {a.range[0], a.range[1]};
    }
    task.at = a.at;
    // The run's own pictures are drawn anew in their place; others get names that tell what they show.
    const bool same = task.color == color && (task.view == view || scene.dimensions == 2) && a.range.empty();
    if (!a.output.empty()) {
        if (!task.at) task.at = HUGE_VAL;
        task.file = [&](int) { return io::Place(a.output); };
    } else if (!same) {
        const std::string seen = scene.dimensions == 2 ? "side" : views[std::size_t(task.view)];
        task.file = [where = results, color = task.color, seen](int number) {
            return where / fmt::format("picture_{}_{}_{:06d}.png", color, seen, number);
        };
    }
    use_threads(comm, a.threads);
    const auto drawn = io::draw_pictures(comm, task);
    if (comm.rank() == 0) {
        for (const auto& w : drawn.warnings) complain("warning: " + w);
        for (const auto& f : drawn.files) fmt::print("{}\n", f.string());
    }
    return Exit::Ok;
}

} // namespace

void add_picture(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("picture", "draw a run's pictures anew, in other colours or from elsewhere, from its snapshots");
    auto a = std::make_shared<Arguments>();
    command->add_option("DIR", a->results, "the result directory")->required();
    command
        ->add_option("--color", a->color,
                     "displacement, speed, plastic_strain, pressure or any field of the snapshots, such as density, stress_zz")
        ->type_name("FIELD");
    command->add_option("--view", a->view, "oblique, side, top or cut (default: the scene's)")->type_name("V");
    command->add_option("--at", a->at, "only the snapshot next to this time (s)")->type_name("T");
    command->add_option("--range", a->range, "least and largest value of the colours (default: of the whole run)")
        ->type_name("LOW HIGH")
        ->expected(2);
    command->add_option("-o,--output", a->output, "one picture, of --at or of the end, into this file")->type_name("FILE");
    command->add_option("--threads", a->threads, "threads of each rank (default: all cores)")->check(CLI::Range(1, most_threads));
    under_heading(*command, "What is shown", {"--color", "--view", "--at", "--range"});
    under_heading(*command, "Machine", {"--threads"});
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return draw(comm, *a); }; });
}

} // namespace kuzure
