// The graph of the blocks that hold soil, and what a cut of it is worth.
#include "decomposition/partition.hpp"
#include "decomposition/rim.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace kuzure {

void check_block(const BlockWork& b, const BlockGrid& grid)
{
    ensure(within_limit(b.block), "a block lies beyond the block limit");
    for (int a = 0; a < 3; ++a)
        ensure(grid.period[a] == 0 || (b.block[a] >= 0 && b.block[a] < grid.period[a]), "a block lies outside its period");
    ensure(std::isfinite(b.work) && b.work >= 0 && std::isfinite(b.particles) && b.particles >= 0,
           "a block's work or particle count is negative or not a number");
}

void append_links(const BlockGraph& g, const BlockIndex& index, int b, std::vector<BlockGraph::Link>& to)
{
    const Block& here = g.block[b];
    bool plain = true; // no period, and no block around it is beyond the limit
    for (int a = 0; a < 3; ++a) plain = plain && g.grid.period[a] == 0 && here[a] > -block_limit && here[a] < block_limit - 1;
    std::array<double, 3> reach;
    for (int a = 0; a < 3; ++a) reach[a] = std::min(1.0, g.grid.reach[a]);
    const std::uint64_t key = key_of(here);
    for (int code = 0; code < 27; ++code) {
        if (code == 13) continue;
        const std::array<std::int8_t, 3> d{std::int8_t(code / 9 - 1), std::int8_t(code / 3 % 3 - 1), std::int8_t(code % 3 - 1)};
        int n = -1;
        if (plain)
            n = index.of_key(key + (std::uint64_t(std::int64_t(d[0])) << 42) + (std::uint64_t(std::int64_t(d[1])) << 21) +
                             std::uint64_t(std::int64_t(d[2])));
        else {
            const Block there = wrapped({here[0] + d[0], here[1] + d[1], here[2] + d[2]}, g.grid.period);
            if (within_limit(there)) n = index[there];
        }
        if (n < 0) continue;
        double share = 1; // of a block's particles within reach of the other block
        for (int a = 0; a < 3; ++a) share *= d[a] ? reach[a] : 1.0;
        to.push_back({n, d, share * g.grid.ghost_bytes * (g.particles[b] + g.particles[n])});
    }
}

BlockGraph block_graph(std::span<const BlockWork> given, const BlockGrid& grid)
{
    for (const auto& b : given) check_block(b, grid);
    std::vector<BlockWork> all(given.begin(), given.end());
    std::ranges::stable_sort(all, {}, &BlockWork::block);

    BlockGraph g;
    g.grid = grid;
    for (const auto& b : all) {
        if (g.block.empty() || g.block.back() != b.block) {
            g.block.push_back(b.block);
            g.work.push_back(0);
            g.particles.push_back(0);
        }
        g.work.back() += b.work;
        g.particles.back() += b.particles;
    }

    BlockIndex index;
    index.reserve(g.block.size());
    for (int b = 0; b < g.size(); ++b) index.set(g.block[b], b);
    for (int b = 0; b < g.size(); ++b) {
        g.first.push_back(g.link.size());
        append_links(g, index, b, g.link);
    }
    g.first.push_back(g.link.size());
    return g;
}

