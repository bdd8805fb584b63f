// Beyond 400 lines: one algorithm in one class, its steps in the order in which a round of it goes.
#include "decomposition/even_out.hpp"
#include "decomposition/rim.hpp"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace kuzure {
namespace {

// What is spent at most; what is left then waits for the next cut, and the report says how much it is.
constexpr int flow_solves = 3;   // each sees what rounding to whole blocks has left of the one before
constexpr int offers_a_flow = 3; // each reaches one layer of blocks deeper
constexpr int local_rounds = 30;
constexpr int most_iterations = 400;    // of one solve: a chain of 200 ranks
constexpr double flow_error = 0.01;     // of the mean work, on the worst rank
constexpr double regularisation = 1e-5; // of the Laplacian's unit: bodies apart, between which nothing can flow, still have a solution

double seconds_of(clockid_t clock)
{
    timespec t{};
    clock_gettime(clock, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}
double now() { return seconds_of(CLOCK_MONOTONIC); }
/// Of this thread alone: many imagined ranks share a core, with whatever else runs there.
double busy_now() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }

struct Offer {
    Block block;
    double load; // what the receiver may come to at most
};
struct Moved {
    Block block;
    int to;
};

/// What one rank knows and does.
struct Part {
    Part(int rank, const std::vector<BlockWork>& mine, const std::vector<MessageOf<BlockWork>>& told, const BlockGrid& grid);

    std::vector<MessageOf<Offer>> offers(bool flowing, double mean);
    std::vector<MessageOf<int>> answer(const std::vector<MessageOf<Offer>>&);
    std::vector<MessageOf<Moved>> commit(const std::vector<MessageOf<int>>& taken);
    void apply(const std::vector<MessageOf<Moved>>&);
    double halo() const;
    BlockOwners table() const;

    // Ranks by their index in `ranks`, this one first.
    int rank;
    std::vector<int> ranks;
    std::map<int, int> index_of_rank;
    std::vector<int> peers; // ranks that touch this one at the start, by number

    BlockGraph g; // the blocks that this rank was told of; links of its own and of those around them
    BlockIndex index;
    std::vector<int> owner, origin; // of each block, now and at the start
    std::vector<int> depth;         // 0: own at the start; 1, 2: so far from them; -1: of no interest
    std::vector<char> listed;       // by this rank, whoever owns it
    std::vector<int> home;          // blocks of depth 0

    double work = 0;
    int blocks = 0;
    std::vector<double> flow, load; // to and of each rank by its index; zero and infinite for those that are no peers
    std::vector<double> phi, ties;
    std::int64_t given = 0;
    double busy = 0; // s

private:
    struct Chosen {
        int block, to;
    };
    int index_of(int r);
    /// Whether a block touches one that this rank (by index) had at the start and still has.
    template <class Eligible> bool rooted(int b, int q, Eligible eligible) const;
    /// Whether the other own blocks hang together as before without this one.
    bool can_spare(int b);

