#include "solver/core/ensure.hpp"
#include "solver/kernels/step.hpp"
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
        if (std::tuple_element_t<I, Variants>::covers(s)) return make_variant<I>(s, a);
        return first_that_covers<I + 1>(s, a);
    }
}
} // namespace

std::unique_ptr<PairModel> choose_model(const scene::Interactions& s, Arithmetic a)
{
    return first_that_covers<KUZURE_FIRST_VARIANT>(s, a);
}
std::unique_ptr<PairModel> choose_model(const Scene& s, Arithmetic a) { return choose_model(s.interactions(), a); }

template <class T>
Record<T> make_record(const Places<T>& place, Vector x, Vector v, double volume, double density, const Stress& s, double c)
{
    return {place(x.x), place(x.y), place(x.z), T(v.x),  T(v.y),  T(v.z),  T(volume), T(density),
            T(s.xx),    T(s.yy),    T(s.zz),    T(s.xy), T(s.yz), T(s.xz), T(c),      T(0)};
}
template Record<double> make_record(const Places<double>&, Vector, Vector, double, double, const Stress&, double);
template Record<float> make_record(const Places<float>&, Vector, Vector, double, double, const Stress&, double);

template <class T> Tension<T> make_tension(const Stress& s, double epsilon)
{
    const Stress t = tension(s, epsilon);
    const bool any = t != Stress{};
    return {T(t.xx), T(t.yy), T(t.zz), T(t.xy), T(t.yz), T(t.xz), T(any), T(0)};
}
template Tension<double> make_tension(const Stress&, double);
template Tension<float> make_tension(const Stress&, double);

} // namespace kuzure
