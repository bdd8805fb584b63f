// Compiled once per entry of Variants, with -DVARIANT=0, 1, 2, ...
#include "solver/kernels/leap_frog.hpp"
#include "solver/kernels/staggered.hpp"
#include "solver/kernels/variants.hpp"

namespace kuzure {

template <int I> std::unique_ptr<PairModel> make_variant(const scene::Interactions&, Arithmetic);

namespace {
template <class M, class V> using MirroringStaggered = Staggered<M, V>; // clang counts parameters that have defaults
template <template <class, class> class Scheme, class M> std::unique_ptr<PairModel> make(const scene::Interactions& s, Arithmetic a)
{
    const bool mixed = s.precision == scene::Precision::Mixed;
    if (a == Arithmetic::Scalar && mixed) return std::make_unique<Scheme<M, float>>(s);
    if (a == Arithmetic::Scalar) return std::make_unique<Scheme<M, double>>(s);
    if (mixed) return std::make_unique<Scheme<M, Native<float>>>(s);
    return std::make_unique<Scheme<M, Native<double>>>(s);
}
} // namespace

template <> std::unique_ptr<PairModel> make_variant<VARIANT>(const scene::Interactions& s, Arithmetic a)
{
    using M = std::tuple_element_t<VARIANT, Variants>;
    if constexpr (has_leap_frog(VARIANT))
        if (s.scheme == scene::Scheme::LeapFrog) return make<LeapFrog, M>(s, a);
    return make<MirroringStaggered, M>(s, a);
}

} // namespace kuzure
