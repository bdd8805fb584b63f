// The fingerprint by which runs are called equal sees every number that a step may change, and nothing else.
#include "solver/core/team.hpp"
#include "solver/run/energy.hpp"
#include <gtest/gtest.h>

using namespace kuzure;

namespace {

Particles three()
{
    Particles p;
    std::apply([&](auto... f) { p.require(f...); }, AllFields{});
    p.resize(3);
    for (Index i = 0; i < 3; ++i) p[field::id].set(i, 10 + i);
    return p;
}

} // namespace

TEST(StateHash, SeesEveryNumberThatAStepMayChange)
{
    const SingleRank alone;
    const std::string before = state_hash(alone, three());
    std::apply(
        [&](auto... f) {
            const auto changed = [&](auto field) {
                using F = decltype(field);
                for (int c = 0; c < field.components; ++c) {
                    Particles p = three();
                    p[field].column[std::size_t(c)][1] += typename F::Number(1);
                    const bool fixed = std::is_same_v<F, std::remove_const_t<decltype(field::origin)>> ||
                                       std::is_same_v<F, std::remove_const_t<decltype(field::soil)>> ||
                                       std::is_same_v<F, std::remove_const_t<decltype(field::unstored)>> || // made anew in each step
                                       std::is_same_v<F, std::remove_const_t<decltype(field::wall_force)>>; // told, not needed
                    if (fixed) EXPECT_EQ(state_hash(alone, p), before) << field.name;
                    else EXPECT_NE(state_hash(alone, p), before) << field.name << ' ' << c;
                }
            };
            (changed(f), ...);
        },
        AllFields{});
}

TEST(StateHash, DoesNotSeeTheOrderOfParticles)
{
    const SingleRank alone;
    Particles p = three(), turned = three();
    for (Index i = 0; i < 3; ++i) {
        p[field::density].set(i, 1 + i);
        turned[field::id].set(i, 12 - i), turned[field::density].set(i, 3 - i);
    }
    EXPECT_EQ(state_hash(alone, p), state_hash(alone, turned));
    p[field::density].set(0, -0.0), turned[field::density].set(2, 0.0); // a zero is a zero
    EXPECT_EQ(state_hash(alone, p), state_hash(alone, turned));
}
