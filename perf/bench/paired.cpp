// What each effect costs, on a machine whose speed changes from second to second: the bare model and the other in turn, and
// the ratio of the medians.
//   build/release/bench_paired [ROUNDS] [NAME ...]        JSON: add --json
#include "perf/bench/work.hpp"
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fmt/format.h>

using namespace kuzure;

namespace {
constexpr int edge = 40;
constexpr double jitter = 0.2;

double timed(bench::ReadyPass& p)
{
    const double begin = omp_get_wtime();
    for (int k = 0; k < p.cycle; ++k) p.run();
    return (omp_get_wtime() - begin) / p.cycle;
}
double quantile(std::vector<double> v, double q)
{
    std::sort(v.begin(), v.end());
    return v[std::size_t(q * double(v.size() - 1) + 0.5)];
}
} // namespace

int main(int argc, char** argv)
{
    int rounds = 21;
    bool json = false;
    std::vector<std::string> names;
    for (int k = 1; k < argc; ++k) {
        if (std::strcmp(argv[k], "--json") == 0) json = true;
        else if (std::atoi(argv[k]) > 0) rounds = std::atoi(argv[k]);
        else names.push_back(argv[k]);
    }
    omp_set_num_threads(1);
    const auto all = bench::workloads(scene::Precision::Double);
    const auto find = [&](const std::string& name) {
        return std::find_if(all.begin(), all.end(), [&](const auto& w) { return w.name == name; });
    };
    for (const auto& name : names)
        if (find(name) == all.end()) {
            fmt::print(stderr, "bench_paired: no workload \"{}\"; there are:", name);
            for (const auto& w : all) fmt::print(stderr, " {}", w.name);
            fmt::print(stderr, "\n");
            return 2;
        }
    if (!json) fmt::print("{:28} {:>10} {:>10} {:>8} {:>17}  against\n", "workload", "bare ms", "it ms", "ratio", "quartiles");
    for (const auto& w : all) {
        if (w.name == "cubic" || (!names.empty() && std::find(names.begin(), names.end(), w.name) == names.end())) continue;
        const std::string against =
            w.name.starts_with("wendland") && w.name != "wendland_c2" && w.name != "wendland_c4_everything" ? "wendland_c2" : "cubic";
        bench::ReadyPass bare(find(against)->scene, Arithmetic::Simd, edge, jitter), it(w.scene, Arithmetic::Simd, edge, jitter);
        std::vector<double> a, b, ratio;
        timed(bare), timed(it);
        for (int k = 0; k < rounds; ++k) {
            a.push_back(timed(bare)), b.push_back(timed(it));
            ratio.push_back(b.back() / a.back());
        }
        const double medians = quantile(b, 0.5) / quantile(a, 0.5);
        if (json)
            fmt::print("{{\"workload\": \"{}\", \"against\": \"{}\", \"bare_ms\": {:.4f}, \"ms\": {:.4f}, \"ratio\": {:.4f}}}\n", w.name,
                       against, 1e3 * quantile(a, 0.5), 1e3 * quantile(b, 0.5), medians);
        else
            fmt::print("{:28} {:10.2f} {:10.2f} {:8.3f} {:8.3f} {:8.3f}  {}\n", w.name, 1e3 * quantile(a, 0.5), 1e3 * quantile(b, 0.5),
                       medians, quantile(ratio, 0.25), quantile(ratio, 0.75), against);
        std::fflush(stdout);
    }
}
