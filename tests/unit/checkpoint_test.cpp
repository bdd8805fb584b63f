// A checkpoint comes back bit for bit or not at all.
#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include <cstring>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sys/wait.h>
#include <unistd.h>

using namespace kuzure;
using testing::HasSubstr;

namespace {

const SingleRank alone;

class CheckpointTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_checkpoint_XXXXXX";
        ASSERT_TRUE(mkdtemp(name));
        dir = name;
    }
    void TearDown() override { std::filesystem::remove_all(dir); }
    io::Path dir;
};

Particles some(Index n, unsigned seed)
{
    Particles p;
    p.require(field::velocity, field::stress, field::density, field::half_velocity, field::origin, field::soil);
    p.resize(n);
    std::mt19937_64 random(seed);
    p.for_each_present([&](auto f) {
        using T = typename decltype(f)::Number;
        const auto view = p[f];
        for (int c = 0; c < f.components; ++c)
            for (Index i = 0; i < n; ++i) {
                const auto bits = random();
                std::memcpy(&view.column[c][i], &bits, sizeof(T)); // any bits, NaN and -0 among them
            }
    });
    return p;
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

void flip_bit(const io::Path& file, std::uint64_t bit)
{
    std::fstream f(file, std::ios::in | std::ios::out | std::ios::binary);
    f.seekg(std::streamoff(bit / 8));
    char byte = char(f.get());
    byte = char(byte ^ (1 << (bit % 8)));
    f.seekp(std::streamoff(bit / 8));
    f.put(byte);
}

std::string refusal(const io::Path& file)
{
    Particles p;
    try {
        io::read_checkpoint(alone, file, p);
    } catch (const IoFailed& e) {
        EXPECT_EQ(p.size(), 0);
        return e.what();
    }
    return "";
}

} // namespace

TEST_F(CheckpointTest, ComesBackBitForBit)
{
    for (const Index n : {0, 1, 5, 100000}) {
        const Particles p = some(n, 1);
        const auto file = io::write_checkpoint(alone, dir, p, "hash", "{\"time\": 0.5}").path();
        Particles q;
        const auto c = io::read_checkpoint(alone, file, q);
        EXPECT_TRUE(same_bits(p, q)) << n;
        EXPECT_EQ(c.particles, n);
        EXPECT_EQ(c.scene_hash, "hash");
        EXPECT_EQ(c.header, "{\"time\": 0.5}");
        EXPECT_EQ(io::verify_checkpoint(alone, file).header, c.header);
        EXPECT_LE(std::filesystem::file_size(file), io::checkpoint_bytes(n, p.bytes_per_particle()));
    }
    EXPECT_FALSE(std::filesystem::exists(dir / "checkpoint.h5.tmp"));
}

TEST_F(CheckpointTest, KeepsTwoGenerationsAndFallsBack)
{
    const auto quiet = [](const std::string& s) { ADD_FAILURE() << s; };
    EXPECT_FALSE(io::newest_good(alone, dir, quiet));
    for (int k = 0; k < 3; ++k) io::write_checkpoint(alone, dir, some(100, unsigned(k)), "hash", std::to_string(k));
    auto good = io::newest_good(alone, dir, quiet);
    ASSERT_TRUE(good);
    EXPECT_EQ(good->header, "2");

    std::vector<std::string> said;
    const auto listen = [&](const std::string& s) { said.push_back(s); };
    std::filesystem::resize_file(dir / "checkpoint.h5", std::filesystem::file_size(dir / "checkpoint.h5") / 2);
    good = io::newest_good(alone, dir, listen);
    ASSERT_TRUE(good);
    EXPECT_EQ(good->header, "1");
    EXPECT_EQ(good->file.path(), dir / "checkpoint.prev.h5");
    ASSERT_EQ(said.size(), 1u);
    EXPECT_THAT(said[0], HasSubstr((dir / "checkpoint.h5").string()));

    std::ofstream(dir / "checkpoint.prev.h5") << "nonsense";
    EXPECT_THROW(io::newest_good(alone, dir, listen), IoFailed);
}

TEST_F(CheckpointTest, ACrashBetweenTheRenamesLosesNothing)
{
    for (int k = 0; k < 2; ++k) io::write_checkpoint(alone, dir, some(100, unsigned(k)), "hash", std::to_string(k));
    std::filesystem::rename(dir / "checkpoint.h5", dir / "checkpoint.h5.tmp");
    const auto good = io::newest_good(alone, dir, [](const std::string& s) { ADD_FAILURE() << s; });
    ASSERT_TRUE(good);
    EXPECT_EQ(good->header, "1");
}

