#pragma once
// What this machine can do at most: the roofs of the roofline, measured with the instruction set of this build.
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace kuzure {

/// Measured ceilings of one host. Rates count 1e9 a second; a fused multiply-add is two operations; bandwidth
/// is that of a(i) = b(i) + s c(i), 24 bytes an element (write-allocate not counted).
struct Machine {
    std::string host, cpu, instruction_set;
    int threads = 0;
    double gflops_double_one = 0, gflops_double_all = 0;
    double gflops_float_one = 0, gflops_float_all = 0;
    double gbytes_one = 0, gbytes_all = 0;
    bool operator==(const Machine&) const = default;
};

/// Name of the processor as the system tells it; "unknown" where it does not.
std::string cpu_name();
/// Name of this host.
std::string host_name();

/// Measure with one thread and with `threads` threads, about two seconds. Works
/// alone: what else runs on the machine then is missing from the figures.
Machine measure_machine(std::string_view instruction_set, int threads);

/// Directory of kept measurements: $XDG_CACHE_HOME/kuzure or ~/.cache/kuzure; empty where neither is known.
std::filesystem::path machine_cache();
/// The kept measurement of this host, processor, instruction set and thread count, if there is one. Measures nothing.
std::optional<Machine> kept_machine(std::string_view instruction_set, int threads, const std::filesystem::path& cache = machine_cache());
/// The kept measurement of this host, processor, instruction set and thread count; else measure and keep it.
/// A cache that cannot be read or written is no error: it is measured again.
Machine this_machine(std::string_view instruction_set, int threads, const std::filesystem::path& cache = machine_cache());

/// As JSON text, and back; nothing where the text is not that of a Machine.
std::string to_json(const Machine&);
std::optional<Machine> machine_from_json(std::string_view text);

} // namespace kuzure