    std::vector<Chosen> chosen_; // offered in this round, in order
    std::vector<char> offered_, barred_, seen_;
    std::vector<int> queue_;
};

int Part::index_of(int r)
{
    const auto [at, fresh] = index_of_rank.try_emplace(r, int(ranks.size()));
    if (fresh) ranks.push_back(r), flow.push_back(0), load.push_back(std::numeric_limits<double>::infinity()), ties.push_back(0);
    return at->second;
}

Part::Part(int me, const std::vector<BlockWork>& mine, const std::vector<MessageOf<BlockWork>>& told, const BlockGrid& grid) : rank(me)
{
    index_of(me);
    struct Claim {
        Block block;
        int rank;
        double work, particles;
    };
    std::vector<Claim> all;
    for (const auto& b : mine) all.push_back({b.block, me, b.work, b.particles});
    for (const auto& p : told)
        for (const auto& b : p.items) all.push_back({b.block, p.rank, b.work, b.particles});
    std::ranges::sort(all, {}, [](const Claim& c) { return std::pair(c.block, c.rank); });

    // A block that several list goes to who has most of its work: all of them are told of each other's.
    g.grid = grid;
    for (std::size_t k = 0, to; k < all.size(); k = to) {
        double sum = 0, particles = 0, most = -1;
        int winner = 0;
        bool own = false;
        for (to = k; to < all.size() && all[to].block == all[k].block; ++to) {
            sum += all[to].work, particles += all[to].particles, own = own || all[to].rank == me;
            if (all[to].work > most) most = all[to].work, winner = all[to].rank;
        }
        g.block.push_back(all[k].block), g.work.push_back(sum), g.particles.push_back(particles);
        origin.push_back(index_of(winner)), listed.push_back(own);
    }
    owner = origin;
    const int n = g.size();
    index.reserve(std::size_t(n));
    for (int b = 0; b < n; ++b) index.set(g.block[b], b);

    depth.assign(std::size_t(n), -1);
    for (int b = 0; b < n; ++b)
        if (owner[b] == 0) depth[b] = 0, home.push_back(b), work += g.work[b], ++blocks;
    std::vector<std::vector<BlockGraph::Link>> links(static_cast<std::size_t>(n));
    for (int d = 0; d < 2; ++d)
        for (int b = 0; b < n; ++b) {
            if (depth[b] != d) continue;
            links[b].reserve(26);
            append_links(g, index, b, links[b]);
            for (const auto& l : links[b])
                if (depth[l.block] < 0) depth[l.block] = d + 1;
        }
    std::size_t all_links = 0;
    for (const auto& some : links) all_links += some.size();
    g.link.reserve(all_links), g.first.reserve(std::size_t(n) + 1);
    for (const auto& some : links) {
        g.first.push_back(g.link.size());
        g.link.insert(g.link.end(), some.begin(), some.end());
    }
    g.first.push_back(g.link.size());

    for (const int b : home)
        for (const auto& l : g.links(b))
            if (owner[l.block] != 0) peers.push_back(ranks[owner[l.block]]);
    std::ranges::sort(peers);
    peers.erase(std::unique(peers.begin(), peers.end()), peers.end());
    offered_.assign(std::size_t(n), 0), barred_ = offered_, seen_ = offered_;
}

template <class Eligible> bool Part::rooted(int b, int q, Eligible eligible) const
{
    return std::ranges::any_of(g.links(b), [&](const auto& l) { return owner[l.block] == q && origin[l.block] == q && eligible(l.block); });
}

bool Part::can_spare(int b)
{
    int wanted = 0, start = -1;
    queue_.clear();
    const auto mine = [&](int c) { return c != b && owner[c] == 0 && depth[c] <= 1; };
    for (const auto& l : g.links(b))
        if (mine(l.block) && !std::exchange(seen_[l.block], 2)) ++wanted, start = l.block, queue_.push_back(l.block);
    std::vector<int> around;
    std::swap(around, queue_);
    bool joined = wanted <= 1;
    if (!joined) {
        int found = 1;
        seen_[start] = 1, queue_.push_back(start);
        for (std::size_t k = 0; k < queue_.size() && !joined; ++k)
            for (const auto& l : g.links(queue_[k])) {
                if (!mine(l.block) || seen_[l.block] == 1) continue;
                found += seen_[l.block] == 2;
                seen_[l.block] = 1, queue_.push_back(l.block);
                joined = joined || found == wanted;
            }
    }
    for (const int c : around) seen_[c] = 0;
    for (const int c : queue_) seen_[c] = 0;
    return joined;
}

std::vector<MessageOf<Offer>> Part::offers(bool flowing, double mean)
{
    chosen_.clear();
    std::ranges::fill(barred_, 0);
    std::vector<MessageOf<Offer>> out;
    if (!flowing && work <= mean) return out;
    const auto always = [](int) { return true; };
    RimChoices rim(g, owner, 0, home, ties);
    while (blocks - int(chosen_.size()) > 1) {
        const RimBlock best = rim.best([&](int b, int q) {
            const double w = g.work[b];
            return (flowing ? flow[q] >= 0.5 * w : load[q] + w < work) && !barred_[b] && rooted(b, q, always);
        });
        if (best.block < 0) break;
        if (!can_spare(best.block)) {
            barred_[best.block] = 1;
            continue;
        }
        chosen_.push_back({best.block, best.to});
        flow[best.to] -= g.work[best.block];
        owner[best.block] = best.to;
        rim.changed(best.block);
        const int r = ranks[best.to];
        auto at = std::ranges::find(out, r, &MessageOf<Offer>::rank);
        if (at == out.end()) at = out.insert(out.end(), {r, {}});
        at->items.push_back({g.block[best.block], flowing ? std::max(work, good_balance * mean) : work});
        if (!flowing) break;
    }
    for (const Chosen& c : chosen_) owner[c.block] = 0, offered_[c.block] = 1;
    return out;
}

std::vector<MessageOf<int>> Part::answer(const std::vector<MessageOf<Offer>>& in)
{
    auto order = in;
    std::ranges::stable_sort(order, std::greater{}, [](const MessageOf<Offer>& p) { return p.items.front().load; });
    std::vector<MessageOf<int>> out;
    double taken = 0;
    for (const auto& p : order) {
        int n = 0;
        for (const Offer& o : p.items) {
            // What is being given away itself is no hold for another block.
            const int b = index[o.block];
            if (b < 0 || depth[b] != 1 || ranks[owner[b]] != p.rank || !rooted(b, 0, [&](int c) { return !offered_[c]; })) break;
            if (!(work + taken + g.work[b] < o.load)) break;
            taken += g.work[b];
            ++n;
        }
        out.push_back({p.rank, {n}});
    }
    return out;
}

std::vector<MessageOf<Moved>> Part::commit(const std::vector<MessageOf<int>>& taken)
{
    std::map<int, int> left; // that may still go, by receiver
    for (const auto& p : taken) left[index_of_rank.at(p.rank)] = p.items.front();
    std::map<int, std::vector<Moved>> updates;
    for (const Chosen& c : chosen_) {
        offered_[c.block] = 0;
        int& n = left[c.to];
        // One that is refused may have been what made the next one spare.
        if (n > 0 && !can_spare(c.block)) n = 0;
        if (n == 0) {
            flow[c.to] += g.work[c.block];
            continue;
        }
        --n;
        owner[c.block] = c.to, work -= g.work[c.block], --blocks, ++given;
        // Every rank that has a block within two of it knows it.
        const Moved moved{g.block[c.block], ranks[c.to]};
        std::vector<int> who;
        for (const auto& l : g.links(c.block)) {
            who.push_back(origin[l.block]);
            for (const auto& m : g.links(l.block)) who.push_back(origin[m.block]);
        }
        std::ranges::sort(who);
        who.erase(std::unique(who.begin(), who.end()), who.end());
        for (const int q : who)
            if (q != 0) updates[ranks[q]].push_back(moved);
    }
    std::vector<MessageOf<Moved>> out;
    for (auto& [r, items] : updates) out.push_back({r, std::move(items)});
    return out;
}

void Part::apply(const std::vector<MessageOf<Moved>>& updates)
{
    for (const auto& p : updates)
        for (const Moved& m : p.items) {
            const int b = index[m.block];
            if (b < 0) continue;
            owner[b] = index_of(m.to);
            if (owner[b] == 0) work += g.work[b], ++blocks;
        }
}

double Part::halo() const
{
    double bytes = 0;
    for (int b = 0; b < g.size(); ++b)
        if (owner[b] == 0)
            for (const auto& l : g.links(b))
                if (owner[l.block] != 0) bytes += 0.5 * l.bytes;
    return bytes;
}

BlockOwners Part::table() const
{
    std::vector<Block> block;
    std::vector<int> by;
    for (int b = 0; b < g.size(); ++b)
        if (depth[b] >= 0 || listed[b]) block.push_back(g.block[b]), by.push_back(ranks[owner[b]]);
    return {std::move(block), std::move(by), false};
}

// ---- all parts that are here, round by round ------------------------------------------------------------------------
class DiffusiveBalancer {
public:
    DiffusiveBalancer(const RankGroup& group, const std::vector<std::vector<BlockWork>>& own, const BlockGrid& grid);
    EvenReport run();
    std::vector<BlockOwners> tables() const
    {
        std::vector<BlockOwners> all;
        for (const Part& p : parts_) all.push_back(p.table());
        return all;
    }

private:
    template <class Do> auto each(Do work)
    {
        std::vector<decltype(work(parts_[0]))> results;
        for (Part& p : parts_) {
            const double begin = busy_now();
            results.push_back(work(p));
            p.busy += busy_now() - begin;
        }
        return results;
    }
    void solve();
    bool round(bool flowing);
    double heaviest() const;

