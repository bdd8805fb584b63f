// Text of users in other languages: whatever it is, it stays one word, one string, one comment, one name.
#include "io/keys.hpp"
#include "io/quote.hpp"
#include "solver/core/ensure.hpp"
#include <array>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <vector>

using namespace kuzure;
using testing::HasSubstr;

namespace {

const std::vector<std::string> hostile{
    "plain",   "with blank", "it's",        "''",        "'; touch out; '", "$(touch out)", "`touch out`", "\\",
    "\\'",     "a\nb",       "a\r\nb",      "#SBATCH x", "\"x\"",           "-rf",          "*",           "~root",
    "!!",      "a;b|c&d",    "\x1b[31mred", "日本語",    "\xc2\x9b",        "a\u2028b",     "${PATH}",     "%s%n",
    "{ranks}", "",           "\t",
};

/// What a shell takes a word for.
std::string through_a_shell(const std::string& word)
{
    const auto script = std::filesystem::temp_directory_path() / fmt::format("kuzure-quote-{}", getpid());
    std::ofstream(script) << "printf %s " + io::shell_word(word);
    std::FILE* pipe = popen(("bash " + script.string()).c_str(), "r"); // NOLINT: the shell itself is what is tested
    std::string out;
    std::array<char, 256> buffer;
    while (const auto n = std::fread(buffer.data(), 1, buffer.size(), pipe)) out.append(buffer.data(), n);
    pclose(pipe);
    std::filesystem::remove(script);
    return out;
}

} // namespace

TEST(Quote, AShellSeesTheSameWord)
{
    for (const auto& word : hostile) {
        EXPECT_EQ(through_a_shell(word), word);
        EXPECT_EQ(io::shell_word(word).find('\n'), std::string::npos) << word;
    }
    EXPECT_THROW((void)io::shell_word(std::string("a\0b", 3)), BadInput);
}

TEST(Quote, GnuplotSeesOneStringOfOneLine)
{
    for (const auto& word : hostile) {
        const std::string s = io::gnuplot_string(word);
        ASSERT_GE(s.size(), 2u);
        EXPECT_EQ(s.front(), '\'');
        EXPECT_EQ(s.back(), '\'');
        EXPECT_EQ(s.find('\n'), s.npos) << word;
        // Inside, quotes stand in pairs: the string ends where it should.
        for (std::size_t i = 1; i + 1 < s.size(); ++i)
            if (s[i] == '\'') {
                ASSERT_LT(i + 2, s.size()) << s;
                EXPECT_EQ(s[++i], '\'') << s;
            }
    }
    EXPECT_EQ(io::gnuplot_string("it's `date`"), "'it''s `date`'");
}

TEST(Quote, ACommentStaysOneLine)
{
    for (const auto& word : hostile)
        for (const char c : io::comment_text(word)) EXPECT_GE((unsigned char)(c), 0x20) << word;
    EXPECT_EQ(io::comment_text("a\r\nb"), "a  b");
    EXPECT_EQ(io::comment_text("日本語"), "日本語");
    EXPECT_EQ(io::comment_text("a\u2028b\xc2\x85g"), "a b g");
}

TEST(Quote, ABatchSystemSeesANameOrNothing)
{
    for (const std::string name : {"gz00", "regular-flat", "p_1.2", "a@b", "x,y", "1:00"})
        EXPECT_EQ(io::batch_value(name, "--account"), name);
    for (const std::string name : {"", "-x", "a b", "a\nb", "a;b", "$(x)", "`x`", "a'b", "a\"b", "a#b", "日本"}) {
        try {
            (void)io::batch_value(name, "--account");
            ADD_FAILURE() << "taken: " << name;
        } catch (const BadInput& e) {
            EXPECT_THAT(e.what(), HasSubstr("--account"));
        }
    }
}

TEST(Quote, ATerminalGetsNoControlCharacters)
{
    EXPECT_EQ(io::printable("a\x1b[2Jb\tc\nd"), "a\\x1b[2Jb\tc\nd");
    EXPECT_EQ(io::printable("\xc2\x9b"), "\\xc2\\x9b");
    EXPECT_EQ(io::printable("日本語 é"), "日本語 é");
}

TEST(Keys, OnlyAWordThatIsLikeAnotherIsMeant)
{
    const std::vector<std::string> keys{"gravity", "viscosity", "artificial_stress", "damping", "friction_angle", "spacing", "density"};
    EXPECT_EQ(io::nearest("gravty", keys), "gravity");
    EXPECT_EQ(io::nearest("Gravity", keys), "gravity");
    EXPECT_EQ(io::nearest("friction", keys), "friction_angle");
    EXPECT_EQ(io::nearest("dx", keys), "spacing");
    for (const char* far : {"rain", "vegetation", "x", "colour", "", "qqqqqqqqqqqqqqqq"}) EXPECT_EQ(io::nearest(far, keys), "") << far;
    EXPECT_EQ(io::did_you_mean("gravty", keys), "; did you mean \"gravity\"?");
    EXPECT_EQ(io::did_you_mean("rain", keys), ".");
}

TEST(Keys, WhatPeopleSearchForAndDoNotFind)
{
    for (const char* idea : {"rain", "Rainfall", "seepage", "vegetation", "roots", "ice"})
        EXPECT_THAT(io::not_simulated(idea), HasSubstr("not simulated")) << idea;
    EXPECT_THAT(io::not_simulated("earthquake"), HasSubstr("[[event]] shaking")); // it has another name here
    for (const char* other : {"gravity", "icecream", "drain", "", "box"}) EXPECT_EQ(io::not_simulated(other), "") << other;
}

TEST(Keys, ATextIsOneLineOfBoundedLength)
{
    EXPECT_EQ(io::not_one_line("a title, 日本語"), "");
    EXPECT_EQ(io::not_one_line(std::string(4096, 'x')), "");
    EXPECT_THAT(io::not_one_line(std::string(66000, 'x')), HasSubstr("66000 bytes"));
    EXPECT_THAT(io::not_one_line("a\nb"), HasSubstr("line break"));
    EXPECT_THAT(io::not_one_line("a\x1b"), HasSubstr("U+001B"));
    EXPECT_THAT(io::not_one_line("a\xc2\x9b"), HasSubstr("U+009B"));
}
