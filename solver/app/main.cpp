// Arguments, MPI on and off, exit codes. What a command does stands in solver/app/commands.
#include "io/hdf5.hpp"
#include "solver/app/command.hpp"
#include "solver/app/command_line.hpp"
#include "solver/app/signals.hpp"
#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fmt/format.h>
#include <system_error>

using namespace kuzure;

namespace {

const char* const help_footer = R"(
First steps:
  kuzure check SCENE.toml                 what will be simulated, why, and how long it will take
  kuzure run SCENE.toml -o DIR            simulate; a bar shows where it is
  mpirun -n 4 kuzure run SCENE.toml       the same on four ranks, with the same bits
  kuzure run SCENE.toml -o DIR --restart  go on from the newest good checkpoint
  kuzure report DIR                       DIR/report.html: one page with everything
  kuzure COMMAND --help                   the options of a command

Exit codes: 0 done, 2 command line or scene wrong (nothing written), 3 the numbers failed,
4 files failed, 5 stopped on request (a checkpoint was written))";

}

int main(int argc, char** argv)
{
    listen_to_signals();
    io::quiet_hdf5(); // before MPI
    CLI::App app{"kuzure: soil that collapses under its own weight"};
    app.set_version_flag("--version", [] { return version_text() + "\n" + packages_text(); });
    app.require_subcommand(1);
    fit_help_to_screen(app);
    Action chosen;
    add_run(app, chosen);
    add_check(app, chosen);
    add_report(app, chosen);
    add_job(app, chosen);
    add_study(app, chosen);
    add_reference(app, chosen);
    add_scale(app, chosen);
    add_completion(app, chosen);
    app.footer(help_footer); // last: commands added after it would show it too
    Environment mpi(argc, argv);
    const Comm& comm = Comm::world();
    const bool speaks = comm.rank() == 0;
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == 0) {
            if (speaks) app.exit(e);
            return 0;
        }
        if (speaks) std::fprintf(stderr, "kuzure: %s\nsee kuzure --help\n", e.what());
        return int(Exit::BadInput);
    }
    if (!app.got_subcommand("run")) stop_listening();
    const auto fail = [&](const char* what, Exit code) {
        if (speaks) complain(what);
        return int(code);
    };
    try {
        require_one_instruction_set(comm);
        const Exit code = chosen(comm);
        // What a command says is what it is for; a run's results are in its directory.
        if (speaks && !app.got_subcommand("run") && (std::fflush(stdout) != 0 || std::ferror(stdout)))
            return fail(fmt::format("standard output could not be written: {}", std::strerror(errno)).c_str(), Exit::IoFailed);
        return int(code);
    } catch (const BadInput& e) {
        return fail(e.what(), Exit::BadInput);
    } catch (const NumbersFailed& e) {
        return fail(e.what(), Exit::NumbersFailed);
    } catch (const IoFailed& e) {
        return fail(e.what(), Exit::IoFailed);
    } catch (const std::system_error& e) { // of files, or of standard output
        std::fprintf(stderr, "kuzure: %s\n", e.what());
        if (comm.size() > 1) comm.abort(int(Exit::IoFailed));
        return int(Exit::IoFailed);
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "kuzure: rank %d has no more memory. Remedy: more ranks on more nodes, a larger spacing\n", comm.rank());
        comm.abort(int(Exit::IoFailed));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "kuzure: rank %d: %s (a defect of kuzure: please report it)\n", comm.rank(), e.what());
        comm.abort(70);
    }
}