    const RankGroup& group_;
    std::vector<Part> parts_;
    double mean_ = 0;
    EvenReport report_;
};

DiffusiveBalancer::DiffusiveBalancer(const RankGroup& group, const std::vector<std::vector<BlockWork>>& own, const BlockGrid& grid)
    : group_(group)
{
    std::vector<std::array<std::int32_t, 6>> mine;
    double bad = 0;
    std::string failure = "another rank lists a block that cannot be";
    for (const auto& list : own) {
        const std::int32_t far = block_limit;
        std::array<std::int32_t, 6> box{far, far, far, -far, -far, -far};
        for (const auto& b : list) {
            try {
                check_block(b, grid);
            } catch (const Broken& e) {
                bad = 1, failure = e.what();
            }
            for (int a = 0; a < 3; ++a) box[a] = std::min(box[a], b.block[a]), box[a + 3] = std::max(box[a + 3], b.block[a]);
        }
        mine.push_back(box);
    }
    group.max(std::span(&bad, 1));
    if (bad > 0) throw Broken("the domain cannot be cut: " + failure);

    // Every rank receives the blocks near its own: those within two of the box around them.
    const auto boxes = group.allgather(mine);
    const auto near = [&](int axis, std::int32_t low, std::int32_t high, const std::array<std::int32_t, 6>& box) {
        const std::int32_t n = grid.period[axis];
        for (int turn = n ? -1 : 0; turn <= (n ? 1 : 0); ++turn)
            if (low + turn * n <= box[axis + 3] + 2 && high + turn * n >= box[axis] - 2) return true;
        return false;
    };
    std::vector<std::vector<MessageOf<BlockWork>>> out(own.size());
    std::vector<double> busy(own.size());
    for (std::size_t k = 0; k < own.size(); ++k) {
        const double begin = busy_now();
        const auto& box = mine[k];
        if (own[k].empty()) continue;
        for (int r = 0; r < group.size(); ++r) {
            if (r == group.first() + int(k) || boxes[r][0] > boxes[r][3]) continue;
            bool close = true;
            for (int a = 0; a < 3 && close; ++a) close = near(a, box[a], box[a + 3], boxes[r]);
            if (!close) continue;
            MessageOf<BlockWork> p{r, {}};
            for (const auto& b : own[k])
                if (near(0, b.block[0], b.block[0], boxes[r]) && near(1, b.block[1], b.block[1], boxes[r]) &&
                    near(2, b.block[2], b.block[2], boxes[r]))
                    p.items.push_back(b);
            if (!p.items.empty()) out[k].push_back(std::move(p));
        }
        busy[k] = busy_now() - begin;
    }
    const auto in = group.exchange(out);
    for (std::size_t k = 0; k < own.size(); ++k) {
        const double begin = busy_now();
        parts_.emplace_back(group.first() + int(k), own[k], in[k], grid);
        parts_.back().busy = busy[k] + busy_now() - begin;
    }
}

double DiffusiveBalancer::heaviest() const
{
    double most = 0;
    for (const Part& p : parts_) most = std::max(most, p.work);
    group_.max(std::span(&most, 1));
    return most;
}

/// Conjugate gradients with one sum an iteration (Chronopoulos and Gear, J. Comput. Appl. Math. 25 (1989) 153).
void DiffusiveBalancer::solve()
{
    const std::size_t n = parts_.size();
    std::vector<std::vector<int>> peers;
    std::vector<double> x(n, 0.0), r(n), p(n, 0.0), s(n, 0.0), w(n);
    for (std::size_t k = 0; k < n; ++k) peers.push_back(parts_[k].peers), r[k] = parts_[k].work - mean_;
    double before = 0, step = 0;
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        const auto theirs = group_.exchange_scalar(peers, r);
        // A sum of eighth powers is as good as a maximum, and is one with the others.
        double sums[3] = {0, 0, 0};
        for (std::size_t k = 0; k < n; ++k) {
            w[k] = (double(peers[k].size()) + regularisation) * r[k];
            for (const double t : theirs[k]) w[k] -= t;
            sums[0] += r[k] * r[k], sums[1] += w[k] * r[k], sums[2] += std::pow(r[k] / (flow_error * mean_), 8);
        }
        group_.sum(sums);
        ++report_.iterations;
        if (sums[2] <= 1) break;
        const double beta = before > 0 ? sums[0] / before : 0, curvature = sums[1] - (step > 0 ? beta * sums[0] / step : 0);
        if (!(curvature > 0)) break;
        step = sums[0] / curvature, before = sums[0];
        for (std::size_t k = 0; k < n; ++k) {
            p[k] = r[k] + beta * p[k], s[k] = w[k] + beta * s[k];
            x[k] += step * p[k], r[k] -= step * s[k];
        }
    }
    const auto theirs = group_.exchange_scalar(peers, x);
    ++report_.iterations;
    for (std::size_t k = 0; k < n; ++k) {
        Part& part = parts_[k];
        for (std::size_t q = 0; q < part.peers.size(); ++q) part.flow[part.index_of_rank.at(part.peers[q])] = x[k] - theirs[k][q];
    }
}

