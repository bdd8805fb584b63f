#include "solver/app/scaling/predict.hpp"
#include "solver/app/cli/command.hpp"
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

namespace {

// What the model assumes beside a machine's constants; each is explained in docs/performance.md.
constexpr double rim_per_seen = 1.5;       // a cluster waits as a whole when one of its particles does
constexpr double rebuild_exchanges = 2.25; // boxes, sorted positions of ghosts; one rebuild in four migration
constexpr double rebuild_sums = 1.75; // numbers that all ranks agree on: the halo's; one rebuild in four imbalance (two) and migration's
constexpr double sorted_bytes = 32;   // of a ghost's sorted position, id and soil, at a rebuild
constexpr double box_bytes = 48;      // of a rank's box, which every rank gets
constexpr double rebuilds_a_telling = 12; // as often: soil at its fastest has left the boxes after 21, a cut comes in between
// Of a cut between neighbours: from `perf/scaling.py drift`, 64 ranks (docs/performance.md).
constexpr double even_seconds =
    3.2e-5; // processor time here per block of the mean rank, of the longest rank: 4.7e-5, of which 0.68 of the instructions are left
constexpr double even_iterations = 55; // numbers told to all peers, each with a sum over all ranks
constexpr double even_rounds = 11;     // of offers: offers, answers and updates, and a sum and a maximum over all ranks
constexpr double even_moves = 0.105;   // particles that migrate, of a rank's
constexpr double box_of_blocks = 24;   // bytes of a rank's bounding box, which every rank gets
constexpr double state_bytes = 252;    // of a particle that migrates
constexpr double scalar_ns_here = 59;  // particle_ns of the machine where even_seconds was measured
constexpr double weighed = 0.1; // of a rebuild's work on particles: pairs of one cluster in sixteen are counted, particles put to blocks

/// What a scheme's step is made of: a machine's costs of pairs and particles are those of one pass (Bui's leap-frog) at the paper's step.
/// hirata_52 on the machines of docs/performance.md: 579 rebuilds in 10,000 steps of 1e-4 s, 250 in 790 of the default; a
/// rebuild costs a particle 15/59 x 17 of what a step of one pass does, and `move` a quarter.
struct Scheme {
    double passes;            // over the pairs, each with its own exchange of ghosts behind interior clusters
    double pairs;             // cost of a step's pairs, in one pass
    double particles;         // cost of a step's particles, in those of one pass with lists every 17th step
    double steps_per_rebuild; // while the soil flows
    double growth;            // of the imbalance a step: longer steps move soil further
};
constexpr Scheme one_pass{1, 1, 1, 17, 1};
constexpr double lists_of_particle = 15.0 / 59;
constexpr Scheme two_pass{2, 1.75, 1.25 * (1 - lists_of_particle) + lists_of_particle * 17 / 3.16, 3.16, 10000.0 / 790};

/// Growth of max/mean - 1 a step while soil slides, for a mean rank's soil: smaller parts are crossed sooner. Fitted to
/// `perf/scaling.py drift` on 4, 16, 32 and 64 ranks (docs/performance.md).
double imbalance_growth(double particles) { return 6.1e-5 * std::pow(35152 / std::max(1.0, particles), 0.56); }

const Scheme& scheme_of(scene::Scheme s) { return s == scene::Scheme::Staggered ? two_pass : one_pass; }

} // namespace

int exchanges(scene::Scheme scheme) { return int(scheme_of(scheme).passes); }

