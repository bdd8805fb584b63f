// Tables of results, whole and damaged.
#include "solver/app/report/chart.hpp"
#include "solver/app/report/record.hpp"
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

using namespace kuzure;
using testing::ElementsAre;

TEST(Table, ARowWithoutItsLineEndCountsWhereItIsWhole)
{
    EXPECT_THAT(report::read_table("time,x\n# s,m\n0,1\n1,2\n").at("x"), ElementsAre(1, 2));
    EXPECT_THAT(report::read_table("time,x\n# s,m\n0,1\n1,2").at("x"), ElementsAre(1, 2));
    EXPECT_THAT(report::read_table("time,x\n# s,m\n0,1\n1").at("x"), ElementsAre(1));
}

TEST(Table, DamageCostsRowsAndNothingElse)
{
    const auto t = report::read_table("time,x\n# s,m\n0,1\n\n,,,,\n2,word\n3,1e400\n4,1e200\n5,-inf\n6,7\n");
    EXPECT_EQ(t.at("time").size(), t.at("x").size());
    EXPECT_THAT(t.at("time"), ElementsAre(0, 2, 3, 4, 5, 6));
    for (std::size_t k = 1; k < 5; ++k) EXPECT_TRUE(std::isnan(t.at("x")[k])) << k;
    EXPECT_TRUE(report::read_table(std::string(5000, ',') + "\n\n\n").empty()) << "a table of 5001 columns";
    EXPECT_TRUE(report::read_table("a,a\n#\n1,2\n").empty()) << "two columns of one name";
    EXPECT_TRUE(report::read_table("").empty());
    // Short rows must not become long ones: memory would grow by the number of columns.
    std::string names = "a0";
    for (int k = 1; k < 1000; ++k) names += ",a" + std::to_string(k);
    EXPECT_TRUE(report::read_table(names + "\n#\n" + std::string(100000, '\n')).at("a0").empty());
}

TEST(Chart, AxesEndWhateverTheNumbers)
{
    const std::vector<std::vector<double>> times{{1e16, 1e16 + 2}, {0, 5e-324}, {0, 1e-300}, {-1e100, 1e100},
                                                 {1, 1 + 1e-15},   {0, NAN, 1}, {0, 1}};
    const std::vector<std::vector<double>> values{{1e16, 1e16 + 2}, {0, 5e-324}, {1e-300, 2e-300}, {-1e100, 1e100},
                                                  {1, 1 + 1e-15},   {NAN, NAN},  {3, 3},           {0, 0}};
    for (const auto& t : times)
        for (const auto& y : values) {
            const auto text = report::chart("c", "time", "s", t, "m", {{"y", y}});
            EXPECT_LT(text.size(), 100000u);
            EXPECT_EQ(text.find("nan"), text.npos);
        }
}
