// What many ranks write is what one rank, or another number of them, reads.
#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include "io/history.hpp"
#include "io/picture_series.hpp"
#include "io/result_directory.hpp"
#include "io/snapshot.hpp"
#include "tests/mpi/world.hpp"
#include <cstring>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

using namespace kuzure;
using testing::HasSubstr;

namespace {

class IoTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_io_XXXXXX";
        std::string made;
        if (world().rank() == 0 && mkdtemp(name)) made = name;
        dir = world().broadcast(made);
        ASSERT_FALSE(dir.empty());
    }
    void TearDown() override
    {
        world().barrier();
        if (world().rank() == 0) std::filesystem::remove_all(dir);
        world().barrier();
    }
    io::Path dir;
};

/// Particle k of the whole, every number a function of k.
void fill(Particles& p, Index i, std::int64_t k)
{
    p.for_each_present([&](auto f) {
        using T = typename decltype(f)::Number;
        for (int c = 0; c < f.components; ++c) p[f].column[c][i] = T(double(k) / 7 + 1000 * c);
    });
    p[field::id].set(i, k);
}
Particles share(std::int64_t first, std::int64_t count)
{
    Particles p;
    p.require(field::velocity, field::stress, field::density, field::origin, field::half_stress, field::soil);
    p.resize(Index(count));
    for (Index i = 0; i < p.size(); ++i) fill(p, i, first + i);
    return p;
}
/// Rows of this rank: uneven, rank 1 (or the only one but for a few) empty.
std::int64_t count_here(std::int64_t scale) { return world().rank() == 1 ? 0 : scale * (world().rank() + 1) + 3; }

Particles uneven(std::int64_t scale)
{
    const auto n = count_here(scale);
    return share(world().sum_below(n), n);
}
bool same_bits(const Particles& a, const Particles& b)
{
    bool same = a.size() == b.size() && a.bytes_per_particle() == b.bytes_per_particle();
    a.for_each_present([&](auto f) {
        same = same && b.has(f);
        for (int c = 0; same && c < f.components; ++c)
            same = std::memcmp(a[f].column[c], b[f].column[c], sizeof(a[f].column[c][0]) * std::size_t(a.size())) == 0;
    });
    return same;
}

} // namespace

TEST_F(IoTest, ACheckpointOfManyRanksIsReadByAnyNumber)
{
    for (const std::int64_t scale : {0, 1, 3000}) {
        const Particles p = uneven(scale);
        const auto file = io::write_checkpoint(world(), dir, p, "hash", "header").path();
        Particles q;
        const auto c = io::read_checkpoint(world(), file, q);
        const std::int64_t total = world().sum(std::int64_t(p.size()));
        EXPECT_EQ(c.particles, total);
        EXPECT_EQ(c.header, "header");
        EXPECT_LE(std::abs(q.size() * world().size() - total), world().size());
        EXPECT_TRUE(same_bits(q, share(world().sum_below(q.size()), q.size())));

        Particles all; // by each rank alone
        io::read_checkpoint(SingleRank{}, file, all);
        EXPECT_TRUE(same_bits(all, share(0, total)));
        world().barrier();
    }
}

TEST_F(IoTest, OneRanksCheckpointIsReadByMany)
{
    if (world().rank() == 0) io::write_checkpoint(SingleRank{}, dir, share(0, 5000), "hash", "header");
    world().barrier();
    Particles q;
    EXPECT_EQ(io::read_checkpoint(world(), dir / "checkpoint.h5", q).particles, 5000);
    EXPECT_TRUE(same_bits(q, share(world().sum_below(q.size()), q.size())));
}

TEST_F(IoTest, DamageSeenByOneRankReachesAll)
{
    const Particles p = uneven(4000);
    io::write_checkpoint(world(), dir, p, "hash", "old");
    const auto file = io::write_checkpoint(world(), dir, p, "hash", "new").path();
    if (world().rank() == 0) { // in the middle of the numbers, so that one rank's share holds it
        std::fstream f(file, std::ios::in | std::ios::out | std::ios::binary);
        f.seekp(std::streamoff(std::filesystem::file_size(file) * 2 / 5));
        f.write("damaged!", 8);
    }
    world().barrier();
    Particles q;
    EXPECT_THROW(io::read_checkpoint(world(), file, q), IoFailed);
    EXPECT_EQ(q.size(), 0);
    int said = 0;
    const auto good = io::newest_good(world(), dir, [&](const std::string&) { ++said; });
    ASSERT_TRUE(good);
    EXPECT_EQ(good->header, "old");
    EXPECT_EQ(said, world().rank() == 0 ? 1 : 0);
}

TEST_F(IoTest, AFailureReachesAllRanks)
{
    const Particles p = uneven(10);
    EXPECT_THROW(io::write_checkpoint(world(), dir / "none", p, "hash", ""), IoFailed);
    EXPECT_THROW(io::write_snapshot(world(), dir / "none" / "s.hdf", p, {}, {}), IoFailed);
    EXPECT_THROW(io::History(world(), dir / "none" / "h.csv", 3), IoFailed);
    EXPECT_THROW(io::ResultDirectory(world(), dir / "..", io::Existing::Refuse), BadInput);
    try {
        io::agree(world(), world().rank() == world().size() - 1 ? "the last one's trouble" : "");
        FAIL();
    } catch (const IoFailed& e) {
        EXPECT_STREQ(e.what(), "the last one's trouble");
    }
}

