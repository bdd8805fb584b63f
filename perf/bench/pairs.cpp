// Sorting, list building and the pair pass (sums, constitutive law, leap-frog) on the 52^3 lattice jittered by 0.2 spacings:
// every workload, double, mixed and plain. Counters: ns per directed pair, Gflop/s, shares of the measured FMA peak and of the
// measured bandwidth with as many threads (by the loops' own count of operations and bytes). JSON: --benchmark_format=json.
//   build/release/bench_pairs --benchmark_filter='pass.*' --benchmark_enable_random_interleaving=true --benchmark_repetitions=9
#include "perf/bench/work.hpp"
#include "perf/machine.hpp"
#include <benchmark/benchmark.h>

using namespace kuzure;
using bench::Cloud;

namespace {

constexpr int edge = 52;
constexpr double jitter = 0.2;

void sort(benchmark::State& state)
{
    omp_set_num_threads(int(state.range(0)));
    Cloud c(edge, jitter);
    c.sort();
    for (auto _ : state) c.sort();
    state.counters["ns/particle"] =
        benchmark::Counter(double(c.particles.size()) * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void lists(benchmark::State& state)
{
    omp_set_num_threads(int(state.range(0)));
    Cloud c(edge, jitter);
    c.sort();
    for (auto _ : state) c.build(int(state.range(1)), 0.1);
    state.counters["entries/cluster"] = double(c.lists.entries()) / c.lists.size();
}

/// The roofs, of one thread or of all.
const Machine& roofs()
{
    static const Machine m = this_machine(instruction_set(), omp_get_num_procs());
    return m;
}

void pass(benchmark::State& state, const Scene& s, Arithmetic arithmetic)
{
    omp_set_num_threads(int(state.range(0)));
    bench::ReadyPass ready(s, arithmetic, edge, jitter);
    std::int64_t pairs = 0;
    for (auto _ : state)
        for (int k = 0; k < ready.cycle; ++k) pairs = ready.run();
    using benchmark::Counter;
    state.counters["ns/pair"] = Counter(double(ready.cycle * pairs) * 1e-9, Counter::kIsIterationInvariantRate | Counter::kInvert);
    state.counters["Gflop/s"] = Counter(ready.cycle * ready.flops(pairs) * 1e-9, Counter::kIsIterationInvariantRate);
    const bool one = state.range(0) == 1, mixed = s.accuracy.precision == scene::Precision::Mixed;
    const Machine& m = roofs();
    const double peak = mixed ? (one ? m.gflops_float_one : m.gflops_float_all) : (one ? m.gflops_double_one : m.gflops_double_all);
    const double band = one ? m.gbytes_one : m.gbytes_all;
    state.counters["of FMA peak"] = Counter(ready.cycle * ready.flops(pairs) * 1e-9 / peak, Counter::kIsIterationInvariantRate);
    state.counters["of bandwidth"] = Counter(ready.cycle * ready.bytes() * 1e-9 / band, Counter::kIsIterationInvariantRate);
    state.SetLabel(ready.model());
}

} // namespace

BENCHMARK(sort)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(lists)->Args({1, 4})->Args({2, 4})->Args({1, 8})->Unit(benchmark::kMillisecond)->UseRealTime();

int main(int argc, char** argv)
{
    using scene::Precision;
    for (const auto precision : {Precision::Double, Precision::Mixed})
        for (const auto arithmetic : {Arithmetic::Simd, Arithmetic::Scalar})
            for (const auto& [name, scene] : bench::workloads(precision)) {
                const std::string title = "pass/" + name + (precision == Precision::Mixed ? "/mixed" : "/double") +
                                          (arithmetic == Arithmetic::Scalar ? "/plain" : "/lanes");
                const auto body = [=](benchmark::State& state) { pass(state, scene, arithmetic); };
                auto* b = benchmark::RegisterBenchmark(title.c_str(), body)->Unit(benchmark::kMillisecond)->UseRealTime()->Arg(1);
                if (arithmetic == Arithmetic::Simd) b->Arg(2);
            }
    benchmark::Initialize(&argc, argv);
    roofs(); // measured before anything else runs
    benchmark::RunSpecifiedBenchmarks();
}
