// history.csv, summary.json and the result directory.
#include "io/history.hpp"
#include "io/result_directory.hpp"
#include "io/summary.hpp"
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

using namespace kuzure;
using testing::HasSubstr;
using testing::StartsWith;

namespace {

const SingleRank alone;

class HistoryTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_history_XXXXXX";
        ASSERT_TRUE(mkdtemp(name));
        dir = name;
        file = dir / "history.csv";
    }
    void TearDown() override { std::filesystem::remove_all(dir); }
    static io::HistoryRow row(int k)
    {
        io::HistoryRow r{};
        r.time = 0.1 * k;
        r.step = k;
        r.kinetic = 1.0 / 3 + k;
        r.front_max_y = -0.5;
        return r;
    }
    io::Path dir, file;
};

} // namespace

TEST_F(HistoryTest, HasHeaderUnitsAndRowsThatReadBack)
{
    {
        io::History h(alone, file, 3);
        EXPECT_FALSE(h.last_time());
        h.append(row(0));
        h.append(row(3));
        EXPECT_EQ(h.last_time(), row(3).time);
    }
    EXPECT_EQ(io::read_text(file), "time,step,dt,kinetic,potential,elastic,plastic,viscous,wall,damping,residual,max_speed,height,"
                                   "front_min_x,front_max_x,front_min_y,front_max_y,stabilising,moved_wall,events,loads\n"
                                   "# s,1,s,J,J,J,J,J,J,J,1,m/s,m,m,m,m,m,J,J,J,J\n"
                                   "0,0,0,0.3333333333333333,0,0,0,0,0,0,0,0,0,0,0,0,-0.5,0,0,0,0\n"
                                   "0.30000000000000004,3,0,3.3333333333333335,0,0,0,0,0,0,0,0,0,0,0,0,-0.5,0,0,0,0\n");
}

TEST_F(HistoryTest, ARowWhoseLineEndIsGoneIsKeptWhereItIsWhole)
{
    {
        io::History h(alone, file, 3);
        for (int k = 0; k < 3; ++k) h.append(row(k));
    }
    const std::string whole = io::read_text(file);
    for (const bool torn : {false, true}) {
        std::ofstream(file, std::ios::trunc) << whole.substr(0, whole.size() - (torn ? 6 : 1)); // "-0.5" and its comma, or the line's end
        io::History h(alone, file, 3, row(2).time);
        EXPECT_EQ(*h.last_time(), row(torn ? 1 : 2).time);
        if (torn) h.append(row(2));
        EXPECT_EQ(io::read_text(file), whole);
    }
}

TEST_F(HistoryTest, ARestartLeavesNeitherGapNorDouble)
{
    std::string whole;
    {
        io::History h(alone, file, 2);
        for (int k = 0; k < 10; ++k) h.append(row(k));
        whole = io::read_text(file);
    }
    for (const int from : {0, 4, 9}) {
        std::ofstream(file, std::ios::app) << "9.9,99,0.1,0."; // torn by a crash
        io::History h(alone, file, 2, row(from).time);
        EXPECT_EQ(h.last_time(), row(from).time);
        for (int k = from + 1; k < 10; ++k) h.append(row(k));
        h.sync();
        EXPECT_EQ(io::read_text(file), whole) << from;
    }
}

TEST_F(HistoryTest, ARestartWithoutAHistoryStartsOne)
{
    io::History h(alone, file, 3, 0.5);
    h.append(row(6));
    EXPECT_THAT(io::read_text(file), StartsWith("time,step,dt,"));
}

TEST_F(HistoryTest, AForeignFileIsNotTouched)
{
    std::ofstream(file) << "my,own,data\n1,2,3\n";
    EXPECT_THROW(io::History(alone, file, 3, 0.5), IoFailed);
    EXPECT_EQ(io::read_text(file), "my,own,data\n1,2,3\n");
}

