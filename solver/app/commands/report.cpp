// kuzure report: report.html, and a film, from what a run left.
#include "solver/app/report/report.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/report/movie.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace kuzure {

void add_report(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("report", "report.html, one self-contained page, from what a run left");
    auto dir = std::make_shared<std::string>();
    auto movie = std::make_shared<bool>(false);
    command->add_option("DIR", *dir, "the result directory")->required();
    command->add_flag("--movie", *movie, "make a film of the pictures too (needs ffmpeg)");
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            io::on_root(comm, [&] {
                const io::Path path(*dir);
                report::read_record(path); // refuses what is no result directory before anything is written
                if (*movie) fmt::print("{}\n", report::write_movie(path).string());
                report::add_roofs(path);
                fmt::print("{}\n", report::write_report(path).string());
            });
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
