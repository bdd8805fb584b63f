// Snapshots hold what INTERFACE promises, and their series survives a restart.
#include "io/hdf5.hpp"
#include "io/snapshot.hpp"
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

using namespace kuzure;
using testing::ElementsAre;
using testing::HasSubstr;

namespace {

const SingleRank alone;

class SnapshotTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_snapshot_XXXXXX";
        ASSERT_TRUE(mkdtemp(name));
        dir = name;
        p.require(field::velocity, field::stress, field::density, field::origin, field::soil);
        p.resize(2);
        for (Index i = 0; i < 2; ++i) {
            const double d = i;
            p[field::id].set(i, std::int64_t(10 + i));
            p[field::soil].set(i, std::int32_t(i));
            p[field::position].set(i, Vector{d, d + 0.25, d + 0.5});
            p[field::origin].set(i, Vector{0, 0, 0});
            p[field::velocity].set(i, Vector{1, 2, 3});
            p[field::stress].set(i, Stress{1, 2, 3, 4, 5, 6});
            p[field::density].set(i, 1800 + d);
        }
        walls.position = {{7, 8, 9}};
        walls.id = {20};
        walls.density = {2000};
    }
    void TearDown() override { std::filesystem::remove_all(dir); }

    template <class T> std::vector<T> read(const io::H5Reader& in, const std::string& name, int components)
    {
        std::vector<T> all;
        in.rows("/VTKHDF/" + name, 0, in.table("/VTKHDF/" + name).rows, components, all);
        return all;
    }
    std::vector<std::string> series()
    {
        std::vector<std::string> names;
        const auto all = nlohmann::json::parse(io::read_text(dir / "state.hdf.series"));
        for (const auto& f : all.at("files")) names.push_back(f.at("name").get<std::string>() + " " + f.at("time").dump());
        return names;
    }

    io::Path dir;
    Particles p;
    io::WallPoints walls;
};

} // namespace

TEST_F(SnapshotTest, HoldsThePromisedTables)
{
    io::SnapshotLabel label{0.25, 7, 3, "a title", {}};
    io::write_snapshot(alone, dir / "s.hdf", p, walls, label);
    const io::H5Reader in(dir / "s.hdf");
    EXPECT_EQ(in.text("/VTKHDF", "Type"), "UnstructuredGrid");
    EXPECT_EQ(in.real("/VTKHDF", "time"), 0.25);
    EXPECT_EQ(in.integer("/VTKHDF", "step"), 7);
    EXPECT_THAT(read<std::int64_t>(in, "NumberOfPoints", 1), ElementsAre(3));
    EXPECT_THAT(read<std::int64_t>(in, "NumberOfCells", 1), ElementsAre(3));
    EXPECT_THAT(read<std::int64_t>(in, "Connectivity", 1), ElementsAre(0, 1, 2));
    EXPECT_THAT(read<std::int64_t>(in, "Offsets", 1), ElementsAre(0, 1, 2, 3));
    EXPECT_THAT(read<std::uint8_t>(in, "Types", 1), ElementsAre(1, 1, 1));
    EXPECT_THAT(read<double>(in, "Points", 3), ElementsAre(0, 0.25, 0.5, 1, 1.25, 1.5, 7, 8, 9));
    EXPECT_THAT(read<std::int64_t>(in, "PointData/id", 1), ElementsAre(10, 11, 20));
    EXPECT_THAT(read<std::int32_t>(in, "PointData/kind", 1), ElementsAre(0, 0, 1));
    EXPECT_THAT(read<std::int32_t>(in, "PointData/soil", 1), ElementsAre(0, 1, -1));
    EXPECT_THAT(read<double>(in, "PointData/velocity", 3), ElementsAre(1, 2, 3, 1, 2, 3, 0, 0, 0));
    EXPECT_THAT(read<double>(in, "PointData/stress", 6), ElementsAre(1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6, 0, 0, 0, 0, 0, 0));
    EXPECT_THAT(read<double>(in, "PointData/density", 1), ElementsAre(1800, 1801, 2000));
    EXPECT_THAT(read<double>(in, "PointData/plastic_strain", 1), ElementsAre(0, 0, 0));
    EXPECT_THAT(read<double>(in, "PointData/displacement", 3), ElementsAre(0, 0.25, 0.5, 1, 1.25, 1.5, 0, 0, 0));
    EXPECT_THAT(read<double>(in, "FieldData/TimeValue", 1), ElementsAre(0.25));
    EXPECT_EQ(in.text("/VTKHDF/PointData/stress", "unit"), "Pa");
    EXPECT_EQ(in.text("/VTKHDF/Points", "unit"), "m");
    EXPECT_LE(std::filesystem::file_size(dir / "s.hdf"), io::snapshot_bytes(3, {}));
}

// Gaps count in the density that users see; the soil's own is what the sums take.
TEST_F(SnapshotTest, DensityIsWithTheOpenedVolume)
{
    p.require(field::opened_volume);
    p[field::opened_volume].set(1, 0.5);
    io::write_snapshot(alone, dir / "s.hdf", p, walls, {0, 0, 3, "", {"density"}});
    const io::H5Reader in(dir / "s.hdf");
    EXPECT_THAT(read<double>(in, "PointData/density", 1), ElementsAre(1800, 1801 * std::exp(-0.5), 2000));
}