TEST_F(HistoryTest, SummaryIsJsonWithTheNamesOfTheInterface)
{
    io::Summary s;
    s.status = "finished";
    s.precision = "double";
    s.soil_particles = 140608;
    s.energy = {{"kinetic", 1.5}, {"residual", std::nan("")}};
    s.effects = {{"gravity", "the scene asks for it", true}, {"artificial_stress", "c = 0", false}};
    io::write_summary(alone, dir / "summary.json", s);
    const auto j = nlohmann::json::parse(io::read_text(dir / "summary.json"));
    for (const char* key :
         {"status", "exit_code", "scene_hash", "version", "ranks", "threads", "precision", "soil_particles", "wall_particles", "steps",
          "time", "wall_seconds", "pairs", "seconds_per_step", "particle_steps_per_second", "energy", "effects", "state_hash"})
        EXPECT_TRUE(j.contains(key)) << key;
    EXPECT_EQ(j["energy"]["kinetic"], 1.5);
    EXPECT_TRUE(j["energy"]["residual"].is_null());
    EXPECT_EQ(j["effects"]["on"][0]["name"], "gravity");
    EXPECT_EQ(j["effects"]["off"][0]["why"], "c = 0");
}

TEST_F(HistoryTest, WriteAtomicallyReplacesOrLeaves)
{
    io::write_atomically(dir / "a", "one");
    io::write_atomically(dir / "a", "two");
    EXPECT_EQ(io::read_text(dir / "a"), "two");
    EXPECT_THROW(io::write_atomically(dir / "none" / "a", "x"), IoFailed);
    EXPECT_THROW(io::read_text(dir / "b"), IoFailed);
    EXPECT_THROW(io::read_text(dir / "a", 2), IoFailed);
    EXPECT_FALSE(std::filesystem::exists(dir / "a.tmp"));
}

TEST_F(HistoryTest, AResultDirectoryIsNeverOverwritten)
{
    using io::Existing;
    const auto results = dir / "runs" / "one";
    const auto moved = [](const io::Path& path, Existing existing) {
        io::ResultDirectory d(alone, path, existing);
        d.make(existing);
        return d.moved_to();
    };
    EXPECT_EQ(moved(results, Existing::Refuse), "");
    EXPECT_TRUE(std::filesystem::is_directory(results / "snapshots"));
    std::ofstream(results / "history.csv") << "old";
    try {
        io::ResultDirectory(alone, results, Existing::Refuse);
        FAIL();
    } catch (const BadInput& e) {
        EXPECT_THAT(e.what(), HasSubstr("--restart"));
        EXPECT_THAT(e.what(), HasSubstr("--force"));
    }
    // Nothing but results is gone on with or moved aside: a wrong -o may name a home directory.
    EXPECT_THROW(io::ResultDirectory(alone, results, Existing::GoOn), BadInput);
    EXPECT_THROW(io::ResultDirectory(alone, results, Existing::MoveAside), BadInput);
    std::ofstream(results / "scene.toml") << "# kuzure 0.1.0\n";
    EXPECT_EQ(moved(results, Existing::GoOn), "");
    EXPECT_EQ(io::read_text(results / "history.csv"), "old");

    EXPECT_EQ(moved(results.string() + "/", Existing::MoveAside), results.string() + ".old-1");
    EXPECT_EQ(io::read_text(results.string() + ".old-1/history.csv"), "old");
    EXPECT_FALSE(std::filesystem::exists(results / "history.csv"));
    EXPECT_EQ(moved(results, Existing::MoveAside), results.string() + ".old-2");

    std::ofstream(dir / "file") << "x";
    EXPECT_THROW(moved(dir / "file", Existing::MoveAside), BadInput);
    EXPECT_THROW(moved(dir / "file" / "below", Existing::Refuse), IoFailed);
    EXPECT_GT(io::free_bytes(dir / "not" / "there"), 0u);
}
