// Cutting the graph of blocks into parts: along a Hilbert curve, or by METIS and then evened out.
#include "decomposition/partition.hpp"
#include "decomposition/rim.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <map>
#include <metis.h>
#include <numeric>
#include <utility>

namespace kuzure {

std::string partitioner_library()
{
    return "METIS " + std::to_string(METIS_VER_MAJOR) + '.' + std::to_string(METIS_VER_MINOR) + '.' + std::to_string(METIS_VER_SUBMINOR);
}

const char* name(Method m) { return m == Method::Metis ? "METIS" : "Hilbert curve"; }

std::uint64_t hilbert_index(std::array<std::uint32_t, 3> x, int bits)
{
    const std::uint32_t top = std::uint32_t(1) << (bits - 1);
    for (std::uint32_t q = top; q > 1; q >>= 1) {
        const std::uint32_t p = q - 1;
        for (int i = 0; i < 3; ++i) {
            if (x[i] & q) {
                x[0] ^= p;
            } else {
                const std::uint32_t t = (x[0] ^ x[i]) & p;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
    }
    for (int i = 1; i < 3; ++i) x[i] ^= x[i - 1];
    std::uint32_t t = 0;
    for (std::uint32_t q = top; q > 1; q >>= 1)
        if (x[2] & q) t ^= q - 1;
    for (auto& c : x) c ^= t;
    std::uint64_t index = 0;
    for (int bit = bits - 1; bit >= 0; --bit)
        for (int i = 0; i < 3; ++i) index = index << 1 | (x[i] >> bit & 1);
    return index;
}

namespace {

using Cut = std::vector<int>;

/// Pieces of equal work along the Hilbert curve.
Cut hilbert_cut(const BlockGraph& g, int parts)
{
    Block low = g.block[0], high = g.block[0];
    for (const auto& b : g.block)
        for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], b[a]), high[a] = std::max(high[a], b[a]);
    int bits = 1;
    for (int a = 0; a < 3; ++a)
        while ((high[a] - low[a]) >> bits) ++bits;
    std::vector<std::pair<std::uint64_t, int>> curve;
    for (int b = 0; b < g.size(); ++b) {
        std::array<std::uint32_t, 3> x;
        for (int a = 0; a < 3; ++a) x[a] = std::uint32_t(g.block[b][a] - low[a]);
        curve.emplace_back(hilbert_index(x, bits), b);
    }
    std::ranges::sort(curve);
    const double total = std::accumulate(g.work.begin(), g.work.end(), 0.0);
    Cut part(g.size());
    double below = 0;
    for (int k = 0; k < g.size(); ++k) {
        const int b = curve[k].second;
        const double middle = total > 0 ? (below + 0.5 * g.work[b]) / total : (k + 0.5) / g.size();
        part[b] = std::min(parts - 1, int(middle * parts));
        below += g.work[b];
    }
    return part;
}

/// The graph as METIS takes it: no self-loops, no double edges, integer weights well below 2^31 in sum.
struct MetisGraph {
    std::vector<idx_t> first, neighbour, bytes, work;
    bool connected;

    MetisGraph(const BlockGraph& g, int parts)
    {
        // A block heavier than a part is a part of its own whatever METIS does: to it, it weighs as much as a
        // part, or its bisections would run out of blocks. Fewer parts are left for the lighter ones, hence in turn.
        std::vector<double> load = g.work;
        std::ranges::sort(load, std::greater{});
        double all_work = std::accumulate(load.begin(), load.end(), 0.0), most = all_work;
        for (std::size_t k = 0; k < load.size() && int(k) < parts; ++k) {
            most = all_work / (parts - int(k));
            if (load[k] <= most) break;
            all_work -= load[k];
        }
        load = g.work;
        for (double& w : load) w = std::min(w, most);
        all_work = std::accumulate(load.begin(), load.end(), 0.0);
        double all_bytes = 0;
        for (const auto& l : g.link) all_bytes += l.bytes;
        const double largest = 1 << 28;
        std::vector<std::pair<idx_t, double>> edges;
        for (int b = 0; b < g.size(); ++b) {
            first.push_back(idx_t(neighbour.size()));
            work.push_back(all_work > 0 ? 1 + idx_t(load[b] / all_work * largest) : 1);
            edges.clear();
            for (const auto& l : g.links(b))
                if (l.block != b) edges.emplace_back(l.block, l.bytes);
            std::ranges::sort(edges);
            for (std::size_t e = 0; e < edges.size(); ++e) {
                const idx_t weight = 1 + idx_t(edges[e].second / std::max(all_bytes, 1.0) * largest);
                if (e && edges[e].first == edges[e - 1].first) {
                    bytes.back() += weight;
                } else {
                    neighbour.push_back(edges[e].first);
                    bytes.push_back(weight);
                }
            }
        }
        first.push_back(idx_t(neighbour.size()));

        std::vector<int> queue{0};
        std::vector<char> seen(g.size(), 0);
        seen[0] = 1;
        for (std::size_t k = 0; k < queue.size(); ++k)
            for (idx_t e = first[queue[k]]; e < first[queue[k] + 1]; ++e)
                if (!std::exchange(seen[neighbour[e]], 1)) queue.push_back(neighbour[e]);
        connected = int(queue.size()) == g.size();
    }
};

/// Up to here several cuts are tried; larger graphs would take minutes.
constexpr int small_graph = 10000;

enum class Way { Kway, ContiguousKway, Bisection };

/// Nothing where METIS fails.
std::optional<Cut> metis_cut(MetisGraph& g, int parts, Way way)
{
    idx_t n = idx_t(g.work.size());
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_NUMBERING] = 0;
    options[METIS_OPTION_SEED] = 1;
    options[METIS_OPTION_NCUTS] = n <= small_graph ? 4 : 1;
    options[METIS_OPTION_NITER] = 20;
    options[METIS_OPTION_UFACTOR] = way == Way::Bisection ? 1 : 20; // tolerated imbalance in 1/1000
    idx_t constraints = 1, k = parts, cut = 0;
    std::vector<idx_t> part(g.work.size());
    int rc = METIS_OK;
    if (way == Way::Bisection) {
        rc = METIS_PartGraphRecursive(&n, &constraints, g.first.data(), g.neighbour.data(), g.work.data(), nullptr, g.bytes.data(), &k,
                                      nullptr, nullptr, options, &cut, part.data());
    } else {
        options[METIS_OPTION_CONTIG] = way == Way::ContiguousKway;
        rc = METIS_PartGraphKway(&n, &constraints, g.first.data(), g.neighbour.data(), g.work.data(), nullptr, g.bytes.data(), &k, nullptr,
                                 nullptr, options, &cut, part.data());
    }
    if (rc != METIS_OK) return std::nullopt;
    for (const idx_t p : part)
        if (p < 0 || p >= parts) return std::nullopt;
    return Cut(part.begin(), part.end());
}

/// Parts' loads while blocks move.
struct Loads {
    const BlockGraph& g;
    Cut& part;
    std::vector<double> work;
    std::vector<int> blocks;