TEST_F(IoTest, AFullDiskFailsOnAllRanksAndHarmsNothing)
{
    const auto small = dir / "small";
    const bool mounted = world().any(world().rank() == 0 && std::filesystem::create_directory(small) &&
                                     std::system(("mount -t tmpfs -o size=2m none " + small.string() + " 2>/dev/null").c_str()) == 0);
    if (!mounted) GTEST_SKIP() << "may not mount a small disk here";
    const Particles few = uneven(10), many = uneven(50000);
    io::write_checkpoint(world(), small, few, "hash", "good");
    std::string said;
    try {
        io::write_checkpoint(world(), small, many, "hash", "too large");
    } catch (const IoFailed& e) {
        said = e.what();
    }
    EXPECT_THAT(said, HasSubstr("disk is full"));
    EXPECT_THAT(said, HasSubstr("The last good checkpoint is " + (small / "checkpoint.h5").string()));

    // The disk fills up while the file is being written.
    said.clear();
    try {
        io::H5Writer out(world(), small / "grows.h5", 0);
        const std::vector<double> numbers(500000, 1.5);
        out.table("/numbers", std::span<const double>(numbers), 1);
        out.publish();
    } catch (const IoFailed& e) {
        said = e.what();
    }
    EXPECT_THAT(said, HasSubstr("grows.h5"));
    EXPECT_THAT(said, HasSubstr("disk is full"));
    world().barrier();
    EXPECT_FALSE(std::filesystem::exists(small / "grows.h5.tmp"));
    EXPECT_FALSE(std::filesystem::exists(small / "grows.h5"));
    EXPECT_EQ(io::verify_checkpoint(world(), small / "checkpoint.h5").header, "good");
    world().barrier();
    if (world().rank() == 0) EXPECT_EQ(std::system(("umount " + small.string()).c_str()), 0);
}

TEST_F(IoTest, ASnapshotOfManyRanksIsOneGrid)
{
    const Particles p = uneven(1000);
    io::WallPoints walls;
    if (world().rank() == 0) walls = {{{1, 2, 3}}, {1 << 20}, {2000}};
    io::Snapshots snapshots(world(), dir);
    const auto file = snapshots.write(p, walls, {0.5, 3, 3, "many", {}});
    const std::int64_t total = world().sum(std::int64_t(p.size())) + 1;

    const io::H5Reader in(file);
    std::vector<std::int64_t> ids, offsets;
    std::vector<double> stress;
    in.rows("/VTKHDF/PointData/id", 0, std::uint64_t(total), 1, ids);
    in.rows("/VTKHDF/Offsets", 0, std::uint64_t(total) + 1, 1, offsets);
    in.rows("/VTKHDF/PointData/stress", 0, std::uint64_t(total), 6, stress);
    for (std::int64_t i = 0; i <= total; ++i) ASSERT_EQ(offsets[std::size_t(i)], i);
    const auto rank0 = world().max(world().rank() == 0 ? std::int64_t(p.size()) : 0);
    for (std::int64_t i = 0; i < total; ++i) {
        const std::int64_t k = i < rank0 ? i : i - 1; // rank 0's wall point follows its soil
        if (i == rank0) {
            EXPECT_EQ(ids[std::size_t(i)], 1 << 20);
        } else {
            ASSERT_EQ(ids[std::size_t(i)], k);
            ASSERT_EQ(stress[std::size_t(6 * i + 4)], double(k) / 7 + 4000);
        }
    }
    EXPECT_EQ(in.table("/VTKHDF/Points").rows, std::uint64_t(total));
    world().barrier();

    io::Snapshots again(world(), dir, 0.4);
    EXPECT_FALSE(again.last_time());
    EXPECT_FALSE(io::exists(file));
}

TEST_F(IoTest, HistoryIsWrittenOnceAndGoesOn)
{
    io::HistoryRow row{};
    {
        io::History h(world(), dir / "h.csv", 3);
        for (int k = 0; k < 4; ++k) row.time = k, h.append(row);
    }
    world().barrier();
    {
        io::History h(world(), dir / "h.csv", 3, 1.5);
        EXPECT_EQ(h.last_time(), 1.0);
        row.time = 2;
        h.append(row);
    }
    world().barrier();
    const std::string all = io::read_text(dir / "h.csv");
    EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 5);
}

TEST_F(IoTest, ThePicturesAreTheSameForAnyNumberOfRanks)
{
    const std::int64_t n = 12 * 12 * 12, ranks = world().size(), me = world().rank();
    io::on_root(world(), [&] { std::filesystem::create_directory(dir / "snapshots"); });
    io::Snapshots snapshots(world(), dir / "snapshots");
    for (const double t : {0.0, 0.1, 0.2}) {
        Particles p;
        p.require(field::origin, field::velocity, field::stress, field::density);
        const auto first = n * me / ranks, last = n * (me + 1) / ranks;
        p.resize(Index(last - first));
        for (auto k = first; k < last; ++k)
            p[field::position].set(Index(k - first),
                                   Vector{0.1 * double(k % 12), 0.1 * double(k / 12 % 12), (0.1 - t / 3) * double(k / 144)});
        snapshots.write(p, {}, {t, 0, 3, "the same", {}});
    }
    io::PictureTask task;
    task.results = dir, task.spacing = 0.1, task.title = "the same";
    EXPECT_EQ(io::draw_pictures(world(), task).files.size(), 3u);
    world().barrier();
    if (me == 0)
        for (int k = 0; k < 3; ++k) {
            task.at = 0.1 * k;
            task.file = [&](int) { return dir / "alone.png"; };
            io::draw_pictures(SingleRank{}, task);
            EXPECT_EQ(io::read_text(dir / "alone.png"), io::read_text(io::picture_file(dir, k)));
        }
    task.color = "sped"; // all ranks fail together
    EXPECT_THROW(io::draw_pictures(world(), task), BadInput);
}
