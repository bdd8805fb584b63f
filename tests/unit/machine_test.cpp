// The measured roofs: plausible, kept, and measured again where what was kept is spoilt.
#include "perf/machine.hpp"
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>

namespace kuzure {
namespace {

namespace fs = std::filesystem;

struct Folder {
    Folder()
    {
        std::string name = (fs::temp_directory_path() / "kuzure-machine-XXXXXX").string();
        if (!mkdtemp(name.data())) throw std::runtime_error("no temporary directory");
        path = name;
    }
    ~Folder() { fs::remove_all(path); }
    fs::path only_file() const
    {
        EXPECT_EQ(std::distance(fs::directory_iterator(path), {}), 1);
        return fs::directory_iterator(path)->path();
    }
    fs::path path;
};

const Machine example{.host = "node17",
                      .cpu = "a \"processor\"",
                      .instruction_set = "avx2",
                      .threads = 4,
                      .gflops_double_one = 40.125,
                      .gflops_double_all = 160.5,
                      .gflops_float_one = 80.25,
                      .gflops_float_all = 320,
                      .gbytes_one = 12.5,
                      .gbytes_all = 31};

TEST(Machine, JsonThereAndBack)
{
    EXPECT_EQ(machine_from_json(to_json(example)), example);
    EXPECT_FALSE(machine_from_json(""));
    EXPECT_FALSE(machine_from_json("{\"host\": 3}"));
    EXPECT_FALSE(machine_from_json(to_json(example).substr(0, 60)));
    Machine zero = example;
    zero.gbytes_one = 0;
    EXPECT_FALSE(machine_from_json(to_json(zero))) << "a roof of nothing is no measurement";
}

TEST(Machine, MeasuredOnceAndKept)
{
    const Folder cache;
    const Machine first = this_machine("test set", 2, cache.path / "made" / "on the way");
    EXPECT_EQ(first.host, host_name());
    EXPECT_EQ(first.cpu, cpu_name());
    EXPECT_EQ(first.threads, 2);
    // How fast it is depends on what else runs: here only that each was measured, in the right unit.
    for (const double gflops : {first.gflops_double_one, first.gflops_float_one, first.gflops_double_all, first.gflops_float_all}) {
        EXPECT_GT(gflops, 0);
        EXPECT_LT(gflops, 1000);
    }
    for (const double gbytes : {first.gbytes_one, first.gbytes_all}) {
        EXPECT_GT(gbytes, 0);
        EXPECT_LT(gbytes, 2000);
    }
    EXPECT_EQ(this_machine("test set", 2, cache.path / "made" / "on the way"), first) << "kept to the last digit";
}

TEST(Machine, WhatWasKeptIsUsedAndWhatIsSpoiltIsNot)
{
    const Folder cache;
    const Machine measured = this_machine("test set", 1, cache.path);
    const fs::path file = cache.only_file();
    Machine kept = measured;
    kept.gbytes_all = 12345;
    std::ofstream(file) << to_json(kept);
    EXPECT_EQ(this_machine("test set", 1, cache.path).gbytes_all, 12345);
    kept.cpu = "another processor in the same host";
    std::ofstream(file) << to_json(kept);
    EXPECT_NE(this_machine("test set", 1, cache.path).gbytes_all, 12345);
    std::ofstream(file) << "{ not json";
    EXPECT_EQ(this_machine("test set", 1, cache.path).cpu, measured.cpu);
    EXPECT_TRUE(machine_from_json([&] {
        std::ifstream in(file);
        return std::string(std::istreambuf_iterator<char>(in), {});
    }()))
        << "written anew";
}

TEST(Machine, WithoutAPlaceToKeepItItStillMeasures)
{
    EXPECT_GT(this_machine("test set", 1, "").gbytes_one, 0);
    EXPECT_GT(this_machine("test set", 1, "/proc/no/such/place").gbytes_one, 0);
}

TEST(Machine, CacheFollowsTheEnvironment)
{
    setenv("XDG_CACHE_HOME", "/somewhere", 1);
    EXPECT_EQ(machine_cache(), "/somewhere/kuzure");
    unsetenv("XDG_CACHE_HOME");
    setenv("HOME", "/home/them", 1);
    EXPECT_EQ(machine_cache(), "/home/them/.cache/kuzure");
    unsetenv("HOME");
    EXPECT_EQ(machine_cache(), "");
}

} // namespace
} // namespace kuzure