    Loads(const BlockGraph& graph, Cut& cut, int parts) : g(graph), part(cut), work(parts, 0.0), blocks(parts, 0)
    {
        for (int b = 0; b < g.size(); ++b) work[part[b]] += g.work[b], ++blocks[part[b]];
    }
    void move(int b, int to)
    {
        work[part[b]] -= g.work[b], --blocks[part[b]];
        part[b] = to;
        work[to] += g.work[b], ++blocks[to];
    }
};

/// Gives every empty part the block that costs the heaviest part least halo. Needs parts <= blocks.
void fill_empty_parts(const BlockGraph& g, Cut& part, int parts)
{
    Loads loads(g, part, parts);
    for (int p = 0; p < parts; ++p) {
        if (loads.blocks[p] > 0) continue;
        int from = -1;
        for (int q = 0; q < parts; ++q)
            if (loads.blocks[q] > 1 && (from < 0 || loads.work[q] > loads.work[from])) from = q;
        int best = -1;
        double least = 0;
        for (int b = 0; b < g.size(); ++b) {
            if (part[b] != from) continue;
            double ties = 0;
            for (const auto& l : g.links(b)) ties += part[l.block] == from ? l.bytes : -l.bytes;
            if (best < 0 || ties < least) best = b, least = ties;
        }
        loads.move(best, p);
    }
}

/// Moves rim blocks from heavier to lighter neighbouring parts until the heaviest part is within `target` of
/// the mean or nothing helps. Each move lowers the sum of squared loads, so it ends.
void even_out_parts(const BlockGraph& g, Cut& part, int parts, double target)
{
    Loads loads(g, part, parts);
    const double mean = std::accumulate(loads.work.begin(), loads.work.end(), 0.0) / parts;
    if (!(mean > 0)) return;
    std::vector<std::vector<int>> members(parts);
    std::vector<int> order(parts);
    std::vector<double> ties(parts, 0.0);
    for (int pass = 0; pass < 100; ++pass) {
        if (*std::ranges::max_element(loads.work) <= target * mean) return;
        for (auto& m : members) m.clear();
        for (int b = 0; b < g.size(); ++b) members[part[b]].push_back(b);
        std::iota(order.begin(), order.end(), 0);
        std::ranges::stable_sort(order, [&](int a, int b) { return loads.work[a] > loads.work[b]; });
        bool moved = false;
        for (const int p : order) {
            // One block per part and pass: the loads around it change, so look again before the next.
            if (loads.work[p] <= mean || loads.blocks[p] < 2) continue;
            const RimBlock best =
                best_rim_block(g, part, p, members[p], ties, [&](int b, int q) { return loads.work[q] + g.work[b] < loads.work[p]; });
            if (best.block < 0) continue;
            loads.move(best.block, best.to);
            moved = true;
        }
        if (!moved) return;
    }
}

/// Work that one thing has in common with another.
struct Share {
    int now, before;
    double work;
};
/// Adds up what belongs to the same two, and sorts by them.
void merge(std::vector<Share>& shares)
{
    std::ranges::stable_sort(shares, {}, [](const Share& s) { return std::pair(s.now, s.before); });
    std::size_t kept = 0;
    for (const Share& s : shares) {
        if (kept && shares[kept - 1].now == s.now && shares[kept - 1].before == s.before) shares[kept - 1].work += s.work;
        else shares[kept++] = s;
    }
    shares.resize(kept);
}

/// Renames the parts so that most work stays where it was: greedy matching on the shared work.
void keep_labels(const BlockGraph& g, Cut& part, int parts, const std::vector<int>& previous)
{
    std::vector<Share> shares;
    for (int b = 0; b < g.size(); ++b)
        if (previous[b] >= 0 && previous[b] < parts) shares.push_back({part[b], previous[b], g.work[b]});
    merge(shares);
    std::ranges::stable_sort(shares, std::greater{}, &Share::work);
    std::vector<int> label(parts, -1);
    std::vector<char> taken(parts, 0);
    for (const Share& s : shares)
        if (label[s.now] < 0 && !taken[s.before]) label[s.now] = s.before, taken[s.before] = 1;
    int next = 0;
    for (int p = 0; p < parts; ++p) {
        if (label[p] >= 0) continue;
        while (taken[next]) ++next;
        label[p] = next, taken[next] = 1;
    }
    for (int& p : part) p = label[p];
}

Cut best_cut(const BlockGraph& g, int parts, Method method)
{
    if (parts == 1) return Cut(g.size(), 0);
    Cut one_each(g.size());
    std::iota(one_each.begin(), one_each.end(), 0);
    if (parts == g.size()) return one_each;

    Cut best = hilbert_cut(g, parts);
    fill_empty_parts(g, best, parts);
    if (method == Method::Hilbert) return best;

    even_out_parts(g, best, parts, good_balance);
    CutReport report = describe(g, best, parts);
    MetisGraph metis(g, parts);
    const auto consider = [&](Way way) {
        auto cut = metis_cut(metis, parts, way);
        if (!cut) return;
        fill_empty_parts(g, *cut, parts);
        even_out_parts(g, *cut, parts, good_balance);
        const CutReport r = describe(g, *cut, parts);
        if (std::pair(std::max(good_balance, r.imbalance), r.cut_bytes) >=
            std::pair(std::max(good_balance, report.imbalance), report.cut_bytes))
            return;
        best = std::move(*cut);
        report = r;
    };
    // Bisection cuts best in most scenes, and fastest; it complains on standard output where it runs out of blocks.
    if (g.size() >= 3 * parts) consider(Way::Bisection);
    if (g.size() > small_graph) return best;
    if (metis.connected) consider(Way::ContiguousKway);
    consider(Way::Kway);
    return best;
}

} // namespace

