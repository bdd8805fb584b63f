#include "decomposition/domain.hpp"
#include "tests/mpi/world.hpp"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

namespace kuzure {
namespace {

struct Cloud {
    const char* name;
    int n;
    Vector low, size;     // where the particles are
    Vector origin, block; // how space is cut
    std::array<bool, 3> periodic;
    Vector period_low, period_length;
    double reach;
};

const Cloud clouds[] = {
    {"open", 3000, {-1, 0, 0}, {3, 2, 1}, {-1, 0, 0}, {0.25, 0.25, 0.25}, {}, {}, {}, 0.11},
    {"blocks smaller than the reach", 1500, {0, 0, 0}, {2, 2, 2}, {0, 0, 0}, {0.1, 0.07, 0.13}, {}, {}, {}, 0.3},
    {"periodic in y", 2000, {0, 1, 0}, {3, 1, 1}, {0, 1, 0}, {0.25, 0.25, 0.25}, {false, true, false}, {0, 1, 0}, {0, 1, 0}, 0.15},
    {"one block per period", 800, {0, 0, 0}, {4, 0.5, 0.5}, {0, 0, 0}, {0.25, 0.5, 0.5}, {false, true, false}, {0, 0, 0}, {0, 0.5, 0}, 0.3},
    {"periodic all around, origin off the seam",
     1200,
     {0, 0, 0},
     {1, 1, 1},
     {0.05, -0.11, 0.02},
     {0.2, 0.25, 0.5},
     {true, true, true},
     {0, 0, 0},
     {1, 1, 1},
     0.2},
    {"reach of a whole period",
     60,
     {0, 0, 0},
     {1, 0.3, 0.3},
     {0, 0, 0},
     {0.25, 0.3, 0.3},
     {false, true, true},
     {0, 0, 0},
     {0, 0.3, 0.3},
     0.3},
    {"plane", 1500, {0, 0, 0}, {3, 0, 2}, {0, -0.1, 0}, {0.2, 0.2, 0.2}, {}, {}, {}, 0.12},
    {"two blocks for all ranks", 500, {0, 0, 0}, {2, 1, 1}, {0, 0, 0}, {1, 1, 1}, {}, {}, {}, 0.2},
    {"one block for all ranks", 200, {0.1, 0.1, 0.1}, {0.8, 0.8, 0.8}, {0, 0, 0}, {1, 1, 1}, {}, {}, {}, 0.2},
};

struct Particle {
    std::int64_t id;
    Vector x;
};

/// Particles by id over all ranks, the same on every rank.
std::vector<Particle> all_particles(const Particles& p)
{
    std::vector<Particle> mine;
    for (Index i = 0; i < p.size(); ++i) mine.push_back({p[field::id][i], p[field::position][i]});
    auto all = world().allgather(std::span<const Particle>(mine));
    std::ranges::sort(all, {}, &Particle::id);
    return all;
}

/// Any rank starts with any of the particles.
Particles scatter(const Cloud& c, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<> u(0, 1);
    Particles p;
    p.require(field::soil, field::sorted_position, field::stress);
    for (int id = 0; id < c.n; ++id) {
        const Vector x{c.low.x + u(random) * c.size.x, c.low.y + u(random) * c.size.y, c.low.z + u(random) * c.size.z};
        if (int(random() % unsigned(world().size())) != world().rank()) continue;
        const Index i = p.size();
        p.resize(i + 1);
        p[field::id].set(i, std::int64_t(id));
        p[field::soil].set(i, std::int32_t(id % 3));
        p[field::position].set(i, x);
        p[field::sorted_position].set(i, x);
        p[field::stress].set(i, Stress{double(id), x.x, x.y, x.z, -1, 1});
    }
    return p;
}

Domain domain_of(const Cloud& c) { return Domain(world(), c.origin, c.block, c.periodic, c.period_low, c.period_length); }

std::vector<BlockWork> blocks_of(const Domain& d, const Particles& p)
{
    std::vector<BlockWork> b;
    for (Index i = 0; i < p.size(); ++i) b.push_back({d.block_of(p[field::position][i]), 1.0, 1.0});
    return b;
}

/// Cut by where these particles are, each of which is with its owner then.
Domain cut_domain(const Cloud& c, Particles& p)
{
    Domain domain = domain_of(c);
    domain.cut(blocks_of(domain, p));
    domain.migrate(p);
    return domain;
}

void expect_nobody_lost(const Particles& p, int n)
{
    const auto all = all_particles(p);
    ASSERT_EQ(int(all.size()), n);
    for (int k = 0; k < n; ++k) ASSERT_EQ(all[k].id, k);
    for (Index i = 0; i < p.size(); ++i) {
        const Stress s = p[field::stress][i];
        const Vector x = p[field::sorted_position][i];
        ASSERT_EQ(s.xx, double(p[field::id][i]));
        ASSERT_TRUE(s.xy == x.z && s.yy == x.x && s.zz == x.y);
        ASSERT_EQ(p[field::soil][i], p[field::id][i] % 3);
    }
}

/// Moves every particle by up to d; one that leaves a period comes in at its other end.
void drift(const Cloud& c, Particles& p, double d, unsigned seed)
{
    auto x = p[field::position];
    const double low[3] = {c.period_low.x, c.period_low.y, c.period_low.z};
    const double length[3] = {c.period_length.x, c.period_length.y, c.period_length.z};
    for (Index i = 0; i < p.size(); ++i) {
        std::mt19937 random(unsigned(p[field::id][i]) * 977 + seed);
        std::uniform_real_distribution<> u(-d, d);
        for (int a = 0; a < 3; ++a) {
            double& v = x.column[a][i];
            if (a == 1 && c.size.y == 0) continue;
            v += u(random);
            if (!c.periodic[a]) continue;
            if (v < low[a]) v += length[a];
            if (v >= low[a] + length[a]) v -= length[a];
        }
    }
}

struct Record {
    std::int64_t id, step;
    Vector x;
};

void expect_complete_halo(const Cloud& c, const Domain& domain, const Particles& p)
{
    const HaloPlan plan = domain.plan_halo(p, c.reach);
    Halo halo(world(), plan, sizeof(Record));
    const auto all = all_particles(p);
    std::vector<char> own(all.size(), 0);
    for (Index i = 0; i < p.size(); ++i) own[p[field::id][i]] = 1;

    const auto x = p[field::position];
    const auto records = halo.collect<Record>([&](Index i, Vector s) { return Record{p[field::id][i], 0, x[i] + s}; });
    ASSERT_EQ(Index(records.size()), halo.n_ghosts());

    // No ghost twice, each one where its owner with one of the shifts is, none of them my own unshifted.
    std::set<std::pair<std::int64_t, int>> present;
    for (const Record& g : records) {
        int shift = -1;
        for (int s = 0; s < 27; ++s) {
            const Vector d = plan.shift[s];
            if (s != HaloPlan::no_shift && d == Vector{}) continue;
            if (all[g.id].x + d == g.x) shift = s;
        }
        ASSERT_GE(shift, 0) << "ghost " << g.id << " is nowhere near its owner";
        EXPECT_TRUE(present.insert({g.id, shift}).second) << "ghost " << g.id << " twice";
        EXPECT_FALSE(own[g.id] && shift == HaloPlan::no_shift);
    }
    // Every pair within reach, by brute force.
    int missing = 0;
    std::int64_t wanted = 0;
    for (const auto& j : all)
        for (int s = 0; s < 27; ++s) {
            const Vector d = plan.shift[s];
            if ((s != HaloPlan::no_shift && d == Vector{}) || (s == HaloPlan::no_shift && own[j.id])) continue;
            const Vector at = j.x + d;
            for (Index i = 0; i < p.size(); ++i) {
                const Vector r = x[i] - at;
                if (dot(r, r) >= c.reach * c.reach) continue;
                ++wanted;
                missing += !present.contains({j.id, s});
                break;
            }
        }
    EXPECT_EQ(missing, 0);
    // A tight plan: boxes around the soil send little that nobody needs.
    EXPECT_LE(world().sum(std::int64_t(records.size())), 3 * world().sum(wanted) + 100);

    // What the solver sorts by.
    const auto ghosts = halo.ghosts(p);
    ASSERT_EQ(ghosts.size(), records.size());
    for (std::size_t k = 0; k < records.size(); ++k) {
        EXPECT_EQ(ghosts[k].id, records[k].id);
        EXPECT_EQ(ghosts[k].soil, records[k].id % 3);
    }

    // Refreshes deliver what the owner has now, to the slot it was given.
    std::vector<Index> slot(records.size());
    for (std::size_t k = 0; k < slot.size(); ++k) slot[k] = Index(slot.size() - 1 - k);
    for (std::int64_t step = 1; step <= 6; ++step) {
        if (step == 3) halo.assign_slots(slot);
        halo.begin([&](Index i, Vector s, std::byte* to) {
            const Record r{p[field::id][i], step, x[i] + s};
            std::memcpy(to, &r, sizeof r);
        });
        if (step % 2)
            for (int k = 0; k < 3; ++k) halo.progress();
        std::vector<Record> arrived(records.size(), Record{-1, -1, {}});
        halo.arrive([&](Index at, const std::byte* from) { std::memcpy(&arrived[at], from, sizeof(Record)); });
        for (std::size_t k = 0; k < records.size(); ++k) {
            const Record& r = arrived[step < 3 ? k : std::size_t(slot[k])];
            ASSERT_EQ(r.id, records[k].id);
            ASSERT_EQ(r.step, step);
            ASSERT_EQ(r.x, records[k].x);
        }
    }
    EXPECT_EQ(halo.refreshes(), 6);
    std::int64_t sent = 0;
    int messages = 0;
    for (const auto& peer : plan.peers)
        if (peer.rank != world().rank()) sent += std::int64_t(peer.sends.size() * sizeof(Record)), ++messages;
    EXPECT_EQ(halo.bytes_per_refresh(), sent);
    EXPECT_EQ(halo.messages_per_refresh(), messages);
}

class Clouds : public testing::TestWithParam<Cloud> {};
INSTANTIATE_TEST_SUITE_P(Halo, Clouds, testing::ValuesIn(clouds), [](const auto& info) { return std::to_string(info.index); });

TEST_P(Clouds, MigrateAndSeeEveryPair)
{
    const Cloud& c = GetParam();
    SCOPED_TRACE(c.name);
    Particles p = scatter(c, 11);
    Domain domain = domain_of(c);
    domain.cut(blocks_of(domain, p));
    const auto on_their_owners = [&] {
        for (Index i = 0; i < p.size(); ++i) ASSERT_EQ(domain.owner_of(p[field::position][i]), world().rank());
    };
    const auto moved = domain.migrate(p);
    EXPECT_EQ(world().sum(moved.left), world().sum(moved.arrived));
    expect_nobody_lost(p, c.n);
    on_their_owners();
    expect_complete_halo(c, domain, p);

    // Particles enter blocks that were empty when the cut was made; first seen by whoever has them, then by owners.
    drift(c, p, std::min(1.5 * c.reach, 0.25), 1);
    expect_complete_halo(c, domain, p);
    domain.migrate(p);
    expect_nobody_lost(p, c.n);
    on_their_owners();
    expect_complete_halo(c, domain, p);

    // A new cut, along the other curve.
    domain.cut(blocks_of(domain, p), Method::Hilbert, {c.reach, 64});
    domain.migrate(p);
    expect_nobody_lost(p, c.n);
    on_their_owners();
    expect_complete_halo(c, domain, p);
}

/// While soil creeps on, ranks ask those that may be near, and all others only when some soil has come far from where it was told to be.
/// The plans are the same as where all tell all each time.
TEST(Halo, AllTellAllSeldom)
{
    for (const Cloud& c : clouds) {
        SCOPED_TRACE(c.name);
        Particles p = scatter(c, 21);
        Domain domain = cut_domain(c, p);
        constexpr int plans = 24;
        const double each = 0.1 * c.reach; // half a skin
        for (int k = 0; k < plans; ++k) {
            Domain fresh = domain_of(c); // knows nothing: all tell all
            const HaloPlan mine = domain.plan_halo(p, c.reach), other = fresh.plan_halo(p, c.reach);
            ASSERT_EQ(fresh.tellings(), world().size() > 1 || c.periodic[0] || c.periodic[1] || c.periodic[2] ? 1 : 0);
            ASSERT_EQ(mine.peers.size(), other.peers.size());
            for (std::size_t q = 0; q < mine.peers.size(); ++q) {
                ASSERT_EQ(mine.peers[q].rank, other.peers[q].rank);
                ASSERT_EQ(mine.peers[q].sends.size(), other.peers[q].sends.size());
                for (std::size_t i = 0; i < mine.peers[q].sends.size(); ++i) {
                    ASSERT_EQ(mine.peers[q].sends[i].owned, other.peers[q].sends[i].owned);
                    ASSERT_EQ(mine.peers[q].sends[i].shift, other.peers[q].sends[i].shift);
                }
            }
            drift(c, p, each, unsigned(k));
            if (k % 4 == 3) domain.migrate(p);
        }
        EXPECT_GE(domain.tellings(), world().size() > 1 ? 1 : 0);
        EXPECT_LE(domain.tellings(), plans / 4);
    }
}

/// One that flies far off in one go is found by whom it comes near: what was told holds no longer.
TEST(Halo, ALeapIsToldToAll)
{
    const Cloud& c = clouds[0];
    Particles p = scatter(c, 22);
    Domain domain = cut_domain(c, p);
    static_cast<void>(domain.plan_halo(p, c.reach));
    const auto before = domain.tellings();
    const auto all = all_particles(p);
    for (Index i = 0; i < p.size(); ++i) // the first lands on the last
        if (p[field::id][i] == 0) p[field::position].set(i, all.back().x + Vector{0.1 * c.reach, 0, 0});
    expect_complete_halo(c, domain, p);
    EXPECT_LE(domain.tellings(), before + 1);
}

TEST(Halo, OneRankMayHaveEverything)
{
    const Cloud& c = clouds[2];
    Particles p = scatter(c, 3);
    Domain domain = domain_of(c);
    std::vector<BlockWork> mine;
    if (world().rank() == 0) mine.push_back({{0, 0, 0}, 1.0, 1.0}); // one occupied block: rank 0 owns all space
    domain.cut(mine);
    domain.migrate(p);
    EXPECT_EQ(p.size(), world().rank() == 0 ? c.n : 0);
    expect_nobody_lost(p, c.n);
    expect_complete_halo(c, domain, p);
}

TEST(Halo, NothingAtAll)
{
    Particles p;
    p.require(field::sorted_position);
    Domain domain = domain_of(clouds[4]);
    domain.cut({});
    domain.migrate(p);
    Halo halo(world(), domain.plan_halo(p, 0.1), 128);
    EXPECT_EQ(halo.n_ghosts(), 0);
    EXPECT_TRUE(halo.ghosts(p).empty());
    halo.begin([](Index, Vector, std::byte*) { FAIL(); });
    halo.progress();
    halo.arrive([](Index, const std::byte*) { FAIL(); });
}

TEST(Halo, RefusesMisuse)
{
    Particles p = scatter(clouds[2], 5);
    Domain domain = cut_domain(clouds[2], p);
    EXPECT_THROW(domain.plan_halo(p, 1.5), Broken); // further than the period of 1 m
    Halo halo(world(), domain.plan_halo(p, 0.1), 8);
    const auto copy = [](Index, Vector, std::byte* to) { std::memset(to, 0, 8); };
    const auto put = [](Index, const std::byte*) {};
    EXPECT_THROW(halo.arrive(put), Broken);
    halo.begin(copy);
    EXPECT_THROW(halo.begin(copy), Broken);
    halo.arrive(put);
    EXPECT_THROW(halo.assign_slots(std::vector<Index>(std::size_t(halo.n_ghosts()) + 1)), Broken);

    if (p.size() > 0 && world().rank() == 0) p[field::position].set(0, Vector{NAN, 0, 0});
    EXPECT_THROW(domain.migrate(p), NumbersFailed); // on every rank
    EXPECT_THROW(domain.plan_halo(p, 0.1), NumbersFailed);
}

/// Two halos may replace one another, as at every rebuild.
TEST(Halo, IsRenewed)
{
    const Cloud& c = clouds[0];
    Particles p = scatter(c, 8);
    Domain domain = cut_domain(c, p);
    std::unique_ptr<Halo> halo;
    for (int k = 0; k < 20; ++k) {
        halo = std::make_unique<Halo>(world(), domain.plan_halo(p, c.reach), 128);
        *halo = Halo(world(), domain.plan_halo(p, c.reach), sizeof(std::int64_t));
        halo->begin([&](Index i, Vector, std::byte* to) {
            const std::int64_t id = p[field::id][i];
            std::memcpy(to, &id, sizeof id);
        });
        std::int64_t sum = 0, expected = 0;
        halo->arrive([&](Index, const std::byte* from) {
            std::int64_t id;
            std::memcpy(&id, from, sizeof id);
            sum += id;
        });
        for (const auto& g : halo->ghosts(p)) expected += g.id;
        ASSERT_EQ(sum, expected);
        drift(c, p, 0.02, unsigned(k));
        domain.migrate(p);
    }
}

} // namespace
} // namespace kuzure