TEST_F(CheckpointTest, RefusesWhatIsNotAWholeCheckpoint)
{
    const auto file = io::write_checkpoint(alone, dir, some(1000, 3), "hash", "{}").path();
    const auto size = std::filesystem::file_size(file);
    for (const double share : {0.999, 0.5, 0.01, 0.0}) {
        std::filesystem::copy_file(file, dir / "cut.h5", std::filesystem::copy_options::overwrite_existing);
        std::filesystem::resize_file(dir / "cut.h5", std::uintmax_t(share * double(size)));
        EXPECT_THAT(refusal(dir / "cut.h5"), HasSubstr((dir / "cut.h5").string())) << share;
    }
    std::ofstream(dir / "text.h5") << "time,step\n0,0\n";
    EXPECT_THAT(refusal(dir / "text.h5"), HasSubstr("not a readable HDF5 file"));
    EXPECT_THAT(refusal(dir / "none.h5"), HasSubstr("no such file"));
    EXPECT_THAT(refusal(dir), HasSubstr("expected a file"));
    {
        io::H5Writer other(alone, dir / "other.h5", 0);
        other.group("/data");
        other.publish();
    }
    EXPECT_THAT(refusal(dir / "other.h5"), HasSubstr("not a checkpoint"));
}

TEST_F(CheckpointTest, TablesComeBackAndTheirDamageIsSeen)
{
    const io::CheckpointTable cells{"cells", "m,s", 2, {1, 2, 3, 1e300, -0.0, 0.1}}, more{"more", "1", 1, {123456.789}};
    const auto file = io::write_checkpoint(alone, dir, some(10, 3), "hash", "{}", std::array{cells, more}).path();
    const auto good = io::verify_checkpoint(alone, file);
    EXPECT_EQ(io::read_checkpoint_table(alone, good, "cells", 2), cells.rows);
    EXPECT_EQ(io::read_checkpoint_table(alone, good, "more", 1), more.rows);
    EXPECT_FALSE(io::read_checkpoint_table(alone, good, "others", 1));
    EXPECT_THROW(io::read_checkpoint_table(alone, good, "cells", 3), IoFailed);

    // One bit of the number that stands nowhere else.
    std::string bytes = io::read_text(file);
    const auto at = bytes.find(std::string(reinterpret_cast<const char*>(more.rows.data()), sizeof(double)));
    ASSERT_NE(at, bytes.npos);
    flip_bit(file, 8 * at + 3);
    try {
        io::verify_checkpoint(alone, file);
        FAIL();
    } catch (const IoFailed& e) {
        EXPECT_THAT(e.what(), HasSubstr("checksum of /tables/more"));
    }
    const auto plain = io::verify_checkpoint(alone, io::write_checkpoint(alone, dir, some(10, 3), "hash", "{}"));
    EXPECT_FALSE(io::read_checkpoint_table(alone, plain, "cells", 2));
}

TEST_F(CheckpointTest, RefusesAFieldItDoesNotHave)
{
    const auto file = io::write_checkpoint(alone, dir, some(10, 3), "hash", "{}").path();
    Particles p;
    p.require(field::plastic_strain);
    try {
        io::read_checkpoint(alone, file, p);
        FAIL();
    } catch (const IoFailed& e) {
        EXPECT_THAT(e.what(), HasSubstr("plastic_strain"));
    }
}

TEST_F(CheckpointTest, AFlippedBitIsRefusedOrHarmless)
{
    const Particles p = some(500, 4);
    const auto file = io::write_checkpoint(alone, dir, p, "hash", "{\"time\": 0.5}").path();
    const auto copy = dir / "flipped.h5";
    const auto bits = 8 * std::filesystem::file_size(file);
    std::mt19937_64 random(5);
    int refused = 0, harmless = 0;
    // The first kilobytes are nearly all the library's own structures; the others mostly numbers.
    for (int k = 0; k < 400; ++k) {
        std::filesystem::copy_file(file, copy, std::filesystem::copy_options::overwrite_existing);
        flip_bit(copy, k % 2 ? random() % bits : random() % (8 * 4096));
        // In a child: a crash inside the library would be a finding, not the end of the test.
        const pid_t child = fork();
        if (child == 0) {
            alarm(300);
            Particles q;
            try {
                const auto c = io::read_checkpoint(alone, copy, q);
                _exit(same_bits(p, q) && c.header == "{\"time\": 0.5}" && c.scene_hash == "hash" ? 0 : 3);
            } catch (const IoFailed&) {
                _exit(1);
            } catch (...) {
                _exit(2);
            }
        }
        int status = 0;
        waitpid(child, &status, 0);
        ASSERT_TRUE(WIFEXITED(status)) << "flip " << k << ": killed by signal " << WTERMSIG(status);
        ASSERT_LE(WEXITSTATUS(status), 1) << "flip " << k;
        (WEXITSTATUS(status) ? refused : harmless)++;
    }
    EXPECT_GT(refused, 150); // the others lie where nothing is stored
    RecordProperty("refused", refused);
    RecordProperty("harmless", harmless);
}

TEST_F(CheckpointTest, AFailedWriteNamesWhatIsStillGood)
{
    io::write_checkpoint(alone, dir, some(100, 1), "hash", "1");
    std::filesystem::create_directory(dir / "checkpoint.h5.tmp"); // in the way of the next one
    try {
        io::write_checkpoint(alone, dir, some(100, 2), "hash", "2");
        FAIL();
    } catch (const IoFailed& e) {
        EXPECT_THAT(e.what(), HasSubstr("The last good checkpoint is " + (dir / "checkpoint.h5").string()));
    }
    EXPECT_EQ(io::verify_checkpoint(alone, dir / "checkpoint.h5").header, "1");
}
