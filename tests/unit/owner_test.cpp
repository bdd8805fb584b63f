// One writer for a directory: a living owner is never displaced, a dead one always is, and what is written goes into the directory that
// was opened and nowhere else.
#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include "io/owner.hpp"
#include "io/result_directory.hpp"
#include "io/rows.hpp"
#include <atomic>
#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

using namespace kuzure;
using testing::HasSubstr;

namespace {

const SingleRank alone;
const auto quiet = [](const std::string&) {};

class OwnerTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_owner_XXXXXX";
        ASSERT_TRUE(mkdtemp(name));
        dir = io::Path(name) / "results";
        std::filesystem::create_directory(dir);
        lock = dir / io::Ownership::file_name;
    }
    void TearDown() override { std::filesystem::remove_all(dir.parent_path()); }

    /// The lock of this process, changed, `age` seconds after its last beat.
    void forge(const std::function<void(nlohmann::ordered_json&)>& change, double age = 0) const
    {
        std::string text;
        {
            io::Ownership mine(io::hold(dir), quiet);
            text = io::read_text(lock);
        }
        auto j = nlohmann::ordered_json::parse(text);
        change(j);
        std::ofstream(lock) << j.dump(1) << "\n";
        beat(age);
    }
    void beat(double age) const
    {
        struct timespec now;
        clock_gettime(CLOCK_REALTIME, &now);
        const double t = double(now.tv_sec) + 1e-9 * double(now.tv_nsec) - age;
        const auto whole = time_t(t);
        const struct timespec times[2] = {{whole, long(1e9 * (t - double(whole)))}, {whole, long(1e9 * (t - double(whole)))}};
        ASSERT_EQ(utimensat(AT_FDCWD, lock.c_str(), times, 0), 0);
    }
    /// The words of the refusal; empty if the directory was taken.
    std::string refusal() const
    {
        try {
            io::Ownership mine(io::hold(dir), quiet);
            EXPECT_FALSE(mine.lost());
        } catch (const BadInput& e) {
            return e.what();
        }
        EXPECT_FALSE(std::filesystem::exists(lock)) << "given back";
        return "";
    }
    io::Path dir, lock;
};

} // namespace

TEST_F(OwnerTest, OfManyStartersOneWins)
{
    // Again and again, over the lock of one that was killed: nobody removes the lock of one that lives.
    for (int round = 0; round < 20; ++round) {
        forge([](auto& j) { j["pid"] = 4194304 + 1, j["started"] = 1; }); // above any process number
        int ready[2], results[2];
        ASSERT_EQ(pipe(ready), 0);
        ASSERT_EQ(pipe(results), 0);
        std::vector<pid_t> children;
        for (int k = 0; k < 8; ++k) {
            const pid_t child = fork();
            if (child == 0) {
                ::close(ready[1]);
                char c;
                static_cast<void>(::read(ready[0], &c, 1)); // all at once, when the other end closes
                char outcome = '?';
                try {
                    io::Ownership mine(io::hold(dir), quiet);
                    outcome = 'w';
                    static_cast<void>(::write(results[1], &outcome, 1));
                    pause(); // lives until it is killed
                } catch (const BadInput&) {
                    outcome = 'r';
                } catch (...) {
                }
                static_cast<void>(::write(results[1], &outcome, 1));
                _exit(0);
            }
            children.push_back(child);
        }
        ::close(ready[0]), ::close(ready[1]), ::close(results[1]);
        std::string outcomes(8, ' ');
        for (char& c : outcomes) ASSERT_EQ(::read(results[0], &c, 1), 1);
        ::close(results[0]);
        EXPECT_EQ(std::ranges::count(outcomes, 'w'), 1) << outcomes;
        EXPECT_EQ(std::ranges::count(outcomes, 'r'), 7) << outcomes;
        for (const pid_t c : children) kill(c, SIGKILL); // the winner's lock stays behind
        for (const pid_t c : children) waitpid(c, nullptr, 0);
    }
    EXPECT_EQ(refusal(), "");
    EXPECT_TRUE(io::names_in(dir).empty()) << "nothing of the taking over is left";
}

TEST_F(OwnerTest, ALivingOwnerIsNamed)
{
    const io::Ownership mine(io::hold(dir), quiet);
    const std::string said = [&] {
        try {
            io::Ownership other(io::hold(dir), quiet);
        } catch (const BadInput& e) {
            return std::string(e.what());
        }
        return std::string();
    }();
    EXPECT_THAT(said, HasSubstr(fmt::format("process {}", getpid())));
    EXPECT_THAT(said, HasSubstr(io::Owner::self().host));
    EXPECT_THAT(said, HasSubstr("-o"));
    for (const auto e : {io::Existing::Refuse, io::Existing::GoOn, io::Existing::MoveAside})
        EXPECT_THROW(io::ResultDirectory(alone, dir, e), BadInput);
    EXPECT_FALSE(mine.lost());
}