std::vector<int> partition(const BlockGraph& g, int parts, Method method, const std::vector<int>* previous)
{
    ensure(parts >= 1, "a cut has at least one part");
    ensure(!previous || int(previous->size()) == g.size(), "the previous cut has another number of blocks");
    if (g.size() == 0) return {};
    Cut part = best_cut(g, std::min(parts, g.size()), method);
    if (previous) keep_labels(g, part, parts, *previous);
    return part;
}

BlockCut cut_blocks(std::span<const BlockWork> listed, std::span<const int> lister, const BlockGrid& grid, int parts, Method method)
{
    ensure(lister.empty() || listed.size() == lister.size(), "every block is listed by a rank");
    BlockCut cut{block_graph(listed, grid), {}, {}};
    const BlockGraph& g = cut.graph;

    if (lister.empty()) {
        cut.owner = partition(g, parts, method);
        cut.report = describe(g, cut.owner, parts);
        return cut;
    }
    // A block was where most of its work was listed.
    BlockIndex index;
    index.reserve(g.block.size());
    for (int b = 0; b < g.size(); ++b) index.set(g.block[b], b);
    std::vector<Share> shares;
    for (std::size_t k = 0; k < listed.size(); ++k) shares.push_back({index[listed[k].block], lister[k], listed[k].work});
    merge(shares);
    std::vector<int> previous(g.block.size(), -1);
    std::vector<double> most(g.block.size(), -1);
    for (const Share& s : shares)
        if (s.work > most[s.now]) most[s.now] = s.work, previous[s.now] = s.before;

    cut.owner = partition(g, parts, method, &previous);
    cut.report = describe(g, cut.owner, parts);
    return cut;
}

} // namespace kuzure
