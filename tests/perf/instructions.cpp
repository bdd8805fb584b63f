// Passes over a small jittered cloud, for counting instructions: instructions STEPS lanes|plain|staggered (two passes a step). Prints the
// directed pairs of a pass. Compiled for x86-64-v3 whatever the machine, so that valgrind can run it and the count is the same everywhere.
#include "perf/bench/cloud.hpp"
#include "solver/kernels/leap_frog.hpp"
#include "solver/kernels/staggered.hpp"
#include "solver/scene/scene.hpp"
#include <cstdio>
#include <cstdlib>
#include <cstring>

using namespace kuzure;

int main(int argc, char** argv)
{
    if (argc != 3) return 2;
    const int passes = std::atoi(argv[1]);
    bench::Cloud cloud(14, 0.2);
    cloud.sort();
    using Bare = Model<CubicSpline, LinearViscosity>;
    const auto run = [&](auto model) {
        cloud.prepare(model, 0.1);
        auto in = cloud.input(0);
        // One pass in five prunes the lists, as in a collapse.
        in.margin = 0.026 * cloud.scene.support();
        std::int64_t pairs = 0;
        for (int k = 0; k < passes; ++k) {
            in.prune = k % 5 == 0;
            pairs = cloud.step(model, in).pairs;
        }
        std::printf("%lld\n", static_cast<long long>(pairs));
    };
    const auto scene = bench::dry_sand().interactions();
    if (std::strcmp(argv[2], "plain") == 0) run(LeapFrog<Bare, double>(scene));
    else if (std::strcmp(argv[2], "staggered") == 0) run(Staggered<Bare, Native<double>>(scene));
    else run(LeapFrog<Bare, Native<double>>(scene));
}