TEST_F(OwnerTest, DeadOwnersAreKnown)
{
    forge([](auto& j) { j["pid"] = 4194304 + 1; });
    EXPECT_EQ(refusal(), "") << "no process has this number";
    forge([](auto& j) { j["started"] = j["started"].template get<std::int64_t>() - 1; });
    EXPECT_EQ(refusal(), "") << "the number went to another process";
    forge([](auto& j) { j["directory"] = 1; });
    EXPECT_EQ(refusal(), "") << "a copy of a directory that somebody writes into";
    forge([](auto& j) { j["boot"] = "another machine"; }, 3600);
    EXPECT_EQ(refusal(), "") << "of another machine, silent for an hour";
    forge([](auto& j) { j["boot"] = "another machine"; }, io::Ownership::dead_after_seconds - 0.7);
    EXPECT_EQ(refusal(), "") << "of another machine, silent until it counts as dead";
    std::ofstream(lock) << "{ half of a lo";
    beat(3600);
    EXPECT_EQ(refusal(), "") << "a lock without words, old";
    // A process that waits to be buried.
    const pid_t child = fork();
    if (child == 0) _exit(0);
    siginfo_t ended;
    ASSERT_EQ(waitid(P_PID, id_t(child), &ended, WEXITED | WNOWAIT), 0);
    forge([&](auto& j) { j["pid"] = child; });
    EXPECT_EQ(refusal(), "") << "a process that has ended and waits to be buried";
    waitpid(child, nullptr, 0);
}

TEST_F(OwnerTest, AJobThatWasRequeuedIsItsOwnSuccessor)
{
    const auto before = [](auto& j) { j["boot"] = "another machine", j["job"] = "Slurm job 77", j["restarts"] = 0; };
    setenv("SLURM_JOB_ID", "77", 1), setenv("SLURM_RESTART_COUNT", "1", 1);
    forge(before);
    const auto said = refusal();
    unsetenv("SLURM_JOB_ID"), unsetenv("SLURM_RESTART_COUNT");
    EXPECT_EQ(said, "");
}

TEST_F(OwnerTest, AnOwnerElsewhereIsKnownByItsHeartbeat)
{
    forge([](auto& j) { j["boot"] = "another machine", j["host"] = "node7", j["job"] = "Slurm job 12\x1b[31m"; }, 30);
    // It beats until it was seen to: the first time may be before anybody looks.
    std::atomic<bool> seen = false;
    std::thread heart([&] {
        while (!seen) {
            std::this_thread::sleep_for(std::chrono::milliseconds(300));
            beat(0);
        }
    });
    const auto said = refusal();
    seen = true;
    heart.join();
    EXPECT_THAT(said, HasSubstr("node7"));
    EXPECT_THAT(said, HasSubstr("Slurm job 12?[31m")) << "and nothing of it commands the terminal";
    EXPECT_THAT(said, HasSubstr("remove " + lock.string()));
    EXPECT_TRUE(std::filesystem::exists(lock));
}

TEST_F(OwnerTest, WhoWasTakenForDeadNotices)
{
    io::ResultDirectory mine(alone, dir, io::Existing::Refuse);
    mine.make(io::Existing::Refuse);
    EXPECT_TRUE(mine.owned());
    std::filesystem::remove(lock); // by hand: nobody else came
    EXPECT_TRUE(mine.owned());
    EXPECT_TRUE(std::filesystem::exists(lock));
    std::ofstream(lock) << "somebody else";
    EXPECT_FALSE(mine.owned());
    EXPECT_THROW(mine.require_owned(), IoFailed);
}

TEST_F(OwnerTest, NotItsLockIsNotRemoved)
{
    {
        const io::Ownership mine(io::hold(dir), quiet);
        std::ofstream(lock) << "somebody else";
    }
    EXPECT_EQ(io::read_text(lock), "somebody else");
}

