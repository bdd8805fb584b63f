// Shapes found by position: the same as when every one is asked, and few are asked.
#include "solver/scene/nearby.hpp"
#include <gtest/gtest.h>
#include <random>

using namespace kuzure;
using scene::Box;

namespace {

std::vector<Box> random_boxes(int n, std::mt19937& random)
{
    std::uniform_real_distribution<double> coordinate(-5, 5), size(0.01, 0.6);
    std::vector<Box> boxes;
    for (int k = 0; k < n; ++k) {
        const Vector low{coordinate(random), coordinate(random), coordinate(random)};
        boxes.push_back({low, {low.x + size(random), low.y + size(random), low.z + size(random)}});
    }
    if (n > 10) boxes[3] = {{-6, -6, -6}, {6, 6, -4}}; // a floor under all
    return boxes;
}

bool apart(const Box& a, const Box& b, int dimensions)
{
    return a.high.x < b.low.x || b.high.x < a.low.x || a.high.z < b.low.z || b.high.z < a.low.z ||
           (dimensions == 3 && (a.high.y < b.low.y || b.high.y < a.low.y));
}

} // namespace

TEST(Nearby, FindsWhatAskingEverybodyFinds)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> coordinate(-7, 7);
    for (const int dimensions : {2, 3})
        for (const int n : {0, 1, 2, 50, 700}) {
            const auto boxes = random_boxes(n, random);
            const scene::Nearby near(boxes, dimensions);
            for (int k = 0; k < 500; ++k) {
                Vector x{coordinate(random), coordinate(random), coordinate(random)};
                if (k % 3 == 0 && n > 0) x = boxes[std::size_t(k) % boxes.size()].high; // on a corner
                std::vector<std::size_t> by_all, by_grid;
                for (std::size_t b = 0; b < boxes.size(); ++b)
                    if (scene::contact(boxes[b], x, dimensions).distance <= 0) by_all.push_back(b);
                near.any(x, [&](std::size_t b) { return by_grid.push_back(b), false; });
                std::sort(by_grid.begin(), by_grid.end());
                ASSERT_EQ(by_grid, by_all) << n << " boxes, " << dimensions << "-D";
            }
            for (const Box& box : boxes) {
                const auto found = near.meeting(box);
                ASSERT_TRUE(std::is_sorted(found.begin(), found.end()));
                for (std::size_t b = 0; b < boxes.size(); ++b)
                    if (!apart(box, boxes[b], dimensions)) {
                        ASSERT_TRUE(std::binary_search(found.begin(), found.end(), b));
                    }
            }
        }
}

TEST(Nearby, AsksFewOfMany)
{
    std::vector<Box> boxes;
    for (int x = 0; x < 16; ++x)
        for (int y = 0; y < 16; ++y)
            for (int z = 0; z < 16; ++z) boxes.push_back({{1.0 * x, 1.0 * y, 1.0 * z}, {x + 1.0, y + 1.0, z + 1.0}});
    const scene::Nearby near(boxes, 3);
    std::size_t asked = 0;
    for (const Box& b : boxes) asked += near.meeting(b).size();
    EXPECT_LT(asked, boxes.size() * 130) << "pairs of 4096 bodies that only touch";
}
