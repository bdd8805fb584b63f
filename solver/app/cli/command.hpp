#pragma once
// What the commands share: the team, the scene given on the command line, and how they are registered.
#include "decomposition/comm.hpp"
#include "io/file.hpp"
#include "io/scene_file.hpp"
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace kuzure {

/// Exit codes of the program.
enum class Exit : int { Ok = 0, BadInput = 2, NumbersFailed = 3, IoFailed = 4, Stopped = 5 };

/// SCENE.toml and --set of the commands that read a scene.
struct SceneArguments {
    std::string file;
    std::vector<std::string> sets;
    bool force_step = false;
    void add_to(CLI::App&);
    /// Collective: rank 0 reads the file, every rank parses. Throws BadInput on all ranks.
    scene::CheckedScene read(const Comm&) const;
    scene::StepLimit step_limit() const { return force_step ? scene::StepLimit::Force : scene::StepLimit::Enforce; }
    /// Where the results go: the directory asked for, or the scene's, or results/<scene file's name>.
    io::Path results(const Scene&, const std::string& asked) const;
};

/// What kuzure check says of a scene. Collective.
Exit print_estimate(const Comm&, const SceneArguments&);

/// A command: adds itself to the command line; when chosen, `chosen` is set to what it does.
using Action = std::function<Exit(const Comm&)>;
void add_run(CLI::App&, Action& chosen);
void add_check(CLI::App&, Action& chosen);
void add_reference(CLI::App&, Action& chosen);
void add_scale(CLI::App&, Action& chosen);
void add_report(CLI::App&, Action& chosen);
void add_picture(CLI::App&, Action& chosen);
void add_job(CLI::App&, Action& chosen);
void add_study(CLI::App&, Action& chosen);
void add_hazard(CLI::App&, Action& chosen);
void add_fit(CLI::App&, Action& chosen);
void add_safety(CLI::App&, Action& chosen);
void add_terrain(CLI::App&, Action& chosen);
void add_example(CLI::App&, Action& chosen);
void add_surface(CLI::App&, Action& chosen);
void add_completion(CLI::App&, Action& chosen);

/// A line for the user, on standard error. Never throws: where it cannot be written, the work goes on.
void complain(const std::string& text) noexcept;

/// The program's version, git hash, compiler and instruction set.
std::string version_text();
/// The libraries that its answers depend on, and their versions.
std::string packages_text();

/// The path by which this program is started again: itself, or the launcher where it is one of several that a package
/// installed under lib/kuzure. "kuzure" where the system does not say.
io::Path own_path();
/// Collective. Throws BadInput where ranks are different programs, or built for different instruction sets: their bits would differ.
void require_one_program(const Comm&);

/// The cores this process may use.
int cores_here();

/// No node has more.
inline constexpr int most_threads = 4096;

/// Use this many threads (0: OMP_NUM_THREADS, or the cores of this node shared evenly by its ranks); gives the number. Collective. Throws
/// BadInput for what no machine has.
int use_threads(const Comm&, int threads);

/// What there is to say of more threads than cores: of this rank's own or of its node's; empty where there is nothing. Collective.
std::string too_many_threads(const Comm&, int threads);

} // namespace kuzure
