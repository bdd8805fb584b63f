// Compiled once per entry of Variants, with -DVARIANT=0, 1, 2, ...
#include "solver/kernels/leap_frog.hpp"
#include "solver/kernels/variants.hpp"

namespace kuzure {

template <int I> std::unique_ptr<PairModel> make_variant(const scene::Interactions&, Arithmetic);

template <> std::unique_ptr<PairModel> make_variant<VARIANT>(const scene::Interactions& s, Arithmetic a)
{
    using M = std::tuple_element_t<VARIANT, Variants>;
    const bool mixed = s.precision == scene::Precision::Mixed;
    if (a == Arithmetic::Scalar && mixed) return std::make_unique<LeapFrog<M, float>>(s);
    if (a == Arithmetic::Scalar) return std::make_unique<LeapFrog<M, double>>(s);
    if (mixed) return std::make_unique<LeapFrog<M, Native<float>>>(s);
    return std::make_unique<LeapFrog<M, Native<double>>>(s);
}

} // namespace kuzure