StepSeconds predict_step(std::span<const RankLoad> ranks, const Deployment& at)
{
    const auto& c = at.machine.cost;
    const double cores = double(at.machine.node.cores) / at.ranks_per_node;
    const Scheme& scheme = scheme_of(at.scheme);
    const double pair = 1e-9 * c.pair_ns(at.mixed) * scheme.pairs / cores, particle = 1e-9 * c.particle_ns * scheme.particles / cores;
    const double latency = c.latency * at.latency_times, bandwidth = c.bandwidth * at.bandwidth_times;
    const double memory = c.memory_bandwidth / at.ranks_per_node; // a rank's share

    StepSeconds s;
    double slowest = 0, most_computed = 0, halo_of_slowest = 0, messages = 0, ghosts = 0, node_ghosts = 0;
    for (const RankLoad& r : ranks) {
        const double pairs = r.pairs * pair, computed = pairs + r.particles * particle;
        s.pairs += pairs / double(ranks.size()), s.particles += r.particles * particle / double(ranks.size());
        const double interior = r.particles > 0 ? pairs * (1 - std::min(1.0, rim_per_seen * r.rim / r.particles)) : 0;
        // Packed and unpacked once each: read and written.
        const double copies = 2 * (r.sent + r.ghosts) * at.ghost_bytes / memory;
        const double near = r.messages - r.far_messages;
        // A latency for each exchange; the bytes are those of all together.
        const double wire = (r.far_messages > 0 ? scheme.passes * latency : 0) + r.node_ghosts * at.ghost_bytes / bandwidth +
                            (near > 0 ? 2 * std::max(0.0, r.sent) * at.ghost_bytes / memory : 0);
        // Half the latency of a message is the processor's own time, at both ends; within a node a fifth of it.
        const double handling = scheme.passes * latency * (r.far_messages + 0.2 * near);
        const double halo = copies + handling + std::max(0.0, wire - interior);
        s.network = std::max(s.network, wire);
        messages = std::max(messages, r.messages), ghosts = std::max(ghosts, r.ghosts), node_ghosts = std::max(node_ghosts, r.node_ghosts);
        most_computed = std::max(most_computed, computed);
        if (computed + halo > slowest) slowest = computed + halo, halo_of_slowest = halo;
    }
    s.halo = halo_of_slowest;
    s.imbalance = std::max(0.0, slowest - halo_of_slowest - s.pairs - s.particles);
    if (at.ranks < 2) return s;
    const double levels = std::ceil(std::log2(double(at.ranks)));
    s.reduction = 2 * levels * latency;
    const double collective = 2 * levels * latency; // a sum, a maximum, or the barrier that ends an exchange
    s.rebuild =
        (rebuild_exchanges * (2 * messages * latency + collective) + rebuild_sums * collective + (node_ghosts * sorted_bytes) / bandwidth +
         (double(at.ranks_per_node) * at.ranks * box_bytes / bandwidth + collective) / rebuilds_a_telling) /
        scheme.steps_per_rebuild;
    // Cut when idle time has added up to a cut's cost C: with max/mean growing by d a step, each of t seconds, after
    // sqrt(2 C/(d t)) steps, and cut and idle time together cost 2 C of them.
    double far = 0, most_particles = 0, soil = 0;
    for (const RankLoad& r : ranks) soil += r.particles;
    for (const RankLoad& r : ranks)
        far = std::max(far, r.far_messages + 0.2 * (r.messages - r.far_messages)), most_particles = std::max(most_particles, r.particles);
    const double cut = at.blocks == 0 ? 0
                                      : at.blocks / at.ranks * even_seconds * c.particle_ns / scalar_ns_here +
                                            weighed * most_particles * particle * scheme.steps_per_rebuild +
                                            even_iterations * (far * latency + latency + collective) +
                                            even_rounds * (3 * (messages * latency + collective) + 2 * collective) +
                                            double(at.ranks_per_node) * at.ranks * box_of_blocks / bandwidth + collective +
                                            even_moves * most_particles * state_bytes * at.ranks_per_node / bandwidth;
    if (cut > 0) {
        s.recut_steps = std::sqrt(2 * cut / (scheme.growth * imbalance_growth(soil / double(ranks.size())) * s.total()));
        s.recut = 2 * cut / s.recut_steps;
    }
    return s;
}

std::vector<RankLoad> loads(const CutShare& cut, int ranks_per_node)
{
    std::vector<RankLoad> all(cut.rank.size());
    std::vector<double> out(all.size() / std::size_t(ranks_per_node) + 1), in(out.size());
    const auto node = [&](int rank) { return std::size_t(rank / ranks_per_node); };
    for (const HaloMessage& m : cut.message) {
        if (node(m.from) == node(m.to)) continue;
        out[node(m.from)] += double(m.ghosts), in[node(m.to)] += double(m.ghosts);
        ++all[m.from].far_messages;
    }
    for (std::size_t r = 0; r < all.size(); ++r) {
        const RankShare& s = cut.rank[r];
        const std::size_t n = node(int(r));
        all[r] = {.pairs = s.work.pairs(),
                  .particles = double(s.work.particles),
                  .rim = double(s.seen),
                  .sent = double(s.sent),
                  .ghosts = double(s.ghosts),
                  .messages = double(s.messages),
                  .far_messages = all[r].far_messages,
                  .node_ghosts = std::max(out[n], in[n])};
    }
    return all;
}

double predict_seconds(const Estimate& e, const io::MachineProfile& m, int nodes, int ranks_per_node)
{
    // A cube of soil a rank and a cube of them a node: ghosts are a shell one support thick.
    const double ranks = double(nodes) * ranks_per_node, n = double(e.soil) / ranks;
    const auto shell = [&](double particles) { return std::pow(std::cbrt(particles) + 2 * e.support, 3) - particles; };
    const double ghosts = std::min(ranks > 1 ? shell(n) : 0, double(e.soil) - n);
    RankLoad r{.pairs = e.pairs / double(e.steps) / ranks,
               .particles = n,
               .rim = std::min(n, ghosts),
               .sent = ghosts,
               .ghosts = ghosts,
               .messages = std::min(26.0, ranks - 1)};
    r.far_messages = nodes > 1 ? r.messages : 0;
    r.node_ghosts = nodes > 1 ? shell(n * ranks_per_node) : 0;
    const Deployment at{.machine = m,
                        .ranks = int(ranks),
                        .ranks_per_node = ranks_per_node,
                        .ghost_bytes = e.record,
                        .blocks = std::min(double(default_blocks_per_rank), n / 27) * ranks,
                        .mixed = e.mixed,
                        .scheme = e.scheme};
    return double(e.steps) * predict_step(std::span(&r, 1), at).total();
}

} // namespace kuzure
