#include "solver/app/cli/command.hpp"
#include "decomposition/partition.hpp"
#include "io/hdf5.hpp"
#include "solver/core/ensure.hpp"
#include "solver/core/simd.hpp"
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>
#include <sched.h>
#include <unistd.h>

namespace kuzure {

void SceneArguments::add_to(CLI::App& app)
{
    app.add_option("SCENE.toml", file, "the scene")->required();
    app.add_option("--set", sets, "key.path=value: override a key of the scene")->type_name("KEY=VALUE")->allow_extra_args(false);
    app.add_flag("--force-step", force_step, "accept a fixed step above the stable limit");
}

scene::CheckedScene SceneArguments::read(const Comm& comm) const
{
    std::string text;
    io::on_root(comm, [&] { text = io::read_scene_text(file); });
    text = comm.broadcast(text);
    return io::parse_checked_scene(text, file, sets, step_limit());
}

io::Path SceneArguments::results(const Scene& scene, const std::string& asked) const
{
    if (!asked.empty()) return asked;
    if (!scene.output.directory.empty()) return scene.output.directory;
    return io::Path("results") / io::Path(file).stem();
}

void complain(const std::string& text) noexcept
{
    try {
        const std::string line = "kuzure: " + text + "\n"; // one write: lines of several processes stay whole
        std::fwrite(line.data(), 1, line.size(), stderr);  // not by fmt, which throws
    } catch (const std::bad_alloc&) {
    }
}

std::string packages_text() { return fmt::format("{}, {}, {}", Comm::library(), io::hdf5_library(), partitioner_library()); }

std::string version_text()
{
#if defined(__clang__)
    const char* const compiler = __clang_version__;
    const char* const name = "Clang";
#else
    const char* const compiler = __VERSION__;
    const char* const name = "GCC";
#endif
    return fmt::format("kuzure {} ({}), {} {}, {}, OpenMP {}", KUZURE_VERSION, KUZURE_GIT, name, compiler, instruction_set(), _OPENMP);
}

io::Path own_path()
{
    std::error_code error;
    const io::Path self = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) return "kuzure";
    const io::Path group = self.parent_path().parent_path(); // <prefix>/lib/kuzure
    const io::Path launcher = group.parent_path().parent_path() / "bin" / self.filename();
    return group.filename() == "kuzure" && group.parent_path().filename() == "lib" && std::filesystem::exists(launcher, error) ? launcher
                                                                                                                               : self;
}

void require_one_program(const Comm& comm)
{
    const std::string mine = version_text(), first = comm.broadcast(mine);
    if (!comm.any(mine != first)) return;
    const std::string isa = instruction_set(), first_isa = comm.broadcast(isa);
    if (comm.any(isa != first_isa))
        throw BadInput(fmt::format("the ranks run kuzure for different instruction sets, {} on rank 0: expected one, so that all ranks "
                                   "give the same bits. Remedy: KUZURE_ISA=x86-64-v3 (or x86-64) on all nodes",
                                   first_isa));
    throw BadInput(
        fmt::format("the ranks run different programs, {} on rank 0: expected one on all. Remedy: the same kuzure on every node", first));
}

int cores_here()
{
    cpu_set_t cpus;
    return sched_getaffinity(0, sizeof cpus, &cpus) == 0 ? CPU_COUNT(&cpus) : omp_get_num_procs();
}

int use_threads(const Comm& comm, int threads)
{
    const int on_node = comm.node_position().size; // on all ranks, whatever each was told
    const char* asked = threads > 0 ? nullptr : std::getenv("OMP_NUM_THREADS");
    const long wanted = asked ? std::strtol(asked, nullptr, 10) : 0;
    if (comm.any(wanted > most_threads))
        throw BadInput(fmt::format("OMP_NUM_THREADS: expected at most {} threads for each rank, found more; unset it, or give --threads",
                                   most_threads));
    if (threads <= 0) threads = wanted > 0 ? int(wanted) : std::max(1, cores_here() / on_node);
    omp_set_num_threads(threads);
    return threads;
}

std::string too_many_threads(const Comm& comm, int threads)
{
    const auto here = comm.node_position();
    const int cores = std::max(1, int(sysconf(_SC_NPROCESSORS_ONLN))), mine = cores_here();
    std::string why;
    if (threads > mine)
        why = fmt::format("{} threads on {} core{} that this rank may use: they wait for each other. Remedy: --threads {}{}", threads, mine,
                          mine == 1 ? "" : "s", mine, mine < cores ? ", or a launcher that does not bind ranks to fewer" : "");
    else if (threads * here.size > cores)
        why = fmt::format("{} ranks of {} thread{} on a node of {} core{}: they wait for each other. Remedy: fewer ranks or --threads {}",
                          here.size, threads, threads == 1 ? "" : "s", cores, cores == 1 ? "" : "s", std::max(1, cores / here.size));
    // Ranks may sit on different nodes: the first that has something to say speaks for all.
    std::int64_t speaker = comm.max(why.empty() ? std::int64_t(-1) : std::int64_t(comm.size() - comm.rank()));
    return speaker < 0 ? std::string() : comm.broadcast(why, comm.size() - int(speaker));
}

} // namespace kuzure
