#include "solver/core/ensure.hpp"
#include "solver/kernels/pair_model.hpp"
#include "solver/kernels/variants.hpp"
#include "solver/scene/scene.hpp"

#ifndef KUZURE_FIRST_VARIANT
#define KUZURE_FIRST_VARIANT 0 // CMakeLists.txt: a build may leave out the first, quick ones
#endif

namespace kuzure {

template <int I> std::unique_ptr<PairModel> make_variant(const scene::Interactions&, Arithmetic); // variant.cpp

namespace {
template <int I> std::unique_ptr<PairModel> first_that_covers(const scene::Interactions& s, Arithmetic a)
{
    if constexpr (I == KUZURE_VARIANTS) throw Broken("no compiled pair model covers this scene: see solver/kernels/variants.hpp");
    else {
        if (std::tuple_element_t<I, Variants>::covers(s) && (s.scheme == scene::Scheme::Staggered || has_leap_frog(I)))
            return make_variant<I>(s, a);
        return first_that_covers<I + 1>(s, a);
    }
}
} // namespace

std::unique_ptr<PairModel> choose_model(const scene::Interactions& s, Arithmetic a)
{
    return first_that_covers<KUZURE_FIRST_VARIANT>(s, a);
}
std::unique_ptr<PairModel> choose_model(const Scene& s, Arithmetic a) { return choose_model(s.interactions(), a); }

std::size_t ghost_bytes(const PairModel& model)
{
    std::size_t b = 0;
    for (const Stage& s : model.stages()) b += s.ghost_bytes;
    return b;
}

} // namespace kuzure
