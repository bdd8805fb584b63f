// Timers: what is charged to whom. Report: ranks brought together.
#include "perf/phases.hpp"
#include "perf/report.hpp"
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <thread>

namespace kuzure {
namespace {

using namespace std::chrono_literals;

TEST(Phases, EveryNameIsItsOwn)
{
    EXPECT_EQ(std::set(phase_names.begin(), phase_names.end()).size(), std::size_t(n_phases));
    EXPECT_EQ(name(Phase::Migrate), "migrate");
    EXPECT_EQ(name(Phase::Lists), "lists");
    EXPECT_EQ(name(Phase::Move), "move");
    EXPECT_EQ(name(Phase::Rim), "rim pairs");
    EXPECT_EQ(name(Phase::Reduce), "reduce");
    EXPECT_EQ(name(Phase::Picture), "picture");
    EXPECT_EQ(name(Phase::Total), "other");
}

TEST(Timers, HandsBackValuesAndReferences)
{
    Timers t;
    int x = 3;
    EXPECT_EQ(t.timed(Phase::Sort, [] { return 7; }), 7);
    t.timed(Phase::Sort, [&]() -> int& { return x; }) = 5;
    EXPECT_EQ(x, 5);
    t.timed(Phase::Lists, [] {});
    EXPECT_EQ(t.calls(Phase::Sort), 2);
    EXPECT_EQ(t.calls(Phase::Lists), 1);
    EXPECT_EQ(t.calls(Phase::Rim), 0);
    EXPECT_EQ(t.seconds(Phase::Rim), 0);
}

TEST(Timers, AnInnerPhaseStopsTheOuterClock)
{
    Timers t;
    const auto start = std::chrono::steady_clock::now();
    t.timed(Phase::Total, [&] {
        std::this_thread::sleep_for(20ms);
        t.timed(Phase::Interior, [] { std::this_thread::sleep_for(40ms); });
        std::this_thread::sleep_for(20ms);
    });
    const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    EXPECT_GE(t.seconds(Phase::Total), 0.040);
    EXPECT_GE(t.seconds(Phase::Interior), 0.040);
    EXPECT_LE(t.total(), whole);
    EXPECT_GE(t.total(), 0.080);
    // Outside every phase nobody is charged.
    const double before = t.total();
    std::this_thread::sleep_for(200ms);
    const auto again = std::chrono::steady_clock::now();
    t.timed(Phase::Rim, [] {});
    EXPECT_LE(t.total(), before + std::chrono::duration<double>(std::chrono::steady_clock::now() - again).count() + 1e-9);
}

TEST(Timers, AnExceptionStopsTheClockToo)
{
    Timers t;
    double thrown = 0; // s, of any length: a first exception on a busy machine
    t.timed(Phase::Total, [&] {
        const auto start = std::chrono::steady_clock::now();
        EXPECT_THROW(t.timed(Phase::Snapshot, [] { throw std::runtime_error("full"); }), std::runtime_error);
        thrown = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        std::this_thread::sleep_for(20ms);
    });
    EXPECT_GE(t.seconds(Phase::Total), 0.020);
    EXPECT_LE(t.seconds(Phase::Snapshot), thrown + 1e-9);
}

/// A team of three as rank 0 sees it, whose others have twice and three times what this rank has.
class ThreeAlike final : public Team {
public:
    int rank() const override { return 0; }
    int size() const override { return 3; }
    void barrier() const override {}
    void min(std::span<double>) const override {}
    void max(std::span<double> v) const override { scale(v, 3); }
    void sum(std::span<double> v) const override { scale(v, 6); }
    void min(std::span<std::int64_t>) const override {}
    void max(std::span<std::int64_t>) const override {}
    void sum(std::span<std::int64_t> v) const override { scale(v, 6); }
    std::int64_t sum_below(std::int64_t) const override { return 0; }
    void broadcast(std::span<std::byte>, int) const override {}
    std::vector<std::vector<std::byte>> gather(std::span<const std::byte>, int) const override { return {}; }
    void* native() const override { return nullptr; }

private:
    template <class T> static void scale(std::span<T> v, int by)
    {
        for (T& x : v) x *= by;
    }
};

Timers a_run()
{
    Timers t;
    t.timed(Phase::Total, [&] {
        for (int step = 0; step < 4; ++step) {
            t.timed(Phase::Interior, [] { std::this_thread::sleep_for(3ms); });
            t.timed(Phase::Rim, [] { std::this_thread::sleep_for(1ms); });
            t.did(Phase::Interior, 3e6, 1e6);
            t.did(Phase::Rim, 1e6, 1e6);
        }
    });
    return t;
}

TEST(PhaseReport, OverTheRanks)
{
    const Timers t = a_run();
    const auto report = phase_report(t, {.steps = 4, .particle_steps = 400, .pairs = 8000}, 2, ThreeAlike());
    EXPECT_EQ(report.ranks, 3);
    EXPECT_EQ(report.work.steps, 4);
    EXPECT_EQ(report.work.particle_steps, 2400);
    EXPECT_EQ(report.work.pairs, 48000);
    const auto& interior = report.rows[int(Phase::Interior)];
    const double mine = t.seconds(Phase::Interior);
    EXPECT_DOUBLE_EQ(interior.min, mine);
    EXPECT_DOUBLE_EQ(interior.mean, 2 * mine);
    EXPECT_DOUBLE_EQ(interior.max, 3 * mine);
    EXPECT_EQ(interior.calls, 4);
    EXPECT_DOUBLE_EQ(interior.flops, 6 * 12e6);
    EXPECT_DOUBLE_EQ(interior.intensity(), 3);
    EXPECT_DOUBLE_EQ(interior.gflops(), 6 * 12e6 / (3 * mine) * 1e-9);
    EXPECT_DOUBLE_EQ(report.pair_loop.intensity(), 2);
    double shares = 0;
    for (const auto& row : report.rows) shares += row.share;
    EXPECT_NEAR(shares, 1, 1e-12);
    EXPECT_NEAR(report.total.share, 1, 1e-12);
    EXPECT_NEAR(report.total.mean, 2 * t.total(), 1e-12);
}

TEST(PhaseReport, JsonHoldsWhatTheTableHolds)
{
    auto report = phase_report(a_run(), {.steps = 4, .particle_steps = 400, .pairs = 8000}, 2, SingleRank());
    const auto j = nlohmann::json::parse(report.json());
    EXPECT_EQ(j["ranks"], 1);
    EXPECT_EQ(j["pairs"], 8000);
    EXPECT_EQ(j["phases"]["rim pairs"]["calls"], 4);
    EXPECT_DOUBLE_EQ(j["phases"]["rim pairs"]["seconds"]["max"], report.rows[int(Phase::Rim)].max);
    EXPECT_DOUBLE_EQ(j["flop_per_byte"], 2);
    EXPECT_GT(j["gflop_per_second"], 0);
    EXPECT_FALSE(j["phases"].contains("picture")) << "a phase that was never entered has no row";
    EXPECT_FALSE(j.contains("machine"));
    report.machine = Machine{.host = "h", .cpu = "c", .instruction_set = "i", .threads = 2, .gbytes_all = 30};
    EXPECT_EQ(nlohmann::json::parse(report.json())["machine"]["gbytes_all"], 30);
}

TEST(PhaseReport, TableIsAligned)
{
    auto report = phase_report(a_run(), {.steps = 4, .particle_steps = 400, .pairs = 8000}, 2, SingleRank());
    report.machine = Machine{.host = "h", .cpu = "a processor", .instruction_set = "avx2", .threads = 2};
    const std::string text = report.text();
    EXPECT_THAT(text, testing::HasSubstr("1 rank of 2 threads, 4 steps"));
    EXPECT_THAT(text, testing::HasSubstr("8 000 directed, 20.0 per soil particle and step"));
    EXPECT_THAT(text, testing::HasSubstr("a processor, avx2"));
    EXPECT_THAT(text, testing::Not(testing::HasSubstr("picture")));
    std::set<std::size_t> ends;
    for (std::size_t at = 0; (at = text.find("% ", at)) != text.npos; ++at) ends.insert(at - text.rfind('\n', at));
    EXPECT_EQ(ends.size(), 1u) << text;
}

TEST(PhaseReport, AnEmptyRunDividesByNothing)
{
    const auto report = phase_report(Timers(), {}, 1, SingleRank());
    EXPECT_EQ(report.total.share, 0);
    EXPECT_EQ(report.pair_loop.gflops(), 0);
    EXPECT_THAT(report.text() + report.json(), testing::Not(testing::ContainsRegex("nan|inf|null")));
}

} // namespace
} // namespace kuzure