// ---- what a cut is worth --------------------------------------------------------------------------------------------
namespace {

/// A block seen along one axis: the shares of it within reach of its low face, of its high face, of both, of none.
struct Layer {
    double share;
    bool low, high;
};
std::array<Layer, 3> layers(double reach)
{
    const double r = std::min(1.0, reach);
    if (r <= 0.5) return {{{r, true, false}, {1 - 2 * r, false, false}, {r, false, true}}};
    return {{{1 - r, true, false}, {2 * r - 1, true, true}, {1 - r, false, true}}};
}

/// Sets of blocks of one part that hang together by faces, edges or corners, each by number, the sets by their first.
std::vector<std::vector<int>> pieces_of(const BlockGraph& g, std::span<const int> part)
{
    std::vector<std::vector<int>> pieces;
    std::vector<char> seen(g.size(), 0);
    for (int b = 0; b < g.size(); ++b) {
        if (std::exchange(seen[b], 1)) continue;
        std::vector<int> piece{b};
        for (std::size_t k = 0; k < piece.size(); ++k)
            for (const auto& l : g.links(piece[k]))
                if (part[l.block] == part[b] && !std::exchange(seen[l.block], 1)) piece.push_back(l.block);
        std::ranges::sort(piece);
        pieces.push_back(std::move(piece));
    }
    return pieces;
}

/// A part that needs to see a block, in one direction.
struct Request {
    int part;
    bool image; // reaches itself or its own part through a period: each such direction is a ghost of its own
    std::array<std::int8_t, 3> d;
};
/// Those of one block, equal parts together.
void find_requests(const BlockGraph& g, std::span<const int> part, int b, std::vector<Request>& requests)
{
    requests.clear();
    for (const auto& l : g.links(b)) {
        bool image = false;
        for (int a = 0; a < 3; ++a) image |= l.d[a] != 0 && g.block[b][a] + l.d[a] != g.block[l.block][a];
        if (part[l.block] != part[b] || image) requests.push_back({part[l.block], image, l.d});
    }
    std::ranges::stable_sort(requests, {}, [](const Request& w) { return std::pair(w.part, w.image); });
}

/// The share of a block that lies in a layer near any of these directions.
class Shares {
public:
    explicit Shares(const BlockGrid& grid) : x_(layers(grid.reach[0])), y_(layers(grid.reach[1])), z_(layers(grid.reach[2])) {}
    double of(std::span<const Request> requests) const
    {
        const auto touches = [](const Layer& l, int d) { return d == 0 || (d < 0 ? l.low : l.high); };
        double share = 0;
        for (const auto& lx : x_)
            for (const auto& ly : y_)
                for (const auto& lz : z_)
                    for (const auto& request : requests) {
                        const auto& d = request.d;
                        if (!touches(lx, d[0]) || !touches(ly, d[1]) || !touches(lz, d[2])) continue;
                        share += lx.share * ly.share * lz.share;
                        break;
                    }
        return share;
    }

private:
    decltype(layers(0.0)) x_, y_, z_;
};

} // namespace

CutReport describe(const BlockGraph& g, std::span<const int> part, int parts)
{
    ensure(int(part.size()) == g.size(), "a cut has as many entries as the graph has blocks");
    CutReport r;
    r.parts = parts;
    r.blocks = g.size();
    r.work.assign(parts, 0);
    r.particles.assign(parts, 0);
    r.ghosts.assign(parts, 0);
    r.peers.assign(parts, 0);
    for (int b = 0; b < g.size(); ++b) {
        r.work[part[b]] += g.work[b];
        r.particles[part[b]] += g.particles[b];
    }
    r.pieces.assign(parts, 0);
    for (const auto& piece : pieces_of(g, part)) ++r.pieces[part[piece.front()]];
    const double total = std::accumulate(r.work.begin(), r.work.end(), 0.0);
    if (total > 0) r.imbalance = *std::ranges::max_element(r.work) * parts / total;

    const Shares shares(g.grid);
    std::vector<std::vector<int>> sends(parts);
    std::vector<Request> requests;
    for (int b = 0; b < g.size(); ++b) {
        find_requests(g, part, b, requests);
        for (std::size_t from = 0, to; from < requests.size(); from = to) {
            to = from;
            while (to < requests.size() && requests[to].part == requests[from].part && requests[to].image == requests[from].image) ++to;
            const double ghosts = shares.of(std::span(requests).subspan(from, to - from)) * g.particles[b];
            r.ghosts[requests[from].part] += ghosts;
            if (requests[from].part == part[b]) continue;
            r.cut_bytes += ghosts * g.grid.ghost_bytes;
            sends[part[b]].push_back(requests[from].part);
        }
    }
    for (int p = 0; p < parts; ++p) {
        std::ranges::sort(sends[p]);
        r.peers[p] = int(std::unique(sends[p].begin(), sends[p].end()) - sends[p].begin());
    }
    return r;
}

} // namespace kuzure
