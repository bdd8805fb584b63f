// What the guard costs: the same collapse with and without it, some hundred steps of each in turn, and the ratio of the medians.
// The extremes that every step reports ride in the pass and in its one reduction either way; they are not in the ratio.
//   build/release/bench_guard [SCENE.toml] [ROUNDS]          default: jobs/scenes/quickstart.toml, 15
#include "decomposition/comm.hpp"
#include "io/scene_file.hpp"
#include "solver/run/energy.hpp"
#include "solver/run/simulation.hpp"
#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <omp.h>

using namespace kuzure;

int main(int argc, char** argv)
{
    Environment mpi(argc, argv);
    const Comm& comm = Comm::world();
    const Scene scene = io::read_scene(argc > 1 ? argv[1] : "jobs/scenes/quickstart.toml");
    const int rounds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 15;
    constexpr int steps = 200;
    Simulation with(comm, scene), without(comm, scene, {.guard = false});
    const auto timed = [&](Simulation& s) {
        const double begin = omp_get_wtime();
        for (int k = 0; k < steps && !s.finished(); ++k) s.step();
        return omp_get_wtime() - begin;
    };
    std::vector<double> a, b;
    for (int k = 0; k < rounds && !with.finished(); ++k) {
        // whoever is first has the colder caches: take turns
        if (k % 2) b.push_back(timed(without)), a.push_back(timed(with));
        else a.push_back(timed(with)), b.push_back(timed(without));
    }
    if (state_hash(comm, with.particles()) != state_hash(comm, without.particles())) {
        fmt::print(stderr, "bench_guard: the guard changed a bit of the result\n");
        return 1;
    }
    const auto median = [](std::vector<double> v) {
        std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
        return v[v.size() / 2];
    };
    Timers& t = with.timers();
    fmt::print("{} steps of {}: with the guard {:.4f} ms a step, without {:.4f}, ratio of medians {:.4f}; guard's own timer {:.3f} %\n",
               with.steps(), scene.title, 1e3 * median(a) / steps, 1e3 * median(b) / steps, median(a) / median(b),
               100 * t.seconds(Phase::Guard) / t.total());
}