bool DiffusiveBalancer::round(bool flowing)
{
    const auto offers = group_.exchange(each([&](Part& p) { return p.offers(flowing, mean_); }));
    std::size_t k = 0;
    const auto answers = group_.exchange(each([&](Part& p) { return p.answer(offers[k++]); }));
    k = 0;
    std::int64_t given = 0;
    const auto updates = group_.exchange(each([&](Part& p) {
        const auto before = p.given;
        auto out = p.commit(answers[k++]);
        given += p.given - before;
        return out;
    }));
    k = 0;
    each([&](Part& p) { return p.apply(updates[k++]), 0; });
    double moved = double(given);
    group_.sum(std::span(&moved, 1));
    report_.moved += std::int64_t(moved);
    ++report_.rounds;
    return moved > 0;
}

EvenReport DiffusiveBalancer::run()
{
    double sums[3] = {0, 0, 0};
    for (const Part& p : parts_) {
        sums[0] += p.work, sums[1] += p.blocks;
        for (const int b : p.home) sums[2] += p.g.particles[b] * p.g.grid.ghost_bytes;
    }
    group_.sum(sums);
    mean_ = report_.mean = sums[0] / group_.size();
    report_.blocks = std::int64_t(sums[1]);
    if (mean_ > 0) {
        double most = heaviest();
        const double enough = good_balance * mean_;
        report_.before = most / mean_;
        for (int k = 0; k < flow_solves && most > enough; ++k) {
            solve();
            int rounds = 0;
            while (rounds < offers_a_flow && round(true)) ++rounds;
            most = heaviest();
            if (rounds == 0) break;
        }
        for (int k = 0; k < local_rounds && most > enough; ++k) {
            std::vector<std::vector<int>> peers;
            std::vector<double> load;
            for (const Part& p : parts_) peers.push_back(p.peers), load.push_back(p.work);
            const auto theirs = group_.exchange_scalar(peers, load);
            ++report_.iterations;
            for (std::size_t p = 0; p < parts_.size(); ++p)
                for (std::size_t q = 0; q < peers[p].size(); ++q) parts_[p].load[parts_[p].index_of_rank.at(peers[p][q])] = theirs[p][q];
            if (!round(false)) break;
            most = heaviest();
        }
        report_.after = most / mean_;
    }
    double halo = 0, busy = 0;
    for (const Part& p : parts_) halo += p.halo(), busy = std::max(busy, p.busy);
    group_.sum(std::span(&halo, 1)), group_.max(std::span(&busy, 1));
    report_.halo = sums[2] > 0 ? halo / sums[2] : 0;
    report_.busy = busy;
    return report_;
}