TEST_F(SnapshotTest, WritesOnlyTheFieldsAskedFor)
{
    io::write_snapshot(alone, dir / "s.hdf", p, walls, {0, 0, 3, "", {"velocity"}});
    const io::H5Reader in(dir / "s.hdf");
    EXPECT_TRUE(in.has("/VTKHDF/PointData/velocity"));
    EXPECT_TRUE(in.has("/VTKHDF/PointData/id"));
    EXPECT_FALSE(in.has("/VTKHDF/PointData/stress"));
    EXPECT_THROW(io::write_snapshot(alone, dir / "s.hdf", p, walls, {0, 0, 3, "", {"volocity"}}), BadInput);
}

TEST_F(SnapshotTest, TwoDimensionsLieInThePlane)
{
    io::write_snapshot(alone, dir / "s.hdf", p, walls, {0, 0, 2, "", {}});
    const io::H5Reader in(dir / "s.hdf");
    EXPECT_THAT(read<double>(in, "Points", 3), ElementsAre(0, 0, 0.5, 1, 0, 1.5, 7, 0, 9));
    EXPECT_THAT(read<double>(in, "PointData/velocity", 3), ElementsAre(1, 0, 3, 1, 0, 3, 0, 0, 0));
}

TEST_F(SnapshotTest, AnEmptySnapshotIsAFile)
{
    io::write_snapshot(alone, dir / "s.hdf", Particles{}, {}, {0, 0, 3, "", {"plastic_strain"}});
    const io::H5Reader in(dir / "s.hdf");
    EXPECT_THAT(read<std::int64_t>(in, "Offsets", 1), ElementsAre(0));
    EXPECT_EQ(in.table("/VTKHDF/Points").rows, 0u);
}

TEST_F(SnapshotTest, TheSeriesFollowsARestart)
{
    {
        io::Snapshots s(alone, dir);
        EXPECT_FALSE(s.last_time());
        for (const double t : {0.0, 0.1, 0.2, 0.3}) s.write(p, walls, {t, 0, 3, "", {"velocity"}});
    }
    EXPECT_THAT(series(), ElementsAre("state_000000.hdf 0.0", "state_000001.hdf 0.1", "state_000002.hdf 0.2", "state_000003.hdf 0.3"));
    std::filesystem::remove(dir / "state.hdf.series"); // the files alone are enough
    io::Snapshots s(alone, dir, 0.15);
    EXPECT_EQ(s.last_time(), 0.1);
    EXPECT_FALSE(std::filesystem::exists(dir / "state_000003.hdf"));
    EXPECT_THAT(series(), ElementsAre("state_000000.hdf 0.0", "state_000001.hdf 0.1"));
    EXPECT_EQ(s.write(p, walls, {0.2, 0, 3, "", {"velocity"}}).path(), dir / "state_000002.hdf");
    EXPECT_THAT(series(), ElementsAre("state_000000.hdf 0.0", "state_000001.hdf 0.1", "state_000002.hdf 0.2"));
}

TEST_F(SnapshotTest, WallsAreWrittenOnce)
{
    {
        io::Snapshots s(alone, dir);
        for (const double t : {0.0, 0.1}) s.write(p, walls, {t, 0, 3, "", {}});
    }
    io::Snapshots again(alone, dir, 0.15);
    again.write(p, walls, {0.2, 0, 3, "", {}, 11});
    const auto kinds = [&](const char* file) { return read<std::int32_t>(io::H5Reader(dir / file), "PointData/kind", 1); };
    EXPECT_THAT(kinds("state_000000.hdf"), ElementsAre(0, 0, 1));
    EXPECT_THAT(kinds("state_000001.hdf"), ElementsAre(0, 0));
    EXPECT_THAT(kinds("state_000002.hdf"), ElementsAre(0, 0));
    EXPECT_THAT(kinds("walls.hdf"), ElementsAre(1));
    EXPECT_THAT(read<double>(io::H5Reader(dir / "walls.hdf"), "Points", 3), ElementsAre(7, 8, 9));
    EXPECT_FALSE(io::H5Reader(dir / "state_000001.hdf").has_attribute("/VTKHDF", "failed_particle"));
    EXPECT_EQ(io::H5Reader(dir / "state_000002.hdf").integer("/VTKHDF", "failed_particle"), 11);
    EXPECT_EQ(io::snapshot_number(dir / "state_000002.hdf"), 2);
    EXPECT_FALSE(io::snapshot_number(dir / "walls.hdf"));
}

TEST_F(SnapshotTest, AFailureNamesFileAndCauseAndLeavesNothing)
{
    try {
        io::write_snapshot(alone, dir / "nowhere" / "s.hdf", p, walls, {});
        FAIL();
    } catch (const IoFailed& e) {
        EXPECT_THAT(e.what(), HasSubstr((dir / "nowhere" / "s.hdf").string()));
        EXPECT_THAT(e.what(), HasSubstr("No such file or directory"));
    }
    EXPECT_TRUE(std::filesystem::is_empty(dir));
}
