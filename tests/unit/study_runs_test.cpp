// Runs that a study, a hazard, a fit or a safety start as children.
#include "io/file.hpp"
#include "io/owner.hpp"
#include "solver/app/study/runs.hpp"
#include "solver/core/ensure.hpp"
#include <filesystem>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

using namespace kuzure;
using namespace kuzure::study;

// A starter that is killed leaves a run that has not begun to write, let alone ended: the next starter's run may come second.
TEST(Runs, AChildThatAnEarlierOneKeptOutIsStartedAgainAFewTimes)
{
    const auto folder = io::Path(::testing::TempDir()) / fmt::format("kuzure-runs-{}", ::getpid());
    std::filesystem::create_directories(folder / "run");
    std::string words;
    {
        const io::Ownership earlier(io::hold(folder / "run"), [](const std::string&) {});
        try {
            io::Ownership::refuse_if_owned(io::hold(folder / "run"));
        } catch (const BadInput& e) {
            words = e.what();
        }
    }
    const auto log = folder / "log.txt";
    io::write_lightly(log, "a warning\nkuzure: " + words + "\n");
    int times = 2;
    EXPECT_FALSE(waited_for_an_earlier_run(3, log, folder / "run", times));
    EXPECT_TRUE(waited_for_an_earlier_run(2, log, folder / "run", times));
    EXPECT_TRUE(waited_for_an_earlier_run(2, log, folder / "run", times));
    EXPECT_FALSE(waited_for_an_earlier_run(2, log, folder / "run", times)) << "somebody else's run may go on for days";
    times = 2;
    io::write_lightly(log, "kuzure: scene.toml:3: time.end: expected a number\n");
    EXPECT_FALSE(waited_for_an_earlier_run(2, log, folder / "run", times)) << "a scene that is refused stays refused";
    EXPECT_EQ(times, 2);
    std::filesystem::remove_all(folder);
}
