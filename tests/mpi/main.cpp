// Every rank runs all tests. Rank 0 prints as usual, the others only what fails, with their rank; one failure
// anywhere fails the program. A fatal failure of one rank ends all: the others would wait for it for ever.
#include "tests/mpi/world.hpp"
#include <cstdio>
#include <gtest/gtest.h>

namespace {

class Reporter : public testing::EmptyTestEventListener {
    void OnTestStart(const testing::TestInfo& test) override { test_ = &test; }
    void OnTestPartResult(const testing::TestPartResult& r) override
    {
        if (!r.failed()) return;
        std::fprintf(stderr, "[rank %d of %d] %s.%s: %s:%d: %s\n", kuzure::world().rank(), kuzure::world().size(),
                     test_ ? test_->test_suite_name() : "", test_ ? test_->name() : "", r.file_name() ? r.file_name() : "unknown file",
                     r.line_number(), r.message());
        fatal_ = fatal_ || r.fatally_failed();
    }
    void OnTestEnd(const testing::TestInfo&) override
    {
        if (fatal_ && kuzure::world().size() > 1) kuzure::world().abort(1);
    }
    const testing::TestInfo* test_ = nullptr; // asking gtest here would wait for a lock that it holds
    bool fatal_ = false;
};

} // namespace

int main(int argc, char** argv)
{
    testing::InitGoogleTest(&argc, argv);
    kuzure::Environment mpi(argc, argv);
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    if (kuzure::world().rank() != 0) delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new Reporter);
    const bool good = RUN_ALL_TESTS() == 0;
    return kuzure::world().all(good) ? 0 : 1;
}
