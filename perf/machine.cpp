#include "perf/machine.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <fmt/format.h>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <omp.h>
#include <unistd.h>

namespace kuzure {
namespace {

using Clock = std::chrono::steady_clock;

#if defined(__AVX512F__)
constexpr int register_bytes = 64, chains = 16; // of 32 registers
#elif defined(__AVX__)
constexpr int register_bytes = 32, chains = 12; // of 16 registers
#elif defined(__ARM_FEATURE_SVE_BITS) && __ARM_FEATURE_SVE_BITS > 0
constexpr int register_bytes = __ARM_FEATURE_SVE_BITS / 8, chains = 16; // of 32 registers
#elif defined(__aarch64__)
constexpr int register_bytes = 16, chains = 16;
#else
constexpr int register_bytes = 16, chains = 12;
#endif

// The project compiles with -ffp-contract=off for equal bits; here the fused instruction is the very thing measured.
template <class T> __attribute__((noinline, optimize("fp-contract=fast"))) T multiply_add(T factor, T summand, long rounds)
{
    typedef T Vec __attribute__((vector_size(register_bytes)));
    const Vec a = factor - Vec{}, b = summand - Vec{};
    Vec x[chains];
#pragma GCC unroll 16
    for (int k = 0; k < chains; ++k) x[k] = b * T(k + 1);
    for (long n = 0; n < rounds; ++n) {
#pragma GCC unroll 16
        for (int k = 0; k < chains; ++k) x[k] = x[k] * a + b;
    }
    Vec sum{};
#pragma GCC unroll 16
    for (int k = 0; k < chains; ++k) sum += x[k];
    return sum[0];
}

/// Seconds that `work(thread)` takes on all threads at once: from a common start until the last is done.
template <class Work> double seconds_of(int threads, const Work& work)
{
    Clock::time_point start;
    double last = 0;
#pragma omp parallel num_threads(threads) reduction(max : last)
    {
#pragma omp barrier
#pragma omp master
        start = Clock::now();
#pragma omp barrier
        work(omp_get_thread_num());
        last = std::chrono::duration<double>(Clock::now() - start).count();
    }
    return last;
}

template <class T> double gflops(int threads)
{
    // Known at run time only, or the compiler would do the sums itself. The recurrence stays near 1.
    volatile T factor = T(0.75), summand = T(0.25);
    volatile T sink = 0;
    const T a = factor, b = summand;
    constexpr double flops_a_round = 2.0 * chains * register_bytes / sizeof(T);
    long rounds = 1 << 16;
    double best = 0;
    for (int repeat = 0; repeat < 8; ++repeat) {
        const double seconds = seconds_of(threads, [&](int) {
            const T x = multiply_add(a, b, rounds);
            if (x == T(-1)) sink = x;
        });
        best = std::max(best, double(rounds) * flops_a_round * threads / seconds * 1e-9);
        // The first repeat wakes the processor and finds the length: 30 ms each.
        if (repeat == 0) rounds = std::clamp(long(double(rounds) * 0.03 / seconds), 1L << 12, 1L << 34);
    }
    return best;
}

/// Elements of one array of the triad: beyond the caches that one machine's share of a processor has, and
/// within an eighth of the memory.
std::size_t triad_elements()
{
    const double cache = std::max(double(sysconf(_SC_LEVEL3_CACHE_SIZE)), 32e6);
    const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
    const double bytes = std::min({4 * cache, 0.5e9, memory / 8});
    return std::size_t(std::max(bytes, 24e6) / 24);
}

double gbytes(int threads)
{
    const std::size_t n = triad_elements();
    const auto a = std::make_unique_for_overwrite<double[]>(n), b = std::make_unique_for_overwrite<double[]>(n),
               c = std::make_unique_for_overwrite<double[]>(n);
    double *const x = a.get(), *const y = b.get(), *const z = c.get();
    const auto first = [&](int thread) { return n * std::size_t(thread) / std::size_t(threads); };
    // Each thread first touches the pages that it will use.
    seconds_of(threads, [&](int t) {
        std::fill(x + first(t), x + first(t + 1), 0.0);
        std::fill(y + first(t), y + first(t + 1), 1.0);
        std::fill(z + first(t), z + first(t + 1), 2.0);
    });
    volatile double factor = 3;
    const double s = factor;
    double best = 0;
    for (int repeat = 0; repeat < 5; ++repeat) {
        const double seconds = seconds_of(threads, [&](int t) {
            const std::size_t end = first(t + 1);
#pragma omp simd
            for (std::size_t i = first(t); i < end; ++i) x[i] = y[i] + s * z[i];
        });
        best = std::max(best, double(n) * 24 / seconds * 1e-9);
    }
    return best;
}

/// A text that can be part of a file name.
std::string as_file_name(std::string text)
{
    std::ranges::replace_if(
        text, [](unsigned char c) { return !std::isalnum(c) && c != '-' && c != '.'; }, '_');
    return text;
}

} // namespace

std::string cpu_name()
{
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.starts_with("model name"))
            if (const auto colon = line.find(": "); colon != line.npos) return line.substr(colon + 2);
    return "unknown";
}

