// A team of one without MPI does what one rank with MPI does; and who started this process is read from its environment.
#include "decomposition/comm.hpp"
#include "decomposition/halo.hpp"
#include <cstdlib>
#include <gtest/gtest.h>
#include <numeric>

using namespace kuzure;

TEST(Alone, EveryCollectiveCallIsItsOwnAnswer)
{
    const Environment alone;
    const Comm& comm = Comm::world();
    EXPECT_EQ(comm.rank(), 0);
    EXPECT_EQ(comm.size(), 1);
    EXPECT_EQ(comm.native(), nullptr);
    comm.barrier();
    double d[] = {1.5, -2};
    comm.min(std::span<double>(d)), comm.max(std::span<double>(d)), comm.sum(std::span<double>(d));
    EXPECT_EQ(d[0], 1.5);
    EXPECT_EQ(d[1], -2);
    EXPECT_EQ(comm.sum(std::int64_t(7)), 7);
    EXPECT_EQ(comm.sum_below(3), 0);
    EXPECT_EQ(comm.broadcast(std::string("words")), "words");
    const std::byte some[] = {std::byte{1}, std::byte{2}};
    const auto all = comm.gather(some);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].size(), 2u);
    EXPECT_EQ(comm.allgather(5.0), std::vector<double>{5.0});
    const std::vector<int> mine{1, 2, 3};
    EXPECT_EQ(comm.allgather(std::span<const int>(mine)), mine);
    EXPECT_TRUE(comm.allgather(std::span<const int>()).empty());
    const auto in = comm.exchange(std::vector<MessageOf<int>>{{0, {1, 2}}, {0, {3}}});
    ASSERT_EQ(in.size(), 2u);
    EXPECT_EQ(in[0].items, (std::vector<int>{1, 2}));
    EXPECT_EQ(in[1].items, std::vector<int>{3});
    EXPECT_TRUE(comm.exchange_scalar({}, 1.0).empty());
    const auto node = comm.node_position();
    EXPECT_EQ(node.size, 1);
    EXPECT_EQ(node.nodes, 1);
    EXPECT_FALSE(Comm::library().empty()); // asked without MPI
}

TEST(Alone, ItEndsAndBeginsAgain)
{
    for (int k = 0; k < 2; ++k) {
        const Environment alone;
        EXPECT_EQ(Comm::world().size(), 1);
    }
}

namespace {
struct Set {
    std::string name;
    Set(const char* n, const char* value) : name(n) { setenv(n, value, 1); }
    ~Set() { unsetenv(name.c_str()); }
};
} // namespace

TEST(Launched, ByTheUsualLaunchers)
{
    for (const char* name : {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMI_SIZE", "PMIX_RANK", "MV2_COMM_WORLD_RANK",
                             "PALS_RANKID", "JSM_NAMESPACE_RANK", "SLURM_STEP_NUM_TASKS", "SLURM_PROCID", "KUZURE_MPI"})
        unsetenv(name);
    EXPECT_FALSE(launched());
    {
        const Set rank("OMPI_COMM_WORLD_RANK", "3"), size("OMPI_COMM_WORLD_SIZE", "4");
        EXPECT_TRUE(launched());
        EXPECT_EQ(launched().rank, 3);
        EXPECT_EQ(launched().size, 4);
        const Set never("KUZURE_MPI", "0");
        EXPECT_FALSE(launched());
    }
    {
        const Set rank("PMI_RANK", "1"), size("PMI_SIZE", "2");
        EXPECT_EQ(launched().rank, 1);
    }
    {
        const Set rank("PMIX_RANK", "0"); // of how many it does not say
        EXPECT_TRUE(launched());
    }
    {
        const Set tasks("SLURM_STEP_NUM_TASKS", "1"), id("SLURM_PROCID", "0"); // a shell in a job
        EXPECT_FALSE(launched());
        const Set ours("KUZURE_MPI", "1");
        EXPECT_TRUE(launched());
    }
    {
        const Set tasks("SLURM_STEP_NUM_TASKS", "8"), id("SLURM_PROCID", "5");
        EXPECT_EQ(launched().rank, 5);
    }
}
