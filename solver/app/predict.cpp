#include "solver/app/predict.hpp"
#include "solver/app/command.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure {

io::MachineProfile machine_named(const std::string& name_or_path)
{
    // An installed program has its own beside it; one in the build tree takes the sources'.
    const std::vector<io::Path> folders{own_path().parent_path().parent_path() / "share/kuzure/machines",
                                        io::Path(KUZURE_SOURCE_DIR) / "jobs/machines"};
    auto m = io::read_machine_profile(name_or_path, folders);
    if (m.node.cores == 0) m.node.cores = cores_here();
    if (m.node.memory == 0) m.node.memory = machine_memory();
    return m;
}

double predict_seconds(const Estimate& e, const io::MachineProfile& m, int nodes, int ranks_per_node)
{
    const double cores = double(nodes) * m.node.cores, ranks = double(nodes) * ranks_per_node;
    const auto& c = m.cost;
    const double work = 1e-9 * (e.pairs * c.pair_ns(e.mixed) + double(e.steps) * double(e.soil) * c.particle_ns) / cores;
    if (ranks < 2) return work;
    // A cube of soil a rank: its ghosts are a shell one support thick, one message to each of 26 neighbours, and one
    // reduction up and down a binary tree. Nothing is overlapped.
    const double edge = std::cbrt(std::max(1.0, double(e.soil) / ranks)), shell = e.support;
    const double ghosts = std::pow(edge + 2 * shell, 3) - std::pow(edge, 3);
    const double halo = ghosts * e.record * ranks_per_node / c.bandwidth + 26 * c.latency;
    const double reduction = 2 * std::ceil(std::log2(ranks)) * c.latency;
    return work + double(e.steps) * (halo + reduction);
}

} // namespace kuzure
