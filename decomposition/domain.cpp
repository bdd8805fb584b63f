#include "decomposition/domain.hpp"
#include "solver/core/wall_clock.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <unordered_map>

namespace kuzure {
namespace {

/// Particles below which threads cost more than they bring.
constexpr Index parallel = 4096;

// ---- bytes of several lists in one message --------------------------------------------------------------------------
template <class T> void put(std::vector<std::byte>& to, std::span<const T> items)
{
    const std::uint64_t n = items.size();
    const auto size = std::as_bytes(std::span(&n, 1)), bytes = std::as_bytes(items);
    to.insert(to.end(), size.begin(), size.end());
    to.insert(to.end(), bytes.begin(), bytes.end());
}
template <class T> std::vector<T> take(std::span<const std::byte>& from)
{
    std::uint64_t n = 0;
    std::memcpy(&n, from.data(), sizeof n);
    std::vector<T> items(n);
    if (n) std::memcpy(items.data(), from.data() + sizeof n, n * sizeof(T));
    from = from.subspan(sizeof n + n * sizeof(T));
    return items;
}

} // namespace

// ---- owners ---------------------------------------------------------------------------------------------------------
void Domain::stop_if_lost(bool mine, Vector x) const
{
    const int rank = int(comm_.max(std::int64_t(mine ? comm_.rank() : -1)));
    if (rank >= 0) throw NumbersFailed(comm_.broadcast(mine ? lost_at(x) : std::string(), rank));
}

int Domain::owner_of(const Block& asked) const
{
    ensure(is_cut_, "a domain is asked for owners before it is cut");
    return known_.owner_of(space_.wrapped(asked), space_.period());
}

// ---- cutting --------------------------------------------------------------------------------------------------------
CutReport Domain::cut(std::span<const BlockWork> mine, Method method, HaloCost halo, Labels labels)
{
    const double start = wall_clock();
    const auto lists = comm_.gather(std::as_bytes(mine));
    std::vector<std::byte> result;
    if (comm_.rank() == 0) {
        std::string failure;
        try {
            std::vector<BlockWork> all;
            std::vector<int> lister;
            for (int r = 0; r < comm_.size(); ++r) {
                const std::size_t n = lists[r].size() / sizeof(BlockWork), at = all.size();
                all.resize(at + n);
                if (n) std::memcpy(&all[at], lists[r].data(), n * sizeof(BlockWork));
                lister.resize(at + n, r);
            }
            if (labels == Labels::Free) lister.clear();
            const auto [g, owner, r] = cut_blocks(all, lister, space_.grid(halo.reach, halo.ghost_bytes), comm_.size(), method);
            put(result, std::span<const char>());
            put(result, std::span<const Block>(g.block));
            put(result, std::span<const int>(owner));
            const double numbers[] = {double(r.parts), double(r.blocks), r.imbalance, r.cut_bytes};
            put(result, std::span<const double>(numbers));
            put(result, std::span<const double>(r.work));
            put(result, std::span<const double>(r.particles));
            put(result, std::span<const double>(r.ghosts));
            put(result, std::span<const int>(r.peers));
            put(result, std::span<const int>(r.pieces));
        } catch (const std::exception& e) {
            failure = e.what();
        }
        if (!failure.empty()) {
            result.clear();
            put(result, std::span<const char>(failure));
        }
    }
    result.resize(std::size_t(comm_.max(std::int64_t(result.size()))));
    comm_.broadcast(std::span(result));
    std::span<const std::byte> from(result);
    if (const auto failure = take<char>(from); !failure.empty())
        throw Broken("the domain cannot be cut: " + std::string(failure.begin(), failure.end()));
    auto blocks = take<Block>(from);
    auto owners = take<int>(from);
    known_ = {std::move(blocks), std::move(owners)};
    CutReport r;
    const auto numbers = take<double>(from);
    r.parts = int(numbers[0]);
    r.blocks = int(numbers[1]);
    r.imbalance = numbers[2];
    r.cut_bytes = numbers[3];
    r.work = take<double>(from);
    r.particles = take<double>(from);
    r.ghosts = take<double>(from);
    r.peers = take<int>(from);
    r.pieces = take<int>(from);

    is_cut_ = true;
    r.seconds = comm_.max(wall_clock() - start);
    return r;
}

EvenReport Domain::even_out(std::span<const BlockWork> mine, HaloCost halo)
{
    ensure(is_cut_, "a domain is evened out before it is cut");
    std::vector<BlockOwners> known{known_};
    const auto r = kuzure::even_out(RunRanks(comm_), {{mine.begin(), mine.end()}}, space_.grid(halo.reach, halo.ghost_bytes), known);
    known_ = std::move(known[0]);
    return r;
}

// ---- migration ------------------------------------------------------------------------------------------------------
Domain::Moved Domain::migrate(Particles& p) const
{
    ensure(is_cut_, "particles migrate before the domain is cut");
    const auto x = std::as_const(p)[field::position];
    const Index n = p.size();
    std::vector<int> owner(n);
    Index lost = -1;
#pragma omp parallel reduction(max : lost) if (n > parallel)
    {
        Block last{};
        int last_owner = -1;
#pragma omp for schedule(static)
        for (Index i = 0; i < n; ++i) {
            Block b;
            if (!space_.raw_block(x[i], b)) {
                lost = std::max(lost, i);
                continue;
            }
            if (last_owner < 0 || b != last) last = b, last_owner = owner_of(b);
            owner[i] = last_owner;
        }
    }
    stop_if_lost(lost >= 0, lost >= 0 ? x[lost] : Vector{});

    std::map<int, std::vector<Index>> leaving;
    std::vector<Index> stay;
    stay.reserve(n);
    for (Index i = 0; i < n; ++i) {
        if (owner[i] == comm_.rank()) stay.push_back(i);
        else leaving[owner[i]].push_back(i);
    }
    Moved moved;
    std::vector<Message> out;
    for (const auto& [rank, which] : leaving) {
        moved.left += std::int64_t(which.size());
        out.push_back({rank, {}});
        p.pack(which, out.back().bytes);
    }
    const auto in = comm_.exchange(std::move(out));
    if (moved.left) p.gather(stay);
    for (const Message& m : in) {
        ensure(p.size() + std::int64_t(m.bytes.size() / p.bytes_per_particle()) < std::numeric_limits<Index>::max(),
               "more than 2^31 particles on one rank");
        p.unpack(m.bytes);
    }
    moved.arrived = p.size() - std::int64_t(stay.size());
    return moved;
}

// ---- which ranks need which particles as ghosts ---------------------------------------------------------------------
namespace {

/// The particles by block, and the box that each block's particles fill.
struct ByBlock {
    std::vector<Bounds> box;
    std::vector<Index> first, member; // of a block's particles in `member`, and the end
};
ByBlock by_block(View<Shape::Vector, const double> x, const std::vector<std::uint64_t>& key)
{
    const auto n = Index(key.size());
    ByBlock all{{}, {0}, std::vector<Index>(n)};
    auto& [box, first, member] = all;
    std::unordered_map<std::uint64_t, int> local;
    std::vector<int> group(n);
    for (Index i = 0; i < n; ++i) {
        if (i > 0 && key[i] == key[i - 1]) {
            group[i] = group[i - 1];
        } else {
            group[i] = local.try_emplace(key[i], int(box.size())).first->second;
            if (group[i] == int(box.size())) box.push_back(Bounds::none()), first.push_back(0);
        }
        ++first[group[i] + 1];
    }
    for (std::size_t g = 1; g < first.size(); ++g) first[g] += first[g - 1];
    {
        auto next = first;
        for (Index i = 0; i < n; ++i) member[next[group[i]]++] = i;
    }
    const int n_boxes = int(box.size());
#pragma omp parallel for schedule(dynamic) if (n > parallel)
    for (int g = 0; g < n_boxes; ++g)
        for (Index k = all.first[g]; k < all.first[g + 1]; ++k) all.box[g].add(x[all.member[k]]);
    return all;
}

/// The images across periods that there can be; sets their lengths in `plan`.
std::vector<int> possible_shifts(const BlockSpace& space, HaloPlan& plan)
{
    const auto& length = space.period_length();
    const auto& period = space.period();
    std::vector<int> shifts;
    for (int s = 0; s < 27; ++s) {
        const int d[3] = {s % 3 - 1, s / 3 % 3 - 1, s / 9 - 1};
        plan.shift[s] = {d[0] * length[0], d[1] * length[1], d[2] * length[2]};
        bool possible = true;
        for (int a = 0; a < 3; ++a) possible = possible && (d[a] == 0 || period[a] > 0);
        if (!possible) plan.shift[s] = {};
        else shifts.push_back(s);
    }
    return shifts;
}
std::array<double, 3> shift_of(const HaloPlan& plan, int s) { return {plan.shift[s].x, plan.shift[s].y, plan.shift[s].z}; }

/// What a block's particles send: to the peer of this number.
struct Entry {
    int peer;
    HaloPlan::Send send;
};
/// Those of one block's particles that a peer's boxes are near.
void find_sends(View<Shape::Vector, const double> x, std::span<const Index> members, const double* d, int peer, int shift, double reach2,
                std::vector<const Bounds*>& near, std::vector<Entry>& found)
{
    for (const Index i : members)
        for (const Bounds*& b : near) {
            if (squared_distance(x[i], d, *b) > reach2) continue;
            found.push_back({peer, {i, shift}});
            std::swap(b, near.front()); // the next particle is probably near the same box
            break;
        }
}

/// What was found block by block, to the plan's peers in the order of owned particles; those without any go.
void put_in_order(const std::vector<std::vector<Entry>>& found, HaloPlan& plan)
{
    for (const auto& f : found)
        for (const Entry& e : f) plan.peers[e.peer].sends.push_back(e.send);
    std::erase_if(plan.peers, [](const auto& p) { return p.sends.empty(); });
    for (auto& p : plan.peers) {
        std::ranges::sort(p.sends, {}, [](const HaloPlan::Send& s) { return std::pair(s.owned, s.shift); });
        p.sends.shrink_to_fit();
    }
}

} // namespace

Domain::Surveyed Domain::survey(View<Shape::Vector, const double> x, Index n, bool keys) const
{
    const auto &low = space_.period_low(), &length = space_.period_length();
    const auto& period = space_.period();
    // Blocks are not wrapped here: one across a period's seam would fill a box as long as the period.
    Surveyed of;
    if (keys) of.key.resize(n);
    double most = 0;
    bool outside = false;
    Index lost = -1;
#pragma omp parallel for schedule(static) reduction(max : most, lost) reduction(|| : outside) if (n > parallel)
    for (Index i = 0; i < n; ++i) {
        Block b;
        if (!space_.raw_block(x[i], b)) {
            lost = std::max(lost, i);
            continue;
        }
        if (keys) of.key[i] = key_of(b);
        for (int a = 0; a < 3; ++a) {
            const double c = x.column[a][i];
            most = std::max(most, std::abs(c));
            const double slack = 1e-9 * length[a];
            if (period[a]) outside = outside || c < low[a] - slack || c > low[a] + length[a] + slack;
        }
    }
    of.largest = most, of.lost = lost, of.outside = outside;
    return of;
}

void Domain::tell_all(const Bounds& mine, double reach, std::span<const std::array<double, 3>> shifts) const
{
    // The more is held, the more ranks are asked at a rebuild, and the longer that lasts: here until soil has moved by 2.5 reaches, some
    // twenty rebuilds of soil that flies.
    auto& s = surroundings_;
    s.told = mine, s.held = 6 * reach;
    s.near.clear();
    const auto all = comm_.allgather(mine);
    for (int r = 0; r < comm_.size(); ++r) {
        if (r == comm_.rank() || mine.empty() || all[r].empty()) continue;
        if (std::ranges::any_of(shifts, [&](const auto& d) { return widest_gap(mine, d.data(), all[r]) <= s.held; }))
            s.near.emplace_back(r, all[r]);
    }
    ++s.tellings;
}

double Domain::agree(const Surveyed& soil, View<Shape::Vector, const double> x, const Bounds& whole, const std::string& complaint,
                     double& grown) const
{
    const auto& length = space_.period_length();
    const bool complains = !complaint.empty() || soil.lost >= 0;
    double agreed[4] = {complains ? comm_.rank() : -1.0, double(soil.outside),
                        std::max({soil.largest, std::abs(length[0]), std::abs(length[1]), std::abs(length[2])}),
                        overhang(whole, surroundings_.told)};
    comm_.max(std::span<double>(agreed));
    if (const int rank = int(agreed[0]); rank >= 0) {
        const std::string words = !complaint.empty() ? complaint : soil.lost >= 0 ? lost_at(x[soil.lost]) : std::string();
        throw NumbersFailed(comm_.broadcast(words, rank));
    }
    ensure(agreed[1] == 0, "a halo is planned while particles lie outside the period");
    grown = agreed[3];
    return agreed[2];
}

std::vector<MessageOf<Bounds>> Domain::exchange_boxes(const std::vector<Bounds>& box, std::span<const std::array<double, 3>> ways,
                                                      double reach2, double grown) const
{
    std::vector<MessageOf<Bounds>> out;
    for (const auto& [r, told] : surroundings_.near) {
        const Bounds theirs = widened(told, grown);
        MessageOf<Bounds> p{r, {}};
        for (const auto& b : box)
            if (std::ranges::any_of(ways, [&](const auto& d) { return squared_distance(b, d.data(), theirs) <= reach2; }))
                p.items.push_back(b);
        if (!p.items.empty()) out.push_back(std::move(p));
    }
    if (ways.size() > 1 && !box.empty()) out.push_back({comm_.rank(), box});
    return comm_.exchange(out);
}

HaloPlan Domain::plan_halo(View<Shape::Vector, const double> x, Index n, double reach, const std::string& complaint) const
{
    HaloPlan plan;
    const std::vector<int> shifts = possible_shifts(space_, plan);
    std::vector<std::array<double, 3>> ways;
    for (const int s : shifts) ways.push_back(shift_of(plan, s));
    for (int a = 0; a < 3; ++a)
        ensure(space_.period()[a] == 0 || reach <= space_.period_length()[a], "the halo reaches further than a period");

    const bool alone = comm_.size() == 1 && shifts.size() == 1;
    Surveyed soil;
    if (complaint.empty()) soil = survey(x, n, !alone);
    if (soil.lost >= 0) soil.key.clear();
    const ByBlock blocks = by_block(x, soil.key);
    Bounds whole = Bounds::none();
    for (const auto& b : blocks.box) whole.add(b.low, b.high);
    double grown = 0;
    const double safe = halo_reach(reach, agree(soil, x, whole, complaint, grown)), reach2 = safe * safe;
    if (alone) return plan;
    if (!(safe + 2 * grown <= surroundings_.held)) tell_all(whole, safe, ways), grown = 0;

    // Each rank tells those whose soil may be near it which of its blocks' boxes that is; more boxes than are near change no plan.
    const auto theirs = exchange_boxes(blocks.box, ways, reach2, grown);
    std::vector<Bounds> around(theirs.size(), Bounds::none());
    for (std::size_t peer = 0; peer < theirs.size(); ++peer)
        for (const auto& b : theirs[peer].items) around[peer].add(b.low, b.high);
    const int n_boxes = int(blocks.box.size());
    std::vector<std::vector<Entry>> found(n_boxes);
#pragma omp parallel for schedule(dynamic) if (n > parallel)
    for (int g = 0; g < n_boxes; ++g) {
        std::vector<const Bounds*> close;
        const std::span<const Index> members(blocks.member.data() + blocks.first[g], blocks.member.data() + blocks.first[g + 1]);
        for (int peer = 0; peer < int(theirs.size()); ++peer)
            for (std::size_t k = 0; k < shifts.size(); ++k) {
                if (theirs[peer].rank == comm_.rank() && shifts[k] == HaloPlan::no_shift) continue;
                const double* d = ways[k].data();
                if (squared_distance(blocks.box[g], d, around[peer]) > reach2) continue;
                close.clear();
                for (const auto& b : theirs[peer].items)
                    if (squared_distance(blocks.box[g], d, b) <= reach2) close.push_back(&b);
                if (!close.empty()) find_sends(x, members, d, peer, shifts[k], reach2, close, found[g]);
            }
    }
    for (const auto& them : theirs) plan.peers.push_back({them.rank, {}});
    put_in_order(found, plan);
    return plan;
}

} // namespace kuzure
