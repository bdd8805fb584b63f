// The constitutive law alone: rotation, Hooke and the return to the cone, elastic and yielding, double and lanes.
#include "solver/core/simd.hpp"
#include "solver/physics/drucker_prager.hpp"
#include <benchmark/benchmark.h>

using namespace kuzure;

namespace {

template <class V> void return_map(benchmark::State& state)
{
    scene::Soil sand;
    sand.density = 1850, sand.young = 1.8e6, sand.poisson = 0.3, sand.friction_angle = 0.436;
    const auto soil = Elastoplastic<V>::from(Material::from(sand));
    const double shear = state.range(0) ? 1e5 : 1e3; // outside the cone, or inside
    const auto v = [](double x) { return V(number<V>(x)); };
    Sym3<V> s{v(-2e4), v(-2e4), v(-3e4), v(shear), v(0.0), v(0.0)};
    const Vec3<V> spin{v(1e-4), v(2e-4), v(3e-4)};
    for (auto _ : state) {
        benchmark::DoNotOptimize(s);
        auto y = return_to_cone(rotate(spin, s), soil);
        benchmark::DoNotOptimize(y);
    }
    state.counters["ns/particle"] =
        benchmark::Counter(width<V> * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

} // namespace

BENCHMARK(return_map<double>)->Arg(0)->Arg(1)->Name("return_map/plain");
BENCHMARK(return_map<Native<double>>)->Arg(0)->Arg(1)->Name("return_map/lanes");
BENCHMARK_MAIN();
