// The corpora of the fuzzers, and what they once found, read by the same code without clang: one program for each.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size);

namespace {

std::vector<std::vector<unsigned char>> corpus()
{
    std::vector<std::vector<unsigned char>> inputs;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(KUZURE_CORPUS)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
        std::ifstream in(file, std::ios::binary);
        inputs.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return inputs;
}

} // namespace

TEST(Replay, TheCorpusHarmsNothing)
{
    const auto inputs = corpus();
    ASSERT_GE(inputs.size(), 10u) << "the corpus is missing in " KUZURE_CORPUS;
    for (const auto& input : inputs) EXPECT_EQ(LLVMFuzzerTestOneInput(input.data(), input.size()), 0);
}

// A little of the fuzzer's own work, the same every time: bytes changed, dropped, and joined with others'.
TEST(Replay, NorDoItsNeighbours)
{
    const auto inputs = corpus();
    ASSERT_FALSE(inputs.empty());
    std::mt19937_64 random(1);
    for (int k = 0; k < 2000; ++k) {
        auto input = inputs[random() % inputs.size()];
        if (input.empty()) continue;
        switch (random() % 3) {
        case 0:
            input.resize(random() % input.size() + 1);
            break;
        case 1: {
            const auto& other = inputs[random() % inputs.size()];
            input.resize(random() % input.size() + 1);
            if (!other.empty()) input.insert(input.end(), other.begin() + std::ptrdiff_t(random() % other.size()), other.end());
            break;
        }
        default:
            break;
        }
        for (int n = int(random() % 4); n >= 0; --n) input[random() % input.size()] = static_cast<unsigned char>(random());
        EXPECT_EQ(LLVMFuzzerTestOneInput(input.data(), input.size()), 0);
    }
}