/// Lists of ranks' own blocks: a particle that has left its owner's blocks since the last migration counts where it will be.
std::vector<std::vector<BlockWork>> own_blocks(const RankGroup& group, const std::vector<std::vector<BlockWork>>& listed,
                                               const BlockGrid& grid, const std::vector<BlockOwners>& known)
{
    const std::size_t n = listed.size();
    std::vector<std::vector<MessageOf<BlockWork>>> out(n);
    std::vector<std::map<Block, BlockWork>> own(n);
    const auto add = [&](std::size_t k, const BlockWork& b) {
        const auto [at, fresh] = own[k].try_emplace(b.block, b);
        if (!fresh) at->second.work += b.work, at->second.particles += b.particles;
    };
    for (std::size_t k = 0; k < n; ++k) {
        std::map<int, std::vector<BlockWork>> elsewhere;
        for (const auto& b : listed[k]) {
            const int r = known[k].owner_of(b.block, grid.period);
            if (r == group.first() + int(k)) add(k, b);
            else elsewhere[r].push_back(b);
        }
        for (auto& [r, blocks] : elsewhere) out[k].push_back({r, std::move(blocks)});
    }
    const auto in = group.exchange(out);
    std::vector<std::vector<BlockWork>> lists(n);
    for (std::size_t k = 0; k < n; ++k) {
        for (const auto& p : in[k])
            for (const auto& b : p.items) add(k, b);
        for (const auto& [at, b] : own[k]) lists[k].push_back(b);
    }
    return lists;
}

} // namespace

EvenReport even_out(const RankGroup& group, const std::vector<std::vector<BlockWork>>& listed, const BlockGrid& grid,
                    std::vector<BlockOwners>& known)
{
    ensure(int(listed.size()) == group.here() && known.size() == listed.size(), "every rank here lists its blocks");
    double seconds = -now();
    DiffusiveBalancer balancer(group, own_blocks(group, listed, grid, known), grid);
    EvenReport r = balancer.run();
    known = balancer.tables();
    seconds += now();
    group.max(std::span(&seconds, 1));
    r.seconds = seconds;
    return r;
}

} // namespace kuzure
