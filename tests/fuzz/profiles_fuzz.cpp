// Any bytes are a machine profile, a sweep or a batch template, or a refusal in words. The first byte of the input chooses:
//   0  a machine profile; 1  a sweep; 2  a template of a batch system.
#include "io/batch_template.hpp"
#include "io/machine_profile.hpp"
#include "io/sweep_file.hpp"
#include "solver/core/ensure.hpp"
#include "tests/fuzz/fuzz.hpp"
#include <cmath>

using namespace kuzure;
using namespace kuzure::fuzz;

namespace {

void inspect(const io::MachineProfile& m)
{
    if (m.name.empty() || m.node.count < 1 || m.node.ranks < 1 || m.node.threads_per_core < 1)
        found("a machine without nodes, ranks or threads");
    if (m.threads(1) < 1 || m.threads(1 << 20) < 1) found("a machine that starts no thread");
    for (const auto& q : m.queues)
        if (q.least_nodes > q.most_nodes || !(q.minutes > 0)) found("a queue that takes no job");
    for (const double x : {m.cost.pair_ns_double, m.cost.pair_ns_mixed, m.cost.particle_ns, m.cost.memory_bandwidth, m.cost.bandwidth})
        if (!(x > 0) || !std::isfinite(x)) found("a cost that is none");
}

void inspect(const io::Sweep& s)
{
    if (s.points.empty() || s.points.size() > 100000 || s.threads < 1 || s.measures.empty()) found("a sweep of nothing, or of too much");
    for (const auto& p : s.points)
        if (p.curve.empty()) found("a point without a name");
}

const io::BatchValues& values()
{
    using enum io::BatchValue::Kind;
    static const io::BatchValues all{{"nodes", {Text, {"4"}}},         {"queue", {Text, {}}},
                                     {"name", {Word, {"'a b'"}}},      {"setup", {Lines, {"a", "b"}}},
                                     {"more", {Options, {"#x", "y"}}}, {"none", {Lines, {}}}};
    return all;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    static const Scratch scratch;
    static const io::Path machines = io::Path(KUZURE_SOURCE_DIR) / "jobs" / "machines";
    if (size == 0 || size > (1 << 20)) return 0;
    const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        switch (data[0] % 3) {
        case 0:
            inspect(io::parse_machine_profile(rest, "fuzz.toml", {machines}));
            break;
        case 1:
            inspect(io::parse_sweep(rest, "fuzz.toml"));
            break;
        default: {
            const auto file = scratch.path / "fuzz.job.sh";
            write(file, rest);
            const auto script = io::fill_template(file, values(), {scratch.path});
            if (script.size() > 100 * (rest.size() + 10)) found("a script that grows");
        }
        }
    } catch (const BadInput& e) {
        judge_refusal(e.what());
    }
    return 0;
}
