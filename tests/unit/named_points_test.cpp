// Named points from a table: what is read, and what every kind of broken table is told.
#include "io/named_points.hpp"
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

using namespace kuzure;
using testing::AllOf;
using testing::HasSubstr;

namespace {

class NamedPoints : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_points_XXXXXX.csv";
        const int fd = mkstemps(name, 4);
        ASSERT_GE(fd, 0);
        close(fd);
        path = name;
    }
    void TearDown() override { std::filesystem::remove(path); }
    std::vector<io::NamedPoint> read(const std::string& text)
    {
        std::ofstream(path, std::ios::binary) << text;
        return io::read_named_points(path).points;
    }
    std::string complaint(const std::string& text)
    {
        try {
            read(text);
        } catch (const BadInput& e) {
            return e.what();
        }
        return "none";
    }
    static std::string words_of(const std::vector<io::NamedPoint>& points)
    {
        std::string all;
        for (const auto& p : points) all += fmt::format("{} ({:g}, {:g}) ", p.name, p.x, p.y);
        return all;
    }
    io::Path path;
};

} // namespace

TEST_F(NamedPoints, ColumnsInAnyOrderAmongOthers)
{
    EXPECT_EQ(words_of(read("\xEF\xBB\xBF# gauges\nY,height,Name,X\r\n2e5,9,\"school, old\",-1.5\r\n\r\n4,,\u5b66\u6821,+3\r\n")),
              "school, old (-1.5, 200000) \u5b66\u6821 (3, 4) ");
    EXPECT_EQ(words_of(read("name;x;y\na;1.5;2")), "a (1.5, 2) ");
}

TEST_F(NamedPoints, EveryFaultIsToldWithItsLine)
{
    const std::pair<const char*, const char*> cases[] = {
        {"", "expected a first line with the columns name, x, y, found nothing"},
        {"name,x,z\na,1,2\n", ":1: expected a first line with the columns name, x, y, found name, x, z"},
        {"name,x,y\n", "expected at least one point, found none"},
        {"name,x,y\na,1\n", ":2: expected 3 cells as in the first line, found 2"},
        {"name,x,y\na,b,1,2\n", ":2: expected 3 cells as in the first line, found 4; a name with a \",\""},
        {"name,x,y\n,1,2\n", ":2: expected a name, found none"},
        {"name,x,y\na,1,2\nb,one,2\n", ":3: expected a number in m for x, found \"one\""},
        {"name,x,y\na,1,2 m\n", ":2: expected a number in m for y, found \"2 m\""},
        {"name,x,y\na,nan,2\n", ":2: expected a number in m for x, found \"nan\""},
        {"name,x,y\na,,2\n", ":2: expected a number in m for x, found \"\""},
        {"name,x,y\na,1,2\na,3,4\n", ":3: expected each name once, found \"a\" again"},
        {"name,x,y\n\"a,1,2\n", ":2: expected a quoted cell to end in its line"},
        {"name,x,y\na\x01z,1,2\n", ":2: expected a name in one line"},
    };
    for (const auto& [text, words] : cases) EXPECT_THAT(complaint(text), AllOf(HasSubstr(path.string()), HasSubstr(words))) << text;
}

TEST_F(NamedPoints, AFileThatIsNotThereIsNamed)
{
    EXPECT_THROW(io::read_named_points("/nowhere/houses.csv"), BadInput);
    EXPECT_THROW(io::read_named_points("/tmp"), BadInput);
}

TEST_F(NamedPoints, NamesComeBackFromTheirCells)
{
    for (const std::string name : {"plain", "a, b", "say \"no\"", "semi;colon", "#1"}) {
        const auto points = read("name,x,y\n" + io::csv_cell(name) + ",1,2\n");
        ASSERT_EQ(points.size(), 1u) << name;
        EXPECT_EQ(points[0].name, name);
    }
}