std::string host_name()
{
    char text[256] = {};
    return gethostname(text, sizeof text - 1) == 0 && text[0] ? text : "unknown";
}

Machine measure_machine(std::string_view instruction_set, int threads)
{
    threads = std::max(threads, 1);
    return {.host = host_name(),
            .cpu = cpu_name(),
            .instruction_set = std::string(instruction_set),
            .threads = threads,
            .gflops_double_one = gflops<double>(1),
            .gflops_double_all = gflops<double>(threads),
            .gflops_float_one = gflops<float>(1),
            .gflops_float_all = gflops<float>(threads),
            .gbytes_one = gbytes(1),
            .gbytes_all = gbytes(threads)};
}

std::filesystem::path machine_cache()
{
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return std::filesystem::path(cache) / "kuzure";
    if (const char* home = std::getenv("HOME"); home && *home) return std::filesystem::path(home) / ".cache" / "kuzure";
    return {};
}

namespace {
std::filesystem::path kept_file(std::string_view instruction_set, int threads, const std::filesystem::path& cache)
{
    return cache / as_file_name(fmt::format("machine-{}-{}-{}.json", host_name(), instruction_set, threads));
}
} // namespace

std::optional<Machine> kept_machine(std::string_view instruction_set, int threads, const std::filesystem::path& cache)
{
    if (cache.empty()) return {};
    std::ifstream kept(kept_file(instruction_set, threads, cache));
    if (!kept) return {};
    const std::string text(std::istreambuf_iterator<char>(kept), {});
    const auto m = machine_from_json(text);
    if (m && m->host == host_name() && m->cpu == cpu_name() && m->instruction_set == instruction_set && m->threads == threads) return m;
    return {};
}

Machine this_machine(std::string_view instruction_set, int threads, const std::filesystem::path& cache)
{
    if (const auto kept = kept_machine(instruction_set, threads, cache)) return *kept;
    if (cache.empty()) return measure_machine(instruction_set, threads);
    const auto file = kept_file(instruction_set, threads, cache);
    const Machine measured = measure_machine(instruction_set, threads);
    std::error_code ignored;
    std::filesystem::create_directories(cache, ignored);
    // Through a file of our own: another rank or run may keep the same measurement now.
    auto part = file;
    part += fmt::format(".{}", getpid());
    bool written = false;
    if (std::ofstream out(part); out) {
        out << to_json(measured) << '\n';
        out.close();
        written = out.good();
    }
    if (written) std::filesystem::rename(part, file, ignored);
    else std::filesystem::remove(part, ignored);
    return measured;
}

std::string to_json(const Machine& m)
{
    return nlohmann::ordered_json{{"host", m.host},
                                  {"cpu", m.cpu},
                                  {"instruction_set", m.instruction_set},
                                  {"threads", m.threads},
                                  {"gflops_double_one", m.gflops_double_one},
                                  {"gflops_double_all", m.gflops_double_all},
                                  {"gflops_float_one", m.gflops_float_one},
                                  {"gflops_float_all", m.gflops_float_all},
                                  {"gbytes_one", m.gbytes_one},
                                  {"gbytes_all", m.gbytes_all}}
        .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::optional<Machine> machine_from_json(std::string_view text)
{
    try {
        const auto j = nlohmann::json::parse(text);
        Machine m{.host = j.at("host"),
                  .cpu = j.at("cpu"),
                  .instruction_set = j.at("instruction_set"),
                  .threads = j.at("threads"),
                  .gflops_double_one = j.at("gflops_double_one"),
                  .gflops_double_all = j.at("gflops_double_all"),
                  .gflops_float_one = j.at("gflops_float_one"),
                  .gflops_float_all = j.at("gflops_float_all"),
                  .gbytes_one = j.at("gbytes_one"),
                  .gbytes_all = j.at("gbytes_all")};
        for (const double rate :
             {m.gflops_double_one, m.gflops_double_all, m.gflops_float_one, m.gflops_float_all, m.gbytes_one, m.gbytes_all})
            if (!(rate > 0)) return {};
        return m;
    } catch (const nlohmann::json::exception&) {
        return {};
    }
}

} // namespace kuzure