TEST_F(OwnerTest, ADirectoryThatIsMovedIsStillTheOneWrittenInto)
{
    io::ResultDirectory mine(alone, dir, io::Existing::Refuse);
    mine.make(io::Existing::Refuse);
    EXPECT_TRUE(mine.in_place());
    io::Rows rows(alone, mine.history(), "time", "s");
    const auto moved = dir.parent_path() / "moved";
    std::filesystem::rename(dir, moved);
    std::filesystem::create_directory(dir); // somebody else's
    EXPECT_FALSE(mine.in_place());
    Particles p;
    p.resize(3);
    rows.append(0, "0");
    io::write_atomically(mine.summary(), "{}");
    io::write_checkpoint(alone, mine.place(), p, "hash", "{}");
    io::write_checkpoint(alone, mine.place(), p, "hash", "{}");
    EXPECT_TRUE(std::filesystem::is_empty(dir));
    EXPECT_EQ(io::verify_checkpoint(alone, moved / "checkpoint.prev.h5").particles, 3);
    EXPECT_EQ(io::read_text(moved / "summary.json"), "{}");
    EXPECT_EQ(io::read_text(moved / "history.csv"), "time\ns\n0\n");
}

TEST_F(OwnerTest, NothingIsWrittenOrReadThroughLinks)
{
    const auto elsewhere = dir.parent_path() / "precious";
    const auto plant = [&](const io::Path& name) {
        std::ofstream(elsewhere) << "precious";
        std::filesystem::remove(dir / name);
        std::filesystem::create_symlink(elsewhere, dir / name);
    };
    const auto held = io::hold(dir);
    Particles p;
    p.resize(3);
    for (const char* name :
         {"summary.json", "summary.json.tmp", "checkpoint.h5", "checkpoint.h5.tmp", "checkpoint.prev.h5", "kuzure.lock"}) {
        plant(name);
        for (const io::Place& place : {held, io::Place(dir)}) {
            io::write_atomically(place / "summary.json", "{}");
            io::write_checkpoint(alone, place, p, "hash", "{}");
        }
        EXPECT_EQ(io::read_text(elsewhere), "precious") << name;
    }
    EXPECT_THROW(io::Ownership(held, quiet), IoFailed);
    plant("history.csv");
    EXPECT_THROW(io::read_text(held / "history.csv"), IoFailed);
    EXPECT_THROW(io::Rows(alone, held / "history.csv", "precious", "s", 1.0), IoFailed);
    EXPECT_THROW(io::verify_checkpoint(alone, (plant("checkpoint.h5"), held / "checkpoint.h5")), IoFailed);
    std::filesystem::create_directory_symlink(dir.parent_path(), dir / "snapshots");
    EXPECT_THROW(io::hold(held / "snapshots"), IoFailed);
    EXPECT_EQ(io::read_text(elsewhere), "precious");
    // Nor does a pipe that nobody fills hold a reader.
    ASSERT_EQ(mkfifo((dir / "pipe").c_str(), 0600), 0);
    EXPECT_THROW(io::read_text(held / "pipe"), IoFailed);
    EXPECT_THROW(io::H5Reader(held / "pipe"), IoFailed);
}

TEST_F(OwnerTest, AFileSizeLimitIsAFullDiskWithAnotherRemedy)
{
    Particles few, many;
    few.resize(10), many.resize(20000);
    io::write_checkpoint(alone, dir, few, "hash", "good");
    std::signal(SIGXFSZ, SIG_IGN); // as the program does
    struct rlimit before;
    getrlimit(RLIMIT_FSIZE, &before);
    for (const rlim_t limit : {rlim_t(0), rlim_t(1000), rlim_t(300000)}) {
        const struct rlimit small = {limit, before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &small);
        std::string said;
        try {
            io::write_checkpoint(alone, dir, many, "hash", "bad");
        } catch (const io::CheckpointFailed& e) {
            said = e.what();
        }
        setrlimit(RLIMIT_FSIZE, &before);
        EXPECT_THAT(said, HasSubstr("ulimit -f")) << limit;
        EXPECT_THAT(said, HasSubstr("The last good checkpoint is")) << limit;
    }
    EXPECT_EQ(io::verify_checkpoint(alone, dir / "checkpoint.h5").header, "good");
    EXPECT_FALSE(std::filesystem::exists(dir / "checkpoint.h5.tmp"));
}

TEST_F(OwnerTest, WhatWasVerifiedIsWhatIsRead)
{
    Particles first, second, got;
    first.resize(5), second.resize(7);
    io::write_checkpoint(alone, dir, first, "hash", "first");
    const auto verified = io::verify_checkpoint(alone, dir / "checkpoint.h5");
    // Its owner goes on: the file gets another name, then none.
    for (int k = 0; k < 3; ++k) io::write_checkpoint(alone, dir, second, "hash", "second");
    io::read_checkpoint(alone, verified, got);
    EXPECT_EQ(got.size(), 5);
    EXPECT_EQ(verified.header, "first");
}
