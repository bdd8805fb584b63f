// Sorting, list building and the pair pass (sums, constitutive law, leap-frog) on the 52^3 lattice jittered by 0.2 spacings: every
// compiled model, double, mixed and plain. Counters: ns per directed pair, Gflop/s.
//   build/release/bench_pairs --benchmark_filter='pass.*' --benchmark_enable_random_interleaving=true --benchmark_repetitions=9
#include "perf/bench/cloud.hpp"
#include <benchmark/benchmark.h>
#include <numeric>
#include <omp.h>

using namespace kuzure;
using bench::Cloud;

namespace {

constexpr int edge = 52;
constexpr double jitter = 0.2;

Scene scene_of(scene::Kernel kernel, bool viscous, bool tensile, scene::Precision precision)
{
    Scene s = bench::dry_sand();
    s.accuracy.kernel = kernel, s.accuracy.precision = precision;
    if (!viscous) s.effects.viscosity.reset();
    if (tensile) s.effects.artificial_stress = scene::ArtificialStress{};
    return s;
}

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

template <class T> void pass(benchmark::State& state, Scene s, Arithmetic arithmetic)
{
    omp_set_num_threads(int(state.range(0)));
#pragma omp parallel
    flush_denormals();
    const auto model = choose_model(s, arithmetic);
    Cloud c(edge, jitter, s);
    c.sort();
    c.build(model->cluster_width(), s.accuracy.skin);
    Array<Record<T>> now, next;
    c.make_records(now);
    next.resize(now.size());
    Array<Tension<T>> tension(now.size()), next_tension(now.size());
    for (auto& t : tension) t = {};
    std::vector<Index> all(c.lists.size());
    std::iota(all.begin(), all.end(), 0);
    std::int64_t pairs = 0;
    for (auto _ : state) {
        auto p = c.pass(now, next, 0); // a step of no length: the state stays, the work is the same
        p.kick = 0, p.tension = tension.data(), p.next_tension = next_tension.data();
        pairs = model->run(p, all).pairs;
    }
    using benchmark::Counter;
    state.counters["ns/pair"] = Counter(double(pairs) * 1e-9, Counter::kIsIterationInvariantRate | Counter::kInvert);
    const double flops = double(pairs) * model->flops_per_pair() + double(c.particles.size()) * model->flops_per_particle();
    state.counters["Gflop/s"] = Counter(flops * 1e-9, Counter::kIsIterationInvariantRate);
    state.SetLabel(model->name());
}

} // namespace

BENCHMARK(sort)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(lists)->Args({1, 4})->Args({2, 4})->Args({1, 8})->Unit(benchmark::kMillisecond)->UseRealTime();

int main(int argc, char** argv)
{
    using scene::Kernel, scene::Precision;
    for (const auto precision : {Precision::Double, Precision::Mixed})
        for (const auto arithmetic : {Arithmetic::Lanes, Arithmetic::Plain})
            for (const auto& [name, kernel, viscous, tensile] :
                 {std::tuple{"cubic_bare", Kernel::CubicSpline, false, false}, std::tuple{"cubic", Kernel::CubicSpline, true, false},
                  std::tuple{"wendland_c2", Kernel::WendlandC2, true, false}, std::tuple{"cubic_tensile", Kernel::CubicSpline, true, true},
                  std::tuple{"wendland_c2_tensile", Kernel::WendlandC2, true, true},
                  std::tuple{"wendland_c4_tensile", Kernel::WendlandC4, true, true}}) {
                const std::string title = std::string("pass/") + name + (precision == Precision::Mixed ? "/mixed" : "/double") +
                                          (arithmetic == Arithmetic::Plain ? "/plain" : "/lanes");
                const Scene s = scene_of(kernel, viscous, tensile, precision);
                const auto body = [=](benchmark::State& state) {
                    if (precision == Precision::Mixed) pass<float>(state, s, arithmetic);
                    else pass<double>(state, s, arithmetic);
                };
                auto* b = benchmark::RegisterBenchmark(title.c_str(), body)->Unit(benchmark::kMillisecond)->UseRealTime()->Arg(1);
                if (arithmetic == Arithmetic::Lanes) b->Arg(2);
            }
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
}
