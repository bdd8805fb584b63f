// Arguments, MPI on and off, exit codes. What a command does stands in solver/app/commands.
#include "decomposition/launcher.hpp"
#include "io/hdf5.hpp"
#include "io/quote.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/cli/command_line.hpp"
#include "solver/app/cli/help.hpp"
#include "solver/app/cli/signals.hpp"
#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fmt/format.h>
#include <system_error>

using namespace kuzure;

namespace {

const char* const help_footer = R"(
First steps:
  kuzure example bank > bank.toml         a ready scene to start from; kuzure example lists them
  kuzure check SCENE.toml                 what will be simulated, why, and how long it will take
  kuzure run SCENE.toml -o DIR            simulate; a bar shows where it is
  mpirun -n 4 kuzure run SCENE.toml       the same on four ranks, with the same bits
  kuzure run SCENE.toml -o DIR --restart  go on from the newest good checkpoint
  kuzure report DIR                       DIR/report.html: one page with everything
  kuzure picture DIR --color speed        other colours, another view, of what is there
  kuzure COMMAND --help                   the options of a command

Exit codes: 0 done, 2 command line or scene wrong (nothing written), 3 the numbers failed,
4 files failed, 5 stopped on request (a checkpoint was written))";

int fail(const char* what, Exit code)
{
    std::fprintf(stderr, "kuzure: %s\n", io::printable(what).c_str());
    return int(code);
}

/// What went to standard output must have arrived where the words are all that a command gives.
int said(int code)
{
    if (std::fflush(stdout) != 0 || std::ferror(stdout))
        return fail(fmt::format("standard output could not be written: {}", std::strerror(errno)).c_str(), Exit::IoFailed);
    return code;
}

void say_no_memory(int rank)
{
    std::fprintf(stderr, "kuzure: rank %d has no more memory. Remedy: more ranks on more nodes, a larger spacing\n", rank);
}

/// What a loop of several threads throws cannot leave it: memory may end there too.
[[noreturn]] void on_terminate()
{
    try {
        if (const auto e = std::current_exception()) std::rethrow_exception(e);
    } catch (const std::bad_alloc&) {
        say_no_memory(launched().rank);
        std::_Exit(int(Exit::IoFailed)); // mpirun ends the other ranks
    } catch (const std::exception& e) {
        std::fprintf(stderr, "kuzure: rank %d: %s (a defect of kuzure: please report it)\n", launched().rank, e.what());
    } catch (...) {
    }
    std::abort();
}

/// The chosen command on a team. Every rank has the same arguments.
int carry_out(const Action& chosen, const Comm& comm, bool words_count)
{
    const bool prints = comm.rank() == 0;
    const auto say = [&](const std::exception& e, Exit code) { return prints ? fail(e.what(), code) : int(code); };
    try {
        require_one_program(comm);
        const Exit code = chosen(comm);
        return prints && words_count ? said(int(code)) : int(code);
    } catch (const BadInput& e) {
        return say(e, Exit::BadInput);
    } catch (const NumbersFailed& e) {
        return say(e, Exit::NumbersFailed);
    } catch (const IoFailed& e) {
        return say(e, Exit::IoFailed);
    } catch (const std::system_error& e) { // of files, or of standard output
        fail(e.what(), Exit::IoFailed);
        if (comm.size() > 1) comm.abort(int(Exit::IoFailed));
        return int(Exit::IoFailed);
    } catch (const std::bad_alloc&) {
        say_no_memory(comm.rank());
        comm.abort(int(Exit::IoFailed));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "kuzure: rank %d: %s (a defect of kuzure: please report it)\n", comm.rank(), e.what());
        comm.abort(70);
    }
}

} // namespace

int main(int argc, char** argv)
{
    listen_to_signals();
    io::quiet_hdf5(); // before MPI
    std::set_terminate(on_terminate);
    CLI::App app{"kuzure: soil that collapses under its own weight", "kuzure"};
    app.set_version_flag("-V,--version", [] { return version_text() + "\n" + packages_text(); });
    app.require_subcommand(1);
    fit_help_to_screen(app);
    Action chosen;
    add_run(app, chosen);
    add_check(app, chosen);
    add_report(app, chosen);
    add_picture(app, chosen);
    add_surface(app, chosen);
    add_job(app, chosen);
    add_study(app, chosen);
    add_example(app, chosen);
    add_hazard(app, chosen);
    add_fit(app, chosen);
    add_safety(app, chosen);
    add_terrain(app, chosen);
    add_reference(app, chosen);
    add_scale(app, chosen);
    add_completion(app, chosen);
    app.footer(help_footer); // last: commands added after it would show it too

    // Words first, MPI afterwards and only for what works on ranks: help and checks must not depend on it. Where ranks were given
    // different command lines, another's may be a run that waits for this one.
    const CommandLine given = parse(app, argc, argv);
    if (!given.on_ranks || given.command != "run") stop_listening(); // nothing of theirs is to be ended with care
    const Launched by = launched();
    if (!by || !(given.on_ranks || several_command_lines())) {
        if (by.rank != 0) return given.wrong.empty() ? 0 : int(Exit::BadInput); // one of the ranks does the work
        if (given.shown) return (std::fputs(given.text.c_str(), stdout), said(0));
        if (!given.wrong.empty()) return (std::fputs(given.text.c_str(), stdout), fail(given.wrong.c_str(), Exit::BadInput));
        const Environment alone;
        return carry_out(chosen, Comm::world(), !given.on_ranks);
    }
    const Environment mpi(argc, argv);
    const Comm& comm = Comm::world();
    try {
        agree_on(comm, given);
    } catch (const BadInput& e) {
        return comm.rank() == 0 ? fail(e.what(), Exit::BadInput) : int(Exit::BadInput);
    }
    if (given.shown) return comm.rank() == 0 ? (std::fputs(given.text.c_str(), stdout), said(0)) : 0;
    return carry_out(chosen, comm, !given.on_ranks);
}
