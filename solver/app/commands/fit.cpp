// kuzure fit: back-analysis, the friction that reproduces a known event.
#include "solver/app/cli/help.hpp"
#include "solver/app/hazard/back_analysis.hpp"
#include <CLI/CLI.hpp>

namespace kuzure {

void add_fit(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("fit", "back-analysis: the friction that reproduces a known event (resumes)");
    auto a = std::make_shared<hazard::BackArguments>();
    a->scene.add_to(*command);
    command
        ->add_option("--observed", a->observed,
                     "the event: outline of all that was reached (.shp, .geojson), or raster of the deposit's thickness in m")
        ->required()
        ->type_name("FILE");
    command
        ->add_option("--input", a->inputs,
                     "what is sought: bed_friction, friction, thickness or a key of [[uncertain.key]], in the range given or that of "
                     "[uncertain]; twice for two at once (default: bed_friction, without a range 5 to 45 deg)")
        ->type_name("NAME[=LOW,HIGH]");
    command->add_option("--values", a->values, "values of each input tried first, evenly (default: 9; of two inputs 5 each)")
        ->check(CLI::Range(3, 65));
    command
        ->add_option("--layers", a->layers,
                     "layers of particles over the mean thickness (default: the scene's own, or what --within allows)")
        ->type_name("N");
    command->add_option("--within", a->within, "when the answer is needed: 30m, 90s, 2h (default: when the search is done)")
        ->type_name("TIME");
    command->add_option("--jobs", a->jobs, "runs at a time (default: one a core)")->check(CLI::Range(1, 1024));
    command->add_option("-o,--output", a->output, "directory of the answer; one that was begun goes on (default: results/<scene>-fit)")
        ->type_name("DIR");
    command->callback([=, &chosen] { chosen = [=](const Comm& comm) { return hazard::run_back_analysis(comm, *a); }; });
}

} // namespace kuzure
