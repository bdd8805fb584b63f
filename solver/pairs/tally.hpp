#pragma once
// What a pass reports besides the state: energies that leave the mechanical ledger, and maxima. One member list serves the
// lanes of a register, threads, ranks and the checkpoint.
#include "solver/core/scalar.hpp"
#include <array>
#include <tuple>
#include <utility>

namespace kuzure {

/// Energy that left the mechanical ledger, J (J/m in 2-D), one number or one lane of numbers each. Every addend is a multiple
/// of one unit fixed for the run, so the sums are exact and equal in any order. Stabilising: artificial stress and stress
/// diffusion, which may give as well as take. Wall: as if all walls stood still; moved_wall: what their motion takes, negative where
/// they push. Loads: what they take, negative where they push.
template <class V> struct Energies {
    V plastic{}, viscous{}, wall{}, damping{}, stabilising{}, moved_wall{}, loads{};
    static constexpr std::tuple members{&Energies::plastic,     &Energies::viscous,    &Energies::wall, &Energies::damping,
                                        &Energies::stabilising, &Energies::moved_wall, &Energies::loads};
};
using EnergySums = Energies<double>;

/// The largest values of a step, over lanes, threads and ranks.
template <class V> struct Maxima {
    V acceleration2{};    // (m/s^2)^2
    V signal{};           // c_p + h |D|, m/s
    V displacement2{};    // squared displacement since the last sort, m^2
    V speed2{};           // (m/s)^2
    V half_step_speed2{}; // (m/s)^2, of the half-step velocity that moves the particle; "drift2" in checkpoints
    V not_finite{};       // 1 where a number is not finite
    V outside{};          // 1 where a particle left the box
    V density_ratio{};    // max(rho/rho_0, rho_0/rho)
    static constexpr std::tuple members{&Maxima::acceleration2,    &Maxima::signal,     &Maxima::displacement2, &Maxima::speed2,
                                        &Maxima::half_step_speed2, &Maxima::not_finite, &Maxima::outside,       &Maxima::density_ratio};
    static constexpr std::array<const char*, 8> names{"acceleration2", "signal",     "displacement2", "speed2",
                                                      "drift2",        "not_finite", "outside",       "density_ratio"};
    static_assert(std::tuple_size_v<decltype(members)> == names.size());
};
using Extremes = Maxima<double>;

/// Calls visit(a.member, b.member) for every member of two structs of the same list.
template <class A, class B, class Visit> KUZURE_INLINE void for_each_member(A& a, B& b, Visit visit)
{
    [&]<std::size_t... k>(std::index_sequence<k...>)
    {
        (visit(a.*std::get<k>(A::members), b.*std::get<k>(std::remove_const_t<B>::members)), ...);
    }
    (std::make_index_sequence<std::tuple_size_v<decltype(A::members)>>());
}

/// Energies, maxima and counts of the clusters one thread has done, a lane each; or of a whole pass.
template <class V> struct Tally {
    Energies<V> energy;
    Energies<V> later; // of the half of the step to come that is known already
    Maxima<V> maxima;
    V poison{};              // a sum of zeros, or not a number
    std::int64_t pairs = 0;  // directed, inside the support
    std::int64_t asleep = 0; // particles whose state was kept

    /// What two passes, or two threads of one, report together.
    void add(const Tally& o)
    {
        for_each_member(energy, o.energy, [](V& a, const V& b) { a += b; });
        for_each_member(later, o.later, [](V& a, const V& b) { a += b; });
        for_each_member(maxima, o.maxima, [](V& a, const V& b) { a = max(b, a); });
        poison += o.poison, pairs += o.pairs, asleep += o.asleep;
    }
    /// Over the lanes; the energies are exact sums, so their order does not count.
    Tally<double> over_lanes() const
    {
        Tally<double> t;
        for_each_member(t.energy, energy, [](double& a, const V& b) { a = sum(b); });
        for_each_member(t.later, later, [](double& a, const V& b) { a = sum(b); });
        for_each_member(t.maxima, maxima, [](double& a, const V& b) { a = largest(b); });
        t.poison = sum(poison), t.pairs = pairs, t.asleep = asleep;
        if (!(t.poison == 0)) t.maxima.not_finite = 1, t.poison = 0;
        return t;
    }
};
using PassResult = Tally<double>;

/// Rounds to a multiple of the unit that `magic` stands for (1.5 * 2^52 units): what is summed then is summed exactly.
template <class U> KUZURE_INLINE U quantized(U x, U magic) { return (x + magic) - magic; }
/// The `magic` of a unit, J.
inline double magic_of(double unit) { return unit * 6755399441055744.0; }

} // namespace kuzure
